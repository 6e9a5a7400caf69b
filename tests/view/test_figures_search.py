import shutil

import numpy as np
import pandas as pd
import pytest
from search.made_results import random_runs, results
from softvox_view.folders import ResultsError
from softvox_view.results_folder import read
from view.figure_labels import check_labels, texts_of

from softvox_search import report
from softvox_view.figures import Inputs, files_of, make, style
from softvox_view.figures.search import look


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


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    """Thirteen searchers, as the committed comparison has, their names as long as its longest."""
    names = [f"random_with_replacement{i:02}"[2:] for i in range(12)]
    made = results(*random_runs(("random", *names), 2, 6561))
    return folder_of(tmp_path_factory.mktemp("many") / "many", made)


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


def test_the_figures_are_for_print_with_labels_that_can_be_read(many, noisy):
    made = make("search", Inputs(results=(many, noisy)))
    assert len(made.figures) == 17
    for figure in made.figures.values():
        assert figure.get_figwidth() <= style.WIDTH
        with look():
            style.lay_out(figure)
            check_labels(figure)
            assert min(text.get_fontsize() for text in texts_of(figure)) >= style.SMALL


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


def altered(folder, to, name, change):
    """A copy of a folder of results in which one table is another."""
    copy = shutil.copytree(folder, to / "altered")
    table = pd.read_csv(copy / name, keep_default_na=False)
    change(table).to_csv(copy / name, index=False)
    return copy


def without(column, value):
    return lambda table: table[table[column] != value]


def renamed(column, old, new):
    return lambda table: table.assign(**{column: table[column].replace(old, new)})


RUNS, ANYTIME, BUDGET = "runs.csv", "tables/anytime.csv", "tables/fixed_budget.csv"
SEARCHERS, POLICIES = "tables/noise_searchers.csv", "tables/noise_policies.csv"


@pytest.mark.parametrize(
    ("name", "change", "fault"),
    [
        (RUNS, without("searcher", "ga"), r"anytime\.csv has ga, .* no finished run"),
        (ANYTIME, without("searcher", "ga"), r"anytime\.csv lacks ga, in raw terms, level 0"),
        (ANYTIME, without("terms", "class"), r"anytime\.csv lacks random, in class terms"),
        (ANYTIME, renamed("terms", "class", "klass"), r"has the terms 'klass'"),
        (ANYTIME, without("level", 1.0), r"anytime\.csv lacks level 1, of which"),
        (ANYTIME, lambda table: table[:-3], r"cut off: it has 32 rows of ga, .* and 35 of others"),
        (BUDGET, lambda table: table[:-1], r"fixed_budget\.csv is cut off: .* ga, in class terms"),
        (SEARCHERS, without("policy", "mean"), r"noise_searchers\.csv lacks random, level 0"),
        (POLICIES, renamed("policy", "mean", "men"), r"noise_policies\.csv has .*, policy 'men'"),
    ],
)
def test_tables_that_do_not_belong_to_the_runs_are_refused(noisy, tmp_path, name, change, fault):
    with pytest.raises(ResultsError, match=rf"{fault}.*--report-only writes the tables anew"):
        read(altered(noisy, tmp_path, name, change))


def test_a_table_cut_off_within_a_line_is_refused_with_the_line(quiet, tmp_path):
    copy = shutil.copytree(quiet, tmp_path / "cut")
    text = (copy / ANYTIME).read_text()
    (copy / ANYTIME).write_text(text[: text.rindex(",")])
    line = len(text.splitlines())
    with pytest.raises(ResultsError, match=rf"nothing in the column ecdf on line {line};"):
        read(copy)


def test_a_noisy_experiments_folder_without_its_tables_of_noise_is_refused(noisy, tmp_path):
    copy = shutil.copytree(noisy, tmp_path / "less")
    (copy / SEARCHERS).unlink()
    with pytest.raises(ResultsError, match=r"has no tables/noise_searchers\.csv"):
        read(copy)
