"""The figure transfer, of made up results."""

from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("pandas", reason="needs softvox-gym[search]")
pytest.importorskip("pyarrow", reason="needs softvox-gym[search]")

import pandas as pd
from search.made_results import random_runs, results
from view.figure_labels import check_labels, texts_of

from softvox_search.report import text, transfer
from softvox_search.report.style import PRINT
from softvox_search.report.style import style as project_style
from softvox_view.figures import Inputs, figure_of, files_of, make, style

TESTS, HEADINGS = 20, 4


def made_up(folder, methods, realities, seeds=2):
    """Results as `softvox compare` writes them, of random regrets that never grow."""
    rng = np.random.default_rng(5)
    rows, logs = [], {}
    for method in methods:
        for reality in realities:
            for seed in range(seeds):
                run = f"{method}-{reality}-{seed}"
                row = {"run": run, "status": "ok", "method": method, "reality": reality}
                row |= {"task": "directed", "seed": seed, "tests": TESTS, "simulations": 0}
                rows.append(row | dict.fromkeys(transfer.FORESIGHT, 0.5))
                regret = np.minimum.accumulate(rng.random((HEADINGS, TESTS)), axis=1).ravel()
                logs[run] = {
                    "test": np.tile(np.arange(1, TESTS + 1), HEADINGS),
                    "regret": regret,
                    "class_regret": regret / 2,
                }
    (folder / "runs").mkdir()
    return SimpleNamespace(
        folder=folder,
        runs=pd.DataFrame(rows),
        evaluations=lambda run: logs[run],
        is_of_transfer=True,
    )


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    return made_up(tmp_path_factory.mktemp("small"), ("random", "ite"), ("soft", "public-1"), 3)


def test_regret_is_that_of_the_reports_tables_with_its_band(small):
    (figure,) = make("transfer", Inputs(results={"mine": small})).figures.values()
    table = transfer.make(small)["regret"]
    panels = {axis.get_title(): axis for axis in figure.axes}
    assert list(panels) == ["soft", "public"]
    for reality, axis in panels.items():
        own = table[(table["reality"] == reality) & (table["method"] == "ite")]
        lines = [line.get_xydata().T for line in axis.lines]
        assert any(np.array_equal(line, own[["tests", "regret"]].T) for line in lines)
    assert [len(axis.collections) for axis in panels.values()] == [2, 2]


def test_a_folder_kept_without_its_runs_gives_the_same_figure(small, tmp_path):
    text_of = {name: text.csv(table) for name, table in transfer.make(small).items()}
    (tmp_path / "tables").mkdir()
    for name, content in text_of.items():
        (tmp_path / "tables" / f"{name}.csv").write_bytes(content)
    kept = SimpleNamespace(folder=tmp_path, is_of_transfer=True)
    (figure,) = make("transfer", Inputs(results={"mine": kept})).figures.values()
    (whole,) = make("transfer", Inputs(results={"mine": small})).figures.values()
    for one, other in zip(whole.axes, figure.axes, strict=True):
        for line, again in zip(one.lines, other.lines, strict=True):
            np.testing.assert_allclose(again.get_ydata(), line.get_ydata(), rtol=1e-5)


def test_each_figure_is_of_the_folders_of_its_kind(small, tmp_path):
    searchers = results(*random_runs(("random", "ga"), 2, 60))
    (tmp_path / "runs").mkdir()
    fields = {name: getattr(searchers, name) for name in ("runs", "budgets", "problems")}
    of_search = SimpleNamespace(
        **fields, evaluations=searchers.evaluations, is_of_transfer=False, folder=tmp_path
    )
    assert (figure_of(of_search), figure_of(small)) == ("search", "transfer")
    both = Inputs(results={"a": of_search, "b": small})
    assert list(make("transfer", both).figures) == ["transfer_b_directed"]
    found = make("search", both).figures
    assert found
    assert all(name.startswith("search_a_") for name in found)


def test_labels_can_be_read_where_there_are_many_methods_and_realities(tmp_path):
    methods = [f"domain_randomisation_{letter}" for letter in "abcdefghijklm"]
    realities = ["high_resolution", *(f"area_friction_{i}" for i in range(9)), "test-0", "test-1"]
    many = made_up(tmp_path, methods, realities)
    (figure,) = make("transfer", Inputs(results={"many": many})).figures.values()
    assert len(figure.axes) == 11
    assert figure.get_figwidth() <= style.WIDTH
    with project_style(PRINT):
        style.lay_out(figure)
        check_labels(figure)
        assert min(text.get_fontsize() for text in texts_of(figure)) >= style.SMALL


def test_the_same_bytes(small):
    inputs = Inputs(results={"mine": small})
    first = files_of(make("transfer", inputs), ["png", "pdf"])
    assert files_of(make("transfer", inputs), ["png", "pdf"]) == first
    assert b"/CIDFontType2" in first["transfer_mine_directed.pdf"]
