import re
from pathlib import Path

import malformed_tracks as files
import numpy as np
import pytest

from softvox_gym.design import Design
from softvox_gym.lattice import Lattice
from softvox_gym.real_tracks import CsvError
from softvox_gym.trials import TrialError, track_files
from softvox_gym.trials.track_files import Film, read_track_files

FACTS = {
    "surface": "acrylic",
    "who": "A. Person",
    "date": "2026-11-27",
    "license": "CC0-1.0",
    "frequency_hz": 0.5,
}
FILE = Path("film.csv")
CYCLES = "design,trial,cycle,x_cm,y_cm\n"


BEST = Design(6453)


def read(content, *, film=None, design=BEST, **options):
    """Return the trials in a file's content, and what is told beside them."""
    content = content.encode() if isinstance(content, str) else content
    settings = {**FACTS, "design": design, **options}
    return read_track_files({FILE: content}, film=Film(**(film or {})), **settings)


def one(content, **options):
    (found,) = read(content, **options)
    return found.trial


def test_this_packages_csv_holds_many_trials_in_the_order_in_which_they_begin():
    found = read(files.CSV.replace(b"6453,2,0,5.0,5.0", b"6453,2,0,5.0,5.0 "), design=None)
    whose = [(each.trial.design, each.trial.repetition, each.place) for each in found]
    assert whose == [
        (Design(6453), 1, "film.csv, line 2"),
        (Design(6453), 2, "film.csv, line 5"),
        (Design(573), 1, "film.csv, line 6"),
    ]
    second = found[1].trial
    assert second.cycle.tolist() == [0, 1]
    assert second.position.tolist() == [[0, 0], [0.2, 0.1]]
    assert second.provenance["kind"] == "csv"
    assert second.provenance["file"] == "film.csv"
    assert "cm_per_pixel" not in second.provenance


def test_pixels_and_seconds_become_cm_along_the_robots_axes_and_cycles():
    trial = one(files.SECONDS, film={"scale": "10/437", "x_axis_deg": 90})
    assert trial.cycle.tolist() == [0, 0.5, 1]
    assert trial.position.tolist() == [[0, 0], [1, 0], [2, 0]]  # up in the picture, where +x is
    assert trial.provenance["cm_per_pixel"] == 10 / 437
    assert trial.provenance["x_axis_deg"] == 90
    mirrored = one(files.SECONDS, film={"scale": "10/437", "y": "up"})
    assert mirrored.position.tolist() == [[0, 0], [0, -1], [0, -2]]


@pytest.mark.parametrize(
    ("content", "film"),
    [
        ("t_s,x_px,y_px\n0,100,300\n1,110,260\n", {"scale": "1/10", "y": "up"}),
        ("t,x,y\n0,10,10\n1,11,14\n", {"scale": "cm", "y": "down"}),
        ("t_s,x_cm,y_cm\n0,10,10\n1,11,14\n", {"y": "down"}),
    ],
)
def test_a_film_from_below_is_mirrored_and_its_degrees_count_clockwise(content, film):
    # The robot's +x is up in the picture, and its +y, a mirrored quarter turn on, to the right.
    trial = one(content, film={**film, "x_axis_deg": -90})
    assert trial.position[-1].tolist() == [4, 1]


@pytest.mark.parametrize(
    ("degrees", "end"), [(0, [1, 2]), (90, [2, -1]), (180, [-1, -2]), (-90, [-2, 1])]
)
def test_the_track_is_turned_to_where_the_robots_x_axis_points(degrees, end):
    trial = one("cycle,x_cm,y_cm\n0,5,5\n1,6,7\n", film={"x_axis_deg": degrees})
    assert trial.position[-1].tolist() == end


def test_trackers_export_is_read_with_decimal_commas_and_by_its_unit():
    trial = one(files.TRACKER, film={"scale": "cm"})
    assert trial.cycle.tolist() == [0, 0.0165, 1]
    np.testing.assert_allclose(trial.position[1], [0.001, -0.014], atol=1e-9)
    assert trial.provenance["point"] == "masse A"
    assert trial.provenance["kind"] == "tracker"
    in_mm = one(files.TRACKER.replace(b"\t", b";"), film={"scale": "mm"})
    np.testing.assert_allclose(in_mm.position, trial.position / 10, atol=1e-4)


def test_one_of_trackers_tracks_is_taken_where_it_has_marks():
    film = {"scale": "cm", "point": "mass A"}
    trial = one(files.SEVERAL, film=film)
    assert trial.cycle.tolist() == [0, 0.5]
    assert trial.position[-1].tolist() == [-0.45, 0.28]
    assert one(files.SEVERAL, film={**film, "point": "cm B"}).position[-1].tolist() == [1, 0]
    named = b"cm_A\nt\tx\ty\n0.000E0\t1.2E1\t-1.3E1\n1.0E0\t1.1E1\t-1.2E1\n"
    assert one(named, film={"scale": "cm"}).provenance["point"] == "cm_A"


def test_deeplabcuts_export_leaves_out_what_is_not_likely_and_tells_how_much():
    film = {"scale": "1/10", "fps": 30, "point": "top"}
    (found,) = read(files.DEEPLABCUT, film=film)
    assert found.left_out == 1
    assert found.trial.cycle.tolist() == [0, 0.03333, 0.5]
    assert found.trial.position[-1].tolist() == [1, 2]
    (found,) = read(files.DEEPLABCUT, film={**film, "likelihood": 0.3})
    assert found.left_out == 0
    (found,) = read(files.INDIVIDUALS, film={**film, "point": "two/top"})
    assert found.trial.position[-1].tolist() == [0.1, 0]


def test_what_is_before_the_start_of_the_pump_is_left_out():
    rows = "".join(f"{0.5 * i},{100 + max(i - 4, 0)},50\n" for i in range(9))
    trial = one("t_s,x_px,y_px\n" + rows, film={"scale": "1/10", "start_s": 1.95})
    assert trial.cycle.tolist() == [0, 0.25, 0.5, 0.75, 1]
    assert trial.position[:, 0].tolist() == [0, 0.1, 0.2, 0.3, 0.4]


def test_another_lattice_and_all_facts_are_kept():
    facts = {
        "robot": "B",
        "powder": "starch",
        "pressure_kpa": 6,
        "camera": "above",
        "notes": "a leak",
    }
    numbers = {"voxel_cm": 2, "cycles": 90, "repetition": 3}
    design = Design("0" * 26 + "2", shape=(3, 3, 3))
    trial = one("cycle,x_cm,y_cm\n0,0,0\n1,1,1\n", design=design, **facts, **numbers)
    assert trial.design == design
    for name, value in {**FACTS, **facts, **numbers}.items():
        assert getattr(trial, name) == value
    content = f"design,cycle,x_cm,y_cm\n{design.digits},0,0,0\n{design.digits},1,1,1\n"
    assert one(content, design=None, lattice=Lattice.of((3, 3, 3))).design == design


def test_repetitions_that_no_file_says_are_numbered_on():
    paths = {Path(f"{i}.csv"): f"cycle,x_cm,y_cm\n0,0,0\n1,{i},0\n".encode() for i in range(3)}
    made = read_track_files(paths, design=6453, repetition=4, **FACTS)
    assert [found.trial.repetition for found in made] == [4, 5, 6]


PIXELS = "t_s,x_px,y_px\n"


@pytest.mark.parametrize(
    ("content", "film", "fault"),
    [
        ("", {}, "line 1: the first line must name cycle or t_s, and x_cm,y_cm or"),
        ("cycle,t_s,x_cm,y_cm\n", {}, "line 1: the first line must name"),
        ("cycle,cycle,x_cm,y_cm\n", {}, "line 1: the first line must name"),
        ("cycle,x_cm,y_px\n", {}, "line 1: the first line must name"),
        ("cycle,x_cm,y_cm\n", {}, "has no points; add lines"),
        (
            "cycle,x_cm,y_cm\n0,0,0\n",
            {},
            "line 2: the track has 1 point since .* but needs two; add",
        ),
        (
            "trial,cycle,x_cm,y_cm\none,0,0,0\none,1,0,0\n",
            {},
            "line 2: repetition must be a whole number .*'one'",
        ),
        (
            "trial,cycle,x_cm,y_cm\n0,0,0,0\n0,1,0,0\n",
            {},
            "line 2: repetition must be .* from 1 to 10000, got 0",
        ),
        (
            "cycle,x_cm,y_cm\n0,0,0\n1,0,0\n1,0,0\n",
            {},
            "line 4: cycle must increase, but 1 follows 1; sort",
        ),
        ("cycle,x_cm,y_cm\n1,0,0\n2,0,0\n", {}, "line 2: the first point is at cycle 1, .* count"),
        ("cycle,x_cm,y_cm\n0,0,0\n1,0,0\n", {"start_s": 1}, "counts cycles .* leave out --start-s"),
        (
            "cycle,x_cm,y_cm\n0,0,0\n1,0,0\n",
            {"scale": "1/2"},
            "has x_cm and y_cm.* leave out --scale",
        ),
        (
            "cycle,x_cm,y_cm\n0,0,0\n1,0,0\n",
            {"picture": (9, 9)},
            "is not in pixels; leave out --picture",
        ),
        (
            "cycle,x_cm,y_cm\n0,0,0\n1,6.1,0\n",
            {},
            "line 3: the point is 6.1 cm from .* a robot of 3 cm goes",
        ),
        ("cycle,x_cm,y_cm\n0,0,0\n90,0,101\n", {}, "line 3: the point is 101 cm from the first"),
        (
            PIXELS + "0,0,0\n1,1,0\n",
            {},
            "is in pixels; give a reference length, such as --scale 10/",
        ),
        (PIXELS + "0,0,0\n1,1,0\n", {"scale": "cm"}, "is in pixels; give a reference length"),
        (
            PIXELS + "0,0,0\n1,1,11\n",
            {"scale": "1/9", "picture": (10, 10)},
            r"line 3: \(1, 11\) is outside the picture of 10 x 10 pixels; correct",
        ),
        (
            PIXELS + "0,0,0\n1,1,1\n2,2,1\n",
            {"scale": "1/9", "start_s": 0.5},
            "line 3: the first point is at cycle 0.25, .* or give --start-s",
        ),
        (
            PIXELS + "0,0,0\n1,1,1\n",
            {"scale": "1/9", "start_s": 3},
            "line 2: .* give another --start-s",
        ),
        (files.TRACKER, {}, "doesn't name its unit; give --scale cm, mm or m"),
        (
            files.TRACKER,
            {"scale": "cm", "point": "B"},
            "line 2: has x, y of masse A, not 'B'",
        ),
        (
            files.SEVERAL,
            {"scale": "cm"},
            "line 3: has x, y of mass A, cm B; choose one .* with --point",
        ),
        (
            files.SEVERAL.replace(b".", b","),
            {"scale": "cm", "point": "mass A"},
            "line 4: 12 values for 7 columns",
        ),
        (
            b"#multi:\n,A\ntime,x,y\n",
            {},
            "line 1: the first line must name .* or be that of an export from Tracker",
        ),
        (
            files.TRACKER + b"3,0\t0.2\t1,3\n",
            {"scale": "cm"},
            "line 6: .* numbers with both a point and a comma; export",
        ),
        (
            files.TRACKER.replace(b"y\t", b"y\tx"),
            {"scale": "cm"},
            "line 2: 'masse A' has x twice; export",
        ),
        (
            PIXELS + "0,0,0\n1,-1,0\n",
            {"scale": "1/9"},
            r"line 3: \(-1, 0\) is outside the picture, which begins at 0, 0; correct",
        ),
        (
            files.DEEPLABCUT.replace(b"0.98", b"98"),
            {"scale": "1/9", "fps": 9, "point": "top"},
            "line 6: likelihood must be from 0 to 1, got 98",
        ),
        ("cycle,x_cm,y_cm\n0,0,0\n1,0,\x1c.3\n", {}, r"line 3: y_cm must be .*'\\x1c\.3'"),
        ("cycle,x_cm,y_cm\n0,0,0\n1,0,\u0663\n", {}, "line 3: y_cm must be a finite number"),
        (PIXELS + "0,0,0\n1,1,0\n", {"fps": 30}, "has times, not frame numbers; leave out --fps"),
        (
            PIXELS + "0,0,0\n1,1,0\n",
            {"point": "nose"},
            "doesn't name its points; leave out --point",
        ),
        (files.DEEPLABCUT, {"scale": "1/9"}, "has frame numbers; give the film's .* --fps"),
        (
            files.DEEPLABCUT,
            {"scale": "1/9", "fps": 9},
            "line 3: .* of top, leg; choose one of them with",
        ),
        (
            files.DEEPLABCUT.replace(b"coords", b"cords"),
            {},
            "line 1: DeepLabCut's files begin with lines scorer",
        ),
        (
            files.DEEPLABCUT,
            {"scale": "1/9", "fps": 9, "point": "top", "likelihood": 1},
            "line 7: the track has 1 point since",
        ),
        (
            files.INDIVIDUALS,
            {"scale": "1/9", "fps": 9, "point": "one/top", "likelihood": 1},
            "one/top has no position, or a likelihood below 1, on all 2 lines; give",
        ),
        (b"\x89HDF\r\n\x1a\n", {}, "is HDF5, not CSV; .* save_as_csv=True"),
        (files.CSV.decode().encode("utf-16"), {}, "line 1: not text in UTF-8; save"),
    ],
)
def test_a_malformed_file_is_refused_with_its_name_the_line_and_the_mend(content, film, fault):
    with pytest.raises(CsvError, match=rf"^film\.csv.*{fault}"):
        read(content, film=film)


def test_a_file_that_is_given_twice_is_refused():
    with pytest.raises(CsvError, match=r"^film\.csv is given 2 times; give it once"):
        read_track_files([FILE, "./film.csv"], design=BEST, **FACTS)


def test_what_a_file_and_an_option_both_say_or_neither_is_refused():
    with pytest.raises(CsvError, match=r"has a column design; leave out --design, or the column"):
        read(files.CSV)
    with pytest.raises(
        CsvError, match=r"has a column trial; leave out --repetition, or the column"
    ):
        read(files.CSV, design=None, repetition=1)
    with pytest.raises(CsvError, match=r"names no design; give --design, or add a column design"):
        read("cycle,x_cm,y_cm\n0,0,0\n1,0,0\n", design=None)
    with pytest.raises(
        CsvError, match=r"has times in seconds; give the actuation's --frequency-hz"
    ):
        read(files.SECONDS, film={"scale": "1/9"}, frequency_hz=None)
    with pytest.raises(
        CsvError, match=r"film\.csv, line 2: cycles is 1, but the track lasts until cycle 2"
    ):
        read("cycle,x_cm,y_cm\n0,0,0\n2,0,0\n", cycles=1)


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        ({"license": "mine"}, "^license must be one of"),
        ({"repetition": 0}, "^repetition must be"),
        ({"design": 0}, "^design has no voxels"),
        ({"date": "today"}, "^date must be"),
    ],
)
def test_a_fact_that_no_trial_can_have_is_refused_without_blaming_a_file(options, fault):
    with pytest.raises(TrialError, match=fault):
        read("cycle,x_cm,y_cm\n0,0,0\n1,0,0\n", **options)


@pytest.mark.parametrize(
    ("film", "fault"),
    [
        ({"scale": "10"}, "scale must be cm, mm, m, or a reference length such as 10/437"),
        ({"scale": "0/5"}, "scale must be"),
        ({"scale": "inf/inf"}, "scale must be"),
        ({"y": "left"}, "y must be up or down, got left"),
        ({"fps": 0}, "fps must be above 0"),
        ({"fps": float("nan")}, "fps must be above 0"),
        ({"likelihood": 2}, "likelihood must be from 0 to 1"),
        ({"x_axis_deg": float("nan")}, "x_axis_deg must be"),
        ({"start_s": float("inf")}, "start_s must be"),
    ],
)
def test_a_film_that_can_not_be_is_refused(film, fault):
    with pytest.raises(ValueError, match=fault):
        Film(**film)


def test_simulated_tracks_are_of_voxels_of_a_centimetre():
    facts = {"source": "simulated", "reality": "reversal"}
    assert one("cycle,x_cm,y_cm\n0,0,0\n1,0,0\n", **facts).voxel_cm == 1


def _by_eye(line, delimiter):
    """Return the numbers in a line as one reads them, with decimal commas where those can be."""
    text = line if delimiter == "," else line.replace(",", ".")
    cells = (cell.strip(' "\t\r\ufeff') for cell in text.split(delimiter))
    number = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?", re.IGNORECASE)
    return {float(cell) for cell in cells if number.fullmatch(cell)}


def test_ten_thousand_malformed_files_are_read_as_they_are_or_refused_by_name(monkeypatch):
    tracks, told = [], []
    found = track_files._found

    def noted(path, track, *options):
        tracks.append(track)
        return found(path, track, *options)

    monkeypatch.setattr(track_files, "_found", noted)
    for content, film, options in files.malformed(10_000, seed=15):
        tracks.clear()
        try:
            read(content, film=film, **options)
        except CsvError as error:
            told.append(str(error))
            continue
        lines = content.decode().split("\n")
        for track in tracks:
            for line, time, x, y in track.points:
                point = {round(time * film.get("fps", 1), 9), x, y}
                assert any(point <= _by_eye(lines[line - 1], delimiter) for delimiter in "\t;,")
    assert 8000 < len(told) < 9500
    assert all(fault.startswith(str(FILE)) and len(fault) < 1000 for fault in told)
    assert sum(", line " in fault for fault in told) > 0.9 * len(told)
