import json
import re
import shlex
from pathlib import Path

import pytest
from cli_process import snapshot, softvox
from malformed_tracks import malformed

from softvox_gym.cli import main
from softvox_gym.trials.database import read

PAGE = Path(__file__).parents[2] / "docs" / "trials.md"

RUN = (
    *("--surface", "acrylic", "--powder", "cornstarch", "--pressure-kpa", "6"),
    *("--who", "A. Person", "--date", "2026-11-27", "--license", "CC0-1.0"),
)
CSV = """\
design,trial,cycle,x_cm,y_cm
6453,1,0,0,0
6453,1,1,0.75,0
6453,1,2,1.5,0
6453,2,0,0,0
6453,2,2,1.5,1.5
573,1,0,0,0
573,1,2,0.01,0
"""
DEEPLABCUT = """\
scorer,net,net,net
bodyparts,top,top,top
coords,x,y,likelihood
0,100,300,0.99
30,90,300,0.2
60,100,256.3,1
"""
#: Of the DeepLabCut file.
FILM = (
    *("--design", "6453", "--fps", "30", "--frequency-hz", "0.5", "--scale", "10/437"),
    *("--picture", "640x480", "--x-axis-deg", "90", "--repetition", "3", "--camera", "above"),
)


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "real.csv").write_text(CSV)
    (tmp_path / "dlc.csv").write_text(DEEPLABCUT)
    (tmp_path / "text.csv").write_text("no track, but a sentence\n")
    return tmp_path


def test_tracks_are_added_and_the_same_again_completes_what_was_interrupted(folder):
    done = softvox("trials", "add", "real.csv", *RUN, cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    lines = [line.split() for line in done.stdout.splitlines()]
    shown = [(line[1], *line[5:9]) for line in lines[1:4]]  # cycles, Hz, distance, heading
    assert shown == [
        ("6453", "2", "-", "1.00", "0"),
        ("6453", "2", "-", "1.41", "45"),
        ("573", "2", "-", "0.01", "-"),
    ]
    assert done.stdout.endswith("\n3 trials added to trials, 0 were there already\n")
    made = snapshot(folder / "trials")
    assert sorted(name[:8] for name in made) == sorted(line[0] for line in lines[1:4])
    (folder / "trials" / min(made)).unlink()
    again = softvox("trials", "add", "real.csv", *RUN, cwd=folder)
    assert again.stdout.endswith("\n1 trial added to trials, 2 were there already\n")
    assert snapshot(folder / "trials") == made


def test_all_that_is_said_of_a_film_is_kept(folder):
    done = softvox("trials", "add", "dlc.csv", *RUN, *FILM, "--into", "lab", cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    (trial,) = read(folder / "lab")
    assert trial.position.tolist() == [[0, 0], [1, 0]]
    assert (trial.repetition, trial.camera, trial.pressure_kpa) == (3, "above", 6)
    facts = json.loads(trial.to_bytes())["provenance"]
    assert facts["kind"] == "deeplabcut"
    assert (facts["point"], facts["x_axis_deg"]) == ("top", 90)
    assert "\ndlc.csv, line 4: lines left out, without a likely position: 1\n" in done.stdout


def test_a_simulated_track_says_so(folder):
    simulated = ("--surface", "floor", "--who", "me", "--license", "MIT", "--reality", "reversal")
    assert softvox("trials", "add", "real.csv", *simulated, cwd=folder).returncode == 0
    trials = read(folder / "trials")
    assert {(trial.source, trial.reality, trial.date) for trial in trials} == {
        ("simulated", "reversal", "")
    }


BAD = {
    "real.csv text.csv": "text.csv, line 1: the first line must name",
    "real.csv no.csv": "no.csv can't be read (No such file or directory)",
    "real.csv .": "can't be read (Is a directory)",
    "real.csv --design 6453": "real.csv has a column design; leave out --design, or the column",
    "real.csv --fps 30": "real.csv has times, not frame numbers; leave out --fps",
    "real.csv --shape 3x3": "argument --shape: expected 3 arguments",
    "dlc.csv": "dlc.csv has frame numbers; give the film's frames per second with --fps",
    "dlc.csv --fps 30": "dlc.csv names no design; give --design",
    "dlc.csv --design 6453 --fps 30": "dlc.csv has times in seconds; give the",
    "dlc.csv --design 6561": "0 to 6560",
    "dlc.csv --design 6453 --fps 0": "fps must be above 0",
    "dlc.csv --design 1 --fps 1 --frequency-hz 1": "dlc.csv is in pixels; give a reference length",
    "dlc.csv --scale 437": "scale must be cm, mm, m, or a reference length",
    "dlc.csv --picture 640": "must be WIDTHxHEIGHT",
    "real.csv --repetition 0": "--repetition",
    "real.csv --pressure-kpa high": "--pressure-kpa",
    "real.csv --pressure-kpa -6": "pressure_kpa must be",
    "real.csv --cycles 1": "real.csv, line 2: cycles is 1, but the track lasts until cycle 2",
    "real.csv --date 27.11.2026": "date must be written as 2026-11-27",
    "real.csv --license mine": "--license",
    "real.csv --into text.csv": "text.csv is not a folder; choose another",
    "real.csv --into no/such": "no is not a folder; make it first",
    "real.csv --liklihood 1": "did you mean --likelihood?",
    "": "FILE",
}


@pytest.mark.parametrize("words", BAD, ids=lambda words: words[:40])
def test_bad_input_is_one_line_naming_the_mend_and_nothing_is_written(words, folder):
    before = snapshot(folder)
    done = softvox("trials", "add", *words.split(), *_missing(words), cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith("softvox: error: ")
    assert BAD[words] in done.stderr
    assert snapshot(folder) == before


def _missing(words):
    """Return the options of a run that the words lack."""
    pairs = zip(RUN[::2], RUN[1::2], strict=True)
    return [part for pair in pairs if pair[0] not in words for part in pair]


def test_a_track_that_the_folder_has_under_another_name_is_refused(folder):
    assert softvox("trials", "add", "real.csv", *RUN, cwd=folder).returncode == 0
    before = snapshot(folder / "trials")
    more = "6453,3,0,0,0\n6453,3,1,0.7,0\n6453,3,2,1.4,0\n"
    (folder / "real.csv").write_text(CSV + more)  # the same runs, of a file that has grown
    done = softvox("trials", "add", "real.csv", *RUN, cwd=folder)
    assert done.stdout.endswith("\n1 trial added to trials, 3 were there already\n")
    before = snapshot(folder / "trials")
    (folder / "copy.csv").write_text(CSV.replace("6453,1,", "573,7,"))
    done = softvox("trials", "add", "copy.csv", *RUN, cwd=folder)
    assert "error: copy.csv, line 2 and trials/" in done.stderr
    assert ".json have the same track, which no two runs do; leave out" in done.stderr
    (folder / "other.csv").write_text(CSV.replace("0.75", "0.7"))
    done = softvox("trials", "add", "other.csv", *RUN, cwd=folder)
    assert "error: other.csv, line 2 and trials/" in done.stderr
    assert ".json describe the same run differently (6453, acrylic, 2026" in done.stderr
    assert snapshot(folder / "trials") == before


def test_malformed_files_are_refused_in_a_line(folder, capsys):
    film = FILM[:8]
    for i, (content, _, _) in enumerate(malformed(24, seed=3)):
        path = folder / f"{i}.csv"
        path.write_bytes(content)
        into = ("--into", str(folder / "trials"))
        own = film if b"scorer" in content else film[:2]
        assert main(["trials", "add", str(path), *RUN, *own, *into]) in (0, 2)
        told = capsys.readouterr().err
        assert told == "" or (told.startswith("softvox: error: ") and told.count("\n") == 1)


def test_the_page_does_what_it_shows(tmp_path, monkeypatch):
    page = PAGE.read_text(encoding="utf-8")
    for block in re.findall(r"^```sh\n(.*?)^```", page, re.M | re.S):
        name, content, commands = re.fullmatch(
            r"cat > (\S+) <<'END'\n(.*?)END\n(.*)", block, re.S
        ).groups()
        (tmp_path / name).write_text(content)
        for command in commands.replace("\\\n", "").splitlines():
            _, *words = shlex.split(command)
            done = softvox(*words, cwd=tmp_path)
            assert (done.returncode, done.stderr) == (0, "")
    assert "4 trials" in done.stdout
    ends = {
        (trial.design.index, trial.repetition): trial.position[-1].round(2).tolist()
        for trial in read(tmp_path / "trials")
    }
    same = {(6453, repetition): [0.44, 0.44] for repetition in (1, 2, 3)}
    assert ends == {**same, (573, 1): [0.66, 0]}
    monkeypatch.chdir(tmp_path)
    (code,) = re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)
    made = {}
    exec(code, made)
    assert made["found"].trial.displacement.round(2).tolist() == [0.44, 0.44]
