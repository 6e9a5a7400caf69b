"""The whole way: tracks, a database, a reality, its physics, what to build next, and its sheet.

Nothing here was measured: the tracks are made from the pseudo-reality `reversal`, with noise, as if
nine robots had been filmed three times each.
"""

import csv
import json

import numpy as np
import pytest

from softvox_gym import landscape, reality
from softvox_gym.calibration import tracks_of
from softvox_gym.cli import main

NINE = [6453, 6013, 2117, 6489, 6481, 1385, 6330, 4690, 573]

#: What is known of the robots: how they are pumped.
PUMPED = ("--frequency-hz", "2", "--strain", "0.5")

#: What is looked for.
FOUND = ("friction_static", "friction_kinetic", "shear_ratio")

ABOUT = (
    *("--reality", "reversal", "--surface", "plane", "--who", "softvox-gym"),
    *("--license", "CC0-1.0", "--frequency-hz", "2", "--voxel-cm", "1"),
)


def films(path, rng):
    """Write three runs of each robot, every one a little farther, turned and blurred."""
    rows = []
    for track in tracks_of(reality("reversal"), NINE):
        cycle = track.cycle[::10]
        for run in (1, 2, 3):
            turn, far = np.radians(rng.normal(0, 5)), rng.normal(1, 0.05)
            x, y = track.position[::10].T * far
            ways = [x * np.cos(turn) - y * np.sin(turn), x * np.sin(turn) + y * np.cos(turn)]
            seen = np.stack(ways, axis=1) + rng.normal(0, 0.02, (len(cycle), 2))
            rows += [(track.design, run, c, *place) for c, place in zip(cycle, seen, strict=True)]
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([("design", "trial", "cycle", "x_cm", "y_cm"), *rows])


@pytest.fixture
def softvox(tmp_path, monkeypatch, capsys):
    """Return what runs a command in a folder of its own, and returns what it prints."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments, status=0):
        assert main(arguments) == status
        printed = capsys.readouterr().out
        return json.loads(printed) if "--json" in arguments else printed

    return run


def test_from_tracks_to_the_next_robots_and_their_sheets(tmp_path, softvox):
    films(tmp_path / "films.csv", np.random.default_rng(0))
    assert "27 trials added to trials" in softvox("trials", "add", "films.csv", *ABOUT)
    assert "27 were there" in softvox("trials", "add", "films.csv", *ABOUT)
    assert "27 trials (0 measured, 27 simulated), 0 faults" in softvox("trials", "check")

    # They went other ways than the published simulator says, and one run like another.
    (held,) = softvox("trials", "compare", "--json")["conditions"]
    assert (held["turned"], held["within_45"]) == (9, 0)
    assert held["rms_multiple"] > 10

    # Coulomb's friction moves hardly any robot as they went; area friction alone does, which is
    # what the world that they are from has.
    grid = ("--grid", "friction=0,0.5,1,shear=0,0.5", *PUMPED)
    found = softvox("calibrate", "--trials", "trials", *grid, "--json")["best"]
    truth = reality("reversal").physics
    assert (found["friction_static"], found["friction_kinetic"]) == (0, 0)
    assert (truth.friction_static, truth.friction_kinetic) == (0, 0)
    assert (found["headings"], found["shear_ratio"]) == (9, 0.5)

    # The published simulator, which they contradict, expects less of what it proposes than was
    # seen; the calibrated one finds the best robot of that world.
    doubted = softvox("trials", "next", "--method", "ite", "--json")
    assert doubted["measured"] == sorted(NINE)
    assert all("less than the best measured" in one["why"] for one in doubted["proposals"])
    physics = [f"--{name.replace('_', '-')}={found[name]}" for name in FOUND]
    (held,) = softvox("trials", "compare", *physics, *PUMPED, "--json")["conditions"]
    assert (held["turned"], held["within_45"]) == (0, 9)
    sheet = ("--budget=1", "--out=sheet.svg")
    made = softvox("trials", "next", "--method=ite", *physics, *PUMPED, *sheet, "--json")
    (first,) = made["proposals"]
    assert "more than the best measured" in first["why"]
    assert first["design"] == reality("reversal").landscape()["fitness"].argmax()
    assert first["simulated"] > 3 * landscape()["fitness"][first["design"]]
    assert made["sheets"] == "sheet.svg"
    assert f"Robot {first['design']}" in (tmp_path / "sheet.svg").read_text("utf-8")
