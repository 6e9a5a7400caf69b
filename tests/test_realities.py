"""Realities are other physics of the same engine, said by name, by hand or by a seed."""

import json
import pickle
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

import softvox_gym
from softvox_gym import Design, Physics, Reality, Task, evaluate, realities, reality, simulate
from softvox_gym.design import refined
from softvox_gym.noise import Jakobi
from softvox_gym.realities import SETS

DESIGNS = [6453, 4295, 926, 2117]
BRIEF = Physics.published().lasting(2)


@pytest.mark.parametrize("name", realities())
def test_a_named_reality_says_what_it_is(name):
    one = reality(name)
    assert one.name == name
    assert one.about
    assert one.source
    assert json.loads(json.dumps(one.to_dict()))["physics"] == one.physics.to_dict()
    assert hash(one) == hash(replace(one))


def test_a_reality_is_a_value_whatever_kind_of_number_makes_it():
    more = {"phase": np.full((2, 1, 1), 0.25), "strain_error": np.float32(0.25)}
    one = Reality("mine", BRIEF, seed=np.int64(3), resolution=np.uint8(1), **more)
    again = Reality("mine", BRIEF, strain_error=0.25, phase=[[[0.25]], [[0.25]]], seed=3)
    for other in (again, pickle.loads(pickle.dumps(one))):
        assert other == one
        assert hash(other) == hash(one)
    assert json.loads(json.dumps(one.to_dict())) == json.loads(json.dumps(again.to_dict()))


def test_the_name_of_a_reality_is_no_physics():
    for what in (softvox_gym.landscape, lambda name: evaluate(6453, name)):
        with pytest.raises(
            ValueError, match=r"soft is a reality, not a physics; give reality\('soft'\)"
        ):
            what("soft")


def test_what_is_no_name_is_the_name_of_no_reality():
    with pytest.raises(ValueError, match="no reality"):
        reality(["soft"])


def test_a_plain_reality_is_the_simulation_of_its_physics():
    one = Reality("mine", {"youngs_modulus": 3e6})
    assert one.is_plain
    wanted = simulate(DESIGNS, Physics.of({"youngs_modulus": 3e6}))
    assert one.simulate(DESIGNS).displacement.tobytes() == wanted.displacement.tobytes()


def test_errors_of_fabrication_are_a_designs_own_and_the_same_each_time():
    one = Reality("mine", BRIEF, strain_error=0.2, seed=7)
    together = one.simulate(DESIGNS).displacement
    alone = [one.simulate(design).displacement[0] for design in DESIGNS]
    assert together.tobytes() == np.array(alone).tobytes()
    assert together.tobytes() != simulate(DESIGNS, BRIEF).displacement.tobytes()
    assert together.tobytes() != replace(one, seed=8).simulate(DESIGNS).displacement.tobytes()
    factors = np.array(
        [one.trials(Design(i).array).strain[0, 0] / BRIEF.strain for i in range(1, 6561, 20)]
    )
    assert factors.mean() == pytest.approx(1, abs=0.02)
    assert factors.std() == pytest.approx(0.2, abs=0.02)
    assert factors.min() >= 0


def test_phases_reach_the_engine_and_must_fit_the_lattice():
    phase = np.array([0, 0.25]).reshape(2, 1, 1)
    one = Reality("mine", BRIEF, phase=phase)
    wanted = simulate(DESIGNS, BRIEF, phase=np.broadcast_to(phase, (4, 2, 2, 2)))
    assert one.simulate(DESIGNS).displacement.tobytes() == wanted.displacement.tobytes()
    with pytest.raises(ValueError, match=r"shape \(2, 1, 1\), which don't fit a 3x3x3 lattice"):
        one.simulate(Design(5, shape=(3, 3, 3)))
    with pytest.raises(ValueError, match="don't fit a 3x3x3 lattice"):
        gym.make("SoftVox3x3x3-v0", reality="lag")


def test_a_finer_resolution_is_the_refined_robot_in_widths_of_its_voxels():
    physics = replace(Physics.published().lasting(1), strain=1.0)
    one = Reality("fine", physics, resolution=3)
    fine = simulate(Design(2117).refined(3), replace(physics, edge=physics.edge / 3), track=1)
    found = one.simulate(2117, track=1)
    assert found.displacement.tobytes() == (fine.displacement / 3).tobytes()
    assert found.track.tobytes() == (fine.track / 3).tobytes()
    assert evaluate(2117, one).fitness[0, 0] == found.fitness[0]


def test_a_refined_voxel_expands_from_its_middle_or_as_a_whole():
    array = np.array([[[2, 1]], [[0, 2]]], dtype=np.uint8)
    spherical, uniform = refined(array, 3), refined(array, 3, expansion="uniform")
    assert spherical.shape == uniform.shape == (6, 3, 6)
    assert np.argwhere(spherical == 2).tolist() == [[1, 1, 1], [4, 1, 4]]
    assert (spherical > 0).sum() == (uniform > 0).sum() == 3 * 27
    assert (uniform == 2).sum() == 2 * 27
    assert Design(6453).refined(1) == Design(6453)


@pytest.mark.parametrize(
    ("factor", "options", "error", "message"),
    [
        (2, {}, ValueError, "factor must be odd if expansion is spherical"),
        (0, {}, ValueError, "factor must be a positive whole number"),
        (1.5, {}, TypeError, "factor must be a whole number"),
        (3, {"expansion": "radial"}, ValueError, "expansion must be one of spherical, uniform"),
        (101, {}, ValueError, "sites; at most 1000000 are allowed"),
    ],
)
def test_a_design_that_cant_be_refined_says_why(factor, options, error, message):
    with pytest.raises(error, match=message):
        Design(6453).refined(factor, **options)


def test_a_reality_is_noisy_where_one_asks_for_noise():
    one = Reality("mine", BRIEF, strain_error=0.2)
    noisy = evaluate(DESIGNS, one, perturbations=[Jakobi()], trials=3, seed=1)
    assert all(len(set(row)) == 3 for row in noisy.fitness.tolist())
    still = evaluate(DESIGNS, one, perturbations=[Jakobi(0)], trials=2, seed=1)
    wanted = one.simulate(DESIGNS).fitness
    assert still.fitness.tolist() == [[value] * 2 for value in wanted]


@pytest.mark.parametrize("name", ["fabrication", "reversal"])
def test_an_environment_is_in_the_reality_that_it_names(name):
    options = {"reality": name, "task": "directed", "heading": 90.0}
    env = gym.make(softvox_gym.ENV_ID, **options)
    env.reset(seed=0)
    rewards = [env.step(np.array(list(map(int, Design(i).digits))))[1] for i in DESIGNS]
    expected = reality(name).simulate(DESIGNS).displacement[:, 1]
    assert rewards == expected.tolist()
    assert json.loads(env.spec.to_json())["kwargs"]["reality"] == name
    batch = gym.make_vec(softvox_gym.ENV_ID, num_envs=4, **options)
    batch.reset(seed=0)
    actions = np.array([list(map(int, Design(i).digits)) for i in DESIGNS])
    assert batch.step(actions)[1].tolist() == rewards


def test_a_picture_of_a_finer_robot_has_the_size_of_the_usual_one():
    one = Reality("fine", Physics.published().lasting(0.1), resolution=3)
    pictures = []
    for options in ({}, {"reality": one}):
        env = gym.make(softvox_gym.ENV_ID, render_mode="rgb_array", **options)
        env.reset(seed=0)
        env.step(np.full(8, 1))
        pictures.append(env.render().astype(int))
    assert np.abs(pictures[0] - pictures[1]).mean() < 10


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"reality": "revrsal"}, ValueError, "no reality 'revrsal'; did you mean reversal?"),
        ({"reality": "public-30"}, ValueError, "and public-0 to public-29, test-0 to test-29"),
        ({"reality": "public-03"}, ValueError, "no reality 'public-03'"),
        ({"reality": 3}, TypeError, "reality must be a name or a softvox_gym.Reality"),
        ({"reality": "clamp", "physics": "exact"}, ValueError, "give only one of them"),
        ({"reality": "clamp", "from_table": True}, ValueError, "and no reality"),
        ({"task": "direct"}, ValueError, "no task 'direct'; did you mean directed?"),
        ({"task": "directed", "heading": np.inf}, ValueError, "heading must be finite"),
        ({"task": "directed", "heading": 10**400}, ValueError, "heading must be a number"),
        ({"task": "directed", "heading": "north"}, TypeError, "heading must be a number"),
        ({"heading": 90.0}, ValueError, "the task displacement has no heading"),
    ],
)
def test_an_environment_says_what_is_wrong(options, error, message):
    with pytest.raises(error, match=message):
        gym.make(softvox_gym.ENV_ID, **options)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"name": ""}, TypeError, "name must be a string"),
        ({"physics": "moon"}, ValueError, "presets are published, exact"),
        ({"physics": {"density": [1e6, 2e6]}}, ValueError, "single numbers"),
        ({"nominal": {"gravty": 1}}, ValueError, "no parameter 'gravty'"),
        ({"strain_error": -0.1}, ValueError, "strain_error must be finite and at least 0"),
        ({"nominal": reality("soft")}, TypeError, "a dict of fields or a Physics, got Reality"),
        ({"phase": np.nan}, ValueError, "phase must be finite"),
        ({"phase": "late"}, TypeError, "phase must be a number or an array of numbers"),
        ({"phase": [[0.5], [0.5, 0.1]]}, TypeError, "phase must be a number or an array"),
        ({"phase": np.zeros((1, 1, 1, 1))}, ValueError, "at most three dimensions"),
        ({"resolution": 2}, ValueError, "resolution must be odd"),
        ({"resolution": 1.5}, TypeError, "resolution must be a whole number"),
        ({"expansion": "radial"}, ValueError, "expansion must be one of"),
        ({"seed": -1}, ValueError, "seed must be at least 0"),
    ],
)
def test_a_reality_that_is_none_says_why(options, error, message):
    with pytest.raises(error, match=message):
        Reality(**{"name": "mine", **options})


def test_a_sample_is_its_seeds_and_within_the_prior():
    drawn = [Reality.sample(seed) for seed in SETS["public"]]
    assert drawn[3] == Reality.sample(3)
    assert len({one.physics.strain for one in drawn}) == len(drawn)
    for one in drawn:
        physics = one.physics
        assert 0.05 <= physics.friction_static <= 1.5
        assert 0.4 <= physics.friction_kinetic / physics.friction_static <= 1
        assert physics.shear_ratio == 0 or 0.05 <= physics.shear_ratio <= 1.0001
        assert 0.3 <= physics.youngs_modulus / 1e7 <= 3.0001
        assert 0.15 <= physics.strain <= 0.5
        assert 2 <= physics.frequency_hz <= 5
        assert physics.cycles == pytest.approx(15)
        assert 0 <= one.strain_error <= 0.2
    assert 5 < sum(one.physics.shear_strength > 0 for one in drawn) < 25
    named = reality("public-3")
    assert (named.name, named.to_dict()) == ("public-3", drawn[3].to_dict())
    assert set(SETS["public"]).isdisjoint(SETS["test"])


def test_the_directed_task_is_the_way_along_its_heading():
    moved = np.array([[3.0, 4.0, 1.0], [-1.0, 0.0, 0.0]])
    assert Task().reward(moved).tolist() == [5, 1]
    headings = {0: [3, -1], 90: [4, 0], 180: [-3, 1], 270: [-4, 0], -90: [-4, 0], 360: [3, -1]}
    for heading, worth in headings.items():
        assert Task("directed", heading).reward(moved).tolist() == worth
    turned = Task("directed", 30.0).reward(moved)
    angle = np.radians(30)
    assert turned == pytest.approx(moved[:, :2] @ [np.cos(angle), np.sin(angle)], abs=1e-12)
    assert Task("directed") == Task("directed", 0.0) == Task("directed", -1e-20)
    assert str(Task("directed", 90)) == "directed 90 degrees"
    with pytest.raises(ValueError, match="has no heading"):
        _ = Task().direction
    named = evaluate([6453], task="directed").fitness
    assert named == evaluate([6453], task=Task("directed", 0.0)).fitness
    with pytest.raises(ValueError, match="did you mean directed"):
        evaluate([6453], task="direct")


def test_the_shear_strength_may_be_said_by_its_share_of_the_weight():
    physics = Physics.of({"preset": "published", "shear_ratio": 0.5})
    assert physics.shear_strength == pytest.approx(0.5 * 98_100)
    assert physics.shear_ratio == pytest.approx(0.5)
    assert physics.weight == pytest.approx(9.81)
    light = Physics.of({"density": 1e5, "gravity": [3.0, 0.0, -4.0], "shear_ratio": 2})
    assert light.shear_strength == pytest.approx(2 * 0.1 * 5 / 1e-4)
    assert Physics.of({"gravity": 0.0, "shear_strength": 1.0}).shear_ratio == np.inf
    with pytest.raises(ValueError, match="give only one of them"):
        Physics.of({"shear_strength": 1.0, "shear_ratio": 0.5})
    with pytest.raises(ValueError, match="shear_ratio must be finite and not negative"):
        Physics.of({"shear_ratio": -0.5})
