"""A calibration finds the physics of a grid that moves like the real robots, if there is one."""

from dataclasses import replace

import numpy as np
import pytest

from softvox_gym import Calibration, Design, Physics, Reality, calibrate, reality, simulate
from softvox_gym.calibration import AXES, grid_of, known_of, settings, tracks_of
from softvox_gym.real_tracks import RealTrack

#: The three e-types and the three f-types of the paper's nine robots, as we read its text, and
#: those three of the fittest designs of nine bodies that come next.
NINE = [6453, 6013, 2117, 6489, 6481, 1385, 6330, 4690, 573]

TRUTH = reality("reversal")
KNOWN = {"preset": "published", **known_of(TRUTH)}
BRIEF = Physics.published().lasting(2)


@pytest.fixture(scope="module")
def nine():
    return tracks_of(TRUTH, NINE)


def track(design, x, y, *, trial="1", cycles=2.0):
    return RealTrack(design, trial, np.array([0.0, cycles]), np.array([[0.0, 0.0], [x, y]]))


def made(end, real, diverged=None):
    """A calibration of some ends, shape (p, n, 2), as if it had been simulated."""
    end, real = np.asarray(end, float), np.asarray(real, float)
    p, n = end.shape[:2]
    return Calibration(
        designs=np.arange(1, n + 1),
        trials=np.ones(n, int),
        cycles=np.full(n, 2.0),
        real=real,
        spread=np.zeros(n),
        parameters={"strain": np.arange(p) / 10},
        physics=BRIEF,
        end=end,
        diverged=np.zeros((p, n), bool) if diverged is None else np.asarray(diverged),
    )


@pytest.mark.parametrize("base", [KNOWN, "published"])
def test_no_pair_of_frictions_turns_the_robots_as_the_paper_found(nine, base):
    found = calibrate(nine, "friction", base)
    assert len(found) == 46
    assert found.has_heading.all()
    assert found.headings.max() <= 6


def test_area_friction_turns_all_nine(nine):
    found = calibrate(nine, {"friction": [0, 0.1, 0.5, 1], "shear": None}, KNOWN)
    assert found.headings[found.best] == 9
    point = found.point(found.best)
    assert (point["friction_static"], point["friction_kinetic"]) == (0, 0)
    # Also where its shear strength is not in the grid.
    near = calibrate(nine, {"friction": [0, 0.1], "shear": [0.1, 0.2, 0.3]}, KNOWN)
    assert near.headings[near.best] == 9


def test_the_physics_of_the_truth_leaves_no_error(nine):
    found = calibrate(nine, "friction=0,shear=0.5", KNOWN)
    assert found.end_error.max() < 1e-12
    assert found.heading_error.max() < 1e-10
    assert found.physics_of(0).to_dict()["shear_strength"] == [TRUTH.physics.shear_strength] * 9


def test_of_a_reality_only_the_actuation_is_known():
    assert known_of(TRUTH) == {"strain": 0.5, "frequency_hz": 2.0, "actuation": "hold"}
    assert known_of(reality("clamp"))["actuation"] == "clamp"
    assert known_of(reality("high_resolution"))["strain"] == Physics.published().strain


def test_a_point_is_the_simulation_of_its_physics():
    tracks = [track(6453, 1, 0), track(573, 0, 1, cycles=3)]
    found = calibrate(tracks, {"frequency_hz": [2, 5], "shear": [0, 0.5], "density": [5e5, 1e6]})
    assert found.end.shape == (8, 2, 2)
    for i in range(8):
        at = {name: values[i] for name, values in found.parameters.items()}
        for j, (design, cycles) in enumerate([(6453, 2), (573, 3)]):
            physics = Physics.of({"preset": "published", **at}).lasting(cycles)
            alone = simulate(design, physics).displacement[0, :2]
            assert found.end[i, j].tobytes() == alone.tobytes()
            own = found.physics_of(i)
            assert own.duration[j] == physics.duration
            assert own.shear_strength[j] == physics.shear_strength


def test_an_axis_of_gravity_is_one_number_per_point_even_for_three():
    found = calibrate([track(6453, 1, 0)], "gravity=-2,-5,-9.81")
    for i, gravity in enumerate((-9.81, -5, -2)):
        alone = simulate(6453, replace(BRIEF, gravity=gravity)).displacement[0, :2]
        assert found.end[i, 0].tobytes() == alone.tobytes()


def test_trials_of_a_design_are_averaged_over_the_cycles_of_the_shortest():
    tracks = [track(6453, 4, 0, trial="a", cycles=4), track(6453, 0, 2, trial="b", cycles=2)]
    found = calibrate(tracks, "strain=0.2", {"preset": "published", "edge": 0.02})
    assert found.trials.tolist() == [2]
    assert found.cycles.tolist() == [2]
    # (2, 0) and (0, 2) cm are (1, 0) and (0, 1) voxel widths.
    assert found.real[0] == pytest.approx([0.5, 0.5])
    assert found.spread == pytest.approx([np.sqrt(0.5)])


def test_headings_match_up_to_45_degrees():
    angles = np.radians([0, 44.9, 45.1, 90, 180, -44.9])
    ends = np.stack([np.cos(angles), np.sin(angles)], axis=-1)[:, np.newaxis]
    found = made(ends, [[2, 0]])
    assert found.matched[:, 0].tolist() == [True, True, False, False, False, True]
    assert found.heading_error[:, 0] == pytest.approx([0, 44.9, 45.1, 90, 180, 44.9])
    assert found.distance_error[:, 0] == pytest.approx(-1)
    assert made([[[1, 1]]], [[2, 0]]).headings.tolist() == [1]


def test_a_design_without_a_heading_in_reality_does_not_count_and_one_in_the_model_is_a_miss():
    found = made([[[1, 0], [1, 0], [0.2, 0]]], [[1, 0], [0.2, 0], [1, 0]])
    assert found.has_heading.tolist() == [True, False, True]
    assert found.headings.tolist() == [1]
    assert found.share.tolist() == [0.5]
    assert np.isnan(found.heading_error).tolist() == [[False, True, True]]
    point = found.point(0)
    assert point["heading_error_mean"] == 0
    assert point["distance_error_mean"] == pytest.approx(0)
    assert point["distance_error_rms"] == pytest.approx(0.8 * np.sqrt(2 / 3))
    assert made([[[0, 0]]], [[1, 0]]).point(0)["heading_error_mean"] is None


def test_the_best_point_has_most_headings_then_fewest_diverged_then_the_nearest_ends():
    near, far, wrong, lost = [1, 0.1], [3, 0], [-1, 0], [0, 0]
    found = made([[wrong], [far], [near], [lost]], [[1, 0]], [[False], [False], [False], [True]])
    assert found.order.tolist() == [2, 1, 0, 3]
    assert repr(found) == "Calibration(4 points, 1 designs, best 1 of 1 headings)"


def test_tracks_of_a_finer_resolution_are_those_of_the_designs_asked_for():
    fine = Reality("fine", BRIEF, resolution=2, expansion="uniform")
    tracks = tracks_of(fine, [6453, "22012210"])
    assert [track.design for track in tracks] == [6453, Design("22012210").index]


def test_points_where_designs_diverge_are_told_and_score_nothing():
    found = calibrate([track(6453, 1, 0), track(6013, 1, 0)], "strain=0.2,150")
    assert found.diverged.tolist() == [[False, False], [True, True]]
    assert found.headings[1] == 0
    assert (found.end[1] == 0).all()
    assert found.best == 0
    assert found.point(1)["diverged"] == 2


@pytest.mark.parametrize(
    ("text", "grid"),
    [
        ("friction,shear", {"friction": None, "shear": None}),
        ("strain=0.1,0.3", {"strain": (0.1, 0.3)}),
        (
            "friction,strain=0:1:3,2,shear",
            {"friction": None, "strain": (0, 0.5, 1, 2), "shear": None},
        ),
        ("frequency-hz = 2, 4,gravity=-1e1", {"frequency_hz": (2, 4), "gravity": (-10,)}),
    ],
)
def test_a_grid_is_read_as_it_is_written(text, grid):
    assert grid_of(text) == grid


@pytest.mark.parametrize("name", AXES)
def test_an_axis_has_usual_values_that_can_be_simulated(name):
    found = calibrate([track(6453, 1, 0, cycles=0.5)], name)
    assert len(found) == len(settings(name, None))
    assert not found.diverged.any()


def test_frictions_are_pairs_with_the_kinetic_one_at_most_the_static_one():
    pairs = [tuple(one.values()) for one in settings("friction", [1, 0, 0.5])]
    assert pairs == [(0, 0), (0.5, 0.5), (1, 0.5), (1, 1)]


@pytest.mark.parametrize(
    ("grid", "message"),
    [
        ("fricton", "no axis 'fricton'; did you mean friction?; there are friction, shear, "),
        ("edge=1", "no axis 'edge'"),
        ("duration=1,2", "no axis 'duration'"),
        ("", "name an axis"),
        ({}, "the grid has no axes"),
        ("friction,friction", "friction is in the grid twice"),
        ("friction,friction_static", "friction and friction_static both set friction_static"),
        ("shear,shear_strength=1", "shear and shear_strength both set shear_strength"),
        ("damping_link", "damping_link has no default values; give some"),
        ("strain=", "strain= is not a list of values; write strain=0.1,0.5"),
        ("strain=0.1:0.5", "is not a list of values"),
        ("strain=0.1:0.5:1", "is not a list of values"),
        ("strain=0.1:0.5:5:5", "is not a list of values"),
        ("strain=nan", "strain must be finite, got nan"),
        ("strain=-2", "strain must be finite and above -1, got -2"),
        ("shear=-0.5", "shear must be finite and not negative, got -0.5"),
        ("friction=-0.5", "friction_static must be finite and not negative"),
        ("frequency_hz=1e6", "frequency_hz must be at most half the steps per second"),
        ({"strain": "0.5"}, "strain must be a row of numbers"),
        ({"strain": []}, "strain must be a row of numbers"),
        ("friction=0:1:1000", "friction has 1000 values, which is too many"),
        ("shear=0:1:400,strain=0:1:400", "has 160000 points, which makes 160000 simulations"),
    ],
)
def test_a_grid_that_is_none_says_why(grid, message):
    with pytest.raises(ValueError, match="^[^\n]*" + message.replace("?", r"\?")):
        calibrate([track(6453, 1, 0)], grid)


@pytest.mark.parametrize("tracks", [TRUTH, [6453], None])
def test_what_are_no_tracks_is_refused(tracks):
    with pytest.raises(TypeError, match="tracks must be several RealTracks, as read_tracks or"):
        calibrate(tracks, "shear")


def test_tracks_that_no_heading_can_be_told_of_are_refused():
    with pytest.raises(ValueError, match="no tracks"):
        calibrate([], "shear")
    with pytest.raises(ValueError, match=r"no design travels 0\.25 voxel widths"):
        calibrate([track(6453, 0.1, 0.2)], "shear")
    wild = replace(TRUTH, physics=replace(TRUTH.physics, strain=150.0))
    with pytest.raises(ValueError, match=r"2 of 2 designs diverge .*: 6453, 6013; leave them out"):
        tracks_of(wild, [6453, 6013])
