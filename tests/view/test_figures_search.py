import numpy as np
import pytest

pytest.importorskip("pandas", reason="needs softvox-gym[search]")
pytest.importorskip("pyarrow", reason="needs softvox-gym[search]")

from search.made_results import random_runs, results
from view.figure_labels import check_labels, texts_of

from softvox_search.report import figures, tables
from softvox_search.report.style import PRINT
from softvox_search.report.style import style as project_style
from softvox_view.figures import Inputs, files_of, make, style


@pytest.fixture(scope="module")
def quiet():
    return results(*random_runs(("random", "ga"), 4, 60))


@pytest.fixture(scope="module")
def noisy():
    runs = random_runs(("random", "ga"), 3, 60, levels=(0.0, 1.0), policies=("naive", "mean"))
    return results(*runs)


@pytest.fixture(scope="module")
def many():
    """Thirteen searchers, as the committed comparison has, their names as long as its longest."""
    names = [f"random_with_replacement{i:02}"[2:] for i in range(12)]
    return results(*random_runs(("random", *names), 2, 6561))


def test_the_figures_are_those_of_the_reports_of_all_folders(quiet, noisy):
    made = make("search", Inputs(results={"plain": quiet, "loud": noisy}))
    with project_style():
        expected = [
            f"search_{name}_{figure}"
            for name, one in (("plain", quiet), ("loud", noisy))
            for figure in figures.draw(tables.make(one))
        ]
    assert list(made.figures) == expected


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
