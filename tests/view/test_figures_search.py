import numpy as np
import pandas as pd
import pytest
from search.made_results import random_runs, results

from softvox_search import report
from softvox_view.figures import Inputs, files_of, make
from softvox_view.figures.search import ResultsError, read


def folder_of(path, made):
    path.mkdir()
    made.runs.to_csv(path / "runs.csv", index=False)
    report.write(path, made)
    return path


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    made = results(*random_runs(("random", "ga"), 4, 60))
    return folder_of(tmp_path_factory.mktemp("quiet") / "plain", made)


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    runs = random_runs(("random", "ga"), 3, 60, levels=(0.0, 1.0), policies=("naive", "mean"))
    return folder_of(tmp_path_factory.mktemp("noisy") / "loud", results(*runs))


def test_the_figures_of_a_folder_are_those_of_its_report(quiet, noisy):
    made = make("search", Inputs(results=(quiet, noisy)))
    for folder in (quiet, noisy):
        reported = {path.stem for path in (folder / "figures").iterdir()}
        prefix = f"search_{folder.name}_"
        mine = {name.removeprefix(prefix) for name in made.figures if name.startswith(prefix)}
        assert mine == reported


def test_curves_drawn_anew_are_the_reports(quiet):
    made = make("search", Inputs(results=(quiet,)))
    table = pd.read_csv(quiet / "tables" / "anytime.csv")
    curve = table[(table["terms"] == "raw") & (table["searcher"] == "ga")]
    panel = next(
        axes for axes in made.figures["search_plain_anytime_raw"].axes if axes.get_title() == "ga"
    )
    shown = panel.lines[-1].get_ydata()
    assert np.array_equal(shown[: len(curve)], curve["iqm"])


def test_the_files_have_text_that_is_text_and_the_same_bytes(quiet):
    inputs = Inputs(results=(quiet,))
    first = files_of(make("search", inputs), ["pdf"])
    assert files_of(make("search", inputs), ["pdf"]) == first
    for content in first.values():
        assert b"/CIDFontType2" in content
        assert b"CreationDate" not in content


def test_no_folder_is_refused():
    with pytest.raises(ResultsError, match="name a folder of softvox compare"):
        make("search", Inputs())


def test_two_folders_of_one_name_are_refused(quiet):
    with pytest.raises(ResultsError, match="two folders of results are called plain"):
        make("search", Inputs(results=(quiet, quiet)))


def test_a_folder_without_a_report_is_refused_with_the_command_that_writes_it(tmp_path):
    with pytest.raises(ResultsError, match="is not a folder"):
        read(tmp_path / "nothing")
    with pytest.raises(ResultsError, match=r"has no runs\.csv.*softvox compare FILE\.toml --out"):
        read(tmp_path)


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"", "can't be read as a table"),
        (b"\xff\xfe", "can't be read as a table"),
        (b"level,policy\n", "lacks the column terms"),
        (b"level,policy,terms,searcher,unique,iqm,low,high,ecdf\n", "has"),
        (
            b"level,policy,terms,searcher,unique,iqm,low,high,ecdf\n,,raw,ga,1,much,,,0.1\n",
            "something other than numbers in the column iqm",
        ),
    ],
)
def test_a_table_that_is_none_is_refused(quiet, tmp_path, content, fault):
    broken = tmp_path / "broken"
    (broken / "tables").mkdir(parents=True)
    (broken / "runs.csv").write_bytes((quiet / "runs.csv").read_bytes())
    (broken / "tables" / "anytime.csv").write_bytes(content)
    with pytest.raises(ResultsError, match=rf"anytime\.csv .*{fault}"):
        read(broken)
