"""What Gymnasium's own test suite asks of every registered environment, asked of ours.

Gymnasium's source distributions leave that suite out (they hold tests/test_core.py alone), so its
questions are put here: the checker with no unexpected warning, determinism of roll-outs, render
modes, pickling, equality of vector environments, seeding, partial resets and autoreset modes. The
native vector environment is held against SyncVectorEnv in test_vector_env.py.
"""

import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv
from gymnasium.wrappers import RecordEpisodeStatistics, TimeLimit
from gymnasium.wrappers.vector import RecordEpisodeStatistics as RecordVectorEpisodeStatistics

import softvox_gym

CONTROL = "SoftVoxControl-v0"
IDS = [softvox_gym.ENV_ID, "SoftVox3x3x3-v0", "SoftVoxGrow2x2x2-v0"]
VECTORISERS = ["sync", "async", "vector_entry_point"]

# Processes take seconds to begin: all ids but control's, and not each in every way.
BEGIN = [(name, mode) for name in IDS for mode in VECTORISERS if (name, mode) != (IDS[1], "async")]
STEP = [(IDS[0], shared, mode) for shared in (True, False) for mode in ("NextStep", "SameStep")]
STEP += [(IDS[1], True, "SameStep"), (IDS[2], True, "NextStep"), (IDS[2], False, "SameStep")]


@pytest.fixture(params=[*IDS, CONTROL])
def spec(request):
    return gym.spec(request.param)


def action_of(env):
    env.action_space.seed(0)
    return env.action_space.sample()


def is_growth(env):
    return "Grow" in env.spec.id


def played(env):
    """Play an episode; return what its last step gave."""
    env.reset(seed=0)
    while True:
        step = env.step(action_of(env))
        if np.any(step[2] | step[3]):
            return step


def test_the_registered_spec_is_deterministic_and_versioned(spec):
    assert not spec.nondeterministic
    assert (spec.namespace, spec.version) == (None, 0)
    assert spec.id in gym.pprint_registry(disable_print=True).replace(" ", "\n")


def test_the_spec_survives_pickling_and_json(spec):
    assert pickle.loads(pickle.dumps(spec)) == spec
    assert EnvSpec.from_json(spec.to_json()) == spec


def test_a_rollout_is_deterministic(spec):
    first, second = spec.make(), spec.make()
    assert data_equivalence(first.reset(seed=0), second.reset(seed=0))
    first.action_space.seed(0)
    for _ in range(50):
        action = first.action_space.sample()
        ours, theirs = first.step(action), second.step(action)
        assert data_equivalence(ours, theirs)
        assert ours[0] in first.observation_space
        assert isinstance(ours[2], bool)
        if ours[2] or ours[3]:
            assert data_equivalence(first.reset(seed=0), second.reset(seed=0))


def test_every_render_mode_gives_frames_after_reset_and_after_a_step(spec):
    assert "rgb_array" in spec.make().metadata["render_modes"]
    for mode in spec.make().metadata["render_modes"]:
        env = spec.make(render_mode=mode, physics={"duration": 0.3})
        env.reset()
        for shown in (env.render(), env.step(env.action_space.sample()) and env.render()):
            frame = shown if mode == "rgb_array" else shown[-1]
            assert frame.ndim == 3
            assert frame.shape[2] == 3
            assert frame.dtype == np.uint8
        env.close()


def test_a_list_of_frames_shows_the_walk_and_each_once(spec):
    env = spec.make(render_mode="rgb_array_list", physics={"duration": 0.5})
    env.reset()
    floor = env.render()
    assert len(floor) == (5 if is_growth(env) else 1)
    assert env.render() == []
    over, shown = False, 0
    while not over:
        action = np.ones(env.action_space.shape, env.action_space.dtype)
        if spec.id == CONTROL:
            action *= env.action_space.high
        _, _, terminated, truncated, _ = env.step(action)
        over, shown = terminated or truncated, shown + len(env.render())
    # 0.25 s at half speed, 25 per second; before that 0.2 s after each voxel but the last
    assert shown == (7 * 5 + 13 if is_growth(env) else 12 if spec.id == CONTROL else 13)
    env.reset()
    np.testing.assert_array_equal(env.render(), floor)


@pytest.mark.parametrize(("spec", "shared_memory", "mode"), STEP, indirect=["spec"])
def test_processes_of_single_environments_equal_a_loop_over_them(spec, shared_memory, mode):
    makers = [spec.make] * 3
    loop = SyncVectorEnv(makers, autoreset_mode=mode)
    processes = AsyncVectorEnv(
        makers, shared_memory=shared_memory, autoreset_mode=mode, context="spawn"
    )
    try:
        assert data_equivalence(processes.reset(seed=0), loop.reset(seed=0))
        for _ in range(10 if is_growth(loop.envs[0]) else 3):
            actions = loop.action_space.sample()
            assert data_equivalence(processes.step(actions), loop.step(actions))
    finally:
        processes.close()


@pytest.mark.parametrize(("spec", "mode"), BEGIN, indirect=["spec"])
def test_seeds_count_up_over_the_environments(spec, mode):
    options = {"context": "spawn"} if mode == "async" else {}
    env = gym.make_vec(spec, 3, mode, vector_kwargs=options)
    try:
        env.reset(seed=42)
        assert env.np_random_seed == (42, 43, 44)
        env.reset()
        assert env.np_random_seed == (42, 43, 44)
    finally:
        env.close()


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_the_autoreset_mode_is_in_the_metadata(spec, mode):
    for given in (mode, mode.value):
        env = gym.make_vec(spec, 2, autoreset_mode=given)
        assert env.metadata["autoreset_mode"] is mode
        assert "autoreset_mode" not in spec.make().metadata


def test_one_environment_in_a_batch_equals_a_single_one(spec):
    env, envs = spec.make(), gym.make_vec(spec, 1)
    observation, info = env.reset(seed=123)
    observations, infos = envs.reset(seed=123)
    assert data_equivalence(observation, observations[0])
    assert_row(info, infos)
    over = False
    while not over:
        action = action_of(env)
        single, batch = env.step(action), envs.step(np.array([action]))
        for i in range(4):
            assert np.array_equal(single[i], batch[i][0])
        assert_row(single[4], batch[4])
        over = single[2] or single[3]


def assert_row(info, infos):
    assert set(infos) == set(info) | {f"_{key}" for key in info}
    for key, value in info.items():
        assert np.array_equal(value, infos[key][0])


def test_the_usual_wrappers_fit(spec):
    *_, info = played(TimeLimit(RecordEpisodeStatistics(spec.make()), 50))
    assert info["episode"]["r"] == pytest.approx(info["fitness"])
    *_, infos = played(RecordVectorEpisodeStatistics(gym.make_vec(spec, 2)))
    assert infos["episode"]["r"] == pytest.approx(infos["fitness"])
