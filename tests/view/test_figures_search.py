from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("pandas", reason="needs softvox-gym[search]")
pytest.importorskip("pyarrow", reason="needs softvox-gym[search]")

from search.made_results import random_runs, results
from view.figure_labels import check_labels, texts_of

from softvox_search import report
from softvox_search.report import figures, tables
from softvox_search.report import style as report_style
from softvox_search.report.style import PRINT
from softvox_search.report.style import style as project_style
from softvox_view.figures import Inputs, files_of, make, style

NAMES = ("title", "command", "runs", "budgets", "problems", "evaluations", "is_of_transfer")


def in_a_folder(folder, made):
    """Return results as if they were in a folder with its runs, their report written there.

    Its pictures are left out: they take longest, and the tables are what is read.
    """
    (folder / "runs").mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(report_style, "encoded", lambda figure: b"")
        report.write(folder, made)
    return SimpleNamespace(**{name: getattr(made, name) for name in NAMES}, folder=folder)


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    return in_a_folder(
        tmp_path_factory.mktemp("quiet"), results(*random_runs(("random", "ga"), 4, 60))
    )


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    runs = random_runs(("random", "ga"), 3, 60, levels=(0.0, 1.0), policies=("naive", "mean"))
    return in_a_folder(tmp_path_factory.mktemp("noisy"), results(*runs))


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """Thirteen searchers, as the committed comparison has, their names as long as its longest."""
    names = [f"random_with_replacement{i:02}"[2:] for i in range(12)]
    made = results(*random_runs(("random", *names), 2, 6561))
    return in_a_folder(tmp_path_factory.mktemp("many"), made)


def test_the_figures_are_those_of_the_reports_of_all_folders(quiet, noisy):
    made = make("search", Inputs(results={"plain": quiet, "loud": noisy}))
    with project_style():
        expected = [
            f"search_{name}_{figure}"
            for name, one in (("plain", quiet), ("loud", noisy))
            for figure in figures.draw(tables.make(one))
        ]
    assert list(made.figures) == expected


@pytest.mark.parametrize("name", ["quiet", "noisy"])
def test_a_folder_kept_without_its_runs_gives_the_same_figures(name, request):
    whole = request.getfixturevalue(name)
    (whole.folder / "runs").rename(whole.folder / "elsewhere")
    try:
        kept = make("search", Inputs(results={"a": whole})).figures
    finally:
        (whole.folder / "elsewhere").rename(whole.folder / "runs")
    drawn = make("search", Inputs(results={"a": whole})).figures
    assert list(kept) == list(drawn)
    for key, figure in drawn.items():
        for one, other in zip(figure.axes, kept[key].axes, strict=True):
            for line, again in zip(one.lines, other.lines, strict=True):
                # The tables have six digits.
                np.testing.assert_allclose(again.get_ydata(), line.get_ydata(), rtol=1e-5)


def test_curves_are_those_of_the_reports_tables(quiet):
    made = make("search", Inputs(results={"plain": quiet}))
    curves = tables.make(quiet)["anytime"]
    curve = curves[(curves["searcher"] == "ga") & (curves["terms"] == "raw")]
    panels = made.figures["search_plain_anytime_raw"].axes
    shown = next(axes for axes in panels if axes.get_title() == "ga").lines[-1].get_ydata()
    assert np.array_equal(shown[: len(curve)], curve["iqm"])


def test_the_files_have_text_that_is_text_and_the_same_bytes(quiet):
    inputs = Inputs(results={"plain": quiet})
    first = files_of(make("search", inputs), ["pdf"])
    assert files_of(make("search", inputs), ["pdf"]) == first
    for content in first.values():
        assert b"/CIDFontType2" in content
        assert b"CreationDate" not in content


def test_the_figures_are_for_print_with_labels_that_can_be_read(many, noisy):
    made = make("search", Inputs(results={"many": many, "loud": noisy}))
    assert len(made.figures) > 10
    for figure in made.figures.values():
        assert figure.get_figwidth() <= style.WIDTH
        with project_style(PRINT):
            style.lay_out(figure)
            check_labels(figure)
            assert min(text.get_fontsize() for text in texts_of(figure)) >= style.SMALL
