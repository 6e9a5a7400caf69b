"""Noise wrappers: level 0 is the bare environment, and vector and single ones draw alike."""

import json
from concurrent.futures import ThreadPoolExecutor

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorWrapper
from test_vector_env import assert_same

import softvox_gym
from softvox_gym import Physics, simulate, wrappers
from softvox_gym.evaluation import AGGREGATES
from softvox_gym.landscapes.table import tracks
from softvox_gym.lattice import Lattice
from softvox_gym.noise import AMOUNTS, Jakobi, Trials, tilted
from softvox_gym.wrappers import vector

BEST = np.array([0, 0, 0, 2, 1, 2, 2, 2])
SHORT = {"preset": "published", "duration": 0.9}
MODES = list(AutoresetMode)

STACKS = {
    "noise": [("JakobiNoise", {"level": 1.0})],
    "noise resampled": [("JakobiNoise", {"level": 2.0}), ("Resample", {"n": 3})],
    "resampled under noise": [("Resample", {"n": 3}), ("JakobiNoise", {"level": 2.0})],
    "worst of resampled": [("JakobiNoise", {}), ("Resample", {"n": 5, "aggregate": "cvar25"})],
    "measurement": [("FitnessNoise", {"sigma": 0.3})],
    "each measured": [("FitnessNoise", {"sigma": 0.3}), ("Resample", {"n": 4, "aggregate": "q10"})],
    "aggregate measured": [("Resample", {"n": 4}), ("FitnessNoise", {"sigma": 0.3})],
    "everything": [
        ("JakobiNoise", {"level": 0.5, "tilt": 3.0}),
        ("FitnessNoise", {"sigma": 0.1}),
        ("Resample", {"n": 2, "aggregate": "min"}),
    ],
    "twice": [("JakobiNoise", {"frequency": 0.3}), ("JakobiNoise", {"frequency": 0.05})],
    "noise on numbers": [("DiscreteAction", {}), ("JakobiNoise", {})],
    "numbers of noise": [("JakobiNoise", {}), ("DiscreteAction", {})],
}


def wrapped(env, stack, module):
    for name, options in stack:
        env = getattr(module, name)(env, **options)
    return env


def single(stack, **options):
    return wrapped(gym.make(softvox_gym.ENV_ID, **options), stack, wrappers)


def batch(n, stack, mode=AutoresetMode.NEXT_STEP, **options):
    env = gym.make_vec(softvox_gym.ENV_ID, num_envs=n, autoreset_mode=mode, **options)
    return wrapped(env, stack, vector)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("stack", STACKS.values(), ids=STACKS)
def test_a_vector_draws_what_single_environments_draw(stack, mode):
    ours = batch(3, stack, mode, physics=SHORT)
    theirs = SyncVectorEnv(
        [lambda: single(stack, physics=SHORT, disable_env_checker=True)] * 3, autoreset_mode=mode
    )
    assert_same(ours.reset(seed=4), theirs.reset(seed=4))
    ours.action_space.seed(1)
    for _ in range(3):
        actions = ours.action_space.sample()
        step, other = ours.step(actions), theirs.step(actions)
        assert_same(sorted_infos(step), sorted_infos(other))
        if mode is AutoresetMode.DISABLED:
            ours.reset(options={"reset_mask": step[2]})
            theirs.reset(options={"reset_mask": other[2]})


def sorted_infos(step):
    *others, infos = step
    return (*others, {key: infos[key] for key in sorted(infos)})


@pytest.mark.parametrize(
    "stack",
    [[("JakobiNoise", {"level": 0})], [("FitnessNoise", {"sigma": 0})], [("Resample", {"n": 4})]],
    ids=lambda stack: stack[0][0],
)
def test_without_noise_the_wrapped_environment_is_the_bare_one(stack):
    bare, env = batch(8, []), batch(8, stack)
    actions = bare.action_space.sample()
    for each in (bare, env):
        each.reset(seed=3)
    step, other = bare.step(actions), env.step(actions)
    assert step[1].tobytes() == other[1].tobytes()
    assert step[0].tobytes() == other[0].tobytes()
    same = [key for key in step[4] if key != "steps"]
    assert all(np.array_equal(step[4][key], other[4][key]) for key in same)
    assert not wrappers.is_noisy(env)


def test_trials_that_cant_differ_count_like_those_that_do():
    for name in (softvox_gym.ENV_ID, softvox_gym.TABLE_ENV_ID):
        env = vector.Resample(gym.make_vec(name, num_envs=2), 8)
        env.reset(seed=1)
        infos = env.step(np.tile(BEST, (2, 1)))[4]
        assert infos["steps"].tolist() == [8 * simulate(6453).steps[0]] * 2


@pytest.mark.parametrize("level", [0.5, 1.0])
def test_amounts_of_nothing_disturb_nothing(level):
    """All random numbers are drawn, and times zero: the same bits by the general path."""
    nothing = dict.fromkeys(AMOUNTS, 0.0)
    env = batch(6, [("JakobiNoise", {"level": level, **nothing})])
    env.reset(seed=1)
    designs = np.array([6453, 4295, 5757, 6255, 1, 0])
    _, rewards, _, _, infos = env.step(designs[:, np.newaxis] // 3 ** np.arange(8) % 3)
    assert rewards.tobytes() == simulate(designs).fitness.tobytes()
    assert infos["displacement"].tobytes() == simulate(designs).displacement.tobytes()
    assert wrappers.is_noisy(env)


def test_the_same_seed_gives_the_same_noise_and_another_another():
    env = single(STACKS["noise"], physics=SHORT)
    rewards = []
    for seed in (1, 1, 2, None):
        env.reset(seed=seed)
        rewards.append(env.step(BEST)[1])
    assert rewards[0] == rewards[1]
    assert len(set(rewards)) == 3


def test_noise_ends_with_the_step():
    env = single(STACKS["noise"], physics=SHORT)
    env.reset(seed=1)
    env.step(BEST)
    bare = gym.make(softvox_gym.ENV_ID, physics=SHORT)
    bare.reset()
    env.unwrapped.reset()
    assert env.unwrapped.step(BEST)[1] == bare.step(BEST)[1]


def test_noise_ends_with_a_step_that_fails():
    env = single(STACKS["noise resampled"], physics=SHORT, disable_env_checker=True)
    env.reset(seed=1)
    with pytest.raises(ValueError, match="digits 0, 1 and 2"):
        env.step(np.full(8, 3))
    env.unwrapped.reset()
    assert env.unwrapped.step(BEST)[1] == simulate(6453, Physics.of(SHORT)).fitness[0]


def test_a_resampled_step_tells_all_values():
    env = single([("JakobiNoise", {}), ("Resample", {"n": 6, "aggregate": "min"})], physics=SHORT)
    env.reset(seed=5)
    observation, reward, _, _, info = env.step(BEST)
    values = info["values"]
    assert values.shape == (6,)
    assert len(set(values)) == 6
    assert reward == info["fitness"] == values.min()
    assert info["mean"] == values.mean()
    assert info["standard_error"] == values.std(ddof=1) / np.sqrt(6)
    assert info["displacements"].shape == (6, 3)
    np.testing.assert_allclose(info["displacements"].mean(axis=0), info["displacement"], rtol=1e-14)
    np.testing.assert_allclose(np.hypot(*info["displacements"].T[:2]), values, rtol=1e-14)
    assert observation.shape == env.observation_space.shape


def test_a_trial_of_a_resampled_step_is_the_simulation_that_its_draws_ask_for():
    env = single(STACKS["noise resampled"], physics=SHORT)
    env.reset(seed=5)
    info = env.step(BEST)[4]
    physics = Physics.of(SHORT)
    rng = gym.utils.seeding.np_random(5)[0]
    drawn = Jakobi(2.0).disturb(Trials.of(physics, Lattice(), 3), rng)
    result = simulate([6453] * 3, drawn.physics, strain=drawn.strain, phase=drawn.phase)
    assert result.displacement.tobytes() == info["displacements"].tobytes()


@pytest.mark.parametrize(
    ("aggregate", "by_hand"),
    [
        ("mean", 4.5),
        ("min", 1.0),
        ("q10", 1.7),
        ("cvar25", 1.5),
    ],
)
def test_an_aggregate_is_what_its_name_says(aggregate, by_hand):
    values = np.array([3.0, 1.0, 2.0, 4.0, 8.0, 7.0, 6.0, 5.0])
    assert AGGREGATES[aggregate](values) == pytest.approx(by_hand)
    rows = np.array([values, values + 1])
    np.testing.assert_allclose(AGGREGATES[aggregate](rows), [by_hand, by_hand + 1])


def test_the_worst_quarter_of_six_values_holds_one_and_a_half():
    values = np.array([5.0, 1.0, 4.0, 2.0, 3.0, 6.0])
    assert AGGREGATES["cvar25"](values) == pytest.approx((1.0 + 0.5 * 2.0) / 1.5)


def test_sources_have_the_spread_they_say():
    n = 40_000
    physics = Physics.published()
    noise = Jakobi(leak=0.25, tilt=2.0)
    short = physics.lasting(0.01)  # strain is drawn for two cycles
    drawn = noise.disturb(Trials.of(short, Lattice(), n), np.random.default_rng(0))
    close = {"abs": 0, "rel": 4 / np.sqrt(n)}
    # The voxels' own phase, and the one that all share because the frequency differs at the start.
    assert (drawn.phase - drawn.phase[:, :1, :1, :1]).std() * np.sqrt(8 / 14) == pytest.approx(
        0.02, rel=0.02
    )
    begun = drawn.phase.mean(axis=(1, 2, 3)) + drawn["frequency_hz"] * 0.25
    assert begun.std() == pytest.approx(0.02 / np.sqrt(8), **close)
    assert (drawn["frequency_hz"] / physics.frequency_hz).std() == pytest.approx(0.02, **close)
    assert np.log(drawn["friction_static"]).std() == pytest.approx(0.2, **close)
    assert np.log(drawn["youngs_modulus"]).std() == pytest.approx(0.05, **close)
    assert np.log(drawn["density"]).std() == pytest.approx(0.05, **close)
    assert np.all(drawn["friction_kinetic"] <= drawn["friction_static"])
    leaks = (drawn.strain == 0).all(axis=1)
    assert leaks.mean() == pytest.approx(0.25, abs=4 * np.sqrt(0.25 * 0.75 / (8 * n)))
    share = drawn.strain[~leaks.reshape(n, 8).any(axis=1)] / physics.strain
    # Of a product of two independent factors 1 + 0.1 z.
    assert share[:, 0].std() == pytest.approx(np.sqrt(0.02 + 0.0001), **close)
    voxels = share[:, 0].reshape(-1), share[:, 1].reshape(-1)
    assert np.corrcoef(*voxels)[0, 1] == pytest.approx(0.01 / 0.0201, abs=0.02)
    angle = np.degrees(np.arccos(-drawn["gravity"][:, 2] / 9.81))
    assert np.sqrt((angle**2).mean()) == pytest.approx(2.0, **close)
    np.testing.assert_allclose(np.linalg.norm(drawn["gravity"], axis=1), 9.81, rtol=1e-12)
    azimuth = np.arctan2(drawn["gravity"][:, 1], drawn["gravity"][:, 0])
    assert abs(np.exp(1j * azimuth).mean()) < 4 / np.sqrt(n)


def test_levels_scale_the_same_draws():
    physics = Physics.published()
    one, two = (
        Jakobi(level).disturb(Trials.of(physics, Lattice(), 5), np.random.default_rng(3))
        for level in (1.0, 2.0)
    )
    np.testing.assert_allclose(two.phase, 2 * one.phase)
    np.testing.assert_allclose(
        two["frequency_hz"] - physics.frequency_hz, 2 * (one["frequency_hz"] - physics.frequency_hz)
    )
    np.testing.assert_allclose(np.log(two["friction_static"]), 2 * np.log(one["friction_static"]))


def test_a_source_turned_off_leaves_the_others_alone():
    physics = Physics.published()
    full, less = (
        noise.disturb(Trials.of(physics, Lattice(), 5), np.random.default_rng(3))
        for noise in (Jakobi(), Jakobi(friction=0.0, leak=0.0))
    )
    np.testing.assert_array_equal(less["friction_static"], physics.friction_static)
    np.testing.assert_array_equal(less["gravity"], full["gravity"])
    np.testing.assert_array_equal(less.phase, full.phase)


def test_a_tilted_floor_only_turns_gravity():
    rng = np.random.default_rng(0)
    g = rng.standard_normal((50, 3))
    angle = rng.random(50) * 2 * np.pi
    downhill = np.array([np.cos(angle), np.sin(angle)])
    turned = tilted(g, rng.standard_normal(50), downhill)
    across = np.stack([-downhill[1], downhill[0], np.zeros(50)], axis=-1)
    np.testing.assert_allclose(np.linalg.norm(turned, axis=1), np.linalg.norm(g, axis=1))
    np.testing.assert_allclose((turned * across).sum(axis=1), (g * across).sum(axis=1))


def test_gravity_on_a_tilted_floor_pulls_downhill():
    g = np.array([[0.0, 0.0, -10.0]] * 2)
    turned = tilted(g, np.radians([30.0, 30.0]), np.array([[1.0, 0.0], [0.0, 1.0]]))
    np.testing.assert_allclose(
        turned, [[5, 0, -10 * np.sqrt(3) / 2], [0, 5, -10 * np.sqrt(3) / 2]], atol=1e-12
    )


def test_a_tilted_floor_moves_a_passive_robot_only_where_friction_is_overcome():
    tilt = {**dict.fromkeys(AMOUNTS, 0.0), "tilt": 60.0}
    env = batch(16, [("JakobiNoise", tilt)], physics=SHORT)
    env.reset(seed=2)
    actions = np.ones((16, 8), dtype=int)
    rewards = env.step(actions)[1]
    angles = np.array([abs(60 * draw_of_tilt(seed)) for seed in range(2, 18)])
    # Kinetic friction of 0.5 stops what slides below 26.6 degrees; static of 1 holds up to 45.
    assert np.all(rewards[angles < 26.5] < 0.01)
    assert np.all(rewards[angles > 45] > 1)
    assert (angles < 26.5).any()


def draw_of_tilt(seed):
    """Return the standard normal number behind the tilt of one trial."""
    rng = gym.utils.seeding.np_random(seed)[0]
    rng.standard_normal(8), rng.random(8), rng.standard_normal(8)
    rng.standard_normal(1), rng.standard_normal((2, 1)), rng.standard_normal(1)
    rng.standard_normal(1)
    return rng.standard_normal()


def test_a_track_of_a_slower_or_faster_actuation_has_the_nominal_length():
    slow = {**dict.fromkeys(AMOUNTS, 0.0), "frequency": 0.2}
    env = batch(12, [("JakobiNoise", slow)])
    env.reset(seed=2)
    observations, _, _, _, infos = env.step(np.tile(BEST, (12, 1)))
    assert env.observation_space.contains(observations)
    assert observations.shape == (12, 16, 3)
    ends = observations[:, -1] == infos["displacement"]
    assert ends.all(axis=1).any()
    assert not ends.all()


def test_measurement_noise_leaves_the_displacement_alone():
    env = batch(64, [("FitnessNoise", {"sigma": 0.5})], physics=SHORT)
    env.reset(seed=2)
    _, rewards, _, _, infos = env.step(np.tile(BEST, (64, 1)))
    exact = simulate(6453, Physics.of(SHORT)).fitness[0]
    travelled = np.sqrt(infos["displacement"][:, 0] ** 2 + infos["displacement"][:, 1] ** 2)
    assert np.all(travelled == exact)
    assert np.array_equal(rewards, infos["fitness"])
    assert (rewards - exact).std() == pytest.approx(0.5, rel=0.3)


def test_a_design_that_diverges_has_the_value_0_whatever_is_measured():
    wild = {"strain": 1e6}
    env = single([("FitnessNoise", {"sigma": 1.0}), ("Resample", {"n": 3})], physics=wild)
    env.reset(seed=0)
    _, reward, _, _, info = env.step(np.full(8, 2))
    assert info["diverged"] is True
    assert reward == 0
    assert np.isnan(info["fitness"])
    assert not info["values"].any()
    bare = single([("FitnessNoise", {"sigma": 1.0})], physics=wild)
    bare.reset(seed=0)
    assert bare.step(np.full(8, 2))[1] == 0


def test_a_picture_shows_a_disturbed_robot():
    env = single(STACKS["noise"], render_mode="rgb_array")
    bare = single([], render_mode="rgb_array")
    for each in (env, bare):
        each.reset(seed=1)
        each.step(BEST)
    empty = bare.render().copy()
    bare.reset()
    assert np.any(env.render() != empty)
    assert np.any(env.render() != bare.render())


def test_single_wrappers_survive_json():
    env = single(STACKS["everything"], physics=SHORT)
    again = gym.make(gym.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    for each in (env, again):
        each.reset(seed=9)
    assert json.loads(env.spec.to_json())["additional_wrappers"]
    assert env.step(BEST)[1] == again.step(BEST)[1]


@pytest.mark.parametrize(
    ("wrap", "error", "message"),
    [
        (lambda m, e: m.JakobiNoise(e, level=-1), ValueError, "level must be finite and at least"),
        (lambda m, e: m.JakobiNoise(e, level=np.nan), ValueError, "level must be finite"),
        (lambda m, e: m.JakobiNoise(e, level="1"), TypeError, "level must be a number, got '1'"),
        (lambda m, e: m.JakobiNoise(e, wind=1.0), ValueError, "no source 'wind'; the sources are"),
        (lambda m, e: m.JakobiNoise(e, leak=2), ValueError, "leak must be a probability"),
        (lambda m, e: m.JakobiNoise(e, tilt=-1), ValueError, "tilt must be finite and at least 0"),
        (lambda m, e: m.Resample(e, 0), ValueError, "n must be at least 1"),
        (lambda m, e: m.Resample(e, 2.5), TypeError, "n must be a whole number"),
        (lambda m, e: m.Resample(e, 2, "median"), ValueError, "the aggregates are mean, min, q10"),
        (lambda m, e: m.Resample(m.Resample(e, 2), 2), ValueError, "resampled already"),
        (lambda m, e: m.FitnessNoise(e, 10**400), ValueError, "sigma must be a number"),
        (lambda m, e: m.FitnessNoise(e, -0.1), ValueError, "sigma must be finite and at least 0"),
    ],
)
@pytest.mark.parametrize("kind", ["single", "vector"])
def test_bad_arguments_say_what_is_valid(kind, wrap, error, message):
    module, env = (wrappers, single([])) if kind == "single" else (vector, batch(2, []))
    with pytest.raises(error, match=message):
        wrap(module, env)


def test_foreign_environments_are_refused():
    with pytest.raises(TypeError, match="works on this package's environments"):
        wrappers.JakobiNoise(gym.make("CartPole-v1"))
    with pytest.raises(TypeError, match="before they are made one"):
        vector.JakobiNoise(SyncVectorEnv([lambda: gym.make(softvox_gym.ENV_ID)] * 2))


def test_a_table_cant_be_disturbed_but_measured_with_noise():
    env = gym.make(softvox_gym.TABLE_ENV_ID)
    with pytest.raises(ValueError, match="make SoftVox2x2x2-v0 instead"):
        wrappers.JakobiNoise(env)
    assert not wrappers.is_noisy(wrappers.JakobiNoise(env, level=0))
    noisy = wrappers.FitnessNoise(env, 0.1)
    noisy.reset(seed=1)
    exact = np.hypot(*tracks().track[6453, -1, :2])
    assert 0 < abs(noisy.step(BEST)[1] - exact) < 1


@pytest.mark.parametrize("noisy", [True, False])
def test_noise_inside_a_foreign_vector_is_seen(noisy):
    stack = STACKS["noise"] if noisy else []
    assert wrappers.is_noisy(SyncVectorEnv([lambda: single(stack)] * 2)) is noisy


@pytest.mark.parametrize("name", ["Resample", "FitnessNoise", "JakobiNoise"])
def test_a_step_that_only_resets_passes_through(name):
    options = {"Resample": {"n": 2}, "FitnessNoise": {"sigma": 0.3}, "JakobiNoise": {}}[name]
    inner = gym.wrappers.Autoreset(gym.make(softvox_gym.ENV_ID, physics=SHORT))
    env = getattr(wrappers, name)(inner, **options)
    env.reset(seed=1)
    for step in range(4):
        _, reward, terminated, _, info = env.step(BEST)
        assert terminated is (step % 2 == 0)
        assert (reward > 0, "fitness" in info) == (terminated, terminated)


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_statistics_may_be_recorded_within(mode):
    bare = gym.make_vec(softvox_gym.TABLE_ENV_ID, num_envs=2, autoreset_mode=mode)
    env = vector.Resample(gym.wrappers.vector.RecordEpisodeStatistics(bare), 3)
    env.reset(seed=0)
    _, rewards, _, _, infos = env.step([[0, 0, 0, 2, 1, 2, 2, 2]] * 2)
    assert infos["episode"]["r"].tolist() == pytest.approx(rewards)
    assert infos.get("final_info", infos)["values"].shape == (2, 3)


def test_an_action_that_is_refused_draws_nothing():
    env = single(STACKS["noise"], physics=SHORT, disable_env_checker=True)
    rewards = []
    for refused in (False, True):
        env.reset(seed=1)
        if refused:
            with pytest.raises(ValueError, match="digits 0, 1 and 2"):
                env.step(np.full(8, 3))
        rewards.append(env.step(BEST)[1])
    assert rewards[0] == rewards[1]


class Copies(gym.ActionWrapper):
    """Makes another array, or a list, of every action."""

    def __init__(self, env, make):
        super().__init__(env)
        self.action = make


LOSES = {
    "array": np.array,
    "list": list,
    "where": lambda action: np.where(action > 1, 2, action),
    "concatenate": lambda action: np.concatenate([action[:4], action[4:]]),
}


@pytest.mark.parametrize("stack", [("JakobiNoise", {}), ("Resample", {"n": 3})], ids=str)
@pytest.mark.parametrize("make", LOSES.values(), ids=LOSES)
def test_what_is_asked_is_not_lost_unsaid(make, stack):
    env = wrapped(Copies(gym.make(softvox_gym.ENV_ID), make), [stack], wrappers)
    env.reset(seed=1)
    with pytest.raises(TypeError, match=f"the requests of {stack[0]} don't reach the environment"):
        env.step(BEST)
    around = Copies(single([stack]), make)
    around.reset(seed=1)
    usual = single([stack])
    usual.reset(seed=1)
    assert around.step(BEST)[1] == usual.step(BEST)[1]


def test_what_is_asked_of_a_vector_is_not_lost_unsaid():
    class Lists(VectorWrapper):
        def step(self, actions):
            return self.env.step(actions.tolist())

    env = gym.make_vec(softvox_gym.ENV_ID, num_envs=2, autoreset_mode=AutoresetMode.SAME_STEP)
    env = vector.Resample(vector.JakobiNoise(Lists(env)), 2)
    env.reset(seed=1)
    with pytest.raises(TypeError, match="the requests of JakobiNoise don't reach the environment"):
        env.step([BEST, BEST])


def test_wrappers_keep_nothing_from_step_to_step():
    """Threads that step one chain side by side, each with trials of its own, don't mix them up."""
    env = gym.make(softvox_gym.TABLE_ENV_ID, disable_env_checker=True)  # which threads would share
    stacks = [wrappers.Resample(env, n) for n in (2, 3, 5)]
    env.reset(seed=0)

    def stepped(i):
        return len(stacks[i % 3].step(BEST)[4]["values"])

    with ThreadPoolExecutor(6) as pool:
        assert list(pool.map(stepped, range(60))) == [2, 3, 5] * 20


@pytest.mark.parametrize("name", ["SoftVox3x3x3-v0", "SoftVox4x4x4-v0"])
def test_larger_lattices_draw_alike_single_and_in_a_vector(name):
    stack = STACKS["everything"]
    short = {"preset": "published", "duration": 0.4}
    ours = wrapped(gym.make_vec(name, num_envs=2, physics=short), stack, vector)
    theirs = SyncVectorEnv([lambda: wrapped(gym.make(name, physics=short), stack, wrappers)] * 2)
    assert_same(ours.reset(seed=4), theirs.reset(seed=4))
    ours.action_space.seed(1)
    actions = ours.action_space.sample()
    assert_same(sorted_infos(ours.step(actions)), sorted_infos(theirs.step(actions)))


@pytest.mark.parametrize("name", [softvox_gym.ENV_ID, "SoftVox3x3x3-v0"])
def test_an_action_is_the_designs_number(name):
    env = wrappers.DiscreteAction(gym.make(name, physics=SHORT))
    lattice = env.unwrapped.evaluator.lattice
    assert env.action_space == gym.spaces.Discrete(lattice.n_designs)
    env.reset(seed=0)
    for number in (0, 6453, lattice.n_designs - 1):
        assert env.step(number)[4]["design"] == number
        assert env.step(np.int64(number))[4]["design"] == number
    assert isinstance(gym.make(env.spec), wrappers.DiscreteAction)
    assert json.loads(env.spec.to_json())["additional_wrappers"][-1]["kwargs"] == {}


@pytest.mark.parametrize("action", [6561, -1, 1.0, "a", None, True])
def test_a_number_that_no_design_has_is_refused(action):
    env = wrappers.DiscreteAction(gym.make(softvox_gym.ENV_ID))
    env.reset()
    with pytest.raises(ValueError, match="from 0 to 6560"):
        env.step(action)
    envs = vector.DiscreteAction(gym.make_vec(softvox_gym.ENV_ID, num_envs=2))
    envs.reset()
    with pytest.raises(ValueError, match="from 0 to 6560"):
        envs.step([action, action])


def test_actions_that_numbers_can_not_stand_for_are_refused():
    for module, make in ((wrappers, gym.make), (vector, gym.make_vec)):
        with pytest.raises(ValueError, match="at most 39 sites"):
            module.DiscreteAction(make("SoftVox4x4x4-v0"))
        with pytest.raises(TypeError, match="needs a MultiDiscrete action"):
            module.DiscreteAction(make("CartPole-v1"))


@pytest.mark.parametrize(
    ("make", "theirs", "first"),
    [(gym.make, gym.wrappers, ()), (gym.make_vec, gym.wrappers.vector, (0,))],
)
@pytest.mark.filterwarnings("ignore:.*precision lowered by casting:UserWarning")
def test_gymnasiums_wrappers_make_observations_flat_bounded_and_scaled(make, theirs, first):
    """As docs/environments/wrappers.md shows it."""
    space = gym.spaces.Box(-10, 10, (48,))
    kind = {"observation_space": space} if not first else {"single_observation_space": space}
    env = theirs.DtypeObservation(theirs.FlattenObservation(make(softvox_gym.ENV_ID)), np.float32)
    env = theirs.TransformObservation(env, lambda track: track.clip(-10, 10), **kind)
    env = theirs.RescaleObservation(env, np.float32(-1), np.float32(1))
    start, _ = env.reset(seed=0)
    end = env.step(BEST if not first else BEST[np.newaxis])[0]
    assert start.dtype == end.dtype == np.float32
    assert start in env.observation_space
    track = simulate(6453, track=1).track[0]
    np.testing.assert_allclose(end[first], track.ravel() / 10, rtol=0, atol=1e-6)
