"""The report as files: complete, the same bytes every time, and for the oddest experiments."""

import re
import subprocess
import sys

import matplotlib
import matplotlib.text
import numpy as np
import pandas as pd
import pytest
from made_results import FITNESS, random_runs, results, run

import softvox_gym
from softvox_gym.missing import missing
from softvox_search.report import figures, style, text, write

PNG = b"\x89PNG\r\n\x1a\n"


@pytest.fixture(autouse=True)
def made_up_truth(monkeypatch):
    def noisy_landscape(level):
        table = np.zeros(6561, dtype=[("mean", float), ("std", float), ("draws", int)])
        table["mean"], table["std"], table["draws"] = FITNESS * (1 - level / 10), 0.5, 64
        return table

    monkeypatch.setattr(softvox_gym, "noisy_landscape", noisy_landscape, raising=False)


@pytest.fixture(autouse=True)
def quick_pictures(request, monkeypatch):
    """Have figures laid out and not encoded, which takes longest; return the list of those drawn.

    Not where the test is marked as one that looks at the files of the pictures.
    """
    drawn = []
    if not request.node.get_closest_marker("pictures"):
        monkeypatch.setattr(style, "encoded", lambda made: drawn.append(made) or PNG)
    return drawn


def written(folder, made):
    names = write(folder, made)
    assert len(set(names)) == len(names)
    there = {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}
    assert there == set(names)
    return {name: (folder / name).read_bytes() for name in names}


def check_links(files):
    """Every picture that the page shows is there, and every one there is shown."""
    page = files["report.md"].decode()
    shown = re.findall(r"\]\((figures/[^)]+)\)", page)
    assert sorted(shown) == sorted(name for name in files if name.startswith("figures/"))
    for name in re.findall(r"tables/\S+\.(?:csv|md)", page):
        assert name in files
    assert all(files[name].startswith(PNG) for name in shown)


@pytest.mark.pictures
def test_a_comparison_without_noise_has_all_its_parts(tmp_path):
    made = results(*random_runs(["random", "ga"], 6, 120), command="softvox compare this.toml")
    files = written(tmp_path, made)
    check_links(files)
    page = files["report.md"].decode()
    assert "```sh\nsoftvox compare this.toml\n```" in page
    assert "No run failed." in page
    for title in ("Regret over time", "Targets reached", "Fixed budgets", "Fixed targets", "Pairs"):
        assert f"\n## {title}\n" in page
    assert "What is recommended" not in page
    for name in ("runs", "anytime", "fixed_budget", "fixed_target", "pairs"):
        assert len(pd.read_csv(tmp_path / "tables" / f"{name}.csv")) > 0


def test_a_comparison_with_noise_has_both_parts(tmp_path):
    runs = random_runs(["ga", "afpo"], 4, 60, levels=(0.0, 1.0), policies=("naive", "all"))
    files = written(tmp_path, results(*runs))
    check_links(files)
    page = files["report.md"].decode()
    for title in ("## Noise level 0", "## Noise level 1", "## What is recommended"):
        assert f"\n{title}\n" in page
    assert "than one\n  under the policy naive" in page
    assert {"figures/true_regret.png", "figures/optimism.png"} <= set(files)


def test_figures_say_at_which_level_and_under_which_policy_searchers_are_compared(
    tmp_path, quick_pictures
):
    write(tmp_path, results(*random_runs(["a"], 2, 20, levels=(0.5,), policies=("mean", "all"))))
    titles = [figure.legends[0].get_title().get_text() for figure in quick_pictures]
    assert titles[0] == "The searchers ranked, noise level 0.5"
    assert titles[1] == "Regret in raw terms, noise level 0.5, policy mean"
    assert titles[5] == "Regret at fixed budgets, noise level 0.5, policy mean"


def test_searchers_are_ranked_by_what_they_find_in_the_end_then_by_what_it_costs(tmp_path):
    poor = list(range(59))
    designs = {
        "none": [*poor, 59],
        "late": [*poor, 6453],
        "best": [6453, *poor],
        "short": poor[:50],
    }
    runs = [run(i, name, own) for i, (name, own) in enumerate(designs.items())]
    made = results(*runs, budgets={"short": {"unique": 50}})
    page = written(tmp_path, made)["report.md"].decode()
    assert 0 < page.index("figures/ranking.png") < page.index("## Runs")
    with style.style():
        drawn = figures.draw(text.read(tmp_path / "tables"))
    assert next(iter(drawn)) == "ranking"
    left, right = drawn["ranking"].axes
    names = [label.get_text() for label in left.get_yticklabels()]
    assert names == ["1. best", "2. late", "3. none", "4. short (after 50)"]
    assert [word.get_text().strip() for word in right.texts] == ["none found it"] * 4
    marks = right.lines[0].get_xdata()
    assert sorted(marks)[:2] == [1, 60]


def test_where_no_optimum_is_known_the_fittest_is_first_and_no_tick_is_in_mathtext(tmp_path):
    shape = (3, 3, 3)
    runs = [
        run(0, "poor", range(40), shape=shape, fitness=np.full(40, 1.0)),
        run(1, "good", range(40), shape=shape, fitness=np.linspace(0.0, 2.0, 40)),
    ]
    write(tmp_path, results(*runs))
    with style.style():
        left, right = figures.draw(text.read(tmp_path / "tables"))["ranking"].axes
        right.figure.canvas.draw()
    assert [label.get_text() for label in left.get_yticklabels()] == ["1. good", "2. poor"]
    ticks = [label.get_text() for label in right.get_xticklabels(which="both")]
    assert any(ticks)
    assert not any("$" in tick for tick in ticks)


def test_under_noise_searchers_are_ranked_by_what_they_recommend_under_their_best_policy(tmp_path):
    rows = [
        run(0, "a", [6453], level=1.0, policy="naive"),
        run(1, "a", [0], level=1.0, policy="all"),
        run(2, "b", [926], level=1.0, policy="naive"),
        run(3, "b", [926], level=1.0, policy="all"),
    ]
    write(tmp_path, results(*rows))
    with style.style():
        (axis,) = figures.draw(text.read(tmp_path / "tables"))["ranking_level_1"].axes
    assert [label.get_text() for label in axis.get_yticklabels()] == ["1. a", "2. b"]


def test_levels_of_noise_have_their_distance_on_their_axis():
    table = pd.DataFrame(
        [("a", policy, level) for policy in ("naive", "all") for level in (0, 0.5, 2)],
        columns=["searcher", "policy", "level"],
    ).assign(optimism=1.0, optimism_low=0.9, optimism_high=1.1)
    with style.style():
        (axis,) = figures.noise(table, table, "optimism", "").axes
    assert axis.get_xticks().tolist() == [0, 0.5, 2]
    for line in axis.lines[:2]:
        assert np.diff(line.get_xdata()) == pytest.approx([0.5, 1.5])
        assert np.abs(line.get_xdata() - [0, 0.5, 2]).max() < 0.25


def test_no_marker_is_cut_off_at_a_panels_sides(tmp_path, quick_pictures):
    write(tmp_path, results(run(0, "best", [6453]), run(1, "worst", [0])))
    figure = quick_pictures[-1]  # of fixed budgets
    figure.draw_without_rendering()
    for axis in figure.axes:
        for line in axis.lines:
            at = axis.transData.transform(line.get_xydata())[:, 0]
            half = line.get_markersize() / 2 * figure.dpi / 72
            assert axis.bbox.x0 <= at.min() - half
            assert at.max() + half <= axis.bbox.x1


@pytest.mark.pictures
def test_the_same_results_give_the_same_bytes(tmp_path):
    made = results(*random_runs(["random", "ga"], 3, 60, levels=(1.0,), policies=("naive",)))
    contents = []
    for name in "ab":
        (tmp_path / name).mkdir()
        contents.append(written(tmp_path / name, made))
    assert contents[0] == contents[1]


@pytest.mark.pictures
def test_a_picture_names_no_date_and_no_program(tmp_path):
    for name, content in written(tmp_path, results(*random_runs(["a"], 2, 10))).items():
        if name.endswith(".png"):
            assert not re.search(rb"tEXt|iTXt|zTXt|tIME", content)


def test_a_report_is_replaced_by_the_next(tmp_path):
    first = written(tmp_path, results(run(0, "a", [0, 1])))
    second = written(tmp_path, results(run(0, "a", [0, 6453])))
    assert first.keys() == second.keys()
    assert first["report.md"] != second["report.md"]


def test_what_an_earlier_report_told_of_searchers_that_are_gone_is_not_shown(tmp_path):
    two = [run(0, "a", [0, 1]), run(1, "b", [0, 2])]
    for runs, is_shown in ((two, True), (two[:1], False)):
        write(tmp_path, results(*runs))
        assert ("## Pairs" in (tmp_path / "report.md").read_text()) == is_shown


@pytest.mark.pictures
def test_the_users_settings_of_matplotlib_neither_matter_nor_change(tmp_path):
    made = results(*random_runs(["a"], 2, 10))
    (tmp_path / "plain").mkdir()
    (tmp_path / "own").mkdir()
    plain = written(tmp_path / "plain", made)
    with matplotlib.rc_context({"font.size": 31, "axes.facecolor": "red"}):
        assert written(tmp_path / "own", made) == plain
        assert matplotlib.rcParams["font.size"] == 31


@pytest.mark.parametrize("level", [np.nan, 1.0])
def test_a_single_run_of_a_single_evaluation_is_reported(tmp_path, level):
    files = written(tmp_path, results(run(0, "only", [0], level=level)))
    check_links(files)
    assert "## Pairs" not in files["report.md"].decode()


def test_an_experiment_whose_runs_all_failed_says_so(tmp_path):
    made = results(run(0, "a", [0], status="failed"), run(1, "b", [0], status="failed"))
    made.runs[["unique", "evaluations", "steps", "recommended", "believed"]] = np.nan
    files = written(tmp_path, made)
    assert set(files) == {"report.md", "tables/runs.csv"}
    assert "**2 failed and left out.**" in files["report.md"].decode()


def test_failed_runs_are_counted_beside_finished_ones(tmp_path):
    made = results(run(0, "a", [0]), run(7, "b", [0], status="failed"))
    made.runs.loc[1, ["unique", "evaluations", "steps", "recommended", "believed"]] = np.nan
    page = written(tmp_path, made)["report.md"].decode()
    assert "1 finished runs" in page
    assert "**1 failed and left out.**" in page


def test_a_searcher_with_a_smaller_budget_is_marked(tmp_path):
    runs = [*random_runs(["a"], 3, 120), *(run(9 + i, "tpe", range(i, 60)) for i in range(2))]
    made = results(*runs, budgets={"tpe": {"unique": 60}})
    page = written(tmp_path, made)["report.md"].decode()
    assert "Except tpe: unique 60." in page
    rows = [line.split("|")[1:-1] for line in page.splitlines() if line.startswith("| tpe")]
    at_budgets = [[cell.strip() for cell in row] for row in rows if len(row) == 4]
    assert len(at_budgets) == 2  # raw and class terms, after 50, 100 and 120 unique evaluations
    for _, short, *longer in at_budgets:
        assert short.endswith("]")
        assert longer == ["", ""]


def test_a_searcher_that_ended_early_keeps_its_value_with_a_mark(tmp_path):
    runs = [run(0, "a", range(120)), run(1, "a", range(60)), run(2, "a", range(60))]
    page = written(tmp_path, results(*runs))["report.md"].decode()
    (row, _) = (line for line in page.splitlines() if line.startswith("| a ") and "†" in line)
    assert [cell.strip()[-6:] for cell in row.split("|")[3:5]] == ["† 33 %", "† 33 %"]


def test_tables_in_markdown_keep_a_bar_in_a_label():
    labels = {text.escaped("a|b"): "1.0", "c": "12.0"}
    made = text.markdown([{"searcher": name, "value": v} for name, v in labels.items()])
    assert made == (
        "| searcher | value |\n| -------- | ----: |\n| a\\|b     |   1.0 |\n| c        |  12.0 |\n"
    )


def test_numbers_say_no_more_than_is_known():
    assert text.with_band(0.75, 0.6, 0.9) == "0.75 [0.60, 0.90]"
    assert text.with_band(0.75, np.nan, np.nan) == "0.75"
    assert text.with_band(np.inf, np.inf, np.inf) == "∞"
    assert text.number(-0.001) == "0.00"
    assert (text.percent(0.999), text.percent(1), text.percent(0.001)) == (
        "> 99 %",
        "100 %",
        "< 1 %",
    )
    assert (text.probability(1e-9), text.probability(0.034)) == ("< 0.0001", "0.034")


def shown_by_markdown(escaped):
    """Return what a reader sees of an escaped text, or fail where any of it is markup."""
    assert not re.search(r"[<>]|&(?!#\d+;)|(?<!\\)[*`|~$!]", escaped)
    plain = re.sub(r"\\([!-/:-@\[-`{-~])", r"\1", escaped)
    return re.sub(r"&#(\d+);", lambda found: chr(int(found[1])), plain)


LABELS = [
    "$\\frac{1$",
    "<img src=x onerror=alert(1)>",
    "[a](javascript:b)",
    "**a** _b_ __c__ `d` ~e~ # f",
    "a|b & &amp;",
    "![x](y)",
    "random_with_replacement",
]


@pytest.mark.parametrize("label", LABELS)
def test_an_escaped_label_is_shown_as_it_is(label):
    assert shown_by_markdown(text.escaped(label)) == label
    assert text.escaped("random_with_replacement") == "random_with_replacement"


def test_a_label_is_text_in_figures_and_on_the_page(tmp_path, quick_pictures):
    physics, policies = LABELS[:2], LABELS[:1]
    runs = random_runs(LABELS, 2, 60, physics=physics, levels=(0.0,), policies=policies)
    page = written(tmp_path, results(*runs, title=LABELS[1]))["report.md"].decode()
    assert page.startswith(f"# {text.escaped(LABELS[1])}\n")
    for label in LABELS[:-1]:
        assert text.escaped(label) in page
        assert label not in page
    assert len(quick_pictures) > 6
    for figure in quick_pictures:
        words = figure.findobj(matplotlib.text.Text)
        # The labels of the ranking begin with the ranks.
        shown = {re.sub(r"^\d\. ", "", word.get_text()): word for word in words}
        assert set(LABELS) <= set(shown)
        assert not any(shown[label].get_parse_math() for label in LABELS)
    assert set(pd.read_csv(tmp_path / "tables" / "runs.csv")["searcher"]) == set(LABELS)


def test_an_underscored_label_keeps_its_place_in_a_legend():
    with style.style():
        made = style.figure(3, 2)
        style.legend(made, "title", [style.line("_hidden"), style.line("b")])
        assert [word.get_text() for word in made.legends[0].get_texts()] == ["_hidden", "b"]


def test_a_command_ends_no_block_of_code():
    assert text.fenced("a ``` b") == "````sh\na ``` b\n````"
    assert text.fenced("a") == "```sh\na\n```"


def test_a_comparison_on_several_problems_has_a_part_for_each_and_one_for_all(tmp_path):
    shapes = ((2, 2, 2), (3, 3, 3))
    runs = random_runs(["a", "b"], 3, 60, physics=("published", "other"), shapes=shapes)
    files = written(tmp_path, results(*runs))
    check_links(files)
    page = files["report.md"].decode()
    for title in (
        "## Problems",
        "## Physics published, lattice 2x2x2",
        "## Physics other, lattice 2x2x2",
        "## Physics published, lattice 3x3x3",
        "## All physics, lattice 2x2x2",
        "### Best fitness over time",
    ):
        assert f"\n{title}\n" in page
    assert "figures/ecdf_raw_all_2x2x2.png" in files
    assert "figures/anytime_class_published_3x3x3.png" not in files
    assert "figures/anytime_raw_published_3x3x3.png" in files


def test_the_figures_can_be_drawn_from_the_files_of_the_tables(tmp_path):
    runs = random_runs(["a", "b"], 3, 60, levels=(0.0, 1.0), policies=("naive", "all"))
    names = write(tmp_path, results(*runs))
    with style.style():
        drawn = figures.draw(text.read(tmp_path / "tables"))
    assert {f"figures/{name}.png" for name in drawn} == {n for n in names if n.endswith(".png")}


def test_no_backend_of_the_environment_is_needed_and_one_that_there_is_stays_the_users():
    # What takes long to import is there already where each child loads matplotlib.
    code = """
import os, sys
import numpy, pandas, scipy.stats
sys.modules["matplotlib_inline"] = None
for backend in ["module://matplotlib_inline.backend_inline", "nonsense", "", "svg"]:
    if not (child := os.fork()):
        os.environ["MPLBACKEND"] = backend
        from softvox_search.report import style, figures
        if backend == "svg":
            import matplotlib
            print(matplotlib.get_backend(), flush=True)
        else:
            with style.style():
                style.encoded(style.grid(1)[0])
            print(os.environ["MPLBACKEND"], "matplotlib.pyplot" in sys.modules, flush=True)
        os._exit(0)
    os.waitpid(child, 0)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == (
        "module://matplotlib_inline.backend_inline False\nnonsense False\n False\nsvg\n",
        "",
    )


def test_the_report_is_light_to_import():
    code = "import sys, softvox_search.report; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert not loaded & {"pandas", "matplotlib", "scipy"}


def test_missing_packages_are_named_all_at_once_as_they_are_installed(monkeypatch):
    for name in ("matplotlib", "PIL"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ModuleNotFoundError) as caught:
        import matplotlib.figure  # noqa: F401
    line = missing("figures", caught.value, ["matplotlib", "PIL", "numpy"])
    assert line == "figures needs matplotlib and pillow: pip install matplotlib pillow"
    ours = ModuleNotFoundError(name="softvox_search.lost")
    with pytest.raises(ModuleNotFoundError) as caught:
        missing("figures", ours)
    assert caught.value is ours


def texts_outside(figure):
    """Return the titles, names of axes and legends of a drawn figure that its edges cut off."""
    figure.draw_without_rendering()
    texts = list(figure.texts)
    for axis in figure.axes:
        texts += [axis.title, axis.xaxis.label, axis.yaxis.label]
    for legend in figure.legends:
        texts += [*legend.get_texts(), legend.get_title()]
    inside = figure.bbox.padded(1)
    shown = [one for one in texts if one.get_text().strip()]
    assert len(shown) > 2
    return [
        one.get_text()
        for one in shown
        if not all(inside.contains(x, y) for x, y in one.get_window_extent().get_points())
    ]


@pytest.mark.parametrize(
    ("searchers", "levels", "shapes"),
    [(["ga"], (0.0, 1.0), ((2, 2, 2), (40, 1, 1))), (list("abcde"), (1.0,), ((2, 2, 2),))],
)
def test_no_text_is_cut_off(tmp_path, quick_pictures, searchers, levels, shapes):
    axes = {"levels": levels, "policies": ("naive", "all"), "shapes": shapes}
    write(tmp_path, results(*random_runs(searchers, 2, 40, **axes)))
    assert len(quick_pictures) > 6
    with style.style():
        assert [texts_outside(figure) for figure in quick_pictures] == [[]] * len(quick_pictures)


def test_a_comparison_on_larger_lattices_alone_is_reported(tmp_path):
    files = written(tmp_path, results(*random_runs(["a", "b"], 3, 40, shapes=((3, 3, 3),))))
    check_links(files)
    page = files["report.md"].decode()
    assert "the best that any run was told" in page
    assert "\n## Best fitness over time\n" in page
    assert "\n## Hypervolume\n" in page
    assert "figures/hypervolume.png" in files
