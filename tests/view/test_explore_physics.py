"""The physics of the page: what Python says of it, to the same bits."""

import json
from dataclasses import replace

import numpy as np
import pytest
from node import answer, needs_node

from softvox_gym import Physics, realities, simulate
from softvox_gym.noise import tilted
from softvox_gym.physics import ParameterError
from softvox_view import replay
from softvox_view.explore.page import known

pytestmark = needs_node

BATCHES = """const { known, runs } = given;
return runs.map(([designs, changes, options]) => {
  const made = physics.physicsOf(known, changes);
  const told = engine.simulateOn(wasm, physics.batchOf(known, made, designs, options));
  return [physics.displacementsOf(told.facts, made, designs), made];
});"""


def plain(one):
    return json.loads(json.dumps(one.to_dict()))


def test_designs_under_any_physics_move_as_they_do_in_python(tmp_path):
    designs = np.random.default_rng(3).choice(6561, 60, replace=False).tolist()
    short = {"duration": 0.8}
    changes = [
        {},
        *(
            {**short, **change}
            for change in (
                {"edge": 0.0137},
                {"density": 3.3e5, "youngs_modulus": 7.7e6},
                {"time_step_fraction": 0.37, "poisson_ratio": 0.1},
                {"gravity": [0.3, 0.1, -5]},
                {"strain": 1e300},
                {"actuation": "expand_and_contract"},
                {"actuation": "clamp", "single_precision_rest": False},
                {"preset": "exact", "damping_link": 0.8},
            )
        ),
    ]
    given = {"known": known(), "runs": [[[0, *designs], change, {}] for change in changes]}
    told = answer(tmp_path, BATCHES, given)
    for change, (ours, physics) in zip(changes, told, strict=True):
        made = Physics.of({"preset": "published", **change})
        assert physics == plain(made)
        assert ours.tobytes() == simulate([0, *designs], made).displacement.tobytes()


def test_every_preset_is_the_physics_of_its_name(tmp_path):
    data = known()
    worlds = {one.name: one.physics for one in realities().values() if one.is_plain}
    assert {"published", "exact", "reversal", *worlds} == set(data["presets"])
    script = "return Object.keys(given.presets).map((name) => physics.physicsOf(given, name));"
    told = dict(zip(data["presets"], answer(tmp_path, script, data), strict=True))
    assert told["published"] == plain(Physics.published())
    assert told == {name: plain(Physics.of(values)) for name, values in data["presets"].items()}
    assert all(told[name] == plain(physics) for name, physics in worlds.items())


def test_strain_and_phase_are_of_every_site(tmp_path):
    rng = np.random.default_rng(4)
    designs = rng.integers(1, 6561, 20).tolist()
    strain, phase = rng.uniform(0, 0.4, (20, 2, 2, 2)), rng.uniform(0, 1, (20, 2, 2, 2))
    rows = [np.moveaxis(a, (1, 2, 3), (3, 2, 1)).ravel().tolist() for a in (strain, phase)]
    options = dict(zip(("strain", "phase"), rows, strict=True))
    ((ours, _),) = answer(
        tmp_path, BATCHES, {"known": known(), "runs": [[designs, {"duration": 0.8}, options]]}
    )
    physics = replace(Physics.published(), duration=0.8)
    native = simulate(designs, physics, strain=strain, phase=phase)
    assert ours.tobytes() == native.displacement.tobytes()


def test_the_time_step_has_the_bits_of_python_for_any_edge(tmp_path):
    rng = np.random.default_rng(5)
    names = ("edge", "youngs_modulus", "density", "time_step_fraction")
    values = np.exp(
        rng.uniform(np.log([1e-3, 1e4, 1e2, 0.1]), np.log([1, 1e9, 1e7, 0.9]), (2000, 4))
    )
    rows = [dict(zip(names, row, strict=True)) for row in values.tolist()]
    told = answer(tmp_path, "return Float64Array.from(given, physics.timeStep);", rows)
    physics = replace(Physics.published(), frequency_hz=1e-9, duration=1.0)
    assert told.tolist() == [replace(physics, **row).time_step for row in rows]


@pytest.mark.parametrize(("tilt", "downhill"), [(0, 40), (30, 90), (80, -175), (-3, 360)])
def test_a_tilted_floor_is_a_tilted_gravity(tmp_path, tilt, downhill):
    given = [[0, 0, -9.81], tilt, downhill]
    told = answer(tmp_path, "return Float64Array.from(physics.tilted(...given));", given)
    angles = np.radians([tilt, downhill])
    towards = np.array([[np.cos(angles[1])], [np.sin(angles[1])]])
    expected = tilted(np.array([given[0]]), angles[:1], towards)[0]
    np.testing.assert_allclose(told, expected, atol=1e-11)
    if not tilt:
        assert told.tolist() == given[0]


REFUSED = [
    {"friction_static": -1},
    {"friction_static": "1"},
    {"frequency_hz": 0},
    {"frequency_hz": 1e9},
    {"strain": -2},
    {"strain": 1, "actuation": "expand_and_contract"},
    {"poisson_ratio": 0.6},
    {"poisson_ratio": -1},
    {"time_step_fraction": 0},
    {"time_step_fraction": 1.5},
    {"damping_link": 30.0},
    {"damping_ground": 1e3},
    {"damping_global": 3.0},
    {"actuation": "wiggle"},
    {"single_precision_rest": 1},
    {"duration": 0.25},
    {"duration": 1e9},
]


def test_what_python_refuses_is_refused_naming_the_same_parameter(tmp_path):
    script = """const said = (changes) => {
      try { physics.physicsOf(given.known, changes); } catch (error) { return error.parameter; }
    };
    return given.changes.map(said);"""
    told = answer(tmp_path, script, {"known": known(), "changes": [*REFUSED, {"mass": 1}, {}]})
    for changes, name in zip(REFUSED, told, strict=False):
        with pytest.raises((ParameterError, TypeError)) as refused:
            Physics.of({"preset": "published", **changes})
        assert name == getattr(refused.value, "parameter", str(refused.value).split()[0]), changes
    assert told[len(REFUSED) :] == ["mass", None]


def test_what_is_rarely_meant_is_noted_as_python_warns(tmp_path):
    script = """const notes = [];
    physics.physicsOf(given.known, given.changes, notes);
    return notes;"""
    changes = {"friction_kinetic": 2.0, "frequency_hz": 100}
    notes = answer(tmp_path, script, {"known": known(), "changes": changes})
    with pytest.warns(UserWarning, match="^fr") as warned:
        Physics.of({"preset": "published", **changes})
    assert len(notes) == len(warned) == 2
    for ours, theirs in zip(notes, warned, strict=True):
        assert ours.split(" (")[0] == str(theirs.message).split(" (")[0]


@pytest.mark.parametrize("changes", [{}, {"strain": 1e3}, {"edge": 0.02, "duration": 1.0}])
def test_a_recording_is_what_python_records(tmp_path, changes):
    designs = [6453, 0, 13, 6560]
    script = """const made = physics.physicsOf(given.known, given.changes);
    const batch = physics.batchOf(given.known, made, given.designs, { frames: 37 });
    const told = engine.simulateOn(wasm, batch);
    return recording.recordingOf(told, made, given.designs, 37, given.known.style);"""
    told = answer(tmp_path, script, {"known": known(), "changes": changes, "designs": designs})
    physics = Physics.of({"preset": "published", **changes})
    made = replay.recording(simulate(designs, physics, frames=37))
    assert told == json.loads(json.dumps(made))
