"""The single environment keeps Gymnasium's contract and says what the engine says."""

import json
import pickle
import warnings
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.utils.env_match import check_environments_match

import softvox_gym
from softvox_gym import Design, Physics, simulate
from softvox_gym.envs.single import SoftVoxEnv

BEST = np.array([0, 0, 0, 2, 1, 2, 2, 2])
# Edges of 151 resting lengths tear every link.
DIVERGENT = {"preset": "published", "strain": 150.0}

IDS = ["SoftVox-v0", softvox_gym.ENV_ID, "SoftVox3x3x3-v0", "SoftVox4x4x4-v0"]
IDS += ["SoftVoxPhased2x2x2-v0"]


def make(**options):
    return gym.make(softvox_gym.ENV_ID, **options)


@pytest.mark.parametrize("render_mode", [None, "rgb_array"])
@pytest.mark.parametrize("name", IDS)
def test_the_environment_checker_finds_nothing_but_the_unbounded_box(name, render_mode):
    env = gym.make(name, disable_env_checker=True, render_mode=render_mode)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(env.unwrapped)
    assert all("infinity" in str(warning.message) for warning in caught)


def test_the_environment_can_be_made_with_the_module_before_its_name():
    assert gym.make("softvox_gym:SoftVox2x2x2-v0").spec.id == softvox_gym.ENV_ID


def test_one_step_simulates_the_design_and_ends_the_episode():
    env = make()
    observation, info = env.reset(seed=0)
    assert observation.shape == (16, 3)
    assert not observation.any()
    assert info == {}
    observation, reward, terminated, truncated, info = env.step(BEST)
    result = simulate(6453, track=1)
    assert terminated is True
    assert truncated is False
    assert reward == result.fitness[0] == info["fitness"]
    np.testing.assert_array_equal(observation, result.track[0])
    np.testing.assert_array_equal(info.pop("displacement"), result.displacement[0])
    assert info == {
        "design": 6453,
        "fitness": reward,
        "diverged": False,
        "n_voxels": 5,
        "is_connected": True,
        "steps": result.steps[0],
    }


def test_two_environments_with_one_seed_roll_out_alike():
    first, second = make(), make()
    first.action_space.seed(3)
    check_environments_match(first, second, num_steps=20, seed=3)


def test_two_rendering_environments_match_in_their_pictures():
    check_environments_match(make(render_mode="rgb_array"), make(render_mode="rgb_array"), 3)


def test_the_seed_reaches_the_environments_generator():
    env = make()
    env.reset(seed=42)
    assert env.unwrapped.np_random_seed == 42
    first = env.unwrapped.np_random.random()
    env.reset(seed=42)
    assert env.unwrapped.np_random.random() == first


def test_the_environment_survives_pickling():
    env = make(physics="exact")
    copy = pickle.loads(pickle.dumps(env))
    assert data_equivalence(env.reset(seed=1), copy.reset(seed=1))
    assert data_equivalence(env.step(BEST), copy.step(BEST))


@pytest.mark.parametrize("physics", ["exact", {"preset": "published", "friction_static": 0.7}])
def test_the_spec_survives_json_and_makes_the_same_environment(physics):
    env = make(physics=physics)
    spec = EnvSpec.from_json(env.spec.to_json())
    again = gym.make(spec)
    assert again.unwrapped.physics == env.unwrapped.physics
    check_environments_match(env, again, num_steps=3)
    assert json.loads(env.spec.to_json())["kwargs"]["physics"] == physics


@pytest.mark.parametrize("name", [*IDS, "SoftVoxControl-v0"])
def test_every_registered_spec_survives_json(name):
    spec = gym.spec(name)
    assert EnvSpec.from_json(spec.to_json()) == spec
    assert gym.make(EnvSpec.from_json(spec.to_json())).spec.kwargs == gym.make(name).spec.kwargs


@pytest.mark.parametrize("shape", [(3, 3, 3), (1, 1, 1), (6, 1, 2)])
def test_any_lattice_is_an_environment(shape):
    env = gym.make("SoftVox-v0", shape=shape, physics={"duration": 0.6})
    again = gym.make(EnvSpec.from_json(env.spec.to_json()))
    env.reset(seed=1)
    env.action_space.seed(0)
    action = env.action_space.sample()
    _, reward, _, _, info = env.step(action)
    design = Design(action, shape=shape)
    assert reward == simulate(design, Physics(duration=0.6)).fitness[0]
    assert (info["design"], info["n_voxels"]) == (design.index, design.n_voxels)
    assert info["is_connected"] is design.is_connected
    check_environments_match(env, again, num_steps=2)


def test_a_design_beyond_int64_is_told_by_its_digits():
    env = gym.make("SoftVox4x4x4-v0", physics={"duration": 0.3})
    env.reset(seed=1)
    env.action_space.seed(0)
    action = env.action_space.sample()
    info = env.step(action)[4]
    assert "design" not in info
    np.testing.assert_array_equal(info["digits"], action)


def test_a_shape_that_is_no_lattice_is_refused():
    with pytest.raises(ValueError, match="at most 1000000"):
        gym.make("SoftVox-v0", shape=(10**6,) * 3)


def test_no_info_holds_text():
    """Tensors are made of infos, by Gymnasium's NumpyToTorch and others: all must be numbers."""
    for env in (make(), gym.make_vec(softvox_gym.ENV_ID, num_envs=2)):
        env.reset()
        for value in env.step(env.action_space.sample())[4].values():
            assert np.asarray(value).dtype.kind in "biuf"


def test_the_physics_may_be_a_name_a_dict_or_a_physics():
    assert make().unwrapped.physics == Physics.published()
    assert make(physics="exact").unwrapped.physics == Physics.exact()
    assert make(physics={"friction_static": 0.9}).unwrapped.physics == Physics(friction_static=0.9)
    own = replace(Physics.published(), gravity=(1.0, 0.0, -9.0))
    assert make(physics=own).unwrapped.physics == own


@pytest.mark.parametrize(
    ("physics", "message"),
    [
        ("publishd", "presets are published, exact"),
        ({"frction": 1}, "no parameter 'frction'"),
        ({"friction_static": [0.5, 0.6], "friction_kinetic": 0.1}, "single numbers"),
        ({"density": -1.0}, "density must be positive"),
    ],
)
def test_a_bad_physics_is_refused_with_its_reason(physics, message):
    with pytest.raises(ValueError, match=message):
        make(physics=physics)


def test_the_observation_has_one_sample_per_cycle_of_the_physics():
    env = make(physics={"frequency_hz": 2.0, "duration": 2.25})
    assert env.observation_space.shape == (5, 3)
    env.reset()
    observation, *_ = env.step(BEST)
    assert observation.shape == (5, 3)
    assert np.isfinite(observation).all()


def test_a_design_that_diverges_is_worth_nothing_and_says_so():
    env = make(physics=DIVERGENT)
    env.reset()
    observation, reward, terminated, _, info = env.step(np.full(8, 2))
    assert reward == 0.0
    assert terminated is True
    assert info["diverged"] is True
    assert np.isnan(info["fitness"])
    assert observation in env.observation_space
    assert not observation.any()


def test_the_empty_design_is_worth_nothing():
    env = make(render_mode="rgb_array")
    env.reset()
    empty_floor = env.render()
    observation, reward, _, _, info = env.step(np.zeros(8, dtype=int))
    assert (reward, info["n_voxels"], info["is_connected"]) == (0.0, 0, False)
    assert not observation.any()
    np.testing.assert_array_equal(env.render(), empty_floor)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.full(8, 3), "digits 0, 1 and 2"),
        (np.full(8, -1), "digits 0, 1 and 2"),
        (np.zeros(7, dtype=int), "one per site"),
        (np.zeros(8), "whole numbers"),
        (6453, "one per site"),
    ],
)
def test_an_action_outside_the_space_is_refused(action, message):
    env = make(disable_env_checker=True)
    env.reset()
    with pytest.raises(ValueError, match=message):
        env.step(action)


def test_the_picture_shows_the_deformed_robot():
    env = make(render_mode="rgb_array")
    env.reset()
    empty_floor = env.render()
    env.step(BEST)
    picture = env.render()
    assert picture.dtype == np.uint8
    assert picture.ndim == 3
    assert picture.shape[2] == 3
    assert (picture != empty_floor).any(axis=2).mean() > 0.02
    env.reset()
    np.testing.assert_array_equal(env.render(), empty_floor)


@pytest.mark.parametrize("mode", [None, "rgb_array"])
def test_steps_that_nobody_will_ask_for_are_not_kept(mode):
    env = make(render_mode=mode, physics=DIVERGENT)
    env.reset()
    for _ in range(3):
        env.step(BEST)
    assert len(env.unwrapped._seen) == 1


def test_a_diverged_robot_is_shown_as_built():
    env = make(physics=DIVERGENT, render_mode="rgb_array")
    env.reset()
    empty_floor = env.render()
    env.step(np.full(8, 2))
    assert (env.render() != empty_floor).any()


def test_an_unknown_render_mode_is_refused():
    with pytest.raises(ValueError, match="rgb_array"):
        SoftVoxEnv(render_mode="ascii")


def test_rendering_without_a_mode_warns_and_gives_nothing():
    env = make(disable_env_checker=True)
    env.reset()
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.unwrapped.render() is None
