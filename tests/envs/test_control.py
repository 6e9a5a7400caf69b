"""Control: the published pump to the bit, side by side as one by one, and back to what was."""

import json
import pickle
import warnings
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers import DtypeObservation, RescaleAction, RescaleObservation
from test_vector_env import assert_same

from softvox_gym import (
    Design,
    Lattice,
    Physics,
    Simulation,
    evaluate,
    landscape,
    reality,
    simulate,
)
from softvox_gym.envs.control import SoftVoxControlEnv
from softvox_gym.tasks import Task
from softvox_gym.wrappers import JakobiNoise

ID = "SoftVoxControl-v0"
SHORT = {"preset": "published", "duration": 0.9}  # 2.6 cycles: the last interval is shorter
#: Edges of 151 resting lengths tear every link; small amplitudes don't.
DIVERGENT = {"preset": "published", "duration": 0.9, "strain": 150.0}


def make(**options):
    return gym.make(ID, **options)


def played(env, choose):
    """Play an episode; return its rewards and the last info."""
    env.reset(seed=0)
    rewards, over = [], False
    while not over:
        _, reward, terminated, truncated, info = env.step(choose(env))
        rewards.append(reward)
        over = terminated or truncated
    return rewards, info


def fully(env):
    return env.action_space.high


@pytest.mark.parametrize("design", [6453, 135, 2117, 54, 2])
@pytest.mark.parametrize("interval", [1.0, 0.7])
def test_the_published_pump_gives_the_published_displacement(design, interval):
    rewards, info = played(make(design=design, interval=interval), fully)
    row = landscape()[design]
    assert info["displacement"].tolist() == [row["dx"], row["dy"], row["dz"]]
    assert info["fitness"] == row["fitness"] == pytest.approx(sum(rewards), abs=1e-12)
    assert len(rewards) == {1.0: 15, 0.7: 22}[interval]


def test_so_does_it_side_by_side():
    envs = gym.make_vec(ID, num_envs=9, design="00021222", autoreset_mode="SameStep")
    envs.reset(seed=0)
    for _ in range(15):
        actions = envs.action_space.high.copy()
        actions[1] = 0
        infos = envs.step(actions)[4]
    final, row = infos["final_info"], landscape()[6453]
    expected = [[row["dx"], row["dy"], row["dz"]]] * 9
    differs = (final["displacement"] != expected).any(axis=1)
    assert np.flatnonzero(differs).tolist() == [1]


@pytest.mark.parametrize("name", ["fabrication", "lag"])
def test_a_reality_is_played_as_it_is_evaluated(name):
    info = played(make(reality=name), fully)[1]
    assert info["fitness"] == evaluate(6453, reality(name)).fitness[0, 0]


def test_a_reality_builds_a_phased_design_as_it_is_evaluated():
    design = Design("30003334", shape=Lattice.of((2, 2, 2), phases=4))
    world = replace(reality("fabrication"), physics=Physics.of(SHORT))
    info = played(make(design=design, reality=world), fully)[1]
    assert info["fitness"] == world.simulate(design).fitness[0]


@pytest.mark.parametrize("groups", [False, True])
def test_voxels_of_every_phase_are_controlled(groups):
    design = Design("02302312", shape=Lattice.of((2, 2, 2), phases=2))
    env = make(design=design, physics=SHORT, groups=groups, render_mode="rgb_array")
    driven = [site for sites in env.unwrapped.actuators for site in sites]
    assert sorted(driven) == [1, 2, 4, 5, 7]
    info = played(env, fully)[1]
    assert info["fitness"] == simulate(design, Physics.of(SHORT)).fitness[0]
    assert env.unwrapped.episodes._stand.active.sum() == design.n_active


def test_an_episode_of_other_phases_is_refused():
    envs = [
        make(design=Design("23000000", shape=Lattice.of((2, 2, 2), phases=phases)), physics=SHORT)
        for phases in (2, 4)
    ]
    envs[0].reset()
    envs[1].reset()
    with pytest.raises(ValueError, match="another design"):
        envs[1].unwrapped.restore(envs[0].unwrapped.save())


@pytest.mark.parametrize("mode", AutoresetMode)
@pytest.mark.parametrize(
    "options",
    [
        {"physics": SHORT},
        {"physics": DIVERGENT},
        {"physics": SHORT, "interval": 0.3, "design": 426, "groups": True, "task": "directed"},
    ],
    ids=["plain", "divergent", "groups"],
)
def test_side_by_side_it_is_as_one_by_one(mode, options):
    n = 5
    ours = gym.make_vec(ID, num_envs=n, autoreset_mode=mode, **options)
    theirs = gym.make_vec(ID, n, "sync", vector_kwargs={"autoreset_mode": mode}, **options)
    assert ours.single_observation_space == theirs.single_observation_space
    assert ours.metadata == theirs.metadata
    assert_same(ours.reset(seed=5), theirs.reset(seed=5))
    rng, ends = np.random.default_rng(1), set()
    for k in range(7):
        # A part of them hardly moves, so that where high strains diverge some go on.
        share = rng.random(ours.action_space.shape) * np.where(np.arange(n) % 2, 1e-4, 1)[:, None]
        actions = (share * ours.action_space.high).astype(np.float32)
        step = ours.step(actions)
        assert_same(step, theirs.step(actions))
        assert np.isfinite(step[0]).all()
        assert np.isfinite(step[1]).all()
        over = step[2] | step[3]
        ends.add(int(over.sum()))
        mask = over | (np.arange(n) == k)  # one is reset in the middle of its episode
        if mode is AutoresetMode.DISABLED and mask.any():
            assert_same(
                ours.reset(options={"reset_mask": mask}), theirs.reset(options={"reset_mask": mask})
            )
    if options["physics"] is DIVERGENT:
        assert ends & {1, 2, 3, 4}  # some were over while others went on


def test_side_by_side_it_is_shown_as_one_by_one():
    options = {"physics": SHORT, "interval": 0.2, "render_mode": "rgb_array_list"}
    ours = gym.make_vec(ID, num_envs=2, **options)
    theirs = gym.make_vec(ID, 2, "sync", **options)
    assert ours.metadata == theirs.metadata
    ours.reset(seed=0)
    theirs.reset(seed=0)
    for share in (1.0, 0.3):
        actions = ours.action_space.high * np.array([[1], [share]], np.float32)
        ours.step(actions)
        theirs.step(actions)
    assert_same(ours.render(), theirs.render())


def test_an_observation_says_what_the_simulation_does():
    env = make(design="00021222", interval=0.25)
    env.reset(seed=0)
    sim = Simulation(6453)
    sim.advance(until=0.25)
    frequency = float(sim.physics.frequency_hz)
    for k in range(1, 4):
        observation = env.step(env.action_space.high)[0]
        sim.advance(until=0.25 + k * 0.25 / frequency)
        there, state = sim.designs[0].T > 0, sim.state
        voxels = observation[9:].reshape(5, 8)
        position, velocity, edge, floor = (
            values[0].swapaxes(0, 2)[there] / scale
            for values, scale in (
                (state.relative_position, 0.01),
                (state.relative_velocity, 0.01),
                (state.edge, 0.01),
                (state.on_floor, 1),
            )
        )
        np.testing.assert_allclose(observation[:3], sim.displacement[0], atol=1e-6)
        mean = state.velocity[0].swapaxes(0, 2)[there].mean(axis=0) / 0.01
        np.testing.assert_allclose(observation[3:6], mean, rtol=1e-5)
        turn = 2 * np.pi * frequency * state.time[0]
        np.testing.assert_allclose(observation[6:8], [np.cos(turn), np.sin(turn)], atol=1e-6)
        assert observation[8] == np.float32(k / 60)
        np.testing.assert_allclose(voxels[:, :3], position, atol=1e-6)
        np.testing.assert_allclose(voxels[:, 3:6], velocity, atol=1e-5)
        np.testing.assert_array_equal(voxels[:, 6], floor)
        np.testing.assert_allclose(voxels[:, 7], edge, rtol=1e-6)
    assert observation in env.observation_space
    assert np.isfinite(env.observation_space.low).all()
    assert np.isfinite(env.observation_space.high).all()


def test_what_lies_beyond_the_bounds_is_cut_to_them():
    env = make(physics={"preset": "published", "duration": 0.5, "gravity": [900.0, 0.0, -9.81]})
    env.reset(seed=0)
    observation = env.step(env.action_space.high)[0]
    assert observation in env.observation_space
    assert observation[3] == env.observation_space.high[3] == 20


def test_rewards_add_up_to_the_fitness_however_it_is_played():
    for options in ({}, {"task": "directed", "heading": 230.0}):
        env = make(physics=SHORT, interval=0.2, **options)
        env.action_space.seed(3)
        rewards, info = played(env, lambda env: env.action_space.sample())
        assert len(rewards) == 13
        assert info["fitness"] == pytest.approx(sum(rewards), abs=1e-12)
    worth = Task.of("directed", 230.0).reward(info["displacement"])
    assert info["fitness"] == worth


def test_one_that_diverges_ends_and_loses_what_it_had():
    env = make(physics=DIVERGENT, interval=0.2)
    shares = iter([1e-3, 1e-3, 1.0, 1.0, 1.0])
    rewards, info = played(env, lambda env: env.action_space.high * np.float32(next(shares)))
    assert info["diverged"] is True
    assert np.isnan([info["fitness"], *info["displacement"]]).all()
    assert rewards[0] > 0
    assert sum(rewards) == pytest.approx(0.0, abs=1e-12)
    with pytest.raises(gym.error.ResetNeeded):
        env.unwrapped.step(env.action_space.high)


def test_neighbours_in_a_slice_share_an_actuator():
    design = Design("222022012", shape=(3, 1, 3))  # 222 / 022 / 012, from the floor up
    assert make(design=design).unwrapped.actuators == ((0,), (1,), (2,), (4,), (5,), (8,))
    env = make(design=design, groups=True, physics=SHORT)
    assert env.unwrapped.actuators == ((0, 1, 2), (4, 5), (8,))
    apart = make(design="20020222", groups=True).unwrapped
    assert apart.actuators == ((0,), (3,), (5, 6, 7))
    voxel_by_voxel = make(design=design, physics=SHORT)
    action = np.array([0.1, 0.0, 0.2], np.float32)
    env.reset()
    voxel_by_voxel.reset()
    assert_same(env.step(action), voxel_by_voxel.step(action[[0, 0, 0, 1, 1, 2]]))


def test_saved_and_restored_it_goes_on_to_the_bit():
    env, other = make(physics=SHORT, interval=0.3), make(physics=SHORT, interval=0.3)
    env.action_space.seed(4)
    actions = [env.action_space.sample() for _ in range(9)]
    env.reset(seed=0)
    observation = [env.step(action)[0] for action in actions[:4]][-1]
    saved = env.unwrapped.save()
    first = [env.step(action) for action in actions[4:]]
    assert_same(env.unwrapped.restore(saved), observation)  # after its end
    env.step(actions[0])
    env.unwrapped.restore(saved)
    assert_same([env.step(action) for action in actions[4:]], first)
    assert_same(other.unwrapped.restore(saved), observation)  # before its reset
    assert_same([other.unwrapped.step(action) for action in actions[4:]], first)
    envs = gym.make_vec(ID, num_envs=3, physics=SHORT, interval=0.3)
    assert_same(envs.unwrapped.restore(saved), np.stack([observation] * 3))
    for k, action in enumerate(actions[4:]):
        step = envs.step(np.stack([action] * 3))
        assert_same(step[0][2], first[k][0])
        assert step[1].tolist() == [first[k][1]] * 3
    assert step[3].all()


def test_an_environment_of_a_vector_is_saved_as_a_single_one():
    env, envs = make(physics=SHORT), gym.make_vec(ID, num_envs=2, physics=SHORT)
    for each in (env, envs):
        each.reset(seed=0)
    env.step(env.action_space.high)
    envs.step(np.stack([env.action_space.low, env.action_space.high]))
    assert envs.unwrapped.save(1) == env.unwrapped.save() != envs.unwrapped.save(0)
    with pytest.raises(ValueError, match="number must be at least 0 and at most 1, got 2"):
        envs.unwrapped.save(2)


def test_foreign_bytes_are_refused():
    env = make(physics=SHORT)
    env.reset(seed=0)
    saved = env.unwrapped.save()
    broken = saved[:-1] + bytes([saved[-1] ^ 1])
    for bytes_, message in (
        (b"", "not a saved episode"),
        (Simulation(6453).save(), "not a saved episode"),
        (saved.replace(b"control 1", b"control 2"), "another format"),
        (broken, "is damaged"),
    ):
        with pytest.raises(ValueError, match=message):
            env.unwrapped.restore(bytes_)
    with pytest.raises(TypeError, match="must be bytes, got str"):
        env.unwrapped.restore("text")
    for others in (
        {"physics": SHORT, "design": 6452},
        {"physics": SHORT, "interval": 0.5},
        {"physics": {**SHORT, "friction_static": 0.9}},
        {"physics": SHORT, "design": "00021222", "shape": (4, 2, 1)},
    ):
        with pytest.raises(ValueError, match="another design, physics or interval"):
            make(**others).unwrapped.restore(saved)
    assert env.step(env.action_space.high)[1] > 0  # and it goes on


def test_what_is_over_or_not_begun_cant_be_stepped_or_saved():
    env = make(physics={"preset": "published", "duration": 0.4}).unwrapped
    for attempt in (env.save, lambda: env.step(env.action_space.high)):
        with pytest.raises(gym.error.ResetNeeded, match="reset"):
            attempt()
    env.reset()
    assert env.step(env.action_space.high)[3] is True
    for attempt in (env.save, lambda: env.step(env.action_space.high)):
        with pytest.raises(gym.error.ResetNeeded, match="reset"):
            attempt()


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"design": 1}, ValueError, "no active voxel"),
        ({"design": 0}, ValueError, "no active voxel"),
        ({"design": 6561}, ValueError, "6560"),
        ({"design": "0002122x"}, ValueError, "neither a number from 0 to 6560 nor 8 digits"),
        ({"design": 6453, "shape": (0, 2, 2)}, ValueError, "shape"),
        ({"interval": 0}, ValueError, "interval must be finite and at least a time step"),
        ({"interval": np.nan}, ValueError, "interval"),
        ({"interval": 10**400}, ValueError, "interval must be a number within the range of"),
        ({"interval": "1"}, TypeError, "interval must be a number"),
        ({"interval": True}, TypeError, "interval must be a number"),
        ({"groups": "yes"}, TypeError, "groups must be True or False"),
        ({"physics": {"strain": 0.0}}, ValueError, "strain of the physics must be positive"),
        ({"physics": "publishd"}, ValueError, "presets are"),
        ({"reality": "high_resolution"}, ValueError, "divides voxels .*control can't use"),
        ({"heading": 90.0}, ValueError, "directed has one"),
    ],
)
def test_bad_arguments_say_what_is_valid(options, error, message):
    with pytest.raises(error, match=message):
        make(**options)
    with pytest.raises(error, match=message):
        gym.make_vec(ID, num_envs=2, **options)


@pytest.mark.parametrize(
    ("action", "message"),
    [
        (np.zeros(3), "4 numbers from 0 to 0.23856"),
        (np.zeros((2, 4)), "one per actuator"),
        (["a"] * 4, "4 numbers"),
        (np.full(4, 0.3), "from 0 to 0.2385.*, got 0.3"),
        (np.full(4, -0.1), "got -0.1"),
        (np.full(4, np.nan), "got nan"),
    ],
)
def test_an_action_outside_the_space_is_refused_and_nothing_happens(action, message):
    env = make(physics=SHORT, disable_env_checker=True)
    env.reset(seed=0)
    saved = env.unwrapped.save()
    with pytest.raises(ValueError, match=message):
        env.step(action)
    assert env.unwrapped.save() == saved


def test_a_robot_of_several_pieces_is_controlled_as_a_whole():
    env = make(design="20000002", physics=SHORT)
    observation, _ = env.reset(seed=0)
    assert observation.shape == (9 + 2 * 8,)
    assert env.step(env.action_space.high)[0] in env.observation_space


@pytest.mark.filterwarnings("ignore:overflow encountered in cast")  # Gymnasium, of float64's least
def test_gymnasiums_wrappers_for_learners_fit():
    physics = Physics.of(SHORT)
    env = RescaleAction(make(physics=SHORT), np.float32(-1), np.float32(1))
    info = played(env, fully)[1]
    assert info["fitness"] == evaluate(6453, physics).fitness[0, 0]
    env = DtypeObservation(RescaleObservation(make(physics=SHORT), -1, 1), np.float64)
    observation, _ = env.reset(seed=0)
    assert observation.dtype == np.float64
    assert observation in env.observation_space
    assert np.abs(observation).max() <= 1
    with pytest.raises(TypeError, match="JakobiNoise works on this package's environments whose"):
        JakobiNoise(make())


def test_pictures_show_the_robot_from_the_reset_on():
    env = make(physics=SHORT, render_mode="rgb_array_list", interval=0.4)
    env.reset(seed=0)
    [first] = env.render()
    pictures = [env.step(env.action_space.high) and env.render() for _ in range(2)]
    assert [len(shown) for shown in pictures] == [5, 5]  # 0.1 s each, at half speed, 25 a second
    red = [int((p[..., 0] > p[..., 2].astype(int) + 80).sum()) for p in [first, *pictures[0]]]
    assert min(red) > 5000
    still = make(physics=SHORT, render_mode="rgb_array", interval=0.4)
    still.reset(seed=0)
    np.testing.assert_array_equal(still.render(), first)
    for shown in pictures:
        still.step(still.action_space.high)
        np.testing.assert_array_equal(still.render(), shown[-1])
    assert still.metadata["render_fps"] == 10


def test_a_robot_that_diverged_is_shown_as_it_stood():
    env = make(physics=DIVERGENT, render_mode="rgb_array", interval=0.4)
    env.reset(seed=0)
    standing = env.render()
    assert env.step(env.action_space.high)[2] is True
    assert (env.render() != standing).any(axis=2).mean() < 1e-3  # but for the ruler's very start


def test_an_unknown_render_mode_is_refused():
    with pytest.raises(ValueError, match="render_mode must be None or one of 'rgb_array'"):
        SoftVoxControlEnv(render_mode="ansi")


def test_going_back_it_is_shown_where_it_was():
    env = make(physics=SHORT, render_mode="rgb_array", interval=0.4)
    env.reset(seed=0)
    env.step(env.action_space.high)
    shown, saved = env.render(), env.unwrapped.save()
    env.step(env.action_space.high)
    env.unwrapped.restore(saved)
    assert (env.render() != shown).any(axis=2).mean() < 0.01  # but for the curve of the path


@pytest.mark.parametrize("render_mode", [None, "rgb_array", "rgb_array_list"])
def test_the_environment_checker_finds_nothing(render_mode):
    env = make(disable_env_checker=True, render_mode=render_mode, physics=SHORT)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)


def test_it_survives_pickling_and_its_spec_json():
    env = make(physics=SHORT, design=[0, 0, 0, 2, 1, 2, 2, 2], interval=0.5)
    spec = EnvSpec.from_json(env.spec.to_json())
    assert json.loads(env.spec.to_json())["kwargs"]["interval"] == 0.5
    again = gym.make(spec)
    for each in (env, again):
        each.reset(seed=0)
        each.step(each.action_space.high)
    copy = pickle.loads(pickle.dumps(env))
    step = env.step(env.action_space.high)
    assert_same(again.step(env.action_space.high), step)
    assert_same(copy.step(env.action_space.high), step)
    vector = pickle.loads(pickle.dumps(gym.make_vec(ID, num_envs=2, physics=SHORT)))
    assert vector.reset(seed=0)[0].shape == (2, 49)


def test_designs_may_be_written_in_every_way():
    best = make().unwrapped
    assert best.design == Design(6453)
    for design in ("6453", "00021222", Design(6453), Design(6453).array, np.int64(6453)):
        assert make(design=design).unwrapped.design == best.design
    large = make(design="2" * 27, shape=(3, 3, 3), physics=SHORT).unwrapped
    assert large.observation_space.shape == (9 + 27 * 8,)
    assert large.physics == replace(Physics.published(), duration=0.9)
