import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from pseudo_trials import trials_in
from view.figure_labels import check_labels

from softvox_gym.calibration import calibrate, tracks_of
from softvox_gym.cli.parser import Parser
from softvox_gym.cli.terminal import BadInputError
from softvox_gym.real_tracks import PER_CYCLE, RealTrack
from softvox_gym.realities import Reality
from softvox_gym.trials import database
from softvox_view.cli import calibrate as command
from softvox_view.figures import style
from softvox_view.figures.calibration import best_tracks, draw_calibration, draw_map

NINE = "6453,6013,2117,6489,6481,1385,6330,4690,573"
GRID = "friction=0,0.5,1,shear=0,0.5"


def softvox_calibrate(*arguments):
    parser = Parser(prog="softvox")
    command.add_parser(parser.add_subparsers())
    args = parser.parse_args(["calibrate", *map(str, arguments)])
    return args.run(args)


@pytest.fixture
def real(tmp_path):
    path = tmp_path / "real.csv"
    path.write_text(
        "design,trial,cycle,x_cm,y_cm\n6453,one,0,0,0\n6453,one,2,1,1\n"
        "6453,two,0,0,0\n6453,two,3,1,2\n573,one,0,0,0\n573,one,1.25,0.1,0\n"
    )
    return path


def test_json_tells_the_best_point_and_all_others_and_what_was_known(capsys):
    softvox_calibrate("--reality", "reversal", "--designs", NINE, "--grid", GRID, "--json")
    told = json.loads(capsys.readouterr().out)
    best = told["best"]
    assert best["headings"] == 9
    assert (best["friction_static"], best["friction_kinetic"], best["shear_ratio"]) == (0, 0, 0.5)
    assert told["points"][0] == best
    assert len(told["points"]) == 8
    assert told["with_heading"] == 9
    assert told["known"] == {"strain": 0.5, "frequency_hz": 2.0, "actuation": "hold"}
    assert [row["design"] for row in told["designs"]] == [int(one) for one in NINE.split(",")]
    assert told["designs"][0]["heading"] == pytest.approx(told["designs"][0]["heading_real"])
    # What the grid has not is the simulator's, not the truth's.
    assert told["physics"]["friction_static"] == 1
    assert told["physics"]["shear_strength"] == 0


def test_options_change_what_the_points_share_and_what_is_taken_for_known(capsys):
    known = ["--strain", "0.2386", "--frequency-hz", "4"]
    args = ["--reality", "reversal", "--designs", "6453", "--grid", "shear=0", "--json"]
    softvox_calibrate(*args, *known, "--friction-static", "0.7")
    told = json.loads(capsys.readouterr().out)
    assert told["known"] == {"strain": 0.2386, "frequency_hz": 4, "actuation": "hold"}
    assert told["physics"]["friction_static"] == 0.7


def test_tracks_from_a_file_are_told_with_their_trials(real, capsys):
    softvox_calibrate("--tracks", real, "--grid", GRID)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].split()[:5] == ["headings", "share", "static", "kinetic", "T*"]
    assert "8 points, the best of them shown; 2 designs, 1 of them with a heading" in lines[9]
    (row,) = (line.split() for line in lines if line.startswith("6453"))
    assert row[:4] == ["6453", "2", "0.24", "2"]  # at (1, 1) and (2/3, 4/3)
    (row,) = (line.split() for line in lines if line.startswith("573"))
    assert row[4] == "-"


def test_a_folder_gets_the_figures_and_their_tables(real, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (out / "calibration_tracks_2.png").write_text("a page of an earlier one, of more designs")
    softvox_calibrate("--tracks", real, "--grid", GRID, "--out", out, "--force")
    assert sorted(path.name for path in out.iterdir()) == [
        "calibration.csv",
        "calibration.pdf",
        "calibration.png",
        "calibration_designs.csv",
        "calibration_tracks.csv",
        "calibration_tracks.pdf",
        "calibration_tracks.png",
    ]
    with (out / "calibration.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 8
    assert [int(row["headings"]) for row in rows] == sorted(
        (int(row["headings"]) for row in rows), reverse=True
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "give what is real: one of"),
        (["--tracks", "real.csv", "--reality", "reversal"], "give what is real: one of"),
        (["--designs", "1"], "give what is real: one of"),
        (["--reality", "reversal"], "--reality NAME and --designs N,N,... belong together"),
        (["--tracks", "real.csv", "--designs", "1"], "belong together"),
        (["--reality", "revrsal", "--designs", "1"], "did you mean reversal?"),
        (["--reality", "reversal", "--designs", "6561"], "--designs: design '6561' is neither"),
        (["--reality", "reversal", "--designs", "1,,2"], "--designs: design '' is neither"),
        (["--reality", "reversal", "--designs", "1"], "none has a heading to match"),
        (["--reality", "reversal", "--designs", "6453", "--grid", "her"], "did you mean shear?"),
        (["--reality", "reversal", "--designs", "6453", "--grid", "strain=a"], "--grid strain=a"),
        (["--reality", "reversal", "--designs", "6453", "--duration", "4"], "leave it out"),
        (["--tracks", "none.csv"], "none.csv can't be read"),
    ],
)
def test_bad_input_is_named_with_its_mend(arguments, message):
    with pytest.raises(BadInputError) as error:
        softvox_calibrate(*arguments)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_tracks_that_fit_no_design_are_named_with_their_line(tmp_path):
    path = tmp_path / "real.csv"
    path.write_text("design,trial,cycle,x_cm,y_cm\n6561,one,0,0,0\n")
    with pytest.raises(BadInputError, match="line 2: design '6561' is neither"):
        softvox_calibrate("--tracks", path)


def test_a_folder_with_something_in_it_is_left_alone(real, tmp_path):
    with pytest.raises(BadInputError, match=r"--out .* is not empty"):
        softvox_calibrate("--tracks", real, "--out", tmp_path)


@pytest.fixture(scope="module")
def calibration():
    """Two designs, over two parameters and panels of a third, in a reality that is short."""
    tracks = tracks_of(Reality("mine", {"duration": 0.75, "friction_kinetic": 0.2}), [6453, 573])
    return calibrate(tracks, "friction=0.2,0.5,1,shear=0,0.5,strain=0.2,0.3"), tracks


def test_the_map_has_a_panel_per_third_parameter_and_rings_the_best(calibration):
    found, _ = calibration
    with style.style():
        figure = draw_map(found)
        panels = [axis for axis in figure.axes if axis.images]
        check_labels(figure)
    assert [axis.get_title() for axis in panels] == ["T* = 0", "T* = 0.5"]
    best = found.point(found.best)
    for panel, shear in zip(panels, (0, 0.5), strict=True):
        cells = np.asarray(panel.images[0].get_array().filled(-1))
        for x, static in enumerate((0.2, 0.5, 1)):
            for y, kinetic in enumerate((0.2, 0.5, 1)):
                at = {
                    "friction_static": static,
                    "friction_kinetic": kinetic,
                    "shear_ratio": shear,
                    "strain": best["strain"],
                }
                here = np.all([found.parameters[name] == at[name] for name in at], axis=0)
                wanted = found.headings[here][0] if here.any() else -1
                assert cells[y, x] == wanted
        assert len(panel.lines) == (shear == best["shear_ratio"])


@pytest.mark.parametrize("grid", ["shear=0.5", "shear=0,0.5", "strain=0.1:0.5:3,frequency_hz=2,4"])
def test_a_map_of_fewer_parameters_has_one_panel(calibration, grid):
    _, tracks = calibration
    with style.style():
        figure = draw_map(calibrate(tracks, grid))
        check_labels(figure)
    assert len(figure.axes) == 2  # with the scale


def test_no_label_of_the_usual_grid_lies_on_another():
    usual = calibrate([RealTrack(1, "1", np.array([0, 0.1]), np.array([[0.0, 0], [1, 0]]))])
    with style.style():
        check_labels(draw_map(usual))


def test_the_best_tracks_are_as_long_as_the_real_ones_and_the_physics_of_the_best(calibration):
    found, tracks = calibration
    longer = RealTrack(573, "longer", np.array([0, 2.75]), np.array([[0.0, 0], [1, 0]]))
    made = best_tracks(found, [*tracks, longer])
    assert list(made) == [6453, 573]
    assert [len(track) for track in made.values()] == [2 * PER_CYCLE + 1, int(2.76 * PER_CYCLE) + 1]
    assert made[6453][-1] == pytest.approx(found.end[found.best, 0], abs=1e-9)
    drawing = draw_calibration(found, tracks)
    with style.style():
        for figure in drawing.figures.values():
            check_labels(figure)
    row = drawing.tables["calibration_tracks.csv"].decode().splitlines()[1].split(",")
    assert float(row[8]) == pytest.approx(found.end_error[found.best, 0], abs=1e-5)


def test_a_figure_of_too_many_designs_is_refused(calibration):
    _, tracks = calibration
    many = [RealTrack(i, "1", tracks[0].cycle, tracks[0].position) for i in range(1, 101)]
    with pytest.raises(ValueError, match="of 100 designs, and at most 99"):
        draw_calibration(calibrate(many, "strain=0.1"), many)


def test_trials_are_looked_at_after_the_shortest_runs_cycles_at_the_simulators_size(
    tmp_path, capsys
):
    long, short = trials_in("reversal", [6453, 573], frequency_hz=2.0, notes="simulated")
    half = len(short.cycle) // 2
    short = replace(short, cycle=short.cycle[:half], position=short.position[:half], cycles=None)
    database.add(tmp_path, [long, short])
    truth = ["--strain", "0.5", "--friction-static", "0", "--friction-kinetic", "0"]
    softvox_calibrate("--trials", tmp_path, "--grid", "shear=0,0.5", *truth, "--json")
    told = json.loads(capsys.readouterr().out)
    assert told["known"] == {"frequency_hz": 2.0}
    assert {row["cycles"] for row in told["designs"]} == {short.cycle[-1]}
    assert told["about"].startswith("2 runs of 2 designs, after 7.48 cycles on acrylic, simulated")
    assert told["best"]["shear_ratio"] == 0.5
    assert told["best"]["end_error_rms"] < 1e-3
    softvox_calibrate("--trials", tmp_path, "--grid", "shear=0", "--frequency-hz", "4", "--json")
    assert json.loads(capsys.readouterr().out)["known"] == {"frequency_hz": 4}
    softvox_calibrate("--trials", tmp_path, "--grid", "shear=0", "--cycles", "5")
    end = "real: 2 runs of 2 designs, after 5 cycles on acrylic, simulated in reversal\n"
    assert capsys.readouterr().out.endswith(f"\n{end}taken as known: frequency_hz 2\n")


def test_trials_that_can_not_be_calibrated_with_are_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("one", "two"):
        database.add(tmp_path / name, trials_in("reversal", [6453], surface=name))
    for words, *options in (
        ("--trials: there is no folder none", "--trials", "none"),
        ("--trials: the trials differ in surface", "--trials", "one", "--trials", "two"),
        ("--trials: 1 of 1 runs end before 16 c", "--trials", "one", "--cycles", "16"),
        ("--cycles needs --trials", "--tracks", "one.csv", "--cycles", "9"),
        ("give what is real: one of", "--trials", "one", "--reality", "soft", "--designs", "17"),
        ("--reality NAME and --designs .* belong together", "--trials", "one", "--designs", "17"),
    ):
        with pytest.raises(BadInputError, match=words):
            softvox_calibrate(*options)
