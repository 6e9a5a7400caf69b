"""A folder of trials: read, checked, added to and merged, whatever interrupts it."""

import io
import json
import os
import subprocess
import sys
from dataclasses import replace

import pyarrow.parquet as pq
import pytest
from test_trial import FULL, NEEDED, SIMULATED

from softvox_gym.files import OutputError
from softvox_gym.trials import Trial, TrialError, database
from softvox_gym.trials.export import as_json_lines, as_parquet

ONE, TWO, THREE = (Trial(**facts) for facts in (NEEDED, FULL, SIMULATED))
ALL = tuple(sorted((ONE, TWO, THREE), key=lambda trial: trial.digest))

#: Tells the run of ONE, and something else of it.
OTHER = replace(ONE, notes="seen again")


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture
def folder(tmp_path):
    database.add(tmp_path / "trials", ALL)
    return tmp_path / "trials"


def test_what_is_added_is_read(folder):
    assert contents(folder) == {f"{trial.digest}.json": trial.to_bytes() for trial in ALL}
    assert database.read(folder) == ALL
    assert database.read(folder, folder) == ALL
    assert database.read() == ()
    assert database.check(folder) == (ALL, (), ())


def test_adding_again_changes_nothing_and_tells_what_was_there(folder, tmp_path):
    before = contents(folder)
    again = replace(ONE, repetition=2)
    assert database.add(folder, [ONE, ONE, again]) == ((again,), (ONE,))
    assert contents(folder) == {**before, f"{again.digest}.json": again.to_bytes()}
    assert database.add(tmp_path / "new", []) == ((), ())
    assert database.read(tmp_path / "new") == ()


def test_other_files_are_left_alone(folder):
    (folder / "README.md").write_text("Ours.")
    (folder / ".git").mkdir()
    (folder / ".hidden.json").write_text("{")
    assert database.read(folder) == ALL
    assert database.check(folder) == (ALL, (), ())


def test_what_a_killed_process_leaves_is_no_trial_and_is_told(folder, monkeypatch):
    seen = []
    monkeypatch.setattr(os, "replace", lambda at, _: seen.append((at, database.check(folder))))
    database.add(folder, [replace(ONE, repetition=2)])
    ((left, (trials, faults, doubts)),) = seen
    assert (trials, faults) == (ALL, ())
    assert [line.partition(" is left from an interrupted")[0] for line in doubts] == [str(left)]


def test_a_run_told_twice_is_refused_before_anything_is_written(folder):
    before = contents(folder)
    with pytest.raises(TrialError) as error:
        database.add(folder, [replace(ONE, repetition=2), OTHER])
    assert str(error.value) == (
        f"a trial to add and {folder / ONE.digest}.json describe the same run differently (6453, "
        "acrylic, 2026-11-27, A. Person, repetition 1); if they are two runs, change the "
        "repetition of one, otherwise keep one of them"
    )
    with pytest.raises(TrialError, match=r"a trial to add and a trial to add describe"):
        database.add(folder.parent / "new", [ONE, OTHER])
    assert contents(folder) == before
    assert not (folder.parent / "new").exists()


def test_faults_names_every_file_and_the_remedy(folder):
    one, two, three = (folder / f"{trial.digest}.json" for trial in (ONE, TWO, THREE))
    one.rename(folder / "first.json")
    two.write_bytes(TWO.to_bytes().replace(b"CC0-1.0", b""))
    three.write_bytes(THREE.to_bytes() + b"\n")
    (folder / "folder.json").mkdir()
    os.mkfifo(folder / "pipe.json")
    (folder / "nowhere.json").symlink_to("nothing")
    again = replace(THREE, notes="again"), replace(THREE, notes="and again")
    first, second = sorted(folder / f"{trial.digest}.json" for trial in again)
    for trial in again:
        (folder / f"{trial.digest}.json").write_bytes(trial.to_bytes())
    assert sorted(database.check(folder).faults) == sorted(
        [
            f"{folder}/first.json has content that does not match its name; restore it, or, if "
            f"the change is intended, rename it to {ONE.digest}.json",
            f"{two} license must be one of CC0-1.0, CC-BY-4.0, ODC-By-1.0, PDDL-1.0, MIT, got ''",
            f"{three} differs from what softvox trials writes; restore the file, or add its track "
            "again",
            f"{folder}/folder.json is not a file; remove it",
            f"{folder}/pipe.json is not a file; remove it",
            f"{folder}/nowhere.json can't be read (No such file or directory); make it readable, "
            "or remove it",
            f"{second} and {first} describe the same run differently (6453, reversal, acrylic, "
            "A. Person, repetition 1); if they are two runs, change the repetition of one, "
            "otherwise keep one of them",
        ]
    )
    with pytest.raises(TrialError, match=r"\(6 more: softvox trials check\)$"):
        database.read(folder)
    with pytest.raises(TrialError, match=r"\(6 more: softvox trials check\)$"):
        database.add(folder, [])


def test_folders_may_be_given_by_their_names(folder):
    assert database.read(str(folder)) == database.read(folder)
    assert database.check(str(folder)) == database.check(folder)
    assert database.add(str(folder), ALL).new == ()
    assert database.merge(f"{folder}-2", str(folder)).new == database.read(folder)


@pytest.mark.parametrize("trials", [ALL[0], [None], 6453])
def test_what_are_no_trials_is_not_added(trials, folder):
    with pytest.raises(TypeError, match=r"trials must be a list of softvox_gym\.trials\.Trial, as"):
        database.add(folder, trials)


@pytest.mark.parametrize("function", [database.read, database.check])
def test_what_is_no_folder_is_named(function, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(TrialError, match=r"there is no folder .*missing; name another, or make"):
        function(tmp_path / "missing")
    with pytest.raises(TrialError, match=r"file is a file; name its folder"):
        function(tmp_path / "file")
    with pytest.raises(OutputError, match=r"file is not a folder; choose another"):
        database.add(tmp_path / "file", ALL)
    with pytest.raises(OutputError, match=r"a is not a folder; make it first, or choose another"):
        database.add(tmp_path / "a" / "b", ALL)


def test_one_track_of_two_measured_runs_is_doubted_and_of_two_simulated_ones_is_not(tmp_path):
    copied = replace(ONE, design=6560)
    database.add(tmp_path, [ONE, copied, THREE, replace(THREE, design=6560)])
    trials, faults, doubts = database.check(tmp_path)
    assert (len(trials), faults) == (4, ())
    first, second = sorted([ONE.digest, copied.digest])
    assert doubts == (
        f"{tmp_path}/{second}.json and {tmp_path}/{first}.json have the same track, which no "
        "two runs do; leave out the one that is attributed to the wrong robot",
    )
    with pytest.raises(TrialError, match=r"^c\.csv, line 2 and .*json have the same track"):
        database.add(tmp_path, {replace(ONE, who="C."): "c.csv, line 2"}, refuse_copies=True)
    still = (
        replace(ONE, position=0 * ONE.position),
        replace(ONE, cycle=[0, 1], position=[[0, 0], [9, 9]]),
    )
    for trial in still:
        twice = [trial, replace(trial, who="C.")]
        assert len(database.add(tmp_path / trial.digest, twice, refuse_copies=True).new) == 2
    assert database.add(tmp_path, [ONE], refuse_copies=True) == ((), (ONE,))


def test_two_labs_are_merged(tmp_path):
    ours, theirs, all_of_them = (tmp_path / name for name in ("ours", "theirs", "all"))
    another = replace(ONE, who="B. Person")
    database.add(ours, [ONE, TWO])
    database.add(theirs, [another, TWO])
    made = database.merge(all_of_them, ours, theirs)
    assert set(made.new) == {ONE, TWO, another}
    assert database.read(all_of_them) == database.read(ours, theirs) == made.new
    assert database.merge(all_of_them, ours, all_of_them).new == ()
    assert database.merge(ours, theirs) == ((another,), (TWO,))
    assert contents(ours) == contents(all_of_them)


def test_labs_that_describe_one_run_differently_are_refused_with_both_files(tmp_path):
    ours, theirs, new = (tmp_path / name for name in ("ours", "theirs", "new"))
    database.add(ours, [ONE])
    database.add(theirs, [OTHER, TWO])
    for into, *others in ((ours, theirs), (new, ours, theirs), (theirs, ours)):
        with pytest.raises(TrialError, match="describe the same run differently") as error:
            database.merge(into, *others)
        assert f"{ours}/{ONE.digest}.json" in str(error.value)
        assert f"{theirs}/{OTHER.digest}.json" in str(error.value)
    assert len(contents(ours)) == 1
    assert len(contents(theirs)) == 2
    assert not new.exists()
    with pytest.raises(TrialError, match="describe the same run differently"):
        database.read(ours, theirs)


#: Does a task again and again, each time killed before or after another call that changes the
#: disk, until it goes through; then once more, by four processes at a time. Prints how often it
#: was killed.
DRIVER = """\
import os, shutil, signal, sys, traceback
from pathlib import Path
from softvox_gym.trials import database

def killing(at):
    calls = 0
    def wrapped(function):
        def call(*arguments, **options):
            nonlocal calls
            calls += 1
            if calls == at:
                os.kill(os.getpid(), signal.SIGKILL)
            value = function(*arguments, **options)
            calls += 1
            if calls == at:
                os.kill(os.getpid(), signal.SIGKILL)
            return value
        return call
    for name in ("mkdir", "open", "fsync", "replace"):
        setattr(os, name, wrapped(getattr(os, name)))

def forked(at=0):
    child = os.fork()
    if child == 0:
        try:
            if at:
                killing(at)
            task(into)
            os._exit(0)
        except BaseException:
            traceback.print_exc()
            os._exit(1)
    return child

source, into, kind = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
trials = database.read(source)
task = {
    "add": lambda into: database.add(into, trials),
    "merge": lambda into: database.merge(into, source),
}[kind]
whole = {path.name: path.read_bytes() for path in source.iterdir()}
killed, found, status = 0, set(), -signal.SIGKILL
while status:
    shutil.rmtree(into, ignore_errors=True)
    status = os.waitstatus_to_exitcode(os.waitpid(forked(killed + 1), 0)[1])
    assert status in (0, -signal.SIGKILL), status
    killed += status != 0
    files = [path for path in into.glob("*") if path.name[0] != "."]
    assert all(path.read_bytes() == whole[path.name] for path in files)
    found.add(len(files))
    task(into)
    assert database.read(into) == trials
for _ in range(3):
    shutil.rmtree(into)
    for child in [forked() for _ in range(4)]:
        assert os.waitpid(child, 0)[1] == 0
    assert {path.name: path.read_bytes() for path in into.iterdir()} == whole
print(killed, *sorted(found))
"""


@pytest.mark.parametrize("kind", ["add", "merge"])
def test_killed_at_every_moment_it_loses_nothing_and_the_same_again_completes_it(kind, folder):
    done = subprocess.run(
        [sys.executable, "-c", DRIVER, folder, folder.parent / "into", kind],
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    killed, *found = map(int, done.stdout.split())
    assert killed >= 3 * 2 * 3  # of three files each is synced and put, and the folder synced
    assert found == [0, 1, 2, 3]


def test_stopped_it_says_that_what_is_written_is_kept(tmp_path, monkeypatch):
    def write_one(path, content, *, force):
        monkeypatch.setattr(database, "write_file", stop)
        path.write_bytes(content)

    def stop(path, content, *, force):
        raise KeyboardInterrupt

    monkeypatch.setattr(database, "write_file", write_one)
    with pytest.raises(KeyboardInterrupt) as stopped:
        database.add(tmp_path, ALL)
    (note,) = stopped.value.__notes__
    assert note == "the trials written so far are kept; the same command goes on"
    assert database.read(tmp_path) == ALL[:1]


def test_exported_it_says_all_and_in_the_same_bytes():
    lines = as_json_lines(ALL)
    assert lines == as_json_lines(database.Trial.from_bytes(trial.to_bytes()) for trial in ALL)
    read = [json.loads(line) for line in lines.decode().splitlines()]
    for one, trial in zip(read, ALL, strict=True):
        assert one == {"digest": trial.digest, **trial.facts, **json.loads(trial.to_bytes())}
    table = as_parquet(ALL)
    assert table == as_parquet(ALL)
    rows = pq.read_table(io.BytesIO(table)).to_pylist()
    for row, facts, trial in zip(rows, read, ALL, strict=True):
        points = zip(*(row.pop(name) for name in ("cycle", "x_cm", "y_cm")), strict=True)
        assert [list(point) for point in points] == facts.pop("track")
        known = {name: value for name, value in row["provenance"].items() if value is not None}
        assert {**row, "provenance": known} == facts
        assert row["digest"] == trial.digest
    assert pq.read_table(io.BytesIO(as_parquet([]))).num_rows == 0


def test_what_ships_has_no_fault():
    assert database.shipped().name == "trials"
    if database.shipped().is_dir():
        assert database.check(database.shipped()).faults == ()
