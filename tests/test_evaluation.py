"""evaluate() tries designs as the environments do, and repeats itself to the bit."""

import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import gymnasium as gym
import numpy as np
import pytest

from softvox_gym import Design, Reality, evaluate, simulate
from softvox_gym.noise import Jakobi, MeasurementNoise
from softvox_gym.wrappers import vector

SHORT = {"preset": "published", "duration": 0.9}
DESIGNS = [6453, 4295, 5757, 1, 0]


def bits(evaluation):
    return evaluation.displacement.tobytes() + evaluation.fitness.tobytes()


def test_without_perturbations_it_is_the_simulation():
    evaluation = evaluate(DESIGNS)
    result = simulate(DESIGNS, track=1)
    assert evaluation.fitness[:, 0].tobytes() == result.fitness.tobytes()
    assert evaluation.value.tobytes() == result.fitness.tobytes()
    assert evaluation.displacement[:, 0].tobytes() == result.displacement.tobytes()
    np.testing.assert_array_equal(evaluation.track[:, 0], result.track)
    assert not evaluation.diverged.any()
    assert np.isnan(evaluation.standard_error).all()


def test_trials_that_cant_differ_are_simulated_once_and_counted_as_many():
    evaluation = evaluate(DESIGNS, SHORT, trials=3)
    assert evaluation.fitness.shape == (5, 3)
    assert len(evaluation.result) == 5
    assert (evaluation.fitness == evaluation.fitness[:, :1]).all()
    assert (evaluation.steps.sum(axis=1) == 3 * evaluation.result.steps).all()


@pytest.mark.parametrize("shape", [(2, 2, 2), (3, 2, 1)])
def test_a_seed_gives_what_the_vector_environment_draws(shape):
    rng = np.random.default_rng(0)
    rows = rng.integers(3, size=(4, np.prod(shape)))
    env = gym.make_vec("SoftVox-v0", num_envs=4, shape=shape, physics=SHORT)
    noisy = vector.Resample(vector.JakobiNoise(env, 2.0), 3, "q10")
    noisy.reset(seed=7)
    _, rewards, _, _, infos = noisy.step(rows)
    evaluation = evaluate(
        rows, SHORT, shape=shape, perturbations=[Jakobi(2.0)], trials=3, seed=7, aggregate="q10"
    )
    assert evaluation.value.tobytes() == rewards.tobytes()
    assert evaluation.displacement.tobytes() == infos["displacements"].tobytes()
    assert evaluation.standard_error.tobytes() == infos["standard_error"].tobytes()


def test_a_designs_draws_do_not_depend_on_its_batch():
    noise = [Jakobi(1.0), MeasurementNoise(0.2)]
    together = evaluate(DESIGNS, SHORT, perturbations=noise, trials=2, seed=3)
    for i, design in enumerate(DESIGNS):
        rng = [np.random.default_rng(3 + i)]
        alone = evaluate(design, SHORT, perturbations=noise, trials=2, seed=rng)
        assert alone.fitness.tobytes() == together.fitness[i].tobytes()


def test_the_same_seed_repeats_and_another_or_none_differs():
    def tried(seed):
        return bits(evaluate(6453, SHORT, perturbations=[Jakobi()], seed=seed))

    assert tried(1) == tried(1)
    assert len({tried(seed) for seed in (1, 2, None, None)}) == 4


def test_threads_may_evaluate_side_by_side():
    def tried(seed):
        return bits(evaluate(DESIGNS, SHORT, perturbations=[Jakobi()], seed=seed, threads=1))

    alone = [tried(seed) for seed in range(6)]
    with ThreadPoolExecutor(6) as pool:
        assert list(pool.map(tried, range(6))) == alone


def test_a_design_that_diverges_is_worth_nothing():
    wild = {"strain": 1e6}
    evaluation = evaluate("2" * 8, wild, perturbations=[MeasurementNoise(1.0)], trials=2, seed=0)
    assert evaluation.diverged.all()
    assert not evaluation.fitness.any()
    assert np.isnan(evaluation.displacement).all()
    assert np.isnan(evaluation.mean_displacement).all()
    assert evaluation.value.tolist() == [0.0]


@dataclass(frozen=True)
class Slippery:
    """A perturbation of one's own."""

    def disturb(self, trials, rng):
        return trials.changed(
            friction_static=rng.uniform(0.1, 0.5, len(trials)),
            friction_kinetic=np.full(len(trials), 0.1),
        )

    def measure(self, fitness, rng):
        return fitness


def test_a_perturbation_of_ones_own_reaches_the_physics():
    evaluation = evaluate(6453, SHORT, perturbations=[Slippery()], trials=3, seed=0)
    physics = evaluation.result.physics
    assert physics.friction_static.shape == (3,)
    again = simulate([6453] * 3, physics)
    assert again.fitness.tobytes() == evaluation.fitness[0].tobytes()


def test_it_shows_itself_in_one_line():
    shown = repr(evaluate(DESIGNS[:2], perturbations=[Jakobi(0)], trials=3))
    assert re.fullmatch(r"Evaluation\(2 designs on 2x2x2, trials: 3, best \d\.\d\d\)", shown)
    assert repr(evaluate([])) == "Evaluation(0 designs on 2x2x2, trials: 1)"


def test_no_designs_give_an_empty_evaluation():
    evaluation = evaluate([], perturbations=[Jakobi()], trials=2)
    assert len(evaluation) == 0
    assert evaluation.value.shape == (0,)


def test_a_large_lattice_is_evaluated_by_its_digits():
    design = Design(3**64 - 2, shape=(4, 4, 4))
    evaluation = evaluate([design], SHORT, perturbations=[Jakobi(0.5)], seed=1)
    assert evaluation.fitness.shape == (1, 1)
    assert evaluation.lattice == (4, 4, 4)


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"trials": 0}, ValueError, "trials must be at least 1"),
        ({"trials": 10**9}, ValueError, "trials must be at least 1 and at most 10000000"),
        (
            {"trials": 6 * 10**6},
            ValueError,
            "2 designs with 6000000 trials each are 12000000 trials",
        ),
        ({"perturbations": Jakobi()}, TypeError, "perturbations must be a sequence of objects"),
        ({"perturbations": [Jakobi]}, TypeError, "perturbations must be a sequence of objects"),
        ({"perturbations": ["jakobi"]}, TypeError, "perturbations must be a sequence of objects"),
        ({"seed": "hello"}, TypeError, "seed must be a whole number"),
        ({"trials": 1.5}, TypeError, "trials must be a whole number"),
        ({"aggregate": "median"}, ValueError, "the aggregates are mean, min, q10"),
        ({"aggregate": ["mean"]}, ValueError, "aggregate .* is unknown"),
        ({"physics": "publishd"}, ValueError, "presets are published, exact"),
        ({"physics": {"density": [1e6, 2e6]}}, ValueError, "simulate takes arrays"),
        ({"seed": -1, "perturbations": [Jakobi()]}, ValueError, "seed must not be negative"),
        ({"seed": "a", "perturbations": [Jakobi()]}, TypeError, "seed must be a whole number"),
        (
            {"seed": [np.random.default_rng()], "perturbations": [Jakobi()]},
            TypeError,
            "2 numpy gen",
        ),
        ({"shape": (10**6,) * 3}, ValueError, "at most 1000000"),
    ],
)
def test_a_bad_argument_is_refused_by_name(options, error, message):
    with pytest.raises(error, match=message):
        evaluate([1, 2], **options)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"designs": [[3] * 8]}, "digits 0, 1 and 2 only"),
        ({"frames": -1}, "frames must be at least 0"),
        ({"threads": 0}, "threads must be at least 1"),
        ({"isa": "abacus"}, "not an instruction set"),
        ({"physics": Reality("fine", resolution=61)}, "122x122x122 has"),
    ],
)
def test_a_refused_batch_draws_nothing(options, message):
    rng = np.random.default_rng(5)
    with pytest.raises(ValueError, match=message):
        evaluate(**{"designs": [6453], **options}, perturbations=[Jakobi()], seed=[rng])
    assert rng.random() == np.random.default_rng(5).random()


def test_a_measurement_in_place_leaves_diverged_trials_alone():
    class Sevens(Jakobi):
        def measure(self, fitness, rng):
            fitness[:] = 7
            return fitness

    found = evaluate([0, 6453], {"strain": 150.0, "duration": 0.3}, perturbations=[Sevens(0)])
    assert found.diverged.ravel().tolist() == [False, True]
    assert found.fitness.ravel().tolist() == [7, 0]
