import csv
import json
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from cli_process import softvox
from small_experiments import COMMAND, NOISY, OWN, SMALL, experiment_of, results, run_here

import softvox_gym
from softvox_gym.cli import main
from softvox_gym.files import OutputError
from softvox_search.cli.compare import summary
from softvox_search.experiment import compare as comparing
from softvox_search.experiment.environments import Environments
from softvox_search.experiment.results import read, read_manifest
from softvox_search.experiment.run import do, identity, made_with
from softvox_search.experiment.schema import UsageError
from softvox_search.export import ioh
from softvox_search.leaderboard import leaderboard


def rows(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    folder = tmp_path_factory.mktemp("small")
    experiment = experiment_of(folder, SMALL)
    outcome, said, here = run_here(experiment, folder / "out")
    assert (outcome.total, outcome.failed, said, len(here.runs)) == (7, [], [], 7)
    return experiment, folder / "out"


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("noisy")
    experiment = experiment_of(folder, NOISY)
    run_here(experiment, folder / "out")
    return experiment, folder / "out"


@pytest.fixture
def out(small, tmp_path):
    """A copy of the finished small experiment."""
    return shutil.copytree(small[1], tmp_path / "out")


@pytest.mark.parametrize("which", ["small", "noisy"])
def test_the_folder_holds_what_each_run_gives_alone(which, request):
    experiment, folder = request.getfixturevalue(which)
    found, environments = read(folder), Environments()
    for run, row in zip(experiment.runs(), found.runs.to_dict("records"), strict=True):
        summary, columns = do(run, environments)
        assert row["run"] == identity(run, made_with())
        for key, value in summary.items():
            assert row[key] == value or (value is None and np.isnan(row[key]))
        log = found.evaluations(row["run"])
        assert log.keys() == columns.keys()
        for name, column in columns.items():
            np.testing.assert_array_equal(log[name], column)


def test_every_level_and_policy_spends_the_same_evaluations(noisy):
    found = read(noisy[1])
    assert set(found.runs["unique"]) == set(found.runs["evaluations"]) == {24}
    for run in found.runs["run"]:
        assert not found.evaluations(run)["cached"].any()


def test_level_0_is_the_truth_and_level_1_is_not(noisy):
    found, truth = read(noisy[1]), softvox_gym.landscape()["fitness"]
    for level, run in zip(found.runs["level"], found.runs["run"], strict=True):
        log = found.evaluations(run)
        assert (log["fitness"] == truth[log["design"]]).mean() == (level == 0)


def test_the_manifest_says_what_was_run_from_what(noisy):
    experiment, folder = noisy
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["experiment"] == experiment.to_dict()
    assert {"deap", "numpy", "optuna", "ribs"} <= manifest["made_with"]["versions"].keys()
    assert (manifest["runs"], manifest["failed"], manifest["command"]) == (8, [], COMMAND)
    for name in ("version", "commit", "cpu", "instruction_set", "started", "python"):
        assert name in manifest


def test_repeated_by_two_processes_all_files_are_the_same_bits(small, tmp_path):
    experiment, folder = small
    (tmp_path / "out").mkdir()
    comparing.compare(
        experiment,
        tmp_path / "out",
        command=COMMAND,
        workers=2,
        progress=lambda *_: None,
        say=print,
    )
    assert results(tmp_path / "out") == results(folder)


def test_what_is_done_already_is_not_run_again(small, out):
    before = {path.name: path.stat().st_mtime_ns for path in out.iterdir()}
    outcome, said, here = run_here(small[0], out)
    assert (outcome.before, outcome.total, said, here.runs) == (7, 7, [], [])
    assert {path.name: path.stat().st_mtime_ns for path in out.iterdir()} == before


MORE = SMALL.replace("seeds = 3", "seeds = 4", 1).replace(
    "[budget]", 'physics = ["published", "exact"]\n[budget]'
) + ('[[searchers]]\nname = "hill_climber"\noptions = { batch = [4, 8] }\n')


def test_a_searcher_a_seed_and_a_physics_are_added_to_a_finished_folder(small, out, tmp_path):
    text = SMALL + '[[searchers]]\nname = "ga"\n'
    outcome, said, here = run_here(experiment_of(tmp_path, text), out)
    new = [("ga", "published", seed) for seed in range(3)]
    assert here.names[outcome.repeated :] == new
    assert {run.searcher.label for run in here.runs[: outcome.repeated]} == {
        "exhaustive",
        "random",
        "with",
    }
    assert (outcome.total, outcome.before, outcome.repeated, said) == (10, 7, 5, [])

    outcome, _, here = run_here(experiment_of(tmp_path, MORE), out)
    added = set(here.names[outcome.repeated :])
    assert outcome.total == 2 * (1 + 4 + 4 + 4 + 4)
    assert len(added) == outcome.total - 7
    assert {name for name, _, _ in added} == {
        "exhaustive", "random", "with", "hill_climber(batch=4)", "hill_climber(batch=8)"
    }  # fmt: skip
    assert {run for run in added if run[0] == "random" and run[1] == "published"} == {
        ("random", "published", 3)
    }
    whole, _, _ = run_here(experiment_of(tmp_path, MORE), tmp_path / "whole")
    table = (tmp_path / "whole" / "runs.csv").read_bytes()
    assert (out / "runs.csv").read_bytes() == table
    assert whole.before == 0


def test_what_is_taken_out_of_the_file_is_left_out_of_the_results_and_kept(small, out, tmp_path):
    experiment = experiment_of(tmp_path, SMALL.partition('[[searchers]]\nname = "random_with')[0])
    run_here(experiment, out)
    assert len(read(out).runs) == 4
    assert len(list((out / "runs").iterdir())) == 7
    _, _, here = run_here(small[0], out)
    assert here.runs == []
    assert results(out) == results(small[1])


def test_random_streams_are_keyed_by_names_not_by_place(small, tmp_path):
    rows_ = SMALL.split("[[searchers]]\n")
    other = experiment_of(tmp_path, "[[searchers]]\n".join([rows_[0], *reversed(rows_[1:])]))
    ids = {identity(run, made_with()) for run in other.runs()}
    assert ids == {identity(run, made_with()) for run in small[0].runs()}


def test_changed_source_is_noted_and_a_changed_result_is_an_error(
    small, out, tmp_path, monkeypatch
):
    monkeypatch.setattr(comparing, "code_digest", lambda _: "0123456789abcdef")
    text = SMALL + '[[searchers]]\nname = "ga"\n'
    run_here(experiment_of(tmp_path, text), out)
    (note,) = read_manifest(out).notes
    assert "the source changed, from " in note
    assert "to 0123456789ab; 5 of 7 finished runs were done again, to the same bits" in note

    def changed(run, environments):
        summary, columns = do(run, environments)
        return {**summary, "digest": "other"}, columns

    monkeypatch.setattr("softvox_search.experiment.run.do", changed)
    text += "seeds = 2\n"
    before = results(out)
    with pytest.raises(UsageError) as caught:
        run_here(experiment_of(tmp_path, text.replace("seeds = 2", "seeds = 5")), out)
    message = str(caught.value)
    assert re.search(r"run [0-9a-f]{16} \(searcher \w+, physics .* seed \d\) in ", message)
    assert "can't be repeated: now gives another result" in message
    assert "with --force" in message
    assert results(out) == before
    with pytest.raises(UsageError, match="can't be repeated"):
        run_here(small[0], out, check=True)


def test_a_check_does_finished_runs_again_and_nothing_else(small, out):
    before = results(out)
    outcome, _, here = run_here(small[0], out, check=True)
    assert (outcome.repeated, len(here.runs)) == (5, 5)
    assert results(out) == before


LATTICES = """\
seeds = 2
shape = [[2, 2, 2], [1, 2, 2], [5, 3, 3]]
budget.evaluations = 10
[[searchers]]
name = "own:climb"
label = "climb"
options = { width = [1, 2] }
[[searchers]]
name = "random"
"""


def test_functions_search_any_lattice_and_designs_without_numbers_are_digits(tmp_path, monkeypatch):
    (tmp_path / "own.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own", raising=False)
    outcome, _, _ = run_here(experiment_of(tmp_path, LATTICES), tmp_path / "out")
    found = read(tmp_path / "out")
    assert (outcome.total, outcome.failed) == (18, [])
    assert found.runs["shape"].tolist() == (["2x2x2"] * 2 + ["1x2x2"] * 2 + ["5x3x3"] * 2) * 3
    assert set(found.runs["searcher"]) == {"climb(width=1)", "climb(width=2)", "random"}
    for row in found.runs.itertuples():
        log = found.evaluations(row.run)
        assert row.recommended in log["design"].tolist()
        assert isinstance(row.recommended, str) == (row.shape == "5x3x3")
        assert row.evaluations == len(log["fitness"]) == 10
        if row.shape == "5x3x3":
            design = softvox_gym.Design(row.recommended, shape=(5, 3, 3))
            assert row.believed == softvox_gym.evaluate([design]).value[0]
    table, _ = leaderboard([found])
    assert table["regret"].isna().sum() == 6
    assert len(ioh(found, tmp_path)) == 1 + 3 * (1 + 3)


def test_a_budget_in_seconds_is_left_out_of_what_is_done_again(tmp_path):
    quick = SMALL.partition("[[searchers]]")[0].replace("unique = 60", "cpu_seconds = 0.02")
    text = quick + "[[searchers]]\nname = 'random_with_replacement'\n"
    run_here(experiment_of(tmp_path, text), tmp_path / "out")
    more = text.replace("seeds = 3", "seeds = 4") + "[[searchers]]\nname = 'random'\n"
    more += "budget = { evaluations = 20 }\n"
    outcome, _, here = run_here(experiment_of(tmp_path, more), tmp_path / "out")
    assert (outcome.repeated, outcome.unrepeatable, len(here.runs)) == (0, 3, 5)
    outcome, _, _ = run_here(experiment_of(tmp_path, more), tmp_path / "out", check=True)
    assert outcome.unrepeatable == 8
    assert "8 can't be repeated, as their budget is in CPU seconds" in summary(
        "exp", tmp_path, outcome, check=True
    )


OTHERS = {
    "entropy": ("entropy = 1", "entropy = 9", "entropy was 1, and is 9"),
    "physics": ("[budget]", 'physics = "exact"\n[budget]', 'physics was "published", and is "ex'),
}


@pytest.mark.parametrize("case", [*OTHERS, "version"])
def test_a_folder_of_which_no_run_is_of_use_is_refused_and_left_alone(
    case, out, tmp_path, monkeypatch
):
    experiment = experiment_of(tmp_path, SMALL)
    if case in OTHERS:
        old, new, expected = OTHERS[case]
        experiment = experiment_of(tmp_path, SMALL.replace(old, new, 1))
    else:
        made, expected = made_with(), "numpy was"
        changed = {**made, "versions": {**made["versions"], "numpy": "0.1"}}
        monkeypatch.setattr(comparing, "made_with", lambda *_: changed)
    before = results(out)
    with pytest.raises(UsageError) as caught:
        run_here(experiment, out)
    message = str(caught.value)
    assert "holds results made differently" in message
    assert expected in message
    assert "--out" in message
    assert "--force" in message
    assert results(out) == before


def test_forced_it_throws_the_earlier_results_away(small, noisy, tmp_path):
    out = shutil.copytree(noisy[1], tmp_path / "out")
    (out / "notes.txt").write_text("mine")
    outcome, _, _ = run_here(small[0], out, force=True)
    assert outcome.before == 0
    assert results(out) == {**results(small[1]), "notes.txt": b"mine"}


def test_forced_into_a_folder_without_results_it_throws_nothing_away(small, tmp_path):
    (tmp_path / "figures").mkdir()
    own = [tmp_path / name for name in ("figures/own.png", "report.md", "notes.txt")]
    for path in own:
        path.write_text("mine")
    run_here(small[0], tmp_path, force=True)
    assert [path.read_text() for path in own] == ["mine"] * 3
    assert len(read(tmp_path).runs) == 7


def test_there_is_nothing_to_check_where_there_is_no_folder(tmp_path):
    (tmp_path / "exp.toml").write_text(SMALL)
    done = softvox("compare", "exp.toml", "--check", "--out", "none", cwd=tmp_path)
    assert done.returncode == 2
    assert (
        done.stderr
        == "softvox: error: none doesn't exist, so no runs can be repeated; leave out --check\n"
    )
    assert not (tmp_path / "none").exists()


def test_a_folder_with_anything_else_is_refused(small, tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(UsageError, match="is not empty"):
        run_here(small[0], tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


#: Four ways to fail, and what failed.csv says of each.
FAILURES = {
    "raises": "RuntimeError: no luck at all",
    "illegal": "SearcherError: searcher illegal returned invalid designs",
    "exits": "SystemExit: 3",
    "dies": "its process ended with exit code -9",
}

FAILING = (
    "seeds = 3\nentropy = 10\nbudget.unique = 20\n[[searchers]]\nname = 'random'\n"
) + "".join(
    f"[[searchers]]\nname = 'own:Fails'\nlabel = '{how}'\noptions.how = '{how}'\n"
    for how in FAILURES
)


def test_a_failed_run_is_named_the_others_go_on_and_the_next_start_tries_it_again(tmp_path):
    (tmp_path / "own.py").write_text(OWN)
    (tmp_path / "exp.toml").write_text(FAILING)
    command = ("compare", "exp.toml", "--no-report", "--out")
    done = softvox("compare", "exp.toml", "--out", "out", cwd=tmp_path)
    out = tmp_path / "out"
    assert "failed, see out/failed.csv; the same command tries them again" in done.stdout
    assert "manifest.json, report.md" in done.stdout
    shutil.rmtree(out / "tables")
    shutil.rmtree(out / "figures")
    (out / "report.md").unlink()
    runs, failed = rows(out / "runs.csv"), rows(out / "failed.csv")
    identities = [row["run"] for row in runs if row["status"] == "failed"]
    assert done.returncode == 1
    assert len(runs) == 15
    assert {row["status"] for row in runs[:3]} == {"ok"}
    assert {row["searcher"] for row in failed} == FAILURES.keys()
    assert [row["run"] for row in failed] == identities
    assert all(row["error"].startswith(FAILURES[row["searcher"]]) for row in failed)
    assert json.loads((out / "manifest.json").read_text())["failed"] == identities
    lines, first = done.stderr.splitlines(), failed[0]
    assert len(lines) == min(len(identities), 5)
    assert lines[0] == (
        f"softvox: failed: run {first['run'][:16]} (searcher {first['searcher']}, physics "
        f"published, shape 2x2x2, seed {first['seed']}): {first['error']}"
    )
    assert f"{15 - len(identities)} of 15 runs done" in done.stdout
    assert set(read(out).runs["status"]) == {"ok", "failed"}

    (tmp_path / "mended").touch()
    again = softvox(*command, "out", cwd=tmp_path)
    assert (again.returncode, again.stderr) == (0, "")
    assert f"15 of 15 runs done ({15 - len(identities)} of them before)" in again.stdout
    assert not (out / "failed.csv").exists()
    assert softvox(*command, "whole", cwd=tmp_path).returncode == 0
    assert results(out) == results(tmp_path / "whole")

    (tmp_path / "own.py").write_text(OWN.replace("np.arange(20)", "np.arange(1, 21)"))
    (tmp_path / "exp.toml").write_text(FAILING.replace("seeds = 3", "seeds = 4"))
    edited = softvox(*command, "out", cwd=tmp_path)
    assert (edited.returncode, len(edited.stderr.splitlines())) == (2, 1)
    assert "can't be repeated: now gives another result" in edited.stderr


BAD = {
    "compare": "FILE.toml",
    "compare none.toml": "none.toml: No such file or directory",
    "compare exp.toml --workers 0": "--workers",
    "compare exp.toml --part 3/2": "argument --part: must be K/N with K from 1 to N",
    "compare exp.toml --out file": "--out file is not a folder",
    "compare exp.toml --out file/no/such": "--out file/no",
    "compare exp.toml --no-report --out folder": "folder is not empty; choose another",
    "compare exp.toml --out empty --report-only": "empty: results are not there; softvox compare",
    "compare bad.toml": "bad.toml: [[searchers]] rnd: there is no searcher 'rnd'",
    "compare exp.toml --no-report --report-only": "not allowed with",
    "merge empty --out new": "empty holds no results; softvox compare FILE.toml --part 1/2",
    "export empty --out new": "empty: results are not there; softvox compare FILE.toml --out empty",
    "leaderboard empty file": "empty: results are not there",
}


@pytest.mark.parametrize("command", BAD)
def test_bad_input_is_one_line_and_nothing_is_written(command, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "exp.toml").write_text(SMALL)
    (tmp_path / "bad.toml").write_text(
        'seeds = 1\nentropy = 1\nbudget.unique = 3\n[[searchers]]\nname = "rnd"\n'
    )
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty").mkdir()
    (tmp_path / "folder" / "mine").touch()
    before = sorted(tmp_path.rglob("*"))
    status = main(command.split())
    said = capsys.readouterr()
    assert (status, said.out, len(said.err.splitlines())) == (2, "", 1)
    assert BAD[command] in said.err
    assert [path for path in sorted(tmp_path.rglob("*")) if path.name != "new"] == before


def test_neither_a_backend_that_is_missing_nor_labels_of_markup_break_the_report(tmp_path):
    label = r"$\frac{1$ <img onerror=alert(1)> | `x` *y*"
    (tmp_path / "exp.toml").write_text(SMALL.replace('"with"', f"'{label}'"))
    done = softvox("compare", "exp.toml", cwd=tmp_path, MPLBACKEND="module://no_such.backend")
    assert (done.returncode, done.stderr) == (0, "")
    out = tmp_path / "results" / "exp"
    assert "wrote into results/exp: runs.csv, manifest.json, report.md" in done.stdout
    assert label in set(read(out).runs["searcher"])
    assert "<img" not in (out / "report.md").read_text(encoding="utf-8")
    again = softvox("compare", "exp.toml", "--report-only", cwd=tmp_path)
    assert (again.returncode, again.stdout) == (0, "wrote into results/exp: report.md\n")


def test_a_report_that_cannot_be_made_is_said_before_the_runs(tmp_path):
    (tmp_path / "exp.toml").write_text(SMALL)
    (tmp_path / "scipy.py").write_text("raise ValueError('no such thing')\n")
    done = softvox("compare", "exp.toml", cwd=tmp_path, PYTHONPATH=str(tmp_path))
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
    assert "no such thing" in done.stderr
    assert "--no-report" in done.stderr
    assert not (tmp_path / "results").exists()


CHATTY = """\
from own import Slow

class Chatty(Slow):
    def ask(self, n=None):
        print("hello")
        return super().ask(n)
"""


def test_searchers_beside_the_file_are_found_and_what_they_print_goes_aside(tmp_path):
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "own.py").write_text(OWN)
    (tmp_path / "deep" / "chatty.py").write_text(CHATTY)
    (tmp_path / "deep" / "exp.toml").write_text(
        "seeds = 1\nbudget.unique = 20\n[[searchers]]\nname = 'chatty:Chatty'\n"
    )
    done = softvox("compare", "deep/exp.toml", "--no-report", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert set(done.stderr.split()) == {"hello"}
    assert done.stdout.splitlines()[1] == "wrote into results/exp: runs.csv, manifest.json"
    assert "hello" not in done.stdout


def test_what_cannot_be_written_names_the_folder_and_the_next_start_goes_on(
    small, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "out"
    write, count = comparing.write_file, iter(range(10))

    def full(*args, **options):
        if next(count) == 3:
            raise OutputError("No space left on device")
        write(*args, **options)

    monkeypatch.setattr(comparing, "write_file", full)
    with pytest.raises(OutputError, match="No space"):
        run_here(small[0], out)
    outcome, _, here = run_here(small[0], out)
    assert (outcome.before, len(here.runs) - outcome.repeated) == (3, 4)
    assert results(out) == results(small[1])


def test_the_commands_are_light_to_load():
    code = "import sys, softvox_gym.cli as cli; cli._parser(); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ
    )
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert "softvox_search" in loaded
    assert not loaded & {"deap", "pandas", "matplotlib", "msgspec", "scipy", "pyarrow", "optuna"}
