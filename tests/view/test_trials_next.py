"""softvox trials next, as people meet it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from softvox_gym import Design, landscape, reality
from softvox_gym.cli import main
from softvox_gym.landscapes.table import displacements
from softvox_gym.trials import Trial
from softvox_gym.trials.database import add, read


def runs(designs, where="reversal", **facts):
    """Return a run of each design as it moves in a pseudo-reality."""
    ends = displacements(landscape(reality(where)))[designs, :2]
    about = {"source": "simulated", "reality": where, "surface": "plane", "voxel_cm": 1.0, **facts}
    about |= {"who": "softvox-gym", "license": "CC0-1.0", "cycle": [0, 15]}
    return [
        Trial(design=design, position=[[0, 0], end], **about)
        for design, end in zip(designs, ends.tolist(), strict=True)
    ]


@pytest.fixture
def told(tmp_path, monkeypatch, capsys):
    """Return what runs the command in a folder that holds trials, and returns what it says."""
    monkeypatch.chdir(tmp_path)
    add(Path("trials"), runs([6453, 2117, 573]))
    add(Path("other"), runs([6453, 2117], "sticky"))
    Path("empty").mkdir()

    def run(*arguments, status=0):
        assert main(["trials", "next", "--method=ite", *arguments]) == status
        captured = capsys.readouterr()
        return captured.err if status else captured.out

    return run


def test_people_see_what_was_measured_what_is_expected_and_why(told):
    text = told("--budget=2")
    first, second = text.splitlines()[:2]
    assert first == (
        "ite, displacement; 3 runs of 3 designs, after 15 cycles on plane, simulated in reversal"
    )
    assert second == "compared after 15 simulated cycles"
    assert "less than the best measured" in text
    designs = [line.split()[0] for line in text.splitlines()[4:6]]
    assert f"softvox build {' '.join(designs)} --out FILE draws the sheets" in text
    assert told("--budget=2") == text


def test_json_has_all_of_it(told):
    made = json.loads(told("--json", "--task=directed", "--heading=90", "--option=prior=simulated"))
    assert (made["task"], made["heading"], made["options"]) == (
        "directed",
        90,
        {"prior": "simulated"},
    )
    assert (made["cycles_real"], made["cycles_simulated"]) == (15, 15)
    assert made["measured"] == [573, 2117, 6453]
    assert len(made["proposals"]) == 5
    for one in made["proposals"]:
        assert one["simulated"] == pytest.approx(landscape()["dy"][one["design"]])
        assert one["displacement"] is None


def test_trials_of_one_world_are_chosen_among_others(told):
    text = told("trials", "other", "--simulated-in=sticky", "--design=2117")
    assert "; 1 run of 1 design, after 15 cycles on plane, simulated in sticky\n" in text
    (small,) = read(Path("other"))[:1]
    add(Path("larger"), [replace(small, design=Design("1" * 27, shape=(3, 3, 3)))])
    refused = told("other", "larger", status=2)
    assert "has designs of the lattice 2x2x2, but 1 of 3 runs have others" in refused
    assert "; 2 runs of 2 designs, " in told("other", "larger", "--lattice=2x2x2")


def test_nothing_measured_is_said_and_the_simulator_chooses(told):
    text = told("empty", "--budget=1")
    assert text.startswith("ite, displacement; nothing was measured\n")
    assert "6453" in text
    assert "the simulator's choice" in text


def test_other_cycles_and_another_simulator_are_what_they_are_asked_for(told):
    options = ("--friction-static=0", "--friction-kinetic=0", "--shear-ratio=0.5")
    pumped = ("--strain=0.5", "--frequency-hz=2")
    made = json.loads(told("--json", "--cycles=10:15", *options, *pumped))
    assert (made["cycles_real"], made["cycles_simulated"]) == (10, 15)
    there = reality("reversal").landscape()
    assert made["physics"] == reality("reversal").physics.to_dict()
    for one in made["proposals"]:
        assert one["simulated"] == pytest.approx(there["fitness"][one["design"]])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["trials", "other"], "the trials differ in reality"),
        (
            ["--simulated-in=soft"],
            "none of the 3 trials matches the options; softvox trials list",
        ),
        (["nowhere"], "no folder nowhere"),
        (["--cycles=20"], "3 of 3 runs end before 20 cycles"),
        (["--duration=3"], "--duration follows from the cycles"),
        (["--option=size=8"], "method ite has no option 'size'"),
        (["--option=budget=8"], "method ite has no option 'budget'"),
        (["--option=kernel=none"], "kernel must be hamming or behaviour"),
        (["--heading=3"], "--heading: the task displacement has no heading"),
        (["--budget=101"], "budget must be at least 1 and at most 100"),
        (["--out=sheets.txt"], "--out must end in"),
    ],
)
def test_what_can_not_be_is_refused_in_a_line(told, arguments, message, tmp_path):
    before = sorted(tmp_path.rglob("*"))
    said = told(*arguments, status=2)
    assert message in said
    assert said.count("\n") == 1
    assert sorted(tmp_path.rglob("*")) == before
