"""The shells play episodes of many steps: one by one, and side by side just as one by one."""

from typing import ClassVar

import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from test_vector_env import assert_same

from softvox_gym import Physics
from softvox_gym.envs.episodes import Episodes, Started, Stepped
from softvox_gym.envs.single import SingleEnv
from softvox_gym.envs.vector import NativeVectorEnv

N = 5


class Shown:
    """A film of one grey."""

    def __init__(self, grey):
        self.grey = grey

    def pictures(self):
        return [self.last()] * 2

    def last(self):
        return np.full((2, 3, 3), self.grey, np.uint8)


class Walks(Episodes):
    """Each counts up to where its generator says, or breaks off; infos hold a mask, as growth's."""

    single_action_space = spaces.Discrete(3)
    single_observation_space = spaces.Box(0, 100, (2,), np.float32)
    physics = Physics.published()

    def __init__(self, num_envs=1, render_mode=None, reward_space=None):
        super().__init__(render_mode)
        self.reward_space = reward_space
        self.at, self.end = np.zeros((2, num_envs), np.int64)

    def start(self, which, generators):
        self.at[which] = 0
        self.end[which] = [rng.integers(1, 6) for rng in generators()]
        return Started(self._seen(which), self._mask(which), self._films(which))

    def step(self, which, actions, generators):
        if not np.isin(actions, [0, 1, 2]).all():
            raise ValueError("an action must be 0, 1 or 2")
        self.at[which] += actions
        gain = np.asarray(actions, np.float64)
        far = self.at[which] >= self.end[which]
        return Stepped(
            self._seen(which),
            gain if self.reward_space is None else np.stack([gain, -gain], axis=1),
            far,
            ~far & (actions == 0),
            {"gain": gain, **self._mask(which)},
            self._films(which),
        )

    def _seen(self, which):
        return np.stack([self.at[which], self.end[which]], axis=1).astype(np.float32)

    def _mask(self, which):
        return {"action_mask": self.at[which, np.newaxis] > np.arange(3), "at": self.at[which]}

    def _films(self, which):
        return [Shown(self.at[i]) if self.render_mode else None for i in which]


def single(**options):
    return SingleEnv(Walks(**options))


def both(mode, n=N, **options):
    ours = NativeVectorEnv(Walks(n, **options), n, mode)
    return ours, SyncVectorEnv([lambda: single(**options)] * n, autoreset_mode=mode)


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize("n", [1, N])
def test_side_by_side_they_go_as_one_by_one(mode, n):
    ours, theirs = both(mode, n, render_mode="rgb_array_list")
    assert_same(ours.reset(seed=3), theirs.reset(seed=3))
    rng = np.random.default_rng(0)
    lengths = set()
    for _ in range(30):
        actions = rng.integers(0, 3, n)
        step, other = ours.step(actions), theirs.step(actions)
        assert_same(step, other)
        assert_same(ours.render(), theirs.render())
        over = step[2] | step[3]
        lengths.add(int(over.sum()))
        if mode is AutoresetMode.DISABLED and over.any():
            options = {"reset_mask": over}
            assert_same(ours.reset(options=dict(options)), theirs.reset(options=dict(options)))
    assert len(lengths) >= min(n, 3)  # some were over while others went on


class Objectives(Walks):
    reward_space_of_two: ClassVar = spaces.Box(-9.0, 9.0, (2,), np.float64)

    def __init__(self, num_envs=1):
        super().__init__(num_envs, reward_space=self.reward_space_of_two)


@pytest.mark.parametrize("mode", AutoresetMode)
def test_rewards_may_be_vectors(mode):
    env, envs = SingleEnv(Objectives()), NativeVectorEnv(Objectives(2), 2, mode)
    assert env.reward_space == envs.reward_space == Objectives.reward_space_of_two
    env.reset(seed=0)
    envs.reset(seed=0)
    reward = env.step(2)[1]
    assert_same(reward, np.array([2.0, -2.0]))
    np.testing.assert_array_equal(envs.step(np.array([2, 0]))[1], [[2.0, -2.0], [0.0, 0.0]])


def test_an_action_that_is_refused_changes_nothing():
    env = NativeVectorEnv(Walks(2), 2, "NextStep")
    env.reset(seed=0)
    with pytest.raises(ValueError, match="0, 1 or 2"):
        env.step(np.array([1, 3]))
    for wrong in ([1, 1, 1], 1):
        with pytest.raises(ValueError, match="actions must be 2, one per environment, got shape"):
            env.step(wrong)
    assert env.step(np.array([1, 1]))[4]["at"].tolist() == [1, 1]


def test_an_unknown_render_mode_is_refused():
    with pytest.raises(ValueError, match="'rgb_array', 'rgb_array_list', got 'human'"):
        single(render_mode="human")
