import pickle
from functools import lru_cache
from itertools import combinations

import numpy as np
import pytest

from softvox_gym import Design, Lattice, Physics, simulate
from softvox_gym.calibration import PER_CYCLE
from softvox_gym.landscapes.gap import pearson
from softvox_gym.real_tracks import LITTLE, MOST_CYCLES
from softvox_gym.trials import Trial, compare
from softvox_gym.trials.comparison import ERRORS, speed, warped

#: Cycles of most trials here, and robots that get somewhere within them.
CYCLES, ROBOTS = 3, (6453, 6013, 2117, 6489)

#: cm and voxel widths: what a trial's rounding, to 1e-4 cm, can change.
ROUNDED = 2e-4


@lru_cache
def walk(design, cycles=CYCLES):
    """The simulated track, voxel widths, `PER_CYCLE` samples a cycle."""
    return simulate(design, Physics.published().lasting(cycles), track=PER_CYCLE).track[0, :, :2]


def trial(design=6453, position=None, *, cycle=None, **about):
    """A trial that is the simulated track, or has another one in voxel widths."""
    own = walk(design) if position is None else np.asarray(position, dtype=float)
    about = {"voxel_cm": 1.5, "surface": "acrylic", "who": "nobody, as tests make it"} | about
    return Trial(
        design=design,
        cycle=np.linspace(0, CYCLES, len(own)) if cycle is None else cycle,
        position=own * about["voxel_cm"],
        license="CC0-1.0",
        date="2026-11-27",
        **about,
    )


def line(*ends, cycles=CYCLES, **about):
    """Trials of one design that go straight to some ends."""
    return [
        trial(position=[[0, 0], end], cycle=[0, cycles], repetition=i, **about)
        for i, end in enumerate(ends, start=1)
    ]


def facts_of(made):
    (section,) = made.conditions.values()
    return section.facts


def turned(track, degrees):
    a = np.radians(degrees)
    return track @ [[np.cos(a), np.sin(a)], [-np.sin(a), np.cos(a)]]


def all_warpings(i, j, n, m):
    """Every way to match the rest of two tracks: pairs of points with their weights."""
    if (i, j) == (n - 1, m - 1):
        yield []
    for down, right in ((0, 1), (1, 0), (1, 1)):
        if i + down < n and j + right < m:
            for rest in all_warpings(i + down, j + right, n, m):
                yield [(i + down, j + right, down + right), *rest]


def test_warping_is_the_best_of_all_ways_to_match():
    rng = np.random.default_rng(5)
    for n, m in ((1, 1), (1, 4), (2, 2), (3, 5), (5, 4)):
        a, b = rng.normal(size=(n, 2)), rng.normal(size=(m, 2))
        sums = [
            sum(w * np.hypot(*(a[i] - b[j])) for i, j, w in [(0, 0, 2), *way])
            for way in all_warpings(0, 0, n, m)
        ]
        assert warped(a, b) == pytest.approx(min(sums) / (n + m), rel=1e-12)
        assert warped(b, a) == pytest.approx(warped(a, b), rel=1e-12)


def test_warping_forgives_pauses_but_no_other_way():
    track = walk(6453)[::10]
    assert warped(track, np.repeat(track, 3, axis=0)) == 0
    straight = np.outer(np.arange(9.0), [1, 0])
    assert warped(straight, straight + np.array([0.0, 0.4])) == pytest.approx(0.4)


def test_a_trial_that_moves_as_simulated_has_no_error():
    made = compare([trial(design) for design in ROBOTS])
    for row in made.rows:
        assert row.errors[0, [0, 2, 3, 4, 5]] == pytest.approx(0, abs=ROUNDED)
        assert row.errors[0, 1] < 0.1  # degrees
        assert row.cycles == (CYCLES, CYCLES)
    assert [row.design.index for row in made.rows] == sorted(ROBOTS)
    facts = facts_of(made)
    assert facts["srcc"] == pytest.approx(1, abs=1e-3)
    assert (facts["designs"], facts["trials"], facts["with_heading"]) == (4, 4, 4)
    assert (facts["within_45"], facts["turned"], facts["rms_multiple"]) == (4, 0, None)


def test_errors_of_a_trial_turned_aside_are_those_of_geometry():
    (row,) = compare([trial(position=turned(walk(6453), 90))]).rows
    made, far = row.record(), np.hypot(*walk(6453)[-1])
    assert made["heading_error"] == pytest.approx(90, abs=0.05)
    assert made["distance_error"] == pytest.approx(0, abs=ROUNDED)
    assert made["distance_simulated"] == pytest.approx(far, abs=1e-12)
    assert made["end_point_error"] == pytest.approx(np.sqrt(2) * far, abs=ROUNDED)
    assert made["dtw"] <= made["rms_error"]
    assert made["speed_real"] == pytest.approx(made["speed_simulated"], abs=ROUNDED)


def test_a_slower_robot_is_laid_over_the_simulated_one():
    slow = trial(position=walk(6453), cycle=np.linspace(0, 6, len(walk(6453))))
    (row,) = compare([slow], cycles=(6, 3)).rows
    assert row.errors[0, [0, 2, 4, 5]] == pytest.approx(0, abs=ROUNDED)
    assert row.record()["cycles_real"] == 6
    assert row.tracks[1].cycle[-1] == 3
    assert row.speeds[1] < row.speeds[0]
    assert facts_of(compare([slow], cycles=(6, 3)))["cycles"] == (
        "6 real cycles laid over 3 simulated ones"
    )
    (half,) = compare([slow], cycles=3).rows
    assert half.compared[0].distance_real < 0.7 * half.compared[0].distance_simulated


def test_speed_is_what_a_robot_gets_on_in_a_cycle_of_its_own():
    (row,) = compare(line([3, 4], cycles=4.5), cycles=(4.5, 3)).rows
    assert speed(row.tracks[1], 4.5) == pytest.approx(5 / 4.5)
    (short,) = compare([trial(position=[[0, 0], [1, 1]], cycle=[0, 0.5])]).rows
    assert short.record()["speed_real"] is None
    assert short.record()["speed_error"] is None


def test_repeatability_is_the_same_errors_between_trials():
    runs = line([1, 0], [1.2, 0], [1, 0.3])
    (row,) = compare(runs).rows
    made = row.record()
    ends = np.array([[1, 0], [1.2, 0], [1, 0.3]])
    pairs = list(combinations(ends, 2))
    apart = np.mean([np.hypot(*(a - b)) for a, b in pairs])
    assert made["end_point_error_repeatability"] == pytest.approx(apart, abs=ROUNDED)
    assert made["rms_error_repeatability"] == pytest.approx(apart / np.sqrt(3), abs=ROUNDED)
    off = [abs(np.hypot(*a) - np.hypot(*b)) for a, b in pairs]
    assert made["distance_error_repeatability"] == pytest.approx(np.mean(off), abs=ROUNDED)
    far = np.hypot(*ends.T)
    assert made["distance_real"] == pytest.approx(far.mean(), abs=ROUNDED)
    assert made["distance_real_spread"] == pytest.approx(far.std(ddof=1), abs=ROUNDED)
    for name in ERRORS:
        times = made[name] / made[f"{name}_repeatability"]
        assert made[f"{name}_multiple"] == pytest.approx(times)
    assert row.repeatability.shape == (3, len(ERRORS))


def test_a_single_trial_has_no_spread_and_no_yardstick():
    (row,) = compare(line([1, 0])).rows
    made = row.record()
    for name in ERRORS:
        ends = ("_spread", "_repeatability", "_multiple")
        assert [made[name + end] for end in ends] == [None, None, None]


def test_a_condition_is_compared_over_the_cycles_of_its_shortest_trial():
    runs = [*line([1, 0]), *line([2, 0], cycles=2, who="another"), trial(6013), trial(6013)]
    made = compare([*runs, *line([1, 0], surface="ice")])
    assert [row.cycles for row in made.rows] == [(2, 2), (2, 2), (3, 3)]
    assert [len(row.trials) for row in made.rows] == [1, 2, 1]  # the same trial twice is one
    assert [one.distance_real for one in made.rows[1].compared] == pytest.approx(
        [2, 2 / 3], abs=ROUNDED
    )
    short, whole = (section.facts["cycles"] for section in made.conditions.values())
    assert short == (
        "2 cycles, real and simulated alike, as the shortest trial, of design 6453, has; the "
        "longest has 3"
    )
    assert whole == "3 cycles, real and simulated alike"


def test_trials_that_are_shorter_than_asked_for_are_left_out_and_told():
    long, short = *line([1, 0]), *line([2, 0], cycles=2, who="another")
    made = compare([long, short], cycles=3)
    assert made.left_out == (short,)
    assert made.rows[0].trials == (long,)
    # A film that ends a little early is taken to show the end.
    (nearly,) = line([1, 0], cycles=2.95)
    (row,) = compare([nearly], cycles=3).rows
    assert row.compared[0].distance_real == pytest.approx(1, abs=ROUNDED)


def test_what_gets_nowhere_has_no_heading():
    made = compare([*line([LITTLE / 2, 0])])
    record = made.rows[0].record()
    assert record["heading_error"] is None
    assert record["heading_real"] is None
    facts = facts_of(made)
    assert facts["with_heading"] == 0
    assert "No design has a heading in both worlds" in facts["words"]


def test_the_correlation_is_pearsons_with_a_band_and_kendalls_tau():
    far = dict(zip(ROBOTS, (0.9, 0.5, 0.3, 0.6), strict=True))
    runs = [trial(design, walk(design) * share) for design, share in far.items()]
    made = compare(runs)
    facts = facts_of(made)
    records = [row.record() for row in made.rows]
    both = np.array([[one["distance_simulated"], one["distance_real"]] for one in records]).T
    assert facts["srcc"] == pytest.approx(np.corrcoef(both)[0, 1])
    signs = [np.sign((a - b).prod()) for a, b in combinations(both.T, 2)]
    assert facts["tau"] == pytest.approx(np.mean(signs))
    z, half = np.arctanh(facts["srcc"]), 1.96 / np.sqrt(4 - 3)
    assert np.arctanh([facts["srcc_low"], facts["srcc_high"]]) == pytest.approx(
        [z - half, z + half]
    )
    again = compare(reversed(runs), threads=1)
    assert facts_of(again) == facts
    assert [row.record() for row in again.rows] == records


def test_a_correlation_of_what_does_not_vary_is_none():
    first = np.array([[1.0, 2.0, 4.0], [0.1, 0.1, 0.1], [1.0, 2.0, 3.0]])
    second = np.array([[3.0, 2.0, 0.0], [1.0, 2.0, 3.0], [0.1, 0.1, 0.1]])
    assert pearson(first, second) == pytest.approx([-1, np.nan, np.nan], nan_ok=True)


@pytest.mark.parametrize("designs", [ROBOTS[:3], ROBOTS])
def test_where_there_is_no_correlation_the_reason_is_told(designs):
    facts = facts_of(compare([trial(design, [[0, 0], [1, 0]]) for design in designs]))
    assert [facts[name] for name in ("srcc", "srcc_low", "srcc_high", "tau")] == [None] * 4
    assert "it takes 4 designs that do not all go equally far" in facts["words"]


def test_conditions_are_compared_apart():
    ice = [trial(design, surface="ice", pressure_kpa=6) for design in ROBOTS[:2]]
    made = compare([*ice, *line([1, 0]), trial(6013, frequency_hz=0.5, powder="starch")])
    shown = ["measured, acrylic", "measured, acrylic, starch, 0.5 Hz", "measured, ice, 6 kPa"]
    assert list(map(str, made.conditions)) == shown
    assert [row.design.index for row in made.rows] == [6453, 6013, 6013, 6453]
    assert repr(made) == "Comparison(4 rows, 4 trials, against published)"
    table = made.section()
    assert len(table.rows) == 4
    assert {row["pressure_kpa"] for row in table.records()} == {None, 6}


def test_designs_of_any_lattice_are_compared():
    large = Design("2" * 27, shape=(3, 3, 3))
    phased = Design("00021232", shape=Lattice.of((2, 2, 2), phases=2))
    made = compare([trial(one, [[0, 0], [1, 0]]) for one in (large, phased, Design(6453))])
    assert [row.design for row in made.rows] == [Design(6453), phased, large]
    ends = [row.tracks[0].position[-1] for row in made.rows]
    for end, design in zip(ends, (6453, phased, large), strict=True):
        assert end == pytest.approx(walk(design)[-1], abs=1e-12)


def test_another_simulator_may_be_chosen():
    physics = {"preset": "published", "friction_static": 0.2, "friction_kinetic": 0.1}
    own = simulate(6453, Physics.of(physics).lasting(CYCLES), track=PER_CYCLE).track[0, :, :2]
    (row,) = compare([trial(position=own)], physics).rows
    assert row.errors[0, 4] == pytest.approx(0, abs=ROUNDED)


def test_a_simulated_robot_that_diverges_stands_still():
    (row,) = compare(line([1, 0]), {"strain": 150.0}).rows
    assert row.diverged
    assert row.record()["distance_simulated"] == 0
    assert row.record()["end_point_error"] == pytest.approx(1, abs=ROUNDED)


@pytest.mark.parametrize(
    "given", ["", "90:23", "a", np.nan, 0, -1, MOST_CYCLES + 1, (1, 2, 3), (1, 0), [], {}]
)
def test_cycles_that_are_none_are_refused(given):
    with pytest.raises(ValueError, match=r"cycles must be a number above 0 .* as \(90, 23\)"):
        compare(line([1, 0]), cycles=given)


def test_a_large_robot_leaves_people_the_numbers_beside_it():
    digits = "2" * 63 + "1"
    section = compare(line([1, 0], design=Design(digits, shape=(4, 4, 4)))).section()
    assert section.cells()[1][0] == "2222222222222…2222222222221"
    assert pickle.loads(pickle.dumps(section)).records()[0]["design"] == digits


def test_what_can_not_be_compared_is_refused():
    with pytest.raises(ValueError, match="no trials to compare; give at least one"):
        compare([])
    with pytest.raises(TypeError, match="trials must be a list of softvox_gym"):
        compare([6453])
    with pytest.raises(ValueError, match="no trial has 90 cycles: the longest has 3; give fewer"):
        compare(line([1, 0]), cycles=(90, 23))
    with pytest.raises(ValueError, match="lasts 1001 cycles, but at most 1000"):
        compare(line([1, 0], cycles=1001))
    with pytest.raises(ValueError, match="reversal is a reality, not a physics"):
        compare(line([1, 0]), "reversal")
