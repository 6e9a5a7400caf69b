"""The engine agrees with the data measured from the authors' own (src/softvox_gym/data/authors)."""

from dataclasses import replace

import numpy as np
import pytest

from softvox_gym import Physics, simulate, verify
from softvox_gym.cli import main
from softvox_gym.cli import verify as command
from softvox_gym.data import designs, document, numbers, records

#: Every row of the agreement table, and how much it compares.
COMPARED = {
    "published top 100": 100,
    "digest": 6561,
    "landscape sample": 629,
    "linkless": 22,
    "linkless at dt/10": 22,
    "sensitive": 6,
    "trajectories": 6033,
    "high resolution": 3,
    "2x3x4 lattice": 8,
    "3x3x3 lattice": 20,
    "4x4x4 lattice": 6,
    "phase offsets": 12,
    **dict.fromkeys(document("variants.json"), 16),
    "gravity_moon": 18,
    "damped": 18,
}


@pytest.fixture(scope="module")
def table():
    return {row.name: row for row in verify.checks()}


@pytest.mark.parametrize("name", COMPARED)
def test_a_row_of_the_agreement_table_compares_all_its_data_and_passes(table, name):
    assert table[name].compared == COMPARED[name]
    assert table[name].passed, table[name]


def test_only_designs_that_rounding_decides_are_excepted(table):
    excepted = [row.name.strip() for row in table.values() if row.verdict == "known"]
    assert excepted == ["design 5455", "design 6453"]
    not_judged = [row.name for row in table.values() if row.verdict == "not judged"]
    assert not_judged == ["half the time step", "sensitive", "trajectory 6453"]


def test_verify_prints_the_agreement_table_and_passes(table, monkeypatch, capsys):
    monkeypatch.setattr(command, "checks", lambda *, threads: iter(table.values()))
    assert main(["verify"]) == 0
    output, complaints = capsys.readouterr()
    lines = output.splitlines()
    assert any(line.split()[:4] == ["published", "top", "100", "100/100"] for line in lines)
    assert "FAILED" not in output
    assert complaints == ""


# The robots that are excepted fall to one side or the other; how far they get is nearly the same.
# The tolerance is the spread over 200 runs whose voxels start a random 2e-16 of an edge away.
@pytest.mark.parametrize(("index", "spread"), [(6453, 2e-3), (5455, 0.1)])
def test_an_excepted_design_travels_as_far_in_another_direction(index, spread):
    rows = records("variants.csv")
    (row,) = (r for r in rows if r["variant"] == "clamp" and r["design"] == str(index))
    result = simulate(index, replace(Physics.published(), actuation="clamp"))
    assert abs(result.fitness[0] - np.hypot(float(row["dx"]), float(row["dy"]))) < spread


def test_sensitive_designs_of_the_top_hundred_agree_to_a_thousandth():
    top = {6453, 4295, 6481, 6507}
    tenth = [row for row in records("landscape_sample.csv") if int(row["design"]) in top]
    assert tenth
    found = simulate(designs(tenth)).fitness
    np.testing.assert_allclose(found, numbers(tenth, "fitness")[:, 0], rtol=0, atol=1e-3)


def test_exact_constants_reproduce_ninety_six_of_the_published_hundred():
    published = records("published_top100.csv")
    fitness = simulate(range(6561), Physics.exact()).fitness
    assert verify.published_top100(fitness, published).agree == 96
