"""The native vector environment can't be told from a SyncVectorEnv of single ones."""

import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AutoresetMode

import softvox_gym
from softvox_gym.envs.vector import SoftVoxVectorEnv

MODES = list(AutoresetMode)
STEPS = 5
GYMNASIUMS = (TypeError, ValueError, AssertionError)  # the last before Gymnasium 1.4
SHORT = {"preset": "published", "duration": 0.3}
OWN = {"name": "SoftVox-v0", "shape": (5, 2, 4), "physics": SHORT}  # numbers beyond int64


def native(n, mode=AutoresetMode.NEXT_STEP, *, name=softvox_gym.ENV_ID, **options):
    return gym.make_vec(name, num_envs=n, autoreset_mode=mode, **options)


def oracle(n, mode=AutoresetMode.NEXT_STEP, *, name=softvox_gym.ENV_ID, **options):
    return gym.make_vec(
        name,
        num_envs=n,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        **options,
    )


def assert_same(ours, theirs):
    """Compare whole returns, down to types, masks and the order of keys."""
    assert type(ours) is type(theirs)
    if isinstance(theirs, (tuple, list)):
        for mine, other in zip(ours, theirs, strict=True):
            assert_same(mine, other)
    elif isinstance(theirs, dict):
        assert list(ours) == list(theirs)
        for key in theirs:
            assert_same(ours[key], theirs[key])
    elif isinstance(theirs, np.ndarray) and theirs.dtype == object:
        assert ours.dtype == object
        for mine, other in zip(ours, theirs, strict=True):
            assert_same(mine, other)
    elif isinstance(theirs, np.ndarray):
        assert ours.dtype == theirs.dtype
        np.testing.assert_array_equal(ours, theirs, strict=True)
    else:
        assert ours == theirs


@pytest.mark.parametrize("as_string", [False, True])
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("n", [1, 4, 9])
@pytest.mark.parametrize(
    "lattice", [{}, {"name": "SoftVox3x3x3-v0", "physics": SHORT}, OWN], ids=["2", "3", "own"]
)
def test_it_returns_what_single_environments_return(lattice, n, mode, as_string):
    given = mode.value if as_string else mode
    ours, theirs = native(n, given, **lattice), oracle(n, given, **lattice)
    assert isinstance(ours, SoftVoxVectorEnv)
    for name in (
        "num_envs",
        "metadata",
        "render_mode",
        "single_action_space",
        "action_space",
        "single_observation_space",
        "observation_space",
    ):
        assert getattr(ours, name) == getattr(theirs, name), name
    assert_same(ours.reset(seed=5), theirs.reset(seed=5))
    ours.action_space.seed(7)
    for _ in range(STEPS):
        actions = ours.action_space.sample()
        step, other = ours.step(actions), theirs.step(actions)
        assert_same(step, other)
        assert data_equivalence(step, other)
        if mode is AutoresetMode.DISABLED:
            options = {"reset_mask": step[2]}
            assert_same(ours.reset(options=dict(options)), theirs.reset(options=dict(options)))


@pytest.mark.parametrize("seed", [11, [3, 1, 4, 1], [None, 5, None, 9], None])
def test_it_seeds_like_single_environments(seed):
    ours, theirs = native(4), oracle(4)
    ours.reset(seed=2)
    theirs.reset(seed=2)
    ours.reset(seed=seed)
    theirs.reset(seed=seed)
    assert ours.np_random_seed == theirs.np_random_seed
    for mine, other in zip(ours.np_random, theirs.np_random, strict=True):
        assert mine.random() == other.random()


def test_unseeded_environments_draw_differently():
    env = native(4)
    env.reset()
    assert len(set(env.np_random_seed)) == 4
    assert len({generator.random() for generator in env.np_random}) == 4


def test_a_wrong_number_of_seeds_is_refused():
    for env, error in ((native(4), ValueError), (oracle(4), GYMNASIUMS)):
        with pytest.raises(error, match="seed"):
            env.reset(seed=[1, 2])


@pytest.mark.parametrize("seed", [-1, 1.5, "abcd", [1, 2, 3, -1], [1, 2, 3, 4.0]])
def test_what_is_no_seed_is_refused_and_seeds_nothing(seed):
    env = native(4)
    env.reset(seed=7)
    with pytest.raises(ValueError, match="seed"):
        env.reset(seed=seed)
    assert env.np_random_seed == (7, 8, 9, 10)


def test_numbers_of_numpy_are_seeds():
    env = native(4)
    env.reset(seed=np.array([3, 1, 4, 1]))
    assert env.np_random_seed == (3, 1, 4, 1)


def test_a_partial_reset_keeps_the_other_observations():
    ours, theirs = native(4, AutoresetMode.DISABLED), oracle(4, AutoresetMode.DISABLED)
    actions = np.array([[0, 0, 0, 2, 1, 2, 2, 2]] * 4)
    for env in (ours, theirs):
        env.reset(seed=1)
        env.step(actions)
    options = {"reset_mask": np.array([True, False, True, False])}
    assert_same(
        ours.reset(seed=8, options=dict(options)), theirs.reset(seed=8, options=dict(options))
    )
    assert ours.np_random_seed == theirs.np_random_seed
    assert "reset_mask" in options


def test_a_mask_leaves_the_callers_options_alone():
    options = {"reset_mask": np.array([True, True])}
    native(2).reset(options=options)
    assert list(options) == ["reset_mask"]


@pytest.mark.parametrize(
    "mask",
    [
        [True, True, False, False],
        np.array([True]),
        np.array([[True, True, True, True]]),
        np.array([1, 1, 0, 0]),
        np.array([1.0, 1.0, 0.0, 0.0]),
        np.zeros(4, dtype=bool),
    ],
)
def test_a_bad_mask_raises_what_single_environments_raise(mask):
    errors = []
    for env in (native(4, AutoresetMode.DISABLED), oracle(4, AutoresetMode.DISABLED)):
        env.reset()
        with pytest.raises(GYMNASIUMS) as caught:
            env.reset(options={"reset_mask": mask})
        errors.append(caught.type)
    assert errors[0] in (TypeError, ValueError)
    assert errors[1] in (errors[0], AssertionError)


def test_a_mask_before_the_first_reset_is_refused():
    for env in (native(2), oracle(2)):
        with pytest.raises(Exception):  # noqa: B017, PT011 (theirs is whatever numpy says)
            env.reset(options={"reset_mask": np.array([True, False])})
    with pytest.raises(gym.error.ResetNeeded):
        native(2).reset(options={"reset_mask": np.array([True, False])})


def test_stepping_before_the_first_reset_is_refused():
    for env in (native(2), oracle(2)):
        with pytest.raises(gym.error.ResetNeeded):
            env.step(env.action_space.sample())


def test_rendering_before_the_first_reset_is_refused():
    for env in (native(2, render_mode="rgb_array"), oracle(2, render_mode="rgb_array")):
        with pytest.raises(gym.error.ResetNeeded):
            env.render()


def test_stepping_over_the_end_is_refused_where_autoreset_is_disabled():
    for env in (native(2, AutoresetMode.DISABLED), oracle(2, AutoresetMode.DISABLED)):
        env.reset()
        env.step(env.action_space.sample())
        env.reset(options={"reset_mask": np.array([True, False])})
        with pytest.raises(AssertionError):
            env.step(env.action_space.sample())


@pytest.mark.parametrize(
    "actions", [np.zeros((3, 8), int), np.zeros((4, 7), int), np.zeros((4, 8))]
)
def test_actions_that_do_not_fit_are_refused(actions):
    env = native(4)
    env.reset()
    with pytest.raises(ValueError, match="action"):
        env.step(actions)


def test_a_digit_that_does_not_exist_is_refused():
    env = native(4)
    env.reset()
    with pytest.raises(ValueError, match="digits 0, 1 and 2"):
        env.step(np.full((4, 8), 3))


@pytest.mark.parametrize("mode", MODES)
def test_it_handles_divergence_like_single_environments(mode):
    options = {"physics": {"preset": "published", "strain": 150.0}}
    ours, theirs = native(4, mode, **options), oracle(4, mode, **options)
    actions = np.array([[2] * 8, [0] * 8, [1] * 8, [2, 1, 0, 0, 0, 0, 0, 0]])
    ours.reset(seed=0)
    theirs.reset(seed=0)
    step = ours.step(actions)
    assert_same(step, theirs.step(actions))
    assert np.isfinite(step[1]).all()


@pytest.mark.parametrize("mode", MODES)
def test_it_draws_what_single_environments_draw(mode):
    ours = native(2, mode, render_mode="rgb_array")
    theirs = oracle(2, mode, render_mode="rgb_array")
    ours.reset(seed=0)
    theirs.reset(seed=0)
    assert_same(ours.render(), theirs.render())
    actions = np.array([[0, 0, 0, 2, 1, 2, 2, 2], [0] * 8])
    ours.step(actions)
    theirs.step(actions)
    assert_same(ours.render(), theirs.render())


def test_returned_arrays_belong_to_the_caller():
    env = native(2)
    observations, _ = env.reset()
    observations += 1
    assert not env.reset()[0].any()
    step = env.step(np.full((2, 8), 1))
    step[2][:] = False
    np.testing.assert_array_equal(env.step(np.full((2, 8), 1))[1], 0.0)


def test_the_vector_environment_survives_pickling():
    env = native(3)
    copy = pickle.loads(pickle.dumps(env))
    actions = np.array([[0, 0, 0, 2, 1, 2, 2, 2]] * 3)
    assert_same(env.reset(seed=1), copy.reset(seed=1))
    assert_same(env.step(actions), copy.step(actions))


def test_its_spec_makes_it_again():
    env = native(3, physics="exact")
    again = gym.make_vec(env.spec)
    assert again.num_envs == 3
    assert again.unwrapped.physics == env.unwrapped.physics


@pytest.mark.parametrize("n", [0, -1, 2.5, True])
def test_a_bad_number_of_environments_is_refused(n):
    with pytest.raises((TypeError, ValueError), match="num_envs"):
        SoftVoxVectorEnv(n)


def test_a_numpy_number_of_environments_is_a_number():
    assert SoftVoxVectorEnv(np.int64(2)).num_envs == 2


def test_a_bad_number_of_threads_is_refused_when_it_is_made():
    for threads in (0, "a"):
        with pytest.raises((TypeError, ValueError), match="threads"):
            native(2, threads=threads)


def test_an_unknown_autoreset_mode_is_refused():
    with pytest.raises(ValueError, match="Sometimes"):
        native(2, "Sometimes")
