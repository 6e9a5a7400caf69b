import csv
import errno
import json
import os
import pty
import subprocess
from importlib.metadata import entry_points

import numpy as np
import pytest
from cli_process import COMMAND, snapshot, softvox

import softvox_gym
from softvox_gym import Physics, cli, landscape, simulate
from softvox_gym.manifest import digest

#: Commands of other packages than softvox_gym.
OTHERS = [entry.name for entry in entry_points(group=cli.GROUP)]

#: Short, so that all designs take a second: one cycle.
SHORT = ("--duration", "0.5")


@pytest.fixture(scope="module")
def short_landscape(tmp_path_factory):
    folder = tmp_path_factory.mktemp("landscape")
    done = softvox("landscape", "--out", "out", "--physics", "exact", *SHORT, cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder / "out", done


def test_the_version_is_printed():
    done = softvox("--version")
    assert (done.returncode, done.stdout) == (0, f"softvox {softvox_gym.__version__}\n")


def test_the_console_script_is_installed_and_says_the_same():
    script = os.path.join(os.path.dirname(COMMAND[0]), "softvox")
    if not os.path.exists(script):
        pytest.skip("no console script beside this interpreter")
    done = subprocess.run([script, "--version"], capture_output=True, text=True, check=True)
    assert done.stdout == softvox("--version").stdout


def test_without_a_command_the_help_is_printed_and_the_status_is_2():
    done = softvox()
    assert done.returncode == 2
    assert done.stdout == softvox("--help").stdout
    assert done.stderr == ""


@pytest.mark.parametrize("command", ["landscape", "simulate"])
def test_every_parameter_of_the_physics_is_an_option_in_the_help(command):
    text = softvox(command, "--help").stdout
    for name in Physics.exact().to_dict():
        assert f"  --{name.replace('_', '-')}" in text


@pytest.mark.parametrize(
    ("first", "loaded"),
    [
        ((), sorted(OTHERS)),
        (("--help",), sorted(OTHERS)),
        (("biuld",), sorted(OTHERS)),
        (("build",), ["build"]),
        (("simulate",), []),
        (("--version",), []),
    ],
)
def test_of_other_packages_commands_only_the_one_that_is_asked_for_is_loaded(first, loaded):
    (commands,) = (action for action in cli._parser(*first)._actions if action.choices)
    own = [command.__name__.rpartition(".")[2] for command in cli.COMMANDS]
    assert list(commands.choices) == [*own, *loaded]


def parsers(parser):
    """Yield a parser, and those of its commands and their subcommands."""
    yield parser
    for action in parser._actions:
        if isinstance(action.choices, dict):
            for command in action.choices.values():
                yield from parsers(command)


def test_the_help_of_every_command_fits_80_columns(monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    shown = {parser.prog: parser.format_help() for parser in parsers(cli._parser())}
    assert {"softvox", "softvox verify", "softvox compare", "softvox trials add"} <= set(shown)
    for text in shown.values():
        assert [line for line in text.splitlines() if len(line) > 80] == []


def test_the_landscape_table_reads_back_to_the_bits_that_were_simulated(short_landscape):
    folder, _ = short_landscape
    with (folder / "landscape.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    result = simulate(np.arange(6561), Physics.of({"duration": 0.5}))
    assert list(rows[0]) == list(landscape().dtype.names)
    assert [int(row["design"]) for row in rows] == list(range(6561))
    assert [row["digits"] for row in rows] == [result.design(i).digits for i in range(6561)]
    read = np.array([[float(row[name]) for name in ("dx", "dy", "dz")] for row in rows])
    assert read.tobytes() == result.displacement.tobytes()
    assert [float(row["fitness"]) for row in rows] == result.fitness.tolist()
    assert {row["diverged"] for row in rows} == {"False"}
    assert [int(row["steps"]) for row in rows] == result.steps.tolist()
    assert [float(rows[0][name]) for name in ("dx", "dy", "dz", "fitness")] == [0, 0, 0, 0]


def test_the_manifest_says_what_was_run_where_and_how_long(short_landscape):
    folder, _ = short_landscape
    manifest = json.loads((folder / "manifest.json").read_text())
    assert manifest["version"] == softvox_gym.__version__
    assert manifest["physics"] == Physics.of({"duration": 0.5}).to_dict()
    assert manifest["arguments"] == ["landscape", "--out", "out", "--physics", "exact", *SHORT]
    assert manifest["n_designs"] == 6561
    assert manifest["n_diverged"] == 0
    assert manifest["seconds"] > 0
    assert manifest["cpu_seconds"] > 0
    result = simulate(np.arange(6561), Physics.of({"duration": 0.5}))
    assert manifest["digest"] == digest(result.displacement)
    assert manifest["best"]["fitness"] == result.fitness.max()
    assert manifest["best"]["design"] == int(result.fitness.argmax())
    for name in ("commit", "cpu", "instruction_set", "threads", "platform", "python", "started"):
        assert name in manifest


def test_the_landscape_sums_up_the_ten_best_beside_the_papers_time(short_landscape):
    _, done = short_landscape
    lines = done.stdout.splitlines()
    assert lines[0].split() == ["rank", "design", "digits", "fitness", "dx", "dy"]
    assert [line.split()[0] for line in lines[1:11]] == [str(rank) for rank in range(1, 11)]
    assert "58 CPU-hours" in done.stdout
    assert done.stderr == ""  # no progress bar where there is no terminal


def test_an_earlier_landscape_survives_byte_for_byte_unless_forced(short_landscape):
    folder, _ = short_landscape
    (folder / "notes.txt").write_text("mine")
    before = snapshot(folder.parent)
    done = softvox("landscape", "--out", "out", "--duration", "40", cwd=folder.parent)
    assert done.returncode == 2
    assert done.stderr.startswith("softvox: error: --out out is not empty")
    assert "--force" in done.stderr
    assert snapshot(folder.parent) == before

    forced = softvox("landscape", "--out", "out", "--force", "--duration", "0.3", cwd=folder.parent)
    after = snapshot(folder.parent)
    assert forced.returncode == 0
    assert after.keys() == before.keys()
    assert after["out/landscape.csv"] != before["out/landscape.csv"]
    assert after["out/notes.txt"] == b"mine"


def test_a_diverged_design_is_nan_in_the_table_and_null_in_json(tmp_path):
    wild = ("--strain", "150", "--duration", "0.3")
    assert softvox("landscape", *wild, "--out", "out", cwd=tmp_path).returncode == 0
    with (tmp_path / "out" / "landscape.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    diverged = [row for row in rows if row["diverged"] == "True"]
    manifest = json.loads((tmp_path / "out" / "manifest.json").read_text())
    assert 0 < len(diverged) == manifest["n_diverged"]
    assert {row["fitness"] for row in diverged} == {"nan"}
    design = diverged[0]["design"]
    done = softvox("simulate", design, *wild, "--json")
    data = json.loads(done.stdout)
    assert (data["diverged"], data["fitness"]) == (True, None)


def test_a_design_is_the_same_by_number_and_by_digits():
    by_number, by_digits = softvox("simulate", "6453"), softvox("simulate", "00021222")
    assert by_number.returncode == 0
    assert by_number.stdout == by_digits.stdout
    assert f"fitness       {simulate(6453).fitness[0]:.6f} voxel widths" in by_number.stdout
    assert len(by_number.stdout.splitlines()) == 9 + 16  # cycles 0 to 15


def test_0_is_the_empty_design_and_scores_0():
    data = json.loads(softvox("simulate", "0", "--json").stdout)
    assert (data["design"], data["n_voxels"], data["fitness"]) == (0, 0, 0.0)


def test_simulate_tells_what_half_the_step_changes():
    error = simulate(6453, check_step=True).step_error[0]
    assert f"step error    {error:.6f} voxel widths" in (
        softvox("simulate", "6453", "--check-step").stdout
    )
    data = json.loads(softvox("simulate", "6453", "--check-step", "--json").stdout)
    assert data["step_error"] == error
    assert json.loads(softvox("simulate", "6453", "--json").stdout)["step_error"] is None


def test_simulate_as_json_gives_what_simulate_gives_in_python():
    data = json.loads(softvox("simulate", "5757", "--json", "--physics", "exact").stdout)
    result = simulate(5757, Physics.exact(), track=1)
    assert data["displacement"] == result.displacement[0].tolist()
    assert data["fitness"] == result.fitness[0]
    assert [[row[k] for k in "xyz"] for row in data["track"]] == result.track[0].tolist()
    assert data["physics"] == Physics.exact().to_dict()


def test_options_take_negative_numbers_in_every_spelling():
    options = ("--gravity", "-1e-1", "-.5", "-9.8", "--strain", "-1e-1", "--actuation", "clamp")
    data = json.loads(softvox("simulate", "6453", *options, "--json", *SHORT).stdout)
    assert data["physics"]["gravity"] == [-0.1, -0.5, -9.8]
    assert data["physics"]["strain"] == -0.1
    assert data["physics"]["actuation"] == "clamp"


def test_a_parameter_that_is_a_yes_or_no_is_switched_on_and_off():
    for option, value in (("--single-precision-rest", True), ("--no-single-precision-rest", False)):
        done = softvox("simulate", "1", option, "--json", *SHORT)
        assert json.loads(done.stdout)["physics"]["single_precision_rest"] is value


def test_another_lattice_is_given_by_its_shape():
    digits = "202120001021111111112210"
    done = softvox("simulate", digits, "--shape", "2x3x4", "--json", *SHORT)
    data = json.loads(done.stdout)
    assert (data["digits"], data["shape"], data["n_voxels"]) == (digits, [2, 3, 4], 18)


def test_a_lattice_of_more_designs_than_int64_counts_goes_by_digits():
    digits = "2" * 64
    done = softvox("simulate", digits, "--shape=4x4x4", "--json", "--duration", "0.26")
    data = json.loads(done.stdout)
    assert (data["design"], data["digits"], data["n_voxels"]) == (None, digits, 64)
    assert data["diverged"] is False


def test_frames_are_saved_with_what_made_them(tmp_path):
    options = ("--frames", "f.npz", "--every", "100")
    assert softvox("simulate", "6453", *options, *SHORT, cwd=tmp_path).returncode == 0
    physics = Physics.of({"preset": "published", "duration": 0.5})
    frames = simulate(6453, physics, frames=100).frames
    assert [path.name for path in tmp_path.iterdir()] == ["f.npz"]
    with np.load(tmp_path / "f.npz") as saved:
        assert np.array_equal(saved["step"], frames.step)
        assert np.array_equal(saved["time"], frames.time[0])
        for name in ("position", "quaternion", "edge"):
            assert np.array_equal(saved[name], getattr(frames, name)[0], equal_nan=True)
        assert saved["digits"].shape == (2, 2, 2)
        assert json.loads(str(saved["physics"])) == physics.to_dict()


def test_saved_frames_are_not_overwritten_unless_forced(tmp_path):
    (tmp_path / "f.npz").write_bytes(b"precious")
    done = softvox("simulate", "1", "--frames", "f.npz", *SHORT, cwd=tmp_path)
    assert done.returncode == 2
    assert "--force" in done.stderr
    assert snapshot(tmp_path) == {"f.npz": b"precious"}
    forced = softvox("simulate", "1", "--frames", "f.npz", "--force", *SHORT, cwd=tmp_path)
    assert forced.returncode == 0
    assert snapshot(tmp_path)["f.npz"] != b"precious"


def test_kinetic_friction_above_static_is_one_line_of_warning_and_goes_on():
    done = softvox("simulate", "7", "--friction-kinetic", "2", *SHORT)
    assert done.returncode == 0
    assert done.stderr.startswith("softvox: warning: friction_kinetic (2.0) is above friction_stat")
    assert len(done.stderr.splitlines()) == 1


COMMANDS = ["landscape", "robustness", "simulate", "verify"]
COMMANDS += OTHERS


@pytest.mark.parametrize(
    "arguments",
    [
        *([command, "--help"] for command in COMMANDS),
        ["replay", "6453", "--out", "ä.html"],
        ["simulate", "6453", "--frames", "ä.npz"],
        ["search", "--searcher", "random", "--budget", "5", "--out", "ä.csv"],
        ["landscape", "--duration", "0.3", "--out", "ä"],
    ],
    ids=" ".join,
)
def test_a_terminal_without_unicode_gets_escapes(arguments, tmp_path):
    done = softvox(*arguments, cwd=tmp_path, PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout
    assert done.stdout.isascii()


def test_a_reader_that_has_seen_enough_is_no_error():
    command = f"'{COMMAND[0]}' -m softvox_gym simulate 6453 | true"
    done = subprocess.run(command, shell=True, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_output_that_cannot_be_written_is_one_line():
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [*COMMAND, "simulate", "1"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert done.returncode == 2
    assert done.stderr == "softvox: error: cannot write the output: No space left on device\n"


def test_input_that_cannot_be_read_is_named(monkeypatch, capsys):
    def run(_):
        raise PermissionError(errno.EACCES, "Permission denied", "theirs/manifest.json")

    monkeypatch.setattr(cli.verify, "run", run)
    monkeypatch.setattr("softvox_gym.cli._drop_output", lambda: None)
    assert cli.main(["verify"]) == 2
    error = "softvox: error: theirs/manifest.json: Permission denied\n"
    assert capsys.readouterr() == ("", error)


@pytest.mark.parametrize("quiet", [False, True])
def test_the_progress_bar_is_drawn_on_a_terminal_and_removed_at_the_end(tmp_path, quiet):
    master, slave = pty.openpty()
    process = subprocess.Popen(
        [*COMMAND, "landscape", "--duration", "1", *(["--quiet"] if quiet else [])],
        cwd=tmp_path,
        stdout=subprocess.DEVNULL,
        stderr=slave,
    )
    os.close(slave)
    drawn = b""
    try:
        while chunk := os.read(master, 65536):
            drawn += chunk
    except OSError:  # how a terminal ends
        pass
    os.close(master)
    assert process.wait() == 0
    assert (b"designs/s" in drawn) is not quiet
    assert quiet or drawn.split(b"\r")[-2].strip() == b""
