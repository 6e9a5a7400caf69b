"""What a design is worth on several counts."""

import pickle

import numpy as np
import pytest

from softvox_gym import Task, evaluate, simulate
from softvox_gym.noise import Jakobi, MeasurementNoise
from softvox_gym.objectives import OBJECTIVES, Tried

ALL = ("displacement", "voxels", "actuators", "energy", "straightness", "stability", "heading")
SHORT = {"preset": "published", "duration": 0.9}
DESIGNS = [6453, 4295, 5757, 1, 0]


def worth(name, strides, *, heading=None):
    """Return what a trial is worth whose centre of mass goes by these strides, shape (c, 2)."""
    task = Task() if heading is None else Task("directed", heading)
    track = np.zeros((1, 1, len(strides) + 1, 3))
    track[..., 1:, :2] = np.cumsum(strides, axis=0)
    end, digits, zeros = track[:, :, -1], np.ones((1, 2, 2, 2), np.uint8), np.zeros((1, 1))
    tried = Tried(digits, task, task.reward(end), end, track, zeros)
    return OBJECTIVES[name].values(tried).item()


def test_the_table_has_the_objectives_in_order():
    assert tuple(OBJECTIVES) == ALL
    assert [one.name for one in OBJECTIVES.values() if one.is_cost] == [*ALL[1:4]]


def test_they_come_in_the_order_asked_for_and_are_what_evaluation_and_simulation_tell():
    evaluation = evaluate(DESIGNS, SHORT, objectives=("energy", "displacement", "actuators"))
    values = evaluation.objectives
    assert values.shape == (5, 3)
    assert values.dtype == np.float64
    assert values[:, 1].tobytes() == evaluation.value.tobytes()
    energy = simulate(DESIGNS, evaluation.result.physics, energy=True).energy
    assert values[:, 0].tobytes() == (0.0 - energy).tobytes()
    assert (values[:3, 0] < 0).all()
    assert values[:, 2].tolist() == [-4, -4, -4, 0, 0]
    assert evaluate(DESIGNS, SHORT, objectives=("voxels",)).objectives.T.tolist() == [
        [-5, -5, -5, -1, 0]
    ]
    assert evaluate(DESIGNS, SHORT).objectives.shape == (5, 0)
    again = pickle.loads(pickle.dumps(evaluation))
    assert again.objectives.tobytes() == values.tobytes()
    assert evaluate([], SHORT, objectives=ALL).objectives.shape == (0, 7)


def test_energy_is_measured_only_where_it_is_asked_for():
    assert evaluate(1, SHORT, objectives=("voxels",)).result.energy is None


def test_straightness_is_way_over_path():
    assert worth("straightness", [[1, 1]] * 4) == pytest.approx(1)
    assert worth("straightness", [[1, 0], [0, 1]]) == pytest.approx(np.sqrt(0.5))
    assert worth("straightness", [[1, 0], [-1, 0]]) == 0
    assert worth("straightness", [[0.12, 0], [0.12, 0]]) == 0  # hardly moves
    assert worth("straightness", np.zeros((0, 2))) == 0


def test_stability_is_lost_by_uneven_strides_alone():
    assert worth("stability", [[1, 0], [0, 1], [-1, 0]]) == pytest.approx(1)
    lengths = np.array([1.0, 2.0, 0.5, 3.0])
    variation = lengths.std() / lengths.mean()
    strides = lengths[:, np.newaxis] * [0.6, 0.8]
    assert worth("stability", strides) == pytest.approx(1 / np.sqrt(1 + variation**2))
    assert worth("stability", [[1, 0], *[[0, 0]] * 3]) == pytest.approx(0.5)
    assert worth("stability", [[0.1, 0]]) == 0
    assert worth("stability", np.zeros((0, 2))) == 0


def test_heading_is_along_the_tasks_or_x():
    assert worth("heading", [[-1, 2]]) == -1
    assert worth("heading", [[-1, 2]], heading=90.0) == 2
    assert worth("displacement", [[-1, 2]], heading=90.0) == 2
    assert worth("displacement", [[3, 4]]) == 5


def test_all_are_finite_and_within_their_bounds():
    designs = np.arange(0, 6561, 40)
    values = evaluate(designs, SHORT, objectives=ALL).objectives
    for column, one in zip(values.T, OBJECTIVES.values(), strict=True):
        assert np.isfinite(column).all()
        assert one.low <= column.min() < column.max() <= one.high, one.name


def test_what_diverges_is_worth_what_it_is_built_of_and_the_empty_design_nothing():
    wild = evaluate(["2" * 8, 0], {"strain": 1e6}, objectives=ALL, trials=2)
    assert wild.diverged[0].all()
    assert wild.objectives.tolist() == [[0, -8, -8, 0, 0, 0, 0], [0] * 7]


@pytest.mark.parametrize("aggregate", ["mean", "min"])
def test_several_trials_are_aggregated_as_the_fitness_is(aggregate):
    options = {"trials": 3, "seed": 0, "aggregate": aggregate, "objectives": ALL}
    noise = [Jakobi(1.0), MeasurementNoise(0.5)]
    evaluation = evaluate(DESIGNS[:2], SHORT, perturbations=noise, **options)
    each, values = evaluation.objectives_of_trials, evaluation.objectives
    assert each.shape == (2, 3, 7)
    assert each[..., 0].tobytes() == evaluation.fitness.tobytes()  # with its measurement
    assert values[:, 0].tobytes() == evaluation.value.tobytes()
    expected = each.mean(axis=1) if aggregate == "mean" else each.min(axis=1)
    np.testing.assert_allclose(values, expected, rtol=1e-15)
    assert (np.ptp(each[..., 3:], axis=1) > 0).all()
    alike = evaluate(DESIGNS[:2], SHORT, **options)
    assert alike.objectives_of_trials.shape == (2, 3, 7)
    assert (np.ptp(alike.objectives_of_trials, axis=1) == 0).all()


@pytest.mark.parametrize(
    ("names", "error", "message"),
    [
        (("displacment",), ValueError, "no objective 'displacment'; did you mean displacement?"),
        (("energy", "voxels", "energy"), ValueError, "energy twice"),
        ((), ValueError, "must name at least one; there are displacement, voxels"),
        ("energy", TypeError, r"a sequence of names, such as \(\"displacement\", \"voxels\"\)"),
        (3, TypeError, "a sequence of names"),
        ((["energy"],), ValueError, r"no objective \['energy'\]"),
    ],
)
def test_other_names_are_refused_with_a_hint(names, error, message):
    with pytest.raises(error, match=message):
        evaluate(1, objectives=names)
