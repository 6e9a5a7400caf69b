"""Vector rewards: those of `evaluate`, from single and vector environments alike."""

import gymnasium as gym
import numpy as np
import pytest

from softvox_gym import evaluate
from softvox_gym.envs.vector import SoftVoxVectorEnv
from softvox_gym.noise import Jakobi
from softvox_gym.objectives import OBJECTIVES
from softvox_gym.wrappers import FitnessNoise, JakobiNoise, Resample, vector

ID = "SoftVox2x2x2-v0"
ALL = tuple(OBJECTIVES)
SHORT = {"preset": "published", "duration": 0.9}
ROWS = np.array([[0, 0, 0, 2, 1, 2, 2, 2], [2] * 8, [0] * 8])


def single(objectives=ALL, name=ID, **options):
    return gym.make(name, objectives=objectives, disable_env_checker=True, **options)


def test_the_reward_is_a_vector_in_the_order_asked_for_within_its_space():
    env = single(("energy", "straightness", "displacement"), physics=SHORT)
    space = env.unwrapped.reward_space
    assert isinstance(space, gym.spaces.Box)
    assert (space.low.tolist(), space.high.tolist()) == (
        [-np.inf, 0, -np.inf],
        [np.inf, 1, np.inf],
    )
    env.reset(seed=0)
    _, reward, terminated, _, info = env.step(ROWS[0])
    assert terminated
    assert space.contains(reward)
    assert reward.dtype == np.float64
    assert reward[2] == info["fitness"]
    assert "objectives" not in info


def test_without_objectives_the_reward_is_a_number():
    env = gym.make(ID, physics=SHORT)
    env.reset()
    assert isinstance(env.step(ROWS[0])[1], float)
    assert not hasattr(env.unwrapped, "reward_space")


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_a_vector_gives_what_single_ones_and_evaluate_give(mode):
    envs = gym.make_vec(ID, num_envs=3, objectives=ALL, physics=SHORT, autoreset_mode=mode)
    envs.reset(seed=0)
    rewards = envs.step(ROWS)[1]
    assert rewards.shape == (3, 7)
    assert envs.unwrapped.reward_space.shape == (7,)
    assert rewards.tobytes() == evaluate(ROWS, SHORT, objectives=ALL).objectives.tobytes()
    for row, reward in zip(ROWS, rewards, strict=True):
        env = single(physics=SHORT)
        env.reset()
        assert env.step(row)[1].tobytes() == reward.tobytes()
    if mode == "NextStep":
        assert envs.step(ROWS)[1].tolist() == [[0] * 7] * 3


def test_noise_and_repeated_trials_work():
    options = {"physics": SHORT, "objectives": ALL}
    envs = gym.make_vec(ID, num_envs=3, autoreset_mode="SameStep", **options)
    envs = vector.Resample(vector.JakobiNoise(envs, 1.0), 4, "min")
    envs.reset(seed=5)
    _, rewards, _, _, infos = envs.step(ROWS)
    expected = evaluate(
        ROWS, perturbations=[Jakobi(1.0)], trials=4, seed=5, aggregate="min", **options
    )
    assert rewards.tobytes() == expected.objectives.tobytes()
    told = infos["final_info"]
    assert told["objectives"].tobytes() == expected.objectives_of_trials.tobytes()
    assert told["fitness"].tobytes() == expected.value.tobytes()
    env = Resample(JakobiNoise(single(physics=SHORT), 1.0), 4, "min")
    env.reset(seed=5)
    _, reward, _, _, info = env.step(ROWS[0])
    assert reward.tobytes() == rewards[0].tobytes()
    assert info["objectives"].shape == (4, 7)


def test_the_table_gives_all_but_energy():
    names = tuple(name for name in ALL if name != "energy")
    env = single(names, "SoftVoxTable2x2x2-v0")
    env.reset()
    assert (
        env.step(ROWS[0])[1].tobytes() == evaluate(ROWS[:1], objectives=names).objectives.tobytes()
    )
    with pytest.raises(ValueError, match="objectives has energy, which the table lacks"):
        single(ALL, "SoftVoxTable2x2x2-v0")


def test_a_robot_that_grew_is_worth_what_it_is_at_once():
    envs = gym.make_vec("SoftVoxGrow2x2x2-v0", 2, objectives=ALL, physics=SHORT)
    envs.reset()
    rewards = [envs.step(digits)[1] for digits in ROWS[:2].T]
    assert np.shape(rewards) == (8, 2, 7)
    assert not np.any(rewards[:-1])
    assert rewards[-1].tobytes() == evaluate(ROWS[:2], SHORT, objectives=ALL).objectives.tobytes()
    assert envs.unwrapped.reward_space.shape == (7,)


def test_what_can_not_be_is_refused():
    with pytest.raises(ValueError, match="FitnessNoise measures one number"):
        FitnessNoise(single(), 0.1)
    with pytest.raises(ValueError, match="did you mean energy"):
        SoftVoxVectorEnv(2, objectives=["enrgy"])


def test_a_spec_keeps_them():
    again = gym.make(gym.envs.registration.EnvSpec.from_json(single().spec.to_json()))
    assert again.unwrapped.reward_space.shape == (7,)
