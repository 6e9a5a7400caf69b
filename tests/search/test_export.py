"""Results for others: IOHprofiler's format, read back by its own reader; and the leaderboard."""

import json
import shutil
import warnings

import numpy as np
import pandas as pd
import pytest
from cli_process import softvox
from small_experiments import experiment_of, run_here

import softvox_gym
from softvox_search.experiment.results import read
from softvox_search.export import ioh
from softvox_search.leaderboard import as_text, leaderboard

FITNESS = softvox_gym.landscape()["fitness"]

EXPERIMENT = """\
seeds = 4
entropy = 5
physics = ["published", { label = "moon", preset = "published", gravity = -1.62 }]
levels = [0, 1]
budget.evaluations = 40
[[policies]]
name = "naive"
[[searchers]]
name = "ga"
options = { population = [4, 8] }
[[searchers]]
name = "random"
label = "by chance / $x$"
"""

QUIET = """\
seeds = 5
entropy = 5
budget = { unique = 3000 }
[[searchers]]
name = "random"
[[searchers]]
name = "exhaustive"
seeds = 1
"""


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("noisy")
    run_here(experiment_of(folder, EXPERIMENT), folder / "out")
    return read(folder / "out")


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    folder = tmp_path_factory.mktemp("quiet")
    run_here(experiment_of(folder, QUIET), folder / "out")
    return read(folder / "out")


def test_iohinspector_reads_what_was_exported(noisy, tmp_path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of what it imports
        import iohinspector

    written = ioh(noisy, tmp_path)
    assert all((tmp_path / path).is_file() for path in written)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        manager = iohinspector.DataManager()
        manager.add_folder(str(tmp_path))
        overview = manager.overview.to_pandas()
        data = manager.load(monotonic=False, include_meta_data=True).to_pandas()
    assert len(overview) == len(noisy.runs) == 3 * 2 * 2 * 4
    assert set(overview["algorithm_name"]) == {
        "ga(population=4), naive",
        "ga(population=8), naive",
        "by chance / $x$, naive",
    }
    assert set(overview["function_name"]) == {"SoftVox_noise_0", "SoftVox_noise_1"}
    assert set(overview["dimension"]) == {8}
    assert set(overview["evals"]) == {40}
    instances = pd.read_csv(tmp_path / "instances.csv")
    assert instances["physics"].tolist() == ["published", "moon"]

    logs = [noisy.evaluations(run) for run in noisy.runs["run"]]
    assert sorted(overview["best_y"]) == sorted(log["fitness"].max() for log in logs)
    expected = []
    for log, row in zip(logs, noisy.runs.itertuples(), strict=True):
        best = -np.inf
        for i, value in zip(log["sequence"], log["fitness"], strict=True):
            if value > best or i == 40:
                expected.append((f"{row.searcher}, naive", row.level, row.physics, i, value))
            best = max(best, value)
    physics = instances.set_index("instance")["physics"]
    levels = data["function_name"].str.removeprefix("SoftVox_noise_").astype(float)
    found = zip(
        data["algorithm_name"],
        levels,
        physics[data["instance"]],
        data["evaluations"],
        data["raw_y"],
        strict=True,
    )
    assert sorted(found) == sorted(expected)


def test_the_best_of_a_run_is_given_with_its_digits(quiet, tmp_path):
    ioh(quiet, tmp_path)
    (path,) = tmp_path.glob("random/*.json")
    scenario = json.loads(path.read_text())["scenarios"][0]
    for run, facts in zip(quiet.runs["run"], scenario["runs"], strict=False):
        log = quiet.evaluations(run)
        best = facts["best"]
        number = sum(digit * 3**i for i, digit in enumerate(best["x"]))
        assert best["y"] == FITNESS[number] == log["fitness"].max()
        assert log["design"][best["evals"] - 1] == number


def test_labels_that_are_alike_in_files_have_folders_of_their_own(tmp_path):
    labels = ("a b", "a_b", "A b")
    text = "seeds = 1\nbudget.unique = 3\n"
    text += "".join(f'[[searchers]]\nname = "random"\nlabel = "{one}"\n' for one in labels)
    run_here(experiment_of(tmp_path, text), tmp_path / "out")
    (tmp_path / "ioh").mkdir()
    ioh(read(tmp_path / "out"), tmp_path / "ioh")
    algorithms = [
        json.loads(path.read_text())["algorithm"]["name"] for path in tmp_path.glob("ioh/*/*.json")
    ]
    assert sorted(algorithms) == sorted(labels)


def test_a_failed_run_makes_no_number_of_a_design_inexact(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "fails_here.py").write_text("def now(evaluate, space, rng):\n    1 / 0\n")
    for shape in ([2, 2, 2], [3, 3, 4]):
        text = f"seeds = 1\nshape = {shape}\nbudget.unique = 2\n"
        text += "[[searchers]]\nname = 'random'\n[[searchers]]\nname = 'fails_here:now'\n"
        out = tmp_path / str(shape)
        run_here(experiment_of(tmp_path, text), out)
        found = read(out)
        best, none = found.runs["recommended"]
        log = found.evaluations(found.runs["run"][0])
        assert (best, none) == (log["design"][log["fitness"].argmax()], None)
        assert leaderboard([found])[0]["value"].tolist() == [log["fitness"].max()]


def test_searchers_of_one_label_that_are_set_otherwise_are_told_apart(tmp_path):
    folders = []
    for policy, population in (("naive", 4), ("mean", 6)):
        text = "seeds = 1\nlevels = [0]\nbudget.unique = 12\n[[policies]]\nname = 'mine'\n"
        text += f"running_mean = {str(policy == 'mean').lower()}\n[[searchers]]\nname = 'ga'\n"
        text += f"options.population = {population}\n"
        run_here(experiment_of(tmp_path, text), tmp_path / policy)
        folders.append(read(tmp_path / policy))
    table, _ = leaderboard(folders)
    assert set(table["searcher"]) == {"ga (name=ga, population=4)", "ga (name=ga, population=6)"}
    assert all(policy.startswith("mine (running_mean=") for policy in table["policy"])
    assert table["runs"].tolist() == [1, 1]


def test_of_a_run_in_several_folders_the_one_with_its_log_tells(quiet, tmp_path):
    out = shutil.copytree(quiet.folder, tmp_path / "out")
    shutil.rmtree(out / "runs")
    assert leaderboard([read(out), quiet])[0].equals(leaderboard([quiet])[0])


def test_the_leaderboard_says_what_is_known_of_every_searcher(quiet):
    table, notes = leaderboard([quiet])
    assert notes == []
    assert table["problem"].tolist() == ["physics published, 2x2x2"] * 2
    by_name = table.set_index("searcher")
    random = by_name.loc["random"]
    costs, hits = [], 0
    for row in quiet.runs[quiet.runs["searcher"] == "random"].itertuples():
        designs = quiet.evaluations(row.run)["design"].tolist()
        hit = FITNESS.argmax() in designs
        costs.append(designs.index(FITNESS.argmax()) + 1 if hit else 3000)
        hits += hit
    assert 0 < hits < 5
    assert (random["runs"], random["found"]) == (5, hits / 5)
    assert random["ert"] == sum(costs) / hits
    assert random["best"] == FITNESS.max()
    exhaustive = by_name.loc["exhaustive"]
    assert exhaustive["value"] == FITNESS[:3000].max()
    assert exhaustive["regret"] == FITNESS.max() - FITNESS[:3000].max()
    assert (exhaustive["found"], exhaustive["ert"]) == (0, np.inf)
    assert random["budget"] == "unique 3000, evaluations 60000"


def test_a_run_counts_once_and_problems_are_told_apart(noisy, quiet, tmp_path):
    table, _ = leaderboard([noisy, quiet, noisy])
    assert set(table["runs"]) == {4, 5, 1}
    assert len(table) == 3 * 4 + 2
    assert set(table["problem"]) == {
        "physics published, 2x2x2",
        "physics published, 2x2x2, noise level 0",
        "physics published, 2x2x2, noise level 1",
        "physics moon (gravity -1.62), 2x2x2, noise level 0",
        "physics moon (gravity -1.62), 2x2x2, noise level 1",
    }
    moon = table[table["problem"].str.contains("moon")]
    assert (moon["regret"] >= 0).all()
    text = as_text(table)
    assert "by chance / $x$" in text
    assert len(text.split("\n\n")) == 5


def test_without_the_runs_what_needs_them_is_left_out_and_said(quiet, tmp_path):
    out = shutil.copytree(quiet.folder, tmp_path / "out")
    shutil.rmtree(out / "runs")
    table, (note,) = leaderboard([read(out)])
    assert "has no runs/" in note
    assert quiet.command in note
    assert table["ert"].isna().all()
    assert table["regret"].notna().all()


def test_the_commands_print_and_write(quiet, tmp_path):
    done = softvox("export", str(quiet.folder), "--out", "ioh", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout == "wrote into ioh: 5 files of 6 runs\n"
    again = softvox("export", str(quiet.folder), "--out", "ioh", cwd=tmp_path)
    assert (again.returncode, len(again.stderr.splitlines())) == (2, 1)
    rows = json.loads(softvox("leaderboard", str(quiet.folder), "--json", cwd=tmp_path).stdout)
    assert [row["searcher"] for row in rows] == ["random", "exhaustive"]
    assert rows[1]["ert"] is None
    lines = softvox("leaderboard", str(quiet.folder), "--csv", cwd=tmp_path).stdout.splitlines()
    assert lines[0].startswith("problem,searcher,policy,budget,runs,value,best,regret,found,ert")
    assert len(lines) == 3
