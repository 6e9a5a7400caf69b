"""A vector environment in SB3VecEnv can't be told from a DummyVecEnv of single environments.

Run by `make docs`, whose environment has Stable-Baselines3.
"""

import doctest
import sys
from importlib import import_module

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.wrappers import TimeLimit

import softvox_gym
from softvox_gym.wrappers import DiscreteAction, JakobiNoise, vector

torch = pytest.importorskip("torch", reason="needs softvox-gym[learn]")
sb3 = pytest.importorskip("stable_baselines3", reason="needs softvox-gym[learn]")

from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor  # noqa: E402

from softvox_gym.sb3 import SB3VecEnv  # noqa: E402

torch.set_num_threads(1)  # the networks are small
SHORT = {"preset": "published", "duration": 0.3}
BEST = [0, 0, 0, 2, 1, 2, 2, 2]


def native(n, name=softvox_gym.ENV_ID, **options):
    return gym.make_vec(name, num_envs=n, autoreset_mode="Disabled", **options)


def both(n, name=softvox_gym.ENV_ID, **options):
    singles = [lambda: gym.make(name, **options)] * n
    return SB3VecEnv(native(n, name, **options)), DummyVecEnv(singles)


def assert_same(ours, theirs, *, steps):
    """Reset and step two environments of one seed side by side."""
    assert ours.seed(5) == theirs.seed(5)
    first, other = ours.reset(), theirs.reset()
    np.testing.assert_array_equal(first, other, strict=True)
    assert data_equivalence(ours.reset_infos, theirs.reset_infos)
    ours.action_space.seed(7)
    for _ in range(steps):
        actions = np.array([ours.action_space.sample() for _ in range(ours.num_envs)])
        for mine, other in zip(ours.step(actions), theirs.step(actions), strict=True):
            assert data_equivalence(mine, other)
        assert data_equivalence(ours.reset_infos, theirs.reset_infos)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        (softvox_gym.ENV_ID, {}),
        ("SoftVox-v0", {"shape": (5, 2, 4), "physics": SHORT}),  # numbers beyond int64
        ("SoftVoxGrow2x2x2-v0", {"connected": True, "from_table": True}),
    ],
)
@pytest.mark.parametrize("n", [1, 3])
def test_it_returns_what_single_environments_return(n, name, options):
    ours, theirs = both(n, name, **options)
    for attribute in ("num_envs", "observation_space", "action_space", "render_mode"):
        assert getattr(ours, attribute) == getattr(theirs, attribute)
    assert_same(ours, theirs, steps=9 if "Grow" in name else 3)


def test_it_returns_what_they_return_within_wrappers():
    def make():
        return JakobiNoise(DiscreteAction(gym.make(softvox_gym.ENV_ID)), level=1.0)

    ours = SB3VecEnv(vector.JakobiNoise(vector.DiscreteAction(native(3)), level=1.0))
    assert_same(ours, DummyVecEnv([make] * 3), steps=3)


def test_an_episode_that_is_cut_off_is_told_apart_from_one_that_ends():
    """On one of Gymnasium's, as no episode of one step is cut off."""

    def make():
        return TimeLimit(gym.make("CartPole-v1"), 15)

    envs = gym.vector.SyncVectorEnv([make] * 4, autoreset_mode="Disabled")
    ours, theirs = SB3VecEnv(envs), DummyVecEnv([make] * 4)
    cut = []
    assert ours.seed(5) == theirs.seed(5)
    np.testing.assert_array_equal(ours.reset(), theirs.reset(), strict=True)
    for i in range(40):
        actions = np.arange(i, i + 4) % 2
        step, other = ours.step(actions), theirs.step(actions)
        for mine, others in zip(step, other, strict=True):
            assert data_equivalence(mine, others)
        cut += [info["TimeLimit.truncated"] for info in step[3] if "terminal_observation" in info]
    assert any(cut)


def test_a_step_of_a_noisy_batch_uses_the_seeds():
    env = SB3VecEnv(vector.JakobiNoise(native(2)))
    rewards = []
    for seed in (1, 1, 2):
        env.seed(seed)
        env.reset()
        rewards.append(env.step([BEST, BEST])[1])
    np.testing.assert_array_equal(rewards[0], rewards[1])
    assert (rewards[0] != rewards[2]).any()
    assert rewards[0][1] == rewards[2][0]


def test_what_was_returned_stays_as_it_is():
    env = SB3VecEnv(native(2))
    env.reset()
    observations, _, _, infos = env.step([BEST, BEST])
    final = infos[0]["terminal_observation"].copy()
    observations += 1
    env.step([[1] * 8] * 2)
    np.testing.assert_array_equal(infos[0]["terminal_observation"], final)
    assert final.any()


def test_it_draws_what_single_environments_draw():
    ours, theirs = both(2, render_mode="rgb_array", physics=SHORT)
    for env in (ours, theirs):
        env.reset()
        env.step(np.array([BEST, [1] * 8]))
    np.testing.assert_array_equal(ours.render(), theirs.render())
    assert SB3VecEnv(native(2)).get_images() == [None, None]
    ours.close()


def test_attributes_and_methods_are_those_of_the_batch():
    env = SB3VecEnv(vector.JakobiNoise(native(3), level=0.5))
    env.seed(4)
    env.reset()
    assert env.get_attr("level") == [0.5] * 3
    assert env.get_attr("np_random_seed", indices=[0, 2]) == [4, 6]
    assert not env.has_attr("action_masks")
    with pytest.raises(AttributeError, match="action_masks"):
        env.env_method("action_masks")
    env.set_attr("note", "mine")
    assert env.get_attr("note", indices=1) == ["mine"]
    with pytest.raises(ValueError, match="leave out indices"):
        env.set_attr("note", "his", indices=[0, 1])
    assert env.env_method("render", indices=[1]) == [None]
    assert env.env_is_wrapped(vector.JakobiNoise) == [True] * 3
    assert env.env_is_wrapped(vector.Resample, indices=0) == [False]


def test_options_reach_the_reset():
    env = SB3VecEnv(native(2))
    env.set_options({"reset_mask": np.array([False])})
    with pytest.raises(ValueError, match="reset_mask"):
        env.reset()
    env.set_options([{}, {"other": 1}])
    with pytest.raises(ValueError, match="options must be the same"):
        env.reset()


def test_what_it_can_not_wrap_is_refused():
    with pytest.raises(ValueError, match='autoreset_mode="Disabled"'):
        SB3VecEnv(gym.make_vec(softvox_gym.ENV_ID, num_envs=2))
    with pytest.raises(TypeError, match="vector environment"):
        SB3VecEnv(gym.make(softvox_gym.ENV_ID))
    env = SB3VecEnv(native(2, softvox_gym.TABLE_ENV_ID, objectives=("displacement", "voxels")))
    env.reset()
    with pytest.raises(ValueError, match="without objectives"):
        env.step(np.array([BEST, BEST]))


def test_without_the_library_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3.common.vec_env", None)
    monkeypatch.delitem(sys.modules, "softvox_gym.sb3")
    with pytest.raises(ModuleNotFoundError, match=r"softvox-gym\[learn\]"):
        import_module("softvox_gym.sb3")


@pytest.mark.parametrize("algorithm", ["PPO", "DQN"])
def test_algorithms_learn_on_it(algorithm):
    envs = native(4, softvox_gym.TABLE_ENV_ID)
    if algorithm == "DQN":
        envs, options = vector.DiscreteAction(envs), {"learning_starts": 8}
    else:
        options = {"n_steps": 4, "batch_size": 16, "n_epochs": 1}
    env = VecMonitor(SB3VecEnv(envs))
    model = getattr(sb3, algorithm)("MlpPolicy", env, seed=0, device="cpu", **options)
    model.learn(32)
    assert len(model.ep_info_buffer) == 32
    assert max(info["r"] for info in model.ep_info_buffer) > 0


def test_a_masked_policy_builds_only_what_is_one_piece():
    contrib = pytest.importorskip("sb3_contrib")
    ours, theirs = both(4, "SoftVoxGrow2x2x2-v0", connected=True, from_table=True)
    for env in (ours, theirs):
        env.seed(0)
        env.reset()
        assert contrib.common.maskable.utils.is_masking_supported(env)
        env.step(np.ones(4, int))
    ours_masks, theirs_masks = map(contrib.common.maskable.utils.get_action_masks, (ours, theirs))
    np.testing.assert_array_equal(ours_masks, theirs_masks, strict=True)

    pieces = []
    options = {"n_steps": 16, "batch_size": 64, "n_epochs": 1, "seed": 0, "device": "cpu"}
    model = contrib.MaskablePPO("MlpPolicy", ours, **options)
    model.learn(128, callback=lambda told, _: pieces.extend(told["infos"]) or True)
    over = [info["is_connected"] for info in pieces if "terminal_observation" in info]
    assert len(over) == 16
    assert all(over)


def test_the_example_does_what_it_shows():
    (test,) = [
        test
        for test in doctest.DocTestFinder().find(import_module("softvox_gym.sb3"))
        if test.examples
    ]
    assert doctest.DocTestRunner().run(test).failed == 0
