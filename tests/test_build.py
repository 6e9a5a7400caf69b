"""What is built of a design, and what it takes."""

import csv
from importlib.resources import files
from itertools import combinations

import numpy as np
import pytest

from softvox_gym import Design, Lattice
from softvox_gym.build import bill, plan
from softvox_gym.design import actuators, buildable

TWO_PHASES = Lattice.of((2, 2, 2), phases=2)


def solid(shape, *active, absent=()):
    """A passive block with some other voxels."""
    array = np.ones(shape, dtype=int)
    for value, places in ((2, active), (0, absent)):
        for place in places:
            array[place] = value
    return Design(array)


@pytest.mark.parametrize(
    ("shape", "phases"), [((2, 2, 2), 1), ((2, 2, 2), 2), ((3, 3, 3), 2), ((4, 4, 5), 1)]
)
def test_a_plan_has_problems_where_the_design_is_not_buildable(shape, phases):
    lattice, rng = Lattice.of(shape, phases=phases), np.random.default_rng(0)
    rows = lattice.random(120, rng)
    if shape[0] > 2:  # mostly solid and passive, with hollows and buried groups
        rows = np.where(rng.random(rows.shape) < 0.9, 1, rows)
    plans = [plan(Design(row, shape=lattice)) for row in rows]
    found = [not one.problems for one in plans]
    assert found == buildable(rows, lattice).tolist()
    assert 0 < sum(found) < 120
    assert all(bool(one.steps) == (not one.problems) for one in plans)


def test_of_2x2x2_all_in_one_piece_can_be_built():
    digits = Lattice().digits(np.arange(6561))
    assert buildable(digits, Lattice()).sum() == 5472
    for number in range(0, 6561, 41):
        assert bool(plan(Design(number)).problems) != Design(number).is_connected


def test_groups_holes_and_inlets_are_what_the_protocol_says():
    rng = np.random.default_rng(1)
    lattice = Lattice.of((3, 3, 3), phases=2)
    for row in lattice.random(60, rng):
        design = Design(row, shape=lattice)
        made = plan(design)
        assert [group.sites for group in made.groups] == list(actuators(design))
        assert sorted(s for g in made.groups for s in g.sites) == np.flatnonzero(row > 1).tolist()
        beside = {(a, b) for a in range(27) for b in lattice.neighbours(a) if a < b <= a + 3}
        assert set(made.bonds) == {(a, b) for a, b in beside if row[a] and row[b]}
        for group in made.groups:
            pairs = {pair for pair in combinations(group.sites, 2) if pair in beside}
            assert pairs == {hole for hole in made.holes if hole[0] in group.sites}
            assert {lattice.place(site)[2] for site in group.sites} == {group.z}
            assert {(row[site] - 2) / 2 for site in group.sites} == {group.phase}
            if group.inlet:
                front = np.add(lattice.place(group.inlet.site), group.inlet.face)
                is_inside = ((front >= 0) & (front < 3)).all()
                assert group.inlet.site in group.sites
                assert not is_inside or design.array[tuple(front)] == 0


def test_groups_are_named_in_order():
    names = [group.name for group in plan(Design([2, 1] * 30, shape=(1, 1, 60))).groups]
    assert names == [*"ABCDEFGHIJKLMNOPQRSTUVWXYZ", "AA", "AB", "AC", "AD"]


@pytest.mark.parametrize(
    ("design", "site", "face", "why"),
    [
        (
            Design("00021222"),
            6,
            (0, 1, 0),
            "a free side, nothing beside the tube; 2 of 2",
        ),
        # The notch between two arms is the one free side to -x; +x has nothing beside it.
        (Design("111120111", shape=(3, 3, 1)), 4, (1, 0, 0), "a free side, 2 voxels beside"),
        (Design("20111", shape=(5, 1, 1)), 0, (-1, 0, 0), "a free side, nothing beside the tube"),
        (solid((3, 3, 2), (1, 1, 1)), 13, (0, 0, 1), "the top, as no side is free"),
        (solid((3, 3, 2), (1, 1, 0)), 4, (0, 0, -1), "the underside, as nothing else is free"),
        (
            solid((3, 3, 3), (1, 1, 1), absent=[(1, 1, 0)]),
            13,
            (0, 0, -1),
            "the underside of an overhang, as no side and no top is free",
        ),
    ],
)
def test_an_inlet_is_where_a_tube_leaves_best(design, site, face, why):
    inlet = plan(design).groups[-1].inlet
    assert (inlet.site, inlet.face) == (site, face)
    assert why in inlet.why


def test_a_tube_does_not_leave_towards_another_voxel():
    two_towers = np.ones((3, 1, 2), dtype=int)
    two_towers[:, 0, 1] = 2, 0, 2
    for group in plan(Design(two_towers)).groups:
        assert group.inlet.face[0] * (group.inlet.site % 3 - 1) >= 0
        assert "a free side" in group.inlet.why
    # Rather up than into a pit, but rather into a pit than under the robot.
    pit = solid((5, 5, 1), (2, 2, 0), absent=[(3, 2, 0)])
    assert plan(pit).groups[0].inlet.face == (0, 0, 1)
    pit = np.ones((5, 5, 2), dtype=int)
    pit[2, 2, 0], pit[3, 2] = 2, 0
    inlet = plan(Design(pit)).groups[0].inlet
    assert inlet.face == (1, 0, 0)
    assert "a gap between voxels, as nothing better is free, 2 voxels beside the tube" in inlet.why


@pytest.mark.parametrize(
    ("design", "problem"),
    [
        (Design(0), "it has no voxels"),
        (
            Design("20000002"),
            "it is 2 pieces, (0,0,0) | (1,1,1), that share an edge or a corner only, "
            "(0,0,0)-(1,1,1), and no face to bond",
        ),
        (
            Design("10010000"),
            "it is 2 pieces, (0,0,0) | (1,1,0), that share an edge or a corner only, "
            "(0,0,0)-(1,1,0), and no face to bond",
        ),
        (Design("101", shape=(1, 1, 3)), "it is 2 pieces, (0,0,0) | (0,0,2), that do not touch"),
        (
            solid((3, 3, 3), (1, 1, 1)),
            "group A is buried: no face of (1,1,1) is on the surface, and its tube needs one; "
            "leave out a voxel beside it",
        ),
        (
            Design("23110000", shape=TWO_PHASES),
            "active neighbours of a slice share their air, and (0,0,0)-(1,0,0) differ in "
            "phase; give them one phase, or put a passive voxel between them",
        ),
    ],
)
def test_problems_say_why_it_cant_be_built(design, problem):
    made = plan(design)
    assert made.problems == (problem,)
    assert made.steps == ()
    with pytest.raises(ValueError, match="can't be built"):
        bill([made])


def test_of_many_faults_some_are_named():
    checkered = np.indices((7, 7, 7)).sum(axis=0) % 2 + 1
    problems = plan(Design(checkered)).problems
    assert len(problems) == 7
    assert problems[-1] == "57 more groups are buried"
    scattered = plan(Design([1, 0] * 8, shape=(16, 1, 1))).problems[0]
    assert "(10,0,0) and 2 more, that do not touch" in scattered


def test_a_group_beside_a_closed_hollow_is_buried():
    design = solid((4, 4, 4), (2, 1, 1), absent=[(1, 1, 1)])
    assert "group A is buried" in plan(design).problems[0]
    rows = design.lattice.to_rows(design.array[None])
    assert not buildable(rows, design.lattice)[0]
    opened = solid((4, 4, 4), (2, 1, 1), absent=[(1, 1, 1), (0, 1, 1)])
    assert plan(opened).groups[0].inlet.face == (-1, 0, 0)
    assert buildable(opened.lattice.to_rows(opened.array[None]), opened.lattice)[0]


@pytest.mark.parametrize(
    ("design", "warning"),
    [
        (Design("11110000"), "no voxel is active: it has no tube, and will not move"),
        (Design("00002222"), "nothing is below slice z = 1"),
        (Design("202", shape=(1, 1, 3)), "nothing is below slice z = 2"),
        (Design("20002200"), "nothing is below (1,0,1): support the overhang"),
        (Design("20022222"), "slice z = 0 is 2 parts, (0,0,0) | (1,1,0), that share no face"),
        (solid((3, 3, 1), (1, 1, 0)), "the tube of group A leaves through the top: hold it"),
        (solid((3, 3, 2), (1, 1, 0)), "the tube of group A leaves through the underside, on which"),
    ],
)
def test_warnings_say_what_needs_care(design, warning):
    assert any(one.startswith(warning) for one in plan(design).warnings)


def test_the_steps_are_those_of_this_robot():
    steps = "\n".join(plan(Design(6453)).steps)
    assert "Mould 5 voxels: 4 pink (active), 1 blue or yellow (passive)." in steps
    holes = "(1,0,1)-(1,1,1), (0,1,1)-(1,1,1)"
    assert (
        f"Slice z = 1: bond 4 pairs of neighbours with Sil-Poxy; punch 2 holes: {holes}." in steps
    )
    assert "Slice z = 0" not in steps  # one voxel, nothing to bond
    assert "Inlets: A in (1,1,0) towards +y; B in (0,1,1) towards +y." in steps
    assert "glue in 16 cm of 1/32 in tube" in steps
    assert steps.index("leaks") < steps.index("Stack the slices, z = 0, 1")
    assert "check list), before the slices are stacked." in steps
    assert "stacked" not in " ".join(plan(Design("02220000")).steps)  # one slice
    assert steps.endswith("Join the 2 tubes, by T connectors, to the pump.")
    phased = plan(Design("22223333", shape=TWO_PHASES)).steps
    assert phased[-1] == "A pump for each phase, in cycles ahead: A at 0; B at 0.5."
    passive = "\n".join(plan(Design("11000000")).steps)
    assert "no hole" in passive
    assert "Inlets" not in passive
    assert "Stack" not in passive


def test_fifty_full_robots_cost_what_the_paper_paid():
    full = bill([plan(Design(6560))], copies=50)
    assert (full.total_usd, full.used_usd) == (622.0, 622.0)
    assert full.quantities["silicone_ml"] == pytest.approx(400 * 1.2 / 1.07)
    assert full.quantities["tube_1_32_in_cm"] == pytest.approx(52 * 30.48)
    path = files("softvox_gym.data") / "kit" / "parts.csv"
    table = list(csv.DictReader(path.read_text("utf-8").splitlines()))
    assert len(full.lines) == len(table) == 31
    assert sum(round(100 * float(row["usd"])) for row in table) == 62200
    assert {line.share for line in full.lines} == {1}
    materials = full.materials()
    assert sum(row["bought_usd"] for row in materials.records()) == pytest.approx(622, abs=1e-9)
    assert "622.00 USD to buy" in materials.text()


def test_what_is_bought_once_stays_and_the_rest_is_scaled():
    one = bill([plan(Design(6560))])
    again = sum(line.usd for line in one.lines if line.row["scales_with"] != "once")
    assert one.used_usd == pytest.approx(float(622 - again * 49 / 50))
    assert one.total_usd == 622  # a package of each
    more = bill([plan(Design(6560))], copies=51)
    assert more.total_usd == pytest.approx(float(622 + again))  # a second one
    mixed = bill([plan(Design(6453)), plan(Design("11000000"))], copies=2)
    counts = {"robots": 4, "voxels": 14, "active": 8, "passive": 6, "slices": 6, "groups": 4}
    assert counts.items() <= mixed.quantities.items()
    assert (mixed.quantities["holes"], mixed.quantities["joints"]) == (4, 14)
    share = {int(line.row["no"]): line.share for line in mixed.lines}
    assert (float(share[1]), float(share[2]), float(share[5])) == (14 / 400, 14 / 500, 4 / 100)


def test_a_passive_robot_needs_no_tube():
    passive = bill([plan(Design("11000000"))])
    pneumatic = [line for line in passive.lines if line.row["section"] == "pneumatic"]
    assert [line.packages for line in pneumatic] == [0, 0, 0]
    assert passive.quantities["connectors"] == 0


def test_hours_and_fillings_go_by_the_mould():
    full = [plan(Design(6560))]
    for voxels, fillings, hours, room in ((144, 3, 4.5, 7.5), (100, 4, 6, 10), (400, 1, 1.5, 2.5)):
        made = bill(full, 50, mould_voxels=voxels).quantities
        assert made["mould_fillings"] == fillings
        assert (made["cure_hours"], made["cure_hours_room"]) == (hours, room)
    with pytest.raises(ValueError, match="mould_voxels must be a whole number from 1, got 0"):
        bill(full, mould_voxels=0)
    for copies in (-1, 1.5):
        with pytest.raises(ValueError, match=f"copies must be a whole number from 1, got {copies}"):
            bill(full, copies=copies)
    with pytest.raises(TypeError, match=r"plans must be what plan\(design\) returns, got a Design"):
        bill([Design(6560)])
