"""The table that ships with the package is what the engine produces, bit for bit."""

import json

import gymnasium as gym
import numpy as np
import pytest
from test_vector_env import MODES, assert_same

import softvox_gym
from softvox_gym import Design, verify
from softvox_gym.landscapes.table import COMPUTED, tracks
from softvox_gym.manifest import digest

ALL = np.arange(6561)


@pytest.fixture(scope="module")
def result(published_result):
    return published_result


def test_the_engine_still_produces_the_table(result):
    table = softvox_gym.landscape()
    assert tracks().track.tobytes() == result.track.tobytes()
    assert np.array_equal(tracks().steps, result.steps)
    for axis, name in enumerate(("dx", "dy", "dz")):
        assert table[name].tobytes() == result.displacement[:, axis].tobytes()
    assert table["fitness"].tobytes() == result.fitness.tobytes()
    assert np.array_equal(table["steps"], result.steps)
    assert not table["diverged"].any()


def test_the_table_knows_the_engines_digest(result):
    origin = json.loads((COMPUTED / "landscape.json").read_text())
    assert origin["engine_digest"] == digest(result.displacement) == verify.GOLDEN


def test_the_table_describes_the_bodies():
    table = softvox_gym.landscape()
    assert len(table) == 6561
    for i in (0, 1, 2, 364, 3280, 4295, 6453, 6560):
        row, design = table[i], Design(i)
        assert row["design"] == i
        assert row["digits"] == design.digits
        assert row["n_voxels"] == design.n_voxels
        assert row["n_active"] == design.n_active
        assert row["is_connected"] == design.is_connected


def test_the_table_is_the_callers_own():
    table = softvox_gym.landscape()
    table["fitness"] = 0
    assert softvox_gym.landscape()["fitness"].argmax() == 6453
    with pytest.raises(ValueError, match="read-only"):
        tracks().track[0] = 0


def test_the_table_reads_into_a_data_frame():
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(softvox_gym.landscape())
    assert frame.sort_values("fitness").design.iloc[-1] == 6453


@pytest.mark.parametrize("mode", MODES)
def test_the_table_env_answers_what_the_engine_does(mode):
    ours, theirs = (
        gym.make_vec(name, num_envs=64, autoreset_mode=mode)
        for name in (softvox_gym.TABLE_ENV_ID, softvox_gym.ENV_ID)
    )
    assert_same(ours.reset(seed=1), theirs.reset(seed=1))
    ours.action_space.seed(0)
    for _ in range(3):
        actions = ours.action_space.sample()
        step, other = ours.step(actions), theirs.step(actions)
        assert_same(step, other)
        if mode.value == "Disabled":
            options = {"reset_mask": step[2]}
            assert_same(ours.reset(options=dict(options)), theirs.reset(options=dict(options)))


@pytest.mark.parametrize("design", [0, 1, 6453, 6560])
def test_the_single_table_env_answers_what_the_engine_does(design):
    action = np.array([int(digit) for digit in Design(design).digits])
    ours, theirs = (
        gym.make(name, render_mode="rgb_array")
        for name in (softvox_gym.TABLE_ENV_ID, softvox_gym.ENV_ID)
    )
    for env in (ours, theirs):
        env.reset(seed=1)
    step, other = ours.step(action), theirs.step(action)
    assert np.array_equal(step[0], other[0])
    assert step[1:4] == other[1:4]
    assert list(step[4]) == list(other[4])
    assert all(np.array_equal(step[4][key], other[4][key]) for key in step[4])
    assert np.array_equal(ours.render(), theirs.render())


@pytest.mark.parametrize("bad", [np.full((2, 8), 3), np.full((2, 8), -1), np.zeros((2, 7), int)])
def test_the_table_env_refuses_what_is_no_design(bad):
    env = gym.make_vec(softvox_gym.TABLE_ENV_ID, num_envs=2)
    env.reset()
    with pytest.raises(ValueError, match=r"digits 0, 1 and 2|8 whole numbers"):
        env.step(bad)


def test_the_table_env_has_the_published_physics_only():
    with pytest.raises(ValueError, match="physics 'published'"):
        gym.make(softvox_gym.TABLE_ENV_ID, physics="exact")
