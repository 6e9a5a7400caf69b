import csv
import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pyarrow.parquet as pq
import pytest
from cli_process import softvox
from small_experiments import NOISY, OWN, SMALL, results

import softvox_gym
from softvox_gym.cli import main
from softvox_gym.files import OutputError
from softvox_gym.landscapes.table import origin
from softvox_search.experiment import compare as comparing
from softvox_search.experiment import folder as files
from softvox_search.experiment.compare import Plan, check_report, compare
from softvox_search.experiment.config import read
from softvox_search.experiment.environment import Environments
from softvox_search.experiment.job import do
from softvox_search.log import COLUMNS, digest

PLAN = Plan(command="softvox compare exp.toml", arguments=["compare"], workers=2, report=False)


def experiment_of(folder, text):
    path = folder / "exp.toml"
    path.write_text(text, encoding="utf-8")
    return read(path)


def run(experiment, folder, plan=PLAN):
    said, steps = [], []
    folder.mkdir(exist_ok=True)
    outcome = compare(
        experiment, folder, plan, progress=lambda *step: steps.append(step), say=said.append
    )
    return outcome, said, steps


def rows(path):
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    folder = tmp_path_factory.mktemp("small")
    experiment = experiment_of(folder, SMALL)
    outcome, said, steps = run(experiment, folder / "out")
    assert (outcome.total, outcome.failed, said) == (7, [], [])
    assert steps == [(done, 7) for done in range(8)]
    return experiment, folder / "out"


@pytest.fixture(scope="module")
def noisy(tmp_path_factory):
    folder = tmp_path_factory.mktemp("noisy")
    experiment = experiment_of(folder, NOISY)
    run(experiment, folder / "out")
    return experiment, folder / "out"


def broken_off(*_):
    raise KeyboardInterrupt


@pytest.fixture(scope="module")
def journalled(small, tmp_path_factory):
    """A folder whose runs are all in the journal, but for which no results are written yet."""
    experiment, _ = small
    folder = tmp_path_factory.mktemp("journalled") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(files, "write_data", broken_off)
        with pytest.raises(KeyboardInterrupt):
            run(experiment, folder)
    assert (folder / "journal.bin").exists()
    return folder


@pytest.mark.parametrize("which", ["small", "noisy"])
def test_the_folder_holds_what_each_run_gives_alone(which, request):
    experiment, folder = request.getfixturevalue(which)
    table = pq.read_table(folder / "evaluations.parquet")
    assert table.column_names == ["run", *COLUMNS]
    runs = rows(folder / "runs.csv")
    found = rows(folder / "improvements.csv")
    environments = Environments(experiment)
    for run_, row in zip(experiment.runs(), runs, strict=True):
        record = do(experiment, run_, environments)
        assert row == {
            name: "" if value is None else str(value) for name, value in record.summary.items()
        }
        part = table.filter(np.asarray(table["run"]) == run_.number)
        for name in COLUMNS:
            if name == "noise_seed" and which == "small":
                assert part[name].null_count == len(part) == row_count(row)
            else:
                assert part[name].to_pylist() == record.columns[name].tolist()
        own = [row for row in found if int(row["run"]) == run_.number]
        assert [float(row["fitness"]) for row in own] == record.improvements["fitness"].tolist()
        assert digest(record.columns) == row["digest"]


def row_count(row):
    return int(row["evaluations"])


def test_every_level_and_policy_spends_the_same_evaluations(noisy):
    _, folder = noisy
    assert {row["unique"] for row in rows(folder / "runs.csv")} == {"24"}
    assert {row["evaluations"] for row in rows(folder / "runs.csv")} == {"24"}
    table = pq.read_table(folder / "evaluations.parquet")
    assert table["noise_seed"].null_count == 0
    assert not any(table["cached"].to_pylist())


def test_level_0_is_the_truth_and_level_1_is_not(noisy):
    _, folder = noisy
    table = pq.read_table(folder / "evaluations.parquet").to_pydict()
    truth = softvox_gym.landscape()["fitness"][table["design"]]
    exact = np.array(table["run"]) < 4
    assert (np.array(table["fitness"])[exact] == truth[exact]).all()
    assert (np.array(table["fitness"])[~exact] != truth[~exact]).mean() > 0.9


def test_the_manifest_says_what_was_run_from_what_and_how_fast(noisy):
    experiment, folder = noisy
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["made_from"]["config"]["entropy"] == experiment.entropy
    assert manifest["made_from"]["engine_digest"] == origin()["engine_digest"]
    assert {"deap", "numpy", "optuna", "ribs"} <= manifest["made_from"]["versions"].keys()
    assert (manifest["runs"], manifest["failed"], manifest["command"]) == (8, [], PLAN.command)
    assert manifest["sum"]["evaluations"] == 8 * 24
    assert sum(cell["evaluations"] for cell in manifest["cells"]) == 8 * 24
    assert all(cell["evaluations_per_cpu_second"] > 0 for cell in manifest["cells"])
    for name in ("version", "commit", "cpu", "instruction_set", "started", "python"):
        assert name in manifest


def test_repeated_with_another_number_of_workers_all_files_are_the_same_bits(small, tmp_path):
    experiment, folder = small
    again, _, _ = run(experiment, tmp_path / "again", Plan(**{**vars(PLAN), "workers": 1}))
    assert again.before == 0
    assert results(tmp_path / "again") == results(folder)
    assert set(results(folder)) == {"evaluations.parquet", "runs.csv", "improvements.csv"}


def test_what_is_done_already_is_not_run_again(small, monkeypatch):
    experiment, folder = small
    before = {path.name: path.stat().st_mtime_ns for path in folder.iterdir()}
    monkeypatch.setattr(comparing, "do_all", None)
    outcome, said, steps = run(experiment, folder)
    assert (outcome.was_complete, outcome.before, said, steps) == (True, 7, [], [])
    assert {path.name: path.stat().st_mtime_ns for path in folder.iterdir()} == before


def test_interrupted_while_writing_the_results_it_goes_on_from_the_journal(
    small, journalled, tmp_path, monkeypatch
):
    experiment, folder = small
    out = shutil.copytree(journalled, tmp_path / "out")
    (out / ".evaluations.parquet.partial-0123").write_bytes(b"half")
    with monkeypatch.context() as patch:
        patch.setattr(files, "write_manifest", broken_off)
        with pytest.raises(KeyboardInterrupt):
            run(experiment, out)
    outcome, _, steps = run(experiment, out)
    assert (outcome.before, steps) == (7, [(0, 0)])
    assert results(out) == results(folder)


def test_a_cut_off_journal_is_used_as_far_as_it_is_whole_and_it_says_so(
    small, journalled, tmp_path
):
    experiment, folder = small
    out = shutil.copytree(journalled, tmp_path / "out")
    journal = (out / "journal.bin").read_bytes()
    (out / "journal.bin").write_bytes(journal[: len(journal) * 2 // 3])
    outcome, said, _ = run(experiment, out)
    assert 0 < outcome.before < 7
    (message,) = said
    assert "journal.bin is damaged" in message
    assert f"the {outcome.before} whole runs are used" in message
    assert results(out) == results(folder)


OTHERS = {
    "config": ("entropy = 1", "entropy = 9", "entropy was 1, and is 9"),
    "budget": ("unique = 60", "unique = 61", "budget.unique was 60, and is 61"),
    "searchers": ('name = "random"\n', 'name = "ga"\n', "was"),
}


@pytest.mark.parametrize("state", ["small", "journalled"])
@pytest.mark.parametrize("case", [*OTHERS, "engine", "version", "code"])
def test_results_of_another_config_engine_or_code_are_refused_and_left_alone(
    case, state, small, journalled, tmp_path, monkeypatch
):
    experiment, finished = small
    out = shutil.copytree(finished if state == "small" else journalled, tmp_path / "out")
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    if case in OTHERS:
        old, new, expected = OTHERS[case]
        experiment = experiment_of(tmp_path, SMALL.replace(old, new, 1))
    else:
        key, expected = {
            "engine": ("engine_digest", "the engine's digest was"),
            "version": ("versions", "numpy was"),
            "code": ("code", "the code of the searchers or of this package has changed"),
        }[case]
        changed = {"numpy": "0.1"} if key == "versions" else "0123456789abcdef"
        made_from = comparing.identity(experiment)
        monkeypatch.setattr(comparing, "identity", lambda _: {**made_from, key: changed})
    with pytest.raises(files.FolderError) as caught:
        run(experiment, out)
    message = str(caught.value)
    assert "holds results made otherwise: " in message
    assert expected in message
    assert "--out" in message
    assert "--force" in message
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before


def test_forced_it_throws_the_earlier_results_away(small, noisy, tmp_path):
    experiment, folder = small
    out = shutil.copytree(noisy[1], tmp_path / "out")
    (out / "notes.txt").write_text("mine")
    outcome, _, _ = run(experiment, out, Plan(**{**vars(PLAN), "force": True}))
    assert outcome.before == 0
    assert results(out) == {**results(folder), "notes.txt": b"mine"}


def test_a_folder_with_anything_else_is_refused(small, tmp_path):
    experiment, _ = small
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(files.FolderError, match="is not empty"):
        run(experiment, tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["notes.txt"]


def test_results_that_were_changed_are_not_called_done(small, tmp_path):
    experiment, folder = small
    out = shutil.copytree(folder, tmp_path / "out")
    with (out / "runs.csv").open("a") as file:
        file.write("surplus\n")
    with pytest.raises(files.FolderError, match=r"runs\.csv is not as it was written"):
        run(experiment, out)


def test_two_at_once_in_one_folder_are_refused(small, tmp_path):
    experiment, _ = small
    (tmp_path / "out").mkdir()
    with (
        files.locked(tmp_path / "out"),
        pytest.raises(files.FolderError, match="being written by another process"),
    ):
        run(experiment, tmp_path / "out")


def test_a_disk_that_fills_up_is_an_error_and_the_next_start_goes_on(
    small, journalled, tmp_path, monkeypatch
):
    experiment, folder = small
    out = shutil.copytree(journalled, tmp_path / "out")

    def full(*_, **__):
        raise OutputError("cannot write runs.csv: No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(files, "write_file", full)
        with pytest.raises(OutputError):
            run(experiment, out)
    outcome, _, _ = run(experiment, out)
    assert outcome.before == 7
    assert results(out) == results(folder)


#: Four ways to fail, and what failed.csv says of each.
FAILURES = {
    "raises": "RuntimeError: no luck at all",
    "illegal": "SearcherError: searcher illegal returned what are no designs",
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
    done = softvox(*command, "out", cwd=tmp_path)
    out = tmp_path / "out"
    runs, failed = rows(out / "runs.csv"), rows(out / "failed.csv")
    numbers = [int(row["run"]) for row in runs if row["status"] == "failed"]
    assert done.returncode == 1
    assert len(runs) == 15
    assert {row["status"] for row in runs[:3]} == {"ok"}
    assert {row["searcher"] for row in failed} == FAILURES.keys()
    assert [int(row["run"]) for row in failed] == numbers
    assert all(row["error"].startswith(FAILURES[row["searcher"]]) for row in failed)
    assert json.loads((out / "manifest.json").read_text())["failed"] == numbers
    lines = done.stderr.splitlines()
    assert len(lines) == min(len(numbers), 5)
    first = failed[0]
    assert lines[0] == (
        f"softvox: failed: run {first['run']} ({first['searcher']}, seed {first['seed']}): "
        f"{first['error']}"
    )
    assert f"{15 - len(numbers)} of 15 runs done" in done.stdout

    (tmp_path / "mended").touch()
    again = softvox(*command, "out", cwd=tmp_path)
    assert (again.returncode, again.stderr) == (0, "")
    assert f"15 of 15 runs done ({15 - len(numbers)} of them before)" in again.stdout
    assert not (out / "failed.csv").exists()
    assert softvox(*command, "whole", cwd=tmp_path).returncode == 0
    assert results(out) == results(tmp_path / "whole")

    assert "were done already" in softvox(*command, "out", cwd=tmp_path).stdout
    (tmp_path / "own.py").write_text(OWN.replace("np.arange(20)", "np.arange(30)"))
    edited = softvox(*command, "out", cwd=tmp_path)
    assert (edited.returncode, len(edited.stderr.splitlines())) == (2, 1)
    assert "the code of the searchers or of this package has changed since" in edited.stderr


BAD = {
    "compare": "FILE.toml",
    "compare none.toml": "none.toml: No such file or directory",
    "compare exp.toml --workers 0": "--workers",
    "compare exp.toml --out file": "--out file is not a folder",
    "compare exp.toml --out file/such": "--out file is not a folder; choose another",
    "compare exp.toml --out file/no/such": "--out file is not a folder; choose another",
    f"compare exp.toml --workers {10**23}": "above 0 and at most 999999999",
    "compare exp.toml --out folder": "folder is not empty; choose another",
    "compare exp.toml --out empty --report-only": "empty holds no results yet",
    "compare bad.toml": "bad.toml: [[searchers]] no. 1 (rnd) name must be one of",
    "compare exp.toml --no-report --report-only": "not allowed with",
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
    assert sorted(tmp_path.rglob("*")) == before


def test_the_results_go_to_a_folder_of_the_files_name_unless_said_otherwise(tmp_path):
    (tmp_path / "exp.toml").write_text(SMALL)
    done = softvox("compare", "exp.toml", "--no-report", cwd=tmp_path)
    assert done.returncode == 0
    assert (tmp_path / "results" / "exp" / "runs.csv").exists()
    assert "wrote into results/exp: evaluations.parquet, runs.csv" in done.stdout
    done = softvox("compare", "exp.toml", "--no-report", "--out", "no/such", cwd=tmp_path)
    assert "wrote into no/such (without --out it is results/exp): eval" in done.stdout
    assert results(tmp_path / "no" / "such") == results(tmp_path / "results" / "exp")


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
    assert len(done.stdout.splitlines()) == 2
    assert "hello" not in done.stdout


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (OSError(28, "No space left on device"), "cannot write into out: No space left on device"),
        (OutputError("cannot write out/x: No space"), "cannot write out/x: No space"),
    ],
)
def test_what_cannot_be_written_names_the_folder_and_what_to_do(
    error, message, journalled, tmp_path, monkeypatch, capsys
):
    def full(*_):
        raise error

    monkeypatch.chdir(tmp_path)
    (tmp_path / "exp.toml").write_text(SMALL)
    shutil.copytree(journalled, tmp_path / "out")
    monkeypatch.setattr(files, "write_data", full)
    status = main(["compare", "exp.toml", "--no-report", "--out", "out"])
    said = capsys.readouterr()
    assert (status, said.out) == (2, "")
    assert said.err == (
        f"softvox: error: {message}; what is done is kept; the same command goes on\n"
    )


@pytest.mark.parametrize("name", ["runs.csv", "improvements.csv"])
@pytest.mark.parametrize("damage", ["gone", "cut"])
def test_no_report_is_made_from_damaged_results(name, damage, small, tmp_path):
    experiment, folder = small
    out = shutil.copytree(folder, tmp_path / "out")
    check_report(experiment, out)
    if damage == "gone":
        (out / name).unlink()
    else:
        (out / name).write_bytes((out / name).read_bytes()[:-5])
    with pytest.raises(files.FolderError, match=rf"{name} is not as it was written; restore it"):
        check_report(experiment, out)


def test_another_manifest_is_not_taken_for_ones_own(small, tmp_path):
    experiment, _ = small
    (tmp_path / "manifest.json").write_text("[3]")
    with pytest.raises(files.FolderError, match="is no manifest of results"):
        run(experiment, tmp_path)


def test_the_commands_are_light_to_load():
    code = "import sys, softvox_gym.cli as cli; cli._parser(); print(*sys.modules)"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env=os.environ
    )
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert "softvox_search" in loaded
    assert not loaded & {"deap", "pandas", "matplotlib", "scipy", "pyarrow", "optuna"}


@pytest.mark.parametrize("command", ["compare", "robustness", "search"])
def test_the_help_fits_80_columns(command, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    assert main([command, "--help"]) == 0
    text = capsys.readouterr().out
    assert [line for line in text.splitlines() if len(line) > 80] == []
