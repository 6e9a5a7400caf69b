"""The engine agrees with the data measured from the authors' own (src/softvox_gym/reference)."""

from dataclasses import replace

import numpy as np
import pytest
import reference

from softvox_gym import Design, Physics, simulate

PUBLISHED = Physics.published()
# How far the authors' engine agrees with itself when it is compiled with other flags, voxel widths.
SELF_AGREEMENT = 1e-7
# What differs in their engine where voxels contract as well is not known; it is this small.
CONTRACTING_AGREEMENT = 2e-7
AXES = ("dx", "dy", "dz")
VARIANTS = reference.document("variants.json")
LATTICES = reference.document("lattices.json")


def displacements(rows):
    return np.array([[float(row[axis]) for axis in AXES] for row in rows])


def largest_difference(rows, result):
    return np.abs(displacements(rows) - result.displacement).max(axis=1)


def test_all_hundred_published_designs_agree_at_the_two_decimals_printed():
    rows = reference.rows("published_top100.csv")
    result = simulate([int(row["design"]) for row in rows], PUBLISHED)
    assert [f"{fitness:.2f}" for fitness in result.fitness] == [row["fitness"] for row in rows]


def test_the_landscape_sample_agrees_as_the_authors_engine_does_with_itself():
    rows = [
        row
        for row in reference.rows("landscape_sample.csv")
        if row["sensitive"] == "0" and row["linkless"] == "0"
    ]
    difference = largest_difference(rows, simulate([int(row["design"]) for row in rows], PUBLISHED))
    assert len(rows) == 629
    assert difference.max() < SELF_AGREEMENT


def test_linkless_designs_agree_within_what_the_authors_smaller_time_step_makes():
    rows = [row for row in reference.rows("landscape_sample.csv") if row["linkless"] == "1"]
    difference = largest_difference(rows, simulate([int(row["design"]) for row in rows], PUBLISHED))
    assert len(rows) == 22
    assert difference.max() < 0.002


def test_sensitive_designs_agree_as_far_as_the_authors_engine_does_with_itself():
    rows = [row for row in reference.rows("landscape_sample.csv") if row["sensitive"] == "1"]
    difference = largest_difference(rows, simulate([int(row["design"]) for row in rows], PUBLISHED))
    assert len(rows) == 6
    assert difference.max() < 0.25


@pytest.mark.parametrize("name", VARIANTS)
def test_a_variant_of_the_physics_agrees(name):
    rows = [row for row in reference.rows("variants.csv") if row["variant"] == name]
    physics = replace(PUBLISHED, **VARIANTS[name])
    result = simulate([int(row["design"]) for row in rows], physics)
    assert physics.time_step == pytest.approx(float(rows[0]["time_step"]), rel=1e-15)
    assert list(result.steps) == [int(row["steps"]) for row in rows]
    difference = largest_difference(rows, result)
    chaotic = np.array([(name, row["design"]) in reference.CHAOTIC for row in rows])
    allowed = CONTRACTING_AGREEMENT if name == "both_phases" else SELF_AGREEMENT
    assert difference[~chaotic].max() < allowed


@pytest.mark.parametrize(("variant", "index"), reference.CHAOTIC)
def test_a_design_whose_fall_rounding_decides_falls_as_far(variant, index):
    row = next(
        row
        for row in reference.rows("variants.csv")
        if (row["variant"], row["design"]) == (variant, index)
    )
    result = simulate(int(index), replace(PUBLISHED, **VARIANTS[variant]))
    fitness = np.hypot(float(row["dx"]), float(row["dy"]))
    assert abs(result.fitness[0] - fitness) < reference.CHAOTIC[variant, index]


@pytest.mark.parametrize("case", LATTICES, ids=[case["name"] for case in LATTICES])
def test_another_lattice_or_phases_agree(case):
    physics = replace(PUBLISHED, edge=case["edge"], strain=case["strain"])
    phase = case["phase"]
    if phase is not None:
        phase = np.array(phase).reshape(1, *case["shape"], order="F")
    design = Design(case["digits"], shape=case["shape"])
    result = simulate(design, physics, phase=phase)
    assert result.steps[0] == case["steps"]
    np.testing.assert_allclose(
        result.displacement[0], [case[axis] for axis in AXES], rtol=0, atol=SELF_AGREEMENT
    )


# 0002 and 0135 are linkless: the authors' engine took another time step there.
@pytest.mark.parametrize("name", ["0008", "0020", "0164", "2117", "5164", "6453", "6489", "6560"])
def test_a_trajectory_agrees_voxel_by_voxel(name):
    rows = reference.rows(f"trajectories/{name}.csv")
    frames = simulate(int(name), PUBLISHED, frames=1).frames
    assert frames is not None
    step, site = (np.array([int(row[key]) for row in rows]) for key in ("step", "voxel"))
    x, y, z = np.unravel_index(site, (2, 2, 2), order="F")
    position = np.array([[float(row[axis]) for axis in "xyz"] for row in rows])
    edge = np.array([float(row["edge"]) for row in rows])
    # 6453 falls over late, and rounding decides how; until then it agrees like the others.
    judged = step < (5000 if name == "6453" else np.inf)
    ours = frames.position[0, step, x, y, z]
    np.testing.assert_allclose(
        ours[judged], position[judged], rtol=0, atol=SELF_AGREEMENT * PUBLISHED.edge
    )
    # Edges are printed to 14 digits.
    np.testing.assert_allclose(frames.edge[0, step, x, y, z], edge, rtol=1e-13)
    np.testing.assert_allclose(
        frames.time[0, step], [float(row["time"]) for row in rows], rtol=1e-10
    )
