"""Physics holds every parameter, checks it, and knows the presets."""

import json
import pickle
import warnings
from dataclasses import FrozenInstanceError, fields, replace

import numpy as np
import pytest

from softvox_gym import Physics, simulate

NUMBERS = [
    f.name
    for f in fields(Physics)
    if f.metadata["bounds"] not in ("actuation", "flag") and f.name != "gravity"
]


def test_the_presets_hold_the_papers_and_the_published_runs_values():
    exact, published = Physics.exact(), Physics.published()
    assert exact == Physics()
    assert exact.strain == 1.9 ** (1 / 3) - 1
    assert (exact.frequency_hz, exact.time_step_fraction) == (4.0, 0.9)
    assert published.time_step == pytest.approx(0.0004529629166670976, rel=1e-15)
    differing = {
        f.name for f in fields(Physics) if getattr(exact, f.name) != getattr(published, f.name)
    }
    assert differing == {"strain", "frequency_hz", "time_step_fraction", "single_precision_rest"}


def test_only_the_published_run_rounds_the_edge_that_voxels_swing_about():
    assert Physics.exact().pumped_rest == 0.01
    assert Physics.published().pumped_rest == float(np.float32(0.01))


def test_clamping_gives_the_best_design_what_the_papers_text_would():
    physics = replace(Physics.published(), actuation="clamp")
    assert f"{simulate(6453, physics).fitness[0]:.2f}" == "4.71"


def test_physics_is_made_of_a_name_a_dict_or_itself():
    assert Physics.of("published") == Physics.published()
    assert Physics.of({"density": 2e6}) == Physics(density=2e6)
    assert Physics.of({"preset": "published", "density": 2e6}) == replace(
        Physics.published(), density=2e6
    )
    assert Physics.of(Physics.exact()) is not None


def test_a_dict_of_all_parameters_goes_through_json_and_back():
    physics = replace(Physics.published(), gravity=(0.1, 0.2, -9.0), actuation="clamp")
    assert Physics.of(json.loads(json.dumps(physics.to_dict()))) == physics


@pytest.mark.parametrize("name", NUMBERS)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -1.0])
def test_a_number_that_makes_no_sense_is_refused_by_name(name, value):
    with pytest.raises(ValueError, match=f"{name} must be"):
        Physics(**{name: value})


@pytest.mark.parametrize("name", [*NUMBERS, "gravity"])
@pytest.mark.parametrize("value", ["a", None, True, 1j, [[1.0]], [[1.0], [1.0, 2.0]]])
def test_what_is_no_number_is_refused_by_name(name, value):
    with pytest.raises((TypeError, ValueError), match=f"{name} must be"):
        Physics(**{name: value})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"edge": 0}, "edge must be positive"),
        ({"edge": [0.01, 0.02]}, "edge must be one number for the whole batch"),
        ({"settle_time": [0.1, 0.2]}, "settle_time must be one number"),
        ({"poisson_ratio": 0.6}, "poisson_ratio must be above -1 and at most 0.5"),
        ({"time_step_fraction": 1.1}, "time step is unstable"),
        ({"time_step_fraction": 0.0}, "time_step_fraction"),
        ({"duration": 0.25}, "duration must be longer than settle_time"),
        ({"duration": [4.0, 0.1]}, "duration must be longer than settle_time"),
        ({"actuation": "pump"}, "actuation must be one of hold, clamp, expand_and_contract"),
        ({"actuation": "expand_and_contract", "strain": 1.0}, "strain must be below 1"),
        ({"gravity": np.nan}, "gravity must be finite"),
        ({"duration": 1e9}, "duration of 1e\\+09 s in time steps of 0.000453 s can't be counted"),
        ({"frequency_hz": 1e5}, "frequency_hz must be at most half the steps per second"),
        ({"frequency_hz": 1.7e308}, "frequency_hz must be at most half"),
        ({"edge": 1e300}, "can't be counted"),
        ({"edge": 1e-300}, "can't be counted"),
        ({"density": [1e6, 1e-300]}, "can't be counted"),
        ({"gravity": [[0.0, 1.0]]}, "gravity must be"),
        ({"density": [1e6, -1e6]}, "density must be positive and finite, got -1000000"),
        ({"density": [1e6] * 2, "strain": [0.1] * 3}, "arrays of one length"),
        ({"density": np.ones((2, 2))}, r"density must be a number or a row.*\(2, 2\)"),
    ],
)
def test_a_bad_value_is_refused_with_its_reason(changes, message):
    with pytest.raises(ValueError, match=message):
        Physics(**changes)


def test_a_flag_must_be_a_truth():
    with pytest.raises(TypeError, match="single_precision_rest must be True or False"):
        Physics(single_precision_rest=1)


@pytest.mark.parametrize(
    ("given", "error", "message"),
    [
        ("publishd", ValueError, "'publishd' is unknown; the presets are published, exact"),
        ("of", ValueError, "presets are"),
        ({"densty": 1}, ValueError, "no parameter 'densty'; the parameters are edge"),
        ({"preset": "x"}, ValueError, "presets are"),
        (3, TypeError, "a preset's name, a dict of fields or a Physics"),
    ],
)
def test_what_is_no_physics_is_refused_with_its_reason(given, error, message):
    with pytest.raises(error, match=message):
        Physics.of(given)


def test_kinetic_above_static_friction_is_allowed_with_a_warning():
    with pytest.warns(UserWarning, match=r"friction_kinetic \(0.9\) is above friction_static"):
        physics = Physics(friction_static=0.5, friction_kinetic=0.9)
    assert physics.friction_kinetic == 0.9
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Physics(friction_static=0.5, friction_kinetic=0.5)


def test_gravity_is_a_number_a_vector_or_one_of_either_per_design():
    assert list(Physics(gravity=-1.6).gravity_vector) == [0, 0, -1.6]
    assert list(Physics(gravity=(1, 2, 3)).gravity_vector) == [1, 2, 3]
    assert Physics(gravity=(1, 2, 3)).n_designs is None
    np.testing.assert_array_equal(
        Physics(gravity=[-1.0, -2.0]).gravity_vector, [[0, 0, -1], [0, 0, -2]]
    )
    assert Physics(gravity=np.ones((5, 3))).n_designs == 5


def test_three_numbers_of_gravity_are_one_vector_for_any_batch():
    sideways = Physics(gravity=[-9.81] * 3)
    assert sideways.n_designs is None
    np.testing.assert_array_equal(sideways.gravity_vector, [-9.81] * 3)
    down = Physics(gravity=np.multiply.outer([1.0, 1.0, 1.0], [0, 0, -9.81]))
    expected = simulate([7] * 3, Physics()).displacement
    np.testing.assert_array_equal(simulate([7] * 3, down).displacement, expected)


def test_arrays_are_copied_and_locked():
    densities = np.array([1e6, 2e6])
    physics = Physics(density=densities)
    densities[0] = 3e6
    assert list(physics.density) == [1e6, 2e6]
    with pytest.raises(ValueError, match="read-only"):
        physics.density[0] = 1.0
    with pytest.raises(FrozenInstanceError):
        physics.edge = 1.0


def test_physics_is_a_value():
    one, other = (Physics(density=[1e6, 2e6], gravity=(0, 0, -1)) for _ in range(2))
    assert one == other
    assert hash(one) == hash(other)
    assert one != Physics(density=[1e6, 3e6], gravity=(0, 0, -1))
    assert one != Physics()
    zero, minus_zero = Physics(gravity=(0.0, 0.0, -1.0)), Physics(gravity=(-0.0, 0.0, -1.0))
    assert zero == minus_zero
    assert hash(zero) == hash(minus_zero)
    assert pickle.loads(pickle.dumps(one)) == one


def test_the_duration_may_be_given_in_cycles():
    physics = Physics.exact().lasting(cycles=23)
    assert physics.duration == 6.0
    assert physics.cycles == 23
    with pytest.raises(ValueError, match="cycles must be a positive number"):
        physics.lasting(cycles=0)


def test_the_time_step_follows_stiffness_and_mass():
    base = Physics()
    assert replace(base, youngs_modulus=4e7).time_step == pytest.approx(base.time_step / 2)
    assert replace(base, density=4e6).time_step == pytest.approx(base.time_step * 2)
    steps = replace(base, density=[1e6, 4e6]).time_step
    assert steps == pytest.approx([base.time_step, base.time_step * 2])
