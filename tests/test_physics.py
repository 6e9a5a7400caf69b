"""Physics holds every parameter, checks it, and knows the presets."""

import copy
import json
import pickle
import re
import warnings
from dataclasses import FrozenInstanceError, replace
from pathlib import Path

import numpy as np
import pytest
from cffi import FFI

from softvox_gym import Physics, engine, simulate
from softvox_gym.physics import SPECS, ParameterError

ROOT = Path(__file__).parent.parent
NUMBERS = [s.name for s in SPECS if isinstance(s.default, float) and s.name != "gravity"]


def table():
    """Return the table of parameters in docs/physics.md."""
    rows = [("parameter", "unit", "paper", "published", "values", "")]
    rows += [("---",) * len(rows[0])]
    for spec in SPECS:
        published = "" if spec.published == spec.default else f"{spec.published}"
        values = spec.bounds.words + (", per design" if spec.per_design else "")
        row = (f"`{spec.name}`", spec.unit, f"{spec.default}", published, values, spec.about)
        rows.append(row)
    return "\n".join(f"| {' | '.join(row)} |".replace("|  |", "| |") for row in rows)


def test_the_page_on_the_physics_lists_the_parameters():
    assert table() in (ROOT / "docs" / "physics.md").read_text(encoding="utf-8")


def test_the_docstring_lists_the_parameters():
    for spec in SPECS:
        assert f"\n    {spec.name} : " in Physics.__doc__
        assert spec.about in Physics.__doc__


def swapped(one, other):
    """Return the struct of parameters with two fields in each other's place, as a cffi type."""
    header = (ROOT / "csrc" / "include" / "softvox.h").read_text(encoding="utf-8")
    struct = re.search(r"typedef struct \{[^}]*\} sv_parameters;", header)[0]
    names = {one: other, other: one}
    ffi = FFI()
    ffi.cdef(re.sub(rf"\b({one}|{other})\b(?=[;\[])", lambda name: names[name[0]], struct))
    return ffi, ffi.typeof("sv_parameters")


@pytest.mark.parametrize(
    ("one", "other"), [("density", "friction_static"), ("duration", "duration")]
)
def test_the_layout_follows_the_names_of_the_engines_fields_not_their_order(one, other):
    ffi, struct = swapped(one, other)
    rows = np.zeros(2, engine.layout(struct))
    assert rows.dtype.itemsize == ffi.sizeof(struct)
    for i, name in enumerate(engine.PARAMETERS.names):
        rows[name] = i + 1
    read = ffi.cast("sv_parameters *", rows.ctypes.data)[1]
    for i, name in enumerate(engine.PARAMETERS.names):
        value = getattr(read, name)
        assert (list(value) if name == "gravity" else [value] * 3) == [i + 1] * 3
    assert (engine.layout(struct) == engine.PARAMETERS) is (one == other)


def test_the_presets_hold_the_papers_and_the_published_runs_values():
    exact, published = Physics.exact(), Physics.published()
    assert exact == Physics()
    assert exact.strain == 1.9 ** (1 / 3) - 1
    assert (exact.frequency_hz, exact.time_step_fraction) == (4.0, 0.9)
    assert published.time_step == pytest.approx(0.0004529629166670976, rel=1e-15)
    differing = {s.name for s in SPECS if getattr(exact, s.name) != getattr(published, s.name)}
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
        (
            {"damping_link": 2.5},
            "damping_link 2.5 makes the time step unstable .*; one of 0.406 would",
        ),
        ({"damping_link": [1.0, 3.0]}, "damping_link 3 makes the time step unstable"),
        ({"damping_ground": 6.0}, "damping_ground 6 makes the time step unstable"),
        ({"damping_global": 0.15}, "damping_global 0.15 makes the time step unstable"),
        ({"poisson_ratio": -0.999}, "poisson_ratio -0.999 makes the time step unstable"),
        ({"damping_link": 1e308}, "damping_link 1e\\+308 makes the time step unstable"),
        ({"damping_ground": 1e308}, "damping_ground 1e\\+308 makes the time step unstable"),
        ({"duration": 0.25}, "duration must be longer than settle_time"),
        ({"duration": [4.0, 0.1]}, "duration must be longer than settle_time"),
        ({"actuation": "pump"}, "actuation must be one of hold, clamp, expand_and_contract"),
        ({"actuation": np.array(["hold", "clamp"])}, "actuation must be one of hold, clamp"),
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


def test_an_error_carries_its_parameter():
    with pytest.raises(ParameterError) as caught:
        Physics(density=-1)
    again = pickle.loads(pickle.dumps(caught.value))
    assert (again.parameter, again.reason) == ("density", "must be positive and finite, got -1.0")
    assert str(again) == f"{again.parameter} {again.reason}"


def test_copies_cannot_be_written_to_either():
    physics = Physics(density=[1e6, 2e6])
    for other in (copy.copy(physics), copy.deepcopy(physics), pickle.loads(pickle.dumps(physics))):
        assert other == physics
        assert not other.density.flags.writeable


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


def refused(**changes):
    """Return the error of a physics that is unstable, or None."""
    try:
        Physics(**changes)
    except ParameterError as error:
        return error
    return None


def test_a_refused_step_is_told_with_one_that_would_do():
    rng = np.random.default_rng(1)
    names = ("damping_link", "damping_ground", "damping_global")
    for _ in range(200):
        changes = dict(zip(names, np.exp(rng.uniform(-3, [3, 3, -1])).tolist(), strict=True))
        changes["poisson_ratio"] = rng.uniform(-0.99, 0.5)
        if error := refused(**changes):
            least = float(re.search(r"one of (\S+) would do", str(error)).group(1))
            assert least < 0.9
            assert refused(**changes, time_step_fraction=least) is None
            assert error.parameter in changes


def test_damping_is_refused_where_the_lattice_that_alternates_swings_up():
    # Voxels that alternate in all three directions: v' = v - dt (12 zeta + 12 x + 2 zeta_global v)
    # in units of omega_0, in air; its roots by hand, and the bound on both sides of 1.
    step = 0.9 / (2 * np.pi)
    for damping, unstable in ((1.08, False), (1.1, True)):
        rate = 12 * damping + 2 * 0.01
        matrix = np.array(
            [[1 - 12 * step**2, step * (1 - rate * step)], [-12 * step, 1 - rate * step]]
        )
        assert (np.abs(np.linalg.eigvals(matrix)).max() > 1) == unstable
        assert (refused(damping_link=damping, damping_ground=0.0) is not None) == unstable


def unrest(**changes):
    """Return how far a voxel of a kicked 5 x 5 x 5 block moves in a step at the end, in widths."""
    physics = Physics(
        **changes, frequency_hz=40.0, strain=0.01, settle_time=0.025, duration=1.0, gravity=-1.0
    )
    kick = np.zeros((1, 2, 5, 5, 5))
    kick[0, 0] = np.where(np.indices((5, 5, 5)).sum(axis=0) % 2, 0.01, -0.005)
    block = np.full((1, 5, 5, 5), 2)
    frames = simulate(block, physics, strain=kick, frames=1).frames
    moved = np.abs(np.diff(frames.position[0], axis=0))
    return np.nanmax(moved[-100:]) / physics.edge


@pytest.mark.parametrize(
    "changes",
    [
        {"damping_link": 1.085},
        {"damping_ground": 1.85},
        {"damping_link": 0.3, "damping_ground": 5.0},
        {"damping_link": 2.2, "damping_ground": 0.5, "time_step_fraction": 0.45},
        {"damping_link": 0.1, "damping_global": 0.14},
    ],
)
def test_what_is_accepted_calms_a_block_and_half_as_much_more_stirs_it(changes, monkeypatch):
    # Widths per step: what is still settling after a second, and a swing that no longer grows
    # because links leave their linear regime; both by orders of magnitude.
    assert unrest(**changes) < 1e-7
    monkeypatch.setattr("softvox_gym.physics._load", lambda **_: np.zeros(()))
    more = {k: v if k == "time_step_fraction" else 1.5 * v for k, v in changes.items()}
    assert not unrest(**more) < 1e-4


def test_too_few_steps_a_cycle_are_told_of():
    message = (
        r"frequency_hz \(60\) leaves 36.8 steps a cycle, .*; time_step_fraction 0.662 would do"
    )
    with pytest.warns(UserWarning, match=message) as caught:
        Physics(frequency_hz=60.0)
    assert [warning.filename for warning in caught] == [__file__]
    with pytest.warns(UserWarning, match="steps a cycle"):
        Physics(frequency_hz=[4.0, 60.0])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        Physics(frequency_hz=60.0, time_step_fraction=0.662)
        Physics.published()


@pytest.mark.parametrize("name", [spec.name for spec in SPECS if spec.per_design])
def test_parameters_may_be_arrays_of_no_design(name):
    physics = replace(Physics.published(), **{name: []})
    assert len(simulate([], physics)) == physics.n_designs == 0


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
