"""The landscapes under noise that ship with the package are what the engine produces."""

import gymnasium as gym
import numpy as np
import pytest
from noise import DRAWS, REDRAWN, sample

import softvox_gym
from softvox_gym.landscapes.noisy import LEVELS
from softvox_gym.wrappers.vector import JakobiNoise, Resample

NOISY_LEVELS = LEVELS[1:]


@pytest.mark.parametrize("level", NOISY_LEVELS)
def test_a_slice_drawn_again_gives_the_same_bits(level):
    table = softvox_gym.noisy_landscape(level)
    others = np.flatnonzero(table["draws"] == DRAWS)[::400]
    again = sample(others, level, draws=DRAWS, seeds=others)
    assert again.tobytes() == table[others].tobytes()


@pytest.mark.parametrize("level", NOISY_LEVELS)
def test_one_drawn_more_often_gives_the_same_bits_again(level):
    table = softvox_gym.noisy_landscape(level)
    for stage, draws in enumerate(REDRAWN, start=1):
        one = np.flatnonzero(table["draws"] == draws)[:1]
        again = sample(one, level, draws=draws, seeds=stage * 6561 + one)
        assert again.tobytes() == table[one].tobytes()


def test_the_environment_draws_what_the_table_was_made_of():
    some, draws = np.array([926, 6453, 77]), 16
    env = Resample(JakobiNoise(gym.make_vec("SoftVox2x2x2-v0", num_envs=3), 2.0), draws)
    env.reset(seed=some.tolist())
    actions = [[int(digit) for digit in softvox_gym.Design(int(i)).digits] for i in some]
    infos = env.step(np.array(actions))[4]
    table = sample(some, 2.0, draws=draws, seeds=some)
    assert infos["mean"].tobytes() == table["mean"].tobytes()
    assert infos["values"].min(axis=1).tobytes() == table["min"].tobytes()
    assert infos["displacement"][:, 0].tobytes() == table["dx"].tobytes()


@pytest.mark.parametrize("level", NOISY_LEVELS)
def test_the_best_without_noise_and_at_the_level_are_drawn_more_often(level):
    table = softvox_gym.noisy_landscape(level)
    assert set(table["draws"]) == {DRAWS, *REDRAWN}
    nominal = np.argsort(-softvox_gym.landscape()["fitness"], kind="stable")[:200]
    assert np.all(table["draws"][nominal] >= min(REDRAWN))
    order = np.argsort(-table["mean"], kind="stable")
    for draws, count in REDRAWN.items():
        assert np.all(table["draws"][order[:count]] >= draws)


@pytest.mark.parametrize("level", NOISY_LEVELS)
def test_the_statistics_belong_together(level):
    table = softvox_gym.noisy_landscape(level)
    assert np.array_equal(table["design"], np.arange(6561))
    assert np.all(table["min"] <= table["q10"])
    assert np.all(table["q10"] <= table["mean"] + 3 * table["std"])
    assert np.all((table["p_diverged"] >= 0) & (table["p_diverged"] <= 1))
    length = np.hypot(table["dx"], table["dy"])
    # The mean travel is at least the length of the mean displacement.
    sound = table["p_diverged"] == 0
    assert np.all(length[sound] <= table["mean"][sound] * (1 + 1e-12))


def test_level_0_is_the_exact_landscape():
    table, exact = softvox_gym.noisy_landscape(0), softvox_gym.landscape()
    for name in ("mean", "min", "q10"):
        assert np.array_equal(table[name], exact["fitness"])
    assert not table["std"].any()
    assert not table["p_diverged"].any()


def test_more_noise_takes_more_from_the_best():
    worst_tenth = [softvox_gym.noisy_landscape(level)["q10"].max() for level in LEVELS]
    assert worst_tenth == sorted(worst_tenth, reverse=True)
    # At level 4 a robot may slide down the tilted floor for metres, which the mean can't forget.
    means = [softvox_gym.noisy_landscape(level)["mean"].max() for level in LEVELS if level < 4]
    assert means == sorted(means, reverse=True)


def test_the_table_is_the_callers_own():
    softvox_gym.noisy_landscape(1)["mean"] = 0
    assert softvox_gym.noisy_landscape(1)["mean"].max() > 1


@pytest.mark.parametrize("level", [0.7, -1, 3, "1"])
def test_a_level_that_was_not_measured_is_refused(level):
    with pytest.raises(ValueError, match=rf"level {level!r}; there are levels 0, 0\.5, 1, 2, 4"):
        softvox_gym.noisy_landscape(level)
