"""Designs whose active voxels are pumped at several phases: lattice, design, evaluation, env."""

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from softvox_gym import (
    Design,
    Lattice,
    Physics,
    Reality,
    Simulation,
    evaluate,
    reality,
    simulate,
    step_error,
)
from softvox_gym.design import buildable, stack_of, written
from softvox_gym.noise import Jakobi
from softvox_gym.wrappers import JakobiNoise, vector

FOUR = Lattice.of((2, 2, 2), phases=4)
BRIEF = {"preset": "published", "duration": 0.5}
ENV_ID = "SoftVoxPhased2x2x2-v0"

#: On the lattice FOUR.
DIGITS = ["00051222", "34201350", "22222222", "01234505"]


@pytest.fixture(scope="module")
def designs():
    return [Design(digits, shape=FOUR) for digits in DIGITS]


def pumped(digits, phases):
    """The kinds and the phases that digits stand for, digit by digit."""
    stack = FOUR.to_stack(np.array([[int(digit) for digit in row] for row in digits]))
    return np.vectorize(lambda d: min(d, 2))(stack), np.vectorize(
        lambda d: (d - 2) / phases if d > 2 else 0.0
    )(stack)


def test_a_lattice_of_phases_is_none_of_one_phase_nor_of_others():
    plain, again = Lattice(), Lattice.of((2, 2, 2), phases=4)
    assert again == FOUR
    assert hash(again) == hash(FOUR)
    assert len({plain, FOUR, again, Lattice.of((2, 2, 2), phases=3)}) == 3
    for other in (
        plain,
        (2, 2, 2),
        Lattice.of((2, 2, 2), phases=3),
        Lattice.of((2, 2, 1), phases=4),
    ):
        assert not other == FOUR  # noqa: SIM201, both are defined
        assert other != FOUR
    assert FOUR[:] == plain
    assert Lattice.of(FOUR) == FOUR


@pytest.mark.parametrize("through", [copy.deepcopy, lambda one: pickle.loads(pickle.dumps(one))])
def test_lattices_and_designs_of_phases_survive(through, designs):
    assert through(FOUR) == FOUR
    assert through(designs[0]) == designs[0]
    assert eval(repr(designs[0])) == designs[0]
    assert Lattice.named(str(FOUR)) == FOUR
    assert Lattice.named("3x2x1") == (3, 2, 1)


def test_one_phase_is_the_lattice_that_there_was():
    one = Lattice.of((2, 2, 2), phases=1)
    assert type(one) is Lattice
    assert (one.phases, one.states, FOUR.states) == (1, 3, 6)
    assert one.pumped(np.array([[0, 1, 2]]))[1] is None


@pytest.mark.parametrize(("shape", "phases"), [((2, 2, 2), 4), ((2, 3, 1), 8), ((3, 3, 3), 4)])
def test_numbers_and_digits_name_the_same_designs(shape, phases):
    lattice = Lattice.of(shape, phases=phases)
    rows = lattice.random(20, np.random.default_rng(0))
    assert rows.max() == phases + 1
    numbers = lattice.numbers(rows)
    base = 2 + phases
    assert numbers.tolist() == [sum(int(d) * base**i for i, d in enumerate(row)) for row in rows]
    assert numbers.tolist() == [Design(row, shape=lattice).index for row in rows]
    np.testing.assert_array_equal(lattice.digits(numbers), rows)
    assert lattice.has_int64_numbers == (lattice.n_designs <= 2**63)


def test_a_design_knows_its_kinds_and_phases(designs):
    kinds, phase = pumped(DIGITS, 4)
    for i, design in enumerate(designs):
        np.testing.assert_array_equal(design.kinds, kinds[i])
        np.testing.assert_array_equal(design.phase, phase[i])
        assert design.n_active == np.count_nonzero(kinds[i] == 2)
        assert design.rotated(4) == design.mirrored().mirrored() == design
        assert design.rotated().lattice == FOUR
        assert design.canonical() == design.rotated(3).mirrored().canonical()
        assert written(str(design.index), FOUR) == design
    assert (Design(6453).phase == 0).all()
    assert Design("05", shape=Lattice.of((2, 1, 1), phases=4)).refined(3).n_active == 1


@pytest.mark.parametrize(
    ("make", "error", "message"),
    [
        (lambda: Design("00061222", shape=FOUR), ValueError, "digits 0, 1, 2, 3, 4 and 5 only"),
        (lambda: Design([6] * 8, shape=FOUR), ValueError, "4 and 5 only, got 6"),
        (lambda: Design(6**8, shape=FOUR), ValueError, "0 ... 1679615, the designs of a 4-phase"),
        (lambda: Design("00051222"), ValueError, "digits 0, 1 and 2 only"),
        (lambda: written("x", FOUR), ValueError, "from 0 to 1679615 nor 8 digits 0, 1, 2, 3, 4, 5"),
        (lambda: Lattice.of((2, 2, 2), phases=9), ValueError, "phases must be from 1 to 8, got 9"),
        (lambda: Lattice.of((2, 2, 2), phases=0), ValueError, "phases must be from 1 to 8, got 0"),
        (lambda: Lattice.of((2, 2, 2), phases=1.5), TypeError, "phases must be a whole number"),
        (lambda: Design(Design(7, shape=FOUR), shape=(2, 2, 2)), ValueError, "has shape 4-phase"),
        (lambda: evaluate([Design(7, shape=FOUR), Design(7)]), ValueError, "4-phase 2x2x2, 2x2x2"),
        (lambda: evaluate([1] * 7 + [5], shape=FOUR), ValueError, "may be the digits of one"),
        (lambda: simulate(stack_of(Design("5" * 8, shape=FOUR))), ValueError, "0, 1 and 2 only"),
    ],
)
def test_what_does_not_fit_is_refused(make, error, message):
    with pytest.raises(error, match=message):
        make()


def test_phased_designs_move_as_their_kinds_with_their_phases(designs):
    kinds, phase = pumped(DIGITS, 4)
    physics = Physics.of(BRIEF)
    wanted = simulate(kinds, physics, phase=phase)
    assert simulate(designs, physics).displacement.tobytes() == wanted.displacement.tobytes()
    numbers = np.array([design.index for design in designs])
    evaluation = evaluate(numbers, BRIEF, shape=FOUR)
    assert evaluation.displacement[:, 0].tobytes() == wanted.displacement.tobytes()
    assert evaluation.lattice == FOUR
    assert [evaluation.result.design(i) for i in range(4)] == designs
    np.testing.assert_array_equal(evaluation.designs, stack_of(designs))
    paused = Simulation(designs, physics)
    paused.advance(until=np.inf)
    assert paused.fitness.tobytes() == wanted.fitness.tobytes()
    own = simulate(kinds, physics, phase=phase + 0.25)
    added = simulate(designs, physics, phase=np.full((4, 2, 2, 2), 0.25))
    assert added.displacement.tobytes() == own.displacement.tobytes()
    checked = simulate(kinds, physics, phase=phase, check_step=True)
    assert step_error(designs, BRIEF).tobytes() == checked.step_error.tobytes()


def test_the_phases_of_a_reality_and_of_noise_are_added(designs):
    kinds, phase = pumped(DIGITS, 4)
    lag = Reality("late", BRIEF, phase=reality("lag").phase)
    wanted = simulate(kinds, lag.physics, phase=phase + np.asarray(lag.phase))
    assert lag.simulate(designs).displacement.tobytes() == wanted.displacement.tobytes()
    assert evaluate(designs, lag).displacement[:, 0].tobytes() == wanted.displacement.tobytes()
    noise = [Jakobi(1.0)]
    trials = noise[0].disturb(lag.trials(kinds[1], 2), np.random.default_rng(1))
    fresh = lag.trials(kinds[1], 2, phase=phase[1])
    shifted = noise[0].disturb(fresh, np.random.default_rng(1))
    np.testing.assert_allclose(shifted.phase, trials.phase + phase[1], rtol=0, atol=1e-15)
    result = lag.run(np.repeat(kinds[1:2], 2, axis=0), shifted)
    noisy = evaluate(designs, lag, perturbations=noise, trials=2, seed=0)
    assert noisy.displacement[1].tobytes() == result.displacement.tobytes()


def test_errors_of_fabrication_are_those_of_the_body_whatever_its_phases(designs):
    built = Reality("built", BRIEF, strain_error=0.2, seed=3)
    kinds, phase = pumped(DIGITS, 4)
    plain, phased = built.trials(kinds[0]), built.trials(kinds[0], phase=phase[0])
    assert plain.strain.tobytes() == phased.strain.tobytes()
    assert (phased.phase == phase[0]).all()


def plainly_buildable(design):
    """The kit's rules, voxel by voxel."""
    array = design.array
    actuators = {site: {site} for site, digit in np.ndenumerate(array) if digit >= 2}
    for x, y, z in list(actuators):
        for other in ((x + 1, y, z), (x, y + 1, z)):
            if other in actuators:
                merged = actuators[x, y, z] | actuators[other]
                actuators |= dict.fromkeys(merged, merged)
    pieces = {frozenset(group) for group in actuators.values()}
    padded = np.pad(array, 1)

    def is_outside(x, y, z):
        around = padded[x : x + 3, y : y + 3, z : z + 3]
        faces = around[[0, 2, 1, 1, 1, 1], [1, 1, 0, 2, 1, 1], [1, 1, 1, 1, 0, 2]]
        return (faces == 0).any()

    return (
        design.is_connected
        and all(len({array[site] for site in group}) == 1 for group in pieces)
        and all(any(is_outside(*site) for site in group) for group in pieces)
    )


@pytest.mark.parametrize(("shape", "phases"), [((2, 2, 2), 1), ((2, 2, 2), 2), ((3, 3, 3), 2)])
def test_the_kit_builds_bodies_whose_actuators_have_one_phase_and_an_inlet(shape, phases):
    lattice, rng = Lattice.of(shape, phases=phases), np.random.default_rng(0)
    rows = lattice.random(200, rng)
    if shape == (3, 3, 3):  # mostly solid and passive: one in the middle may have no inlet
        rows = np.where(rng.random(rows.shape) < 0.9, 1, rows)
        rows[:50, 13], rows[:50, [4, 10, 12, 14, 16, 22]] = 2, 1
    found = buildable(rows, lattice)
    wanted = [plainly_buildable(Design(row, shape=lattice)) for row in rows]
    assert found.tolist() == wanted
    assert 0 < sum(wanted) < 200


@pytest.mark.parametrize("phases", [2, 4])
def test_the_environment_rewards_phased_designs(phases):
    env = gym.make(ENV_ID, phases=phases, physics=BRIEF)
    assert env.action_space.nvec.tolist() == [2 + phases] * 8
    env.reset(seed=0)
    env.action_space.seed(1)
    action = env.action_space.sample()
    _, reward, terminated, truncated, info = env.step(action)
    lattice = Lattice.of((2, 2, 2), phases=phases)
    (wanted,) = evaluate([Design(action, shape=lattice)], BRIEF).value
    assert (reward, terminated, truncated) == (wanted, True, False)
    assert info["design"] == int(lattice.numbers(action))
    with pytest.raises(ValueError, match=f"and {1 + phases} only"):
        env.step(np.full(8, 2 + phases))


def test_its_batches_equal_single_environments_with_noise_around_them():
    sync = SyncVectorEnv(
        [lambda: JakobiNoise(gym.make(ENV_ID, physics=BRIEF))] * 3,
        autoreset_mode=AutoresetMode.NEXT_STEP,
    )
    native = vector.JakobiNoise(gym.make_vec(ENV_ID, num_envs=3, physics=BRIEF))
    for env in (sync, native):
        env.reset(seed=5)
        env.action_space.seed(0)
    actions = native.action_space.sample()
    ours, theirs = native.step(actions), sync.step(actions)
    assert ours[0].tobytes() == theirs[0].tobytes()
    assert ours[1].tobytes() == theirs[1].tobytes()
    assert ours[4]["design"].tolist() == theirs[4]["design"].tolist()


def test_it_shows_a_walk():
    env = gym.make(ENV_ID, physics={**BRIEF, "duration": 0.35}, render_mode="rgb_array_list")
    env.reset(seed=0)
    env.step(np.array([0, 0, 0, 5, 1, 2, 3, 2]))
    pictures = env.render()
    assert len(pictures) > 3
    assert any((one != pictures[-1]).any() for one in pictures[1:-1])
