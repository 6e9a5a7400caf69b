"""A robot grows voxel by voxel, only into one piece where that is asked for."""

import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env, data_equivalence
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from gymnasium.wrappers.vector import TransformReward
from test_vector_env import assert_same

from softvox_gym import simulate
from softvox_gym.design import BodyFacts
from softvox_gym.envs.growth import SoftVoxGrowEnv, SoftVoxGrowVectorEnv, masks
from softvox_gym.lattice import Lattice
from softvox_gym.wrappers import JakobiNoise, Resample, vector

IDS = ["SoftVoxGrow-v0"] + [f"SoftVoxGrow{n}x{n}x{n}-v0" for n in (2, 3, 4)]
MODES = list(AutoresetMode)
BEST = [0, 0, 0, 2, 1, 2, 2, 2]
SHORT = {"preset": "published", "duration": 0.3}
TABLE = {"from_table": True}


def make(**options):
    return gym.make(IDS[1], **options)


def built(env, digits):
    """Reset and build; return all steps."""
    env.reset(seed=0)
    return [env.step(digit) for digit in digits]


def grown(lattice):
    """Return all that can be built along the masks, digits of shape (n, sites)."""
    rows = np.zeros((1, lattice.sites), np.uint8)
    for site in range(lattice.sites):
        allowed = masks(rows, np.full(len(rows), site), lattice, connected=True)
        before, digits = np.nonzero(allowed)
        rows = rows[before]
        rows[:, site] = digits
    return rows


@pytest.mark.parametrize("shape", [(2, 2, 2), (3, 3, 1), (1, 4, 2), (3, 1, 1), (1, 1, 1)])
def test_along_the_masks_lie_all_connected_designs_and_no_other(shape):
    lattice = Lattice(*shape)
    every = lattice.digits(np.arange(lattice.n_designs))
    connected = np.flatnonzero(BodyFacts.of(every, lattice).is_connected)
    assert sorted(lattice.numbers(grown(lattice)).tolist()) == connected.tolist()


@pytest.mark.parametrize(
    ("digits", "allowed"),
    [
        ([], [1, 1, 1]),
        ([0, 0], [0, 1, 1]),  # the empty robot is not one piece
        ([1], [1, 1, 1]),  # it may stay alone
        ([1, 0], [1, 0, 0]),  # another can't reach it any more
        ([1, 1, 1], [1, 1, 1]),
    ],
)
def test_masks_of_a_row_of_three(digits, allowed):
    rows = np.array([digits + [0] * (3 - len(digits))], np.uint8)
    lattice, following = Lattice(3, 1, 1), np.array([len(digits)])
    assert masks(rows, following, lattice, connected=True).tolist() == [[bool(a) for a in allowed]]
    assert masks(rows, following, lattice, connected=False).all()


def test_once_nothing_leads_to_one_piece_all_is_allowed_again():
    env = make(connected=True, physics=SHORT)
    steps = built(env, [1, 0, 0, 0, 0, 1])  # site 0 is cut off, and the mask knows
    assert steps[3][4]["action_mask"].tolist() == [1, 1, 1]
    assert steps[4][4]["action_mask"].tolist() == [1, 0, 0]
    assert steps[5][4]["action_mask"].tolist() == [1, 1, 1]
    env.step(0)
    assert not env.step(2)[4]["is_connected"]


def test_what_grows_along_masks_of_a_large_lattice_is_one_piece():
    envs = gym.make_vec("SoftVoxGrow4x4x4-v0", 8, physics=SHORT, connected=True)
    _, infos = envs.reset(seed=0)
    rng = np.random.default_rng(0)
    for _ in range(64):
        chance = rng.random((8, 3)) * infos["action_mask"]
        _, rewards, terminated, _, infos = envs.step(chance.argmax(axis=1))
    assert terminated.all()
    assert infos["is_connected"].all()
    assert rewards.any()
    assert infos["digits"].shape == (8, 64)  # numbers beyond int64


def test_the_best_design_earns_the_optimum():
    env = make()
    *before, last = built(env, BEST)
    assert [step[1:4] for step in before] == [(0.0, False, False)] * 7
    assert [list(step[4]) for step in before] == [["action_mask"]] * 7
    _, reward, terminated, truncated, info = last
    one_step = gym.make("SoftVox2x2x2-v0")
    one_step.reset()
    told = one_step.step(np.array(BEST))[4]
    assert reward == simulate(6453).fitness[0] == pytest.approx(4.657, abs=5e-4)
    assert (terminated, truncated) == (True, False)
    assert info.pop("action_mask").tolist() == [1, 1, 1]
    assert data_equivalence(info, told)


def test_the_observation_tells_what_stands_and_what_is_next():
    env = make(**TABLE)
    observation, _ = env.reset()
    for site in range(9):
        expected = np.zeros((8, 4), np.float32)
        expected[np.arange(site), BEST[:site]] = 1
        expected[site : site + 1, 3] = 1
        np.testing.assert_array_equal(observation, expected.ravel(), strict=True)
        if site < 8:
            observation = env.step(BEST[site])[0]


def test_of_several_objectives_the_last_reward_is_a_vector():
    options = {"objectives": ("voxels", "displacement"), "physics": SHORT}
    env, envs = make(disable_env_checker=True, **options), gym.make_vec(IDS[1], 2, **options)
    *before, last = built(env, BEST)
    assert [step[1].tolist() for step in before] == [[0.0, 0.0]] * 7
    assert last[1].tolist() == [-5.0, last[4]["fitness"]]
    assert last[1] in env.unwrapped.reward_space
    several = built(envs, [(digit, 1) for digit in BEST])
    assert several[6][1].tolist() == [[0.0, 0.0]] * 2
    assert several[7][1][0].tolist() == last[1].tolist()
    assert several[7][1][1][0] == -8.0


@pytest.mark.parametrize("name", IDS)
@pytest.mark.parametrize("render_mode", [None, "rgb_array"])
def test_the_environment_checker_finds_nothing(name, render_mode):
    env = gym.make(name, render_mode=render_mode, disable_env_checker=True, connected=True)
    check_env(env.unwrapped)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("n", [1, 4])
@pytest.mark.parametrize(
    "options",
    [
        {**TABLE, "connected": True},
        {"shape": (3, 1, 2), "physics": SHORT, "task": "directed"},
    ],
    ids=["table", "own"],
)
def test_a_vector_returns_what_single_environments_return(options, n, mode):
    ours = gym.make_vec(IDS[0], n, autoreset_mode=mode, **options)
    theirs = SyncVectorEnv([lambda: gym.make(IDS[0], **options)] * n, autoreset_mode=mode)
    assert isinstance(ours, SoftVoxGrowVectorEnv)
    assert ours.single_observation_space == theirs.single_observation_space
    assert_same(ours.reset(seed=5), theirs.reset(seed=5))
    ours.action_space.seed(7)
    rng, over = np.random.default_rng(1), 0
    for _ in range(30):
        actions = ours.action_space.sample()
        step = ours.step(actions)
        assert_same(step, theirs.step(actions))
        over += step[2].sum()
        if mode is AutoresetMode.DISABLED:  # some sooner, so that they are at different sites
            mask = step[2] | (rng.random(n) < 0.05)
            if mask.any():
                options = {"reset_mask": mask}
                assert_same(ours.reset(options=dict(options)), theirs.reset(options=dict(options)))
        each = np.stack(theirs.call("get_wrapper_attr", "action_masks"))
        assert ours.action_masks().tolist() == [masks_of().tolist() for masks_of in each]
    assert over >= 2 * n


@pytest.mark.parametrize("mode", MODES)
def test_noise_comes_with_the_last_step(mode):
    options = {"physics": SHORT}
    ours = vector.JakobiNoise(gym.make_vec(IDS[1], 3, autoreset_mode=mode, **options), level=1.0)
    ours = vector.Resample(ours, 3)
    theirs = SyncVectorEnv(
        [lambda: Resample(JakobiNoise(make(**options), level=1.0), 3)] * 3, autoreset_mode=mode
    )
    assert_same(ours.reset(seed=5), theirs.reset(seed=5))
    digits = np.array([BEST, [1, 2] * 4, [2] * 8])
    for site in range(8):
        step, other = ours.step(digits[:, site]), theirs.step(digits[:, site])
        assert_same(step[:4], other[:4])
        assert data_equivalence(step[4], other[4])
    told = step[4].get("final_info", step[4])
    assert told["values"].shape == (3, 3)
    assert len(set(told["values"][0])) == 3


def test_a_wrapper_leaves_the_rewards_alone_of_those_that_are_not_built():
    env = gym.make_vec(IDS[1], 2, autoreset_mode="Disabled", **TABLE)
    env = vector.Resample(TransformReward(env, lambda rewards: rewards + 1), 2)
    env.reset(seed=0)
    env.step([0, 0])
    env.reset(options={"reset_mask": np.array([False, True])})
    for digit in BEST[1:]:
        _, rewards, over, _, _ = env.step([digit, digit])
    assert over.tolist() == [True, False]
    assert rewards[1] == 1


@pytest.mark.parametrize("action", [3, -1, 1.0, [1], "a", None, True])
def test_an_action_that_is_no_digit_is_refused_and_changes_nothing(action):
    env = SoftVoxGrowEnv(from_table=True)
    env.reset()
    with pytest.raises((TypeError, ValueError), match="action"):
        env.step(action)
    assert [env.step(digit)[2] for digit in BEST] == [False] * 7 + [True]


def test_no_site_is_built_before_a_reset_or_after_the_last():
    env = SoftVoxGrowEnv(from_table=True)
    with pytest.raises(gym.error.ResetNeeded, match="reset"):
        env.step(1)
    built(env, BEST)
    with pytest.raises(gym.error.ResetNeeded, match="reset"):
        env.step(1)


def test_bad_arguments_are_refused_when_it_is_made():
    for options in ({"num_envs": 0}, {"num_envs": 2.5}, {"threads": 0}, {"shape": (2, 2)}):
        with pytest.raises((TypeError, ValueError), match=next(iter(options))):
            SoftVoxGrowVectorEnv(**options)
    for flag in ("connected", "from_table"):
        with pytest.raises(TypeError, match=f"{flag} must be True or False, got 'no'"):
            make(**{flag: "no"})
    for options in ({"phases": 2}, {"shape": Lattice.of((2, 2, 2), phases=4)}):
        with pytest.raises(ValueError, match="phases must be 1"):
            make(**options)
    with pytest.raises(TypeError, match="conected"):
        make(conected=True)
    with pytest.raises(ValueError, match="render_mode"):
        SoftVoxGrowEnv(render_mode="ascii")


def test_it_draws_what_stands_and_then_the_walk():
    options = {"physics": SHORT, "render_mode": "rgb_array"}
    env, walking = make(**options), gym.make("SoftVox2x2x2-v0", **options)
    env.reset()
    pictures = [env.render()]
    for digit in BEST:
        env.step(digit)
        pictures.append(env.render())
    for site in range(3):  # absent: nothing to see
        np.testing.assert_array_equal(pictures[site + 1], pictures[0])
    for site in range(3, 8):
        assert (pictures[site + 1] != pictures[site]).any()
    walking.reset()
    walking.step(np.array(BEST))
    np.testing.assert_array_equal(pictures[-1], walking.render())

    ours, theirs = gym.make_vec(IDS[1], 2, **options), SyncVectorEnv([lambda: make(**options)] * 2)
    for envs in (ours, theirs):
        envs.reset()
        envs.step([1, 2])
    assert_same(ours.render(), theirs.render())


def test_it_survives_json_and_pickling_in_the_middle_of_an_episode():
    env = make(connected=True, **TABLE)
    assert EnvSpec.from_json(env.spec.to_json()).make().unwrapped.growth.connected
    built(env, BEST[:5])
    copy = pickle.loads(pickle.dumps(env))
    assert data_equivalence(copy.step(2), env.step(2))
