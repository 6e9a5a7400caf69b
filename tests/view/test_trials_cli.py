"""softvox trials check, merge, list and export, the way people meet them."""

import io
import json
import sys
from dataclasses import replace

import pyarrow.parquet as pq
import pytest

from softvox_gym import Design
from softvox_gym.cli import main
from softvox_gym.cli import trials as options
from softvox_gym.trials import Trial, database
from softvox_gym.trials.export import as_json_lines

#: Runs that nobody made, of numbers that are easy to read in a table.
MEASURED = Trial(
    design=6453,
    cycle=[0, 45, 90],
    position=[[0, 0], [1, 1.2], [2.7, 3.6]],
    surface="Acrylic, 3 mm",
    powder="corn starch",
    pressure_kpa=6,
    frequency_hz=0.5,
    who="A. Person",
    date="2026-11-27",
    license="CC-BY-4.0",
)
STILL = replace(
    MEASURED,
    design=6560,
    pressure_kpa=8,
    who="Laboratory of B. Person",
    position=[[0, 0], [0, 0], [0, 0]],
)
SIMULATED = Trial(
    design=Design("1" + "2" * 26, shape=(3, 3, 3)),
    cycle=[0, 23],
    position=[[0, 0], [-3, 0]],
    surface="floor",
    who="softvox-gym",
    license="CC0-1.0",
    source="simulated",
    reality="reversal",
    voxel_cm=1,
)
ALL = (MEASURED, STILL, SIMULATED)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Stand in a folder with a database of the usual name."""
    monkeypatch.chdir(tmp_path)
    database.add(tmp_path / "trials", ALL)
    return tmp_path / "trials"


def told(capsys, *arguments):
    """Run the command here; return its status, what it printed and what it complained of."""
    status = main(["trials", *map(str, arguments)])
    return status, *capsys.readouterr()


def test_without_a_subcommand_the_help_is_printed_and_the_status_is_2(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    status, out, err = told(capsys)
    assert (status, err) == (2, "")
    assert told(capsys, "--help") == (0, out, "")
    for name in ("check", "merge", "list", "export"):
        assert f"\n    {name} " in out
        _, text, _ = told(capsys, name, "--help")
        assert text.startswith(f"usage: softvox trials {name} ")
        assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["lst"], "invalid choice: 'lst' (choose from "),
        (["list", "--jsn"], "no option --jsn; did you mean --json? (see softvox trials list --hel"),
        (["export"], "the following arguments are required: --out (see softvox trials export --h"),
        (["merge"], "the following arguments are required: FROM (see softvox trials merge --help)"),
    ],
)
def test_what_is_mistyped_is_told(arguments, message, capsys):
    status, out, err = told(capsys, *arguments)
    assert (status, out) == (2, "")
    assert message in err
    assert len(err.splitlines()) == 1


def test_list_shows_what_a_person_asks_for(folder, capsys):
    status, out, err = told(capsys, "list")
    assert (status, err) == (0, "")
    head, *lines, foot = (" ".join(line.split()) for line in out.splitlines())
    assert head == (
        "digest design source surface powder cycles Hz distance heading rep. date who licence"
    )
    assert lines == sorted(
        [
            f"{MEASURED.digest[:8]} 6453 measured Acrylic, 3 mm corn starch 90 0.5 3.00 53 1 "
            "2026-11-27 A. Person CC-BY-4.0",
            f"{STILL.digest[:8]} 6560 measured Acrylic, 3 mm corn starch 90 0.5 0.00 - 1 "
            "2026-11-27 Laboratory of B. ... CC-BY-4.0",
            f"{SIMULATED.digest[:8]} 12222222222222222... reversal floor - 23 - 3.00 180 1 - "
            "softvox-gym CC0-1.0",
        ]
    )
    assert foot == "3 trials (2 measured, 1 simulated)"


@pytest.mark.parametrize(
    ("options", "found"),
    [
        (["--design", "6453"], [MEASURED]),
        (["--design", "00021222"], [MEASURED]),
        (["--design", "1" + "2" * 26], [SIMULATED]),
        (["--source", "measured"], [MEASURED, STILL]),
        (["--source", "simulated"], [SIMULATED]),
        (["--lattice", "2x2x2", "--hz", "0.50"], [MEASURED, STILL]),
        (["--lattice", "3x3x3"], [SIMULATED]),
        (["--kpa", "6"], [MEASURED]),
        (["--surface", "acrylic"], [MEASURED, STILL]),
        (["--who", "b. person", "--surface", "acryl"], [STILL]),
        (["--design", "6454"], []),
    ],
)
def test_list_leaves_out_the_others(options, found, folder, capsys):
    status, out, err = told(capsys, "list", "--json", *options)
    assert (status, err) == (0, "")
    assert {one["digest"] for one in json.loads(out)} == {trial.digest for trial in found}
    if not found:
        none = "none of 3 trials (2 measured, 1 simulated)\n"
        assert told(capsys, "list", *options) == (0, none, "")


def test_a_surface_is_told_from_one_with_a_longer_name(folder, capsys):
    bare, foam, unknown = more = [
        replace(MEASURED, surface="Acrylic", powder="", repetition=2),
        replace(MEASURED, surface="Acrylic foam", repetition=3),
        replace(MEASURED, surface="Oak", pressure_kpa=None, frequency_hz=None),
    ]
    database.add(folder, more)
    for chosen, found in (
        (["--surface", "acrylic"], [bare]),
        (["--surface", "acryl"], [MEASURED, STILL, bare, foam]),
        (["--powder", "", "--source", "measured"], [bare]),
        (["--kpa", "", "--source", "measured"], [unknown]),
        (["--hz", "", "--source", "measured"], [unknown]),
        (["--who", ""], []),
    ):
        _, out, _ = told(capsys, "list", "--json", *chosen)
        assert {one["digest"] for one in json.loads(out)} == {trial.digest for trial in found}


def test_list_as_json_says_all_but_the_track(folder, capsys):
    _, out, _ = told(capsys, "list", folder, "--json", "--design", 6453)
    (one,) = json.loads(out)
    assert one == {
        **MEASURED.facts,
        "digest": MEASURED.digest,
        "design": 6453,
        "digits": "00021222",
        "distance": pytest.approx(3),
        "heading": pytest.approx(53.13, abs=0.01),
    }


def test_check_says_that_there_is_no_fault_or_each(folder, capsys):
    well = "3 trials (2 measured, 1 simulated), 0 faults, 0 warnings\n"
    assert told(capsys, "check") == (0, well, "")
    copied = replace(MEASURED, design=6013)
    database.add(folder, [copied])
    status, out, _ = told(capsys, "check", "trials")
    assert status == 0
    warning, last = out.splitlines()
    assert warning.startswith("warning: trials/")
    assert last == "4 trials (3 measured, 1 simulated), 0 faults, 1 warning"
    (folder / f"{STILL.digest}.json").write_text("{")
    (folder / f"{copied.digest}.json").unlink()
    status, out, err = told(capsys, "check")
    assert (status, err) == (1, "")
    assert out.splitlines() == [
        f"trials/{STILL.digest}.json line 1: is not valid JSON; restore the file, or remove it",
        "2 trials (1 measured, 1 simulated), 1 fault, 0 warnings",
    ]
    status, out, err = told(capsys, "list")
    assert (status, out) == (2, "")
    assert err.startswith(f"softvox: error: trials/{STILL.digest}.json line 1: is not valid JSON")


def test_check_looks_between_folders_too(folder, tmp_path, capsys):
    database.add(tmp_path / "theirs", [replace(MEASURED, notes="again")])
    status, out, _ = told(capsys, "check", "trials", "theirs")
    assert status == 1
    assert out.count("describe the same run differently (6453, Acrylic, 3 mm, 2026-11-27, A.") == 1


def test_merge_copies_what_is_new_or_nothing(folder, tmp_path, capsys):
    copied = "3 trials copied into both\n"
    assert told(capsys, "merge", "trials", "--into", "both") == (0, copied, "")
    database.add(tmp_path / "theirs", [replace(MEASURED, who="C."), STILL])
    copied = "1 trial copied into trials, 1 known one left alone\n"
    assert told(capsys, "merge", "theirs", "both/../theirs") == (0, copied, "")
    assert len(database.read(folder)) == 4
    database.add(tmp_path / "late", [replace(MEASURED, notes="again"), replace(STILL, who="D.")])
    status, out, err = told(capsys, "merge", "late")
    assert (status, out) == (2, "")
    assert f"trials/{MEASURED.digest}.json" in err
    assert "late/" in err
    assert len(database.read(folder)) == 4


def test_export_writes_the_same_bytes_and_refuses_what_it_cannot(folder, capsys):
    status, out, err = told(capsys, "export", "--out", "all.jsonl")
    assert (status, out, err) == (0, "wrote all.jsonl: 3 trials (2 measured, 1 simulated)\n", "")
    content = (folder.parent / "all.jsonl").read_bytes()
    assert content == as_json_lines(database.read(folder))
    for again in (["--force"], []):
        status, _, err = told(capsys, "export", "--out", "all.jsonl", *again)
        assert status == (0 if again else 2)
        assert (folder.parent / "all.jsonl").read_bytes() == content
    assert err == (
        "softvox: error: --out all.jsonl exists; choose another, or replace it with --force\n"
    )
    assert told(capsys, "export", "trials", "--out", "all.parquet")[0] == 0
    table = pq.read_table(io.BytesIO((folder.parent / "all.parquet").read_bytes()))
    assert sorted(table["digest"].to_pylist()) == sorted(trial.digest for trial in ALL)
    status, out, _ = told(capsys, "export", "--out", "some.jsonl", "--lattice", "3x3x3")
    assert (status, out) == (0, "wrote some.jsonl: 1 trial (0 measured, 1 simulated)\n")
    assert (folder.parent / "some.jsonl").read_bytes() == as_json_lines([SIMULATED])
    status, out, err = told(capsys, "export", "--out", "none.jsonl", "--kpa", 7)
    assert (status, out) == (2, "")
    assert err.startswith("softvox: error: none of the 3 trials matches the options")
    assert not (folder.parent / "none.jsonl").exists()
    assert told(capsys, "export", "--out", "all.csv") == (
        *(2, ""),
        "softvox: error: --out all.csv must end in .jsonl or .parquet\n",
    )


def test_export_says_what_is_missing(folder, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    status, _, err = told(capsys, "export", "--out", "all.parquet")
    assert (status, err) == (
        2,
        "softvox: error: --out FILE.parquet needs pyarrow: pip install pyarrow\n",
    )
    assert not (folder.parent / "all.parquet").exists()


@pytest.mark.parametrize("command", [["check"], ["list"], ["export", "--out", "x.jsonl"]])
def test_a_folder_that_is_none_is_named(command, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    status, out, err = told(capsys, *command)
    assert (status, out) == (2, "")
    assert err == (
        "softvox: error: there is no folder trials; name another, or make it with softvox "
        "trials add\n"
    )
    message = "softvox: error: file is a file; name its folder\n"
    assert told(capsys, *command, "file") == (2, "", message)
    assert not (tmp_path / "x.jsonl").exists()


def test_an_empty_folder_has_no_trials(tmp_path, capsys):
    none = "no trials; softvox trials add adds some\n"
    assert told(capsys, "list", tmp_path) == (0, none, "")
    assert told(capsys, "list", tmp_path, "--json") == (0, "[]\n", "")
    assert told(capsys, "check", tmp_path) == (0, "0 trials, 0 faults, 0 warnings\n", "")


def test_with_shipped_there_need_be_no_folder_of_ones_own(folder, tmp_path, capsys, monkeypatch):
    shipped = database.add(tmp_path / "shipped", [replace(MEASURED, who="E.")]).new
    monkeypatch.setattr(options, "shipped", lambda: tmp_path / "shipped")
    status, out, _ = told(capsys, "list", "--shipped", "--json")
    assert (status, len(json.loads(out))) == (0, 4)
    folder.rename(tmp_path / "elsewhere")
    status, out, _ = told(capsys, "list", "--shipped", "--json")
    assert [one["digest"] for one in json.loads(out)] == [trial.digest for trial in shipped]
