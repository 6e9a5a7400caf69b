"""What makes new designs, and what dominates what, stays clear of DEAP's traps."""

import copy
import pickle
import subprocess
import sys

import numpy as np
import pytest
from table_answers import FITNESS

from softvox_gym.design import indices_of
from softvox_search.pareto import Objectives, fronts
from softvox_search.python_random import PythonRandom
from softvox_search.variation import crossed, digits, individuals, mutated, random_designs


def population(n, seed=0):
    designs = random_designs(n, np.random.default_rng(seed))
    return individuals(designs, FITNESS[indices_of(designs)])


def test_a_mutant_always_differs_from_its_parent():
    parents = random_designs(5000, np.random.default_rng(0))
    for rate in (0.0, 1 / 8, 1.0):
        children = mutated(parents, rate, np.random.default_rng(1))
        assert ((children != parents).any(axis=1)).all()
        assert set(np.unique(children)) == {0, 1, 2}


def test_a_mutated_digit_becomes_one_of_the_other_two_equally_often():
    parents = random_designs(5000, np.random.default_rng(0))
    steps = (mutated(parents, 1.0, np.random.default_rng(1)) - parents) % 3
    counts = np.bincount(steps.ravel(), minlength=3)
    assert counts[0] == 0
    # 40,000 digits: the standard deviation of a count is sqrt(40000 / 4) = 100
    np.testing.assert_allclose(counts[1:], 20_000, atol=4 * 100)


@pytest.mark.parametrize("rate", [0.0, 0.05, 1 / 8, 0.5])
def test_digits_mutate_at_the_rate_that_was_asked_for(rate):
    parents = random_designs(20_000, np.random.default_rng(0))
    share = (mutated(parents, rate, np.random.default_rng(1)) != parents).mean()
    expected = rate + (1 - rate) ** 8 / 8  # where no digit is hit, one of eight is after all
    # The number of changes in a design has a variance of 8 rate (1 - rate) at most.
    error = np.sqrt(8 * rate * (1 - rate) / 20_000) / 8
    assert share == pytest.approx(expected, abs=4 * error + 1e-12)


def test_mutation_leaves_the_parents_as_they_are():
    parents = random_designs(50, np.random.default_rng(0))
    before = parents.copy()
    mutated(parents, 0.5, np.random.default_rng(1))
    np.testing.assert_array_equal(parents, before)


def test_children_are_copies_whether_crossed_or_not():
    parents = population(11)
    before = digits(parents)
    for probability in (0.0, 1.0):
        with PythonRandom(np.random.default_rng(0)).swapped_in():
            children = crossed([parents[0], *parents], probability)
        assert not {id(child) for child in children} & {id(parent) for parent in parents}
        for child in children:
            child[:] = [1] * 8
        np.testing.assert_array_equal(digits(parents), before)


def test_a_pair_that_crosses_shares_out_its_digits_at_every_site():
    parents = population(400)
    with PythonRandom(np.random.default_rng(0)).swapped_in():
        children = digits(crossed(parents, 1.0))
    expected = np.sort(digits(parents).reshape(200, 2, 8), axis=1)
    np.testing.assert_array_equal(np.sort(children.reshape(200, 2, 8), axis=1), expected)
    assert (children != digits(parents)).any()


def test_a_child_is_worth_nothing_known_before_it_is_evaluated():
    assert np.isnan([child.value for child in crossed(population(4), 0.0)]).all()


def test_no_class_is_made_by_deaps_creator():
    code = (
        "import sys\n"
        "from softvox_search.searchers import afpo, genetic, map_elites, mu_plus_lambda, nsga2\n"
        "assert 'deap.tools' in sys.modules and 'deap.creator' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


# Domination


def with_objectives(seed):
    pool = population(120, seed)
    for individual in pool:
        individual.fitness = Objectives((individual.value, individual.count(2)))
    return pool


@pytest.mark.parametrize("seed", range(5))
def test_fronts_are_those_that_comparing_all_pairs_gives(seed):
    left = with_objectives(seed)
    for front in fronts(left, len(left)):
        undominated = [
            one
            for one in left
            if not any(
                other.value >= one.value
                and other.count(2) <= one.count(2)
                and (other.value, other.count(2)) != (one.value, one.count(2))
                for other in left
            )
        ]
        assert sorted(map(id, front)) == sorted(map(id, undominated))
        left = [one for one in left if all(one is not other for other in front)]
    assert left == []


def test_a_copied_fitness_keeps_its_crowding_distance():
    fitness = Objectives((2.0, 3.0))
    fitness.crowding_dist = 0.25
    for copied in (copy.deepcopy(fitness), pickle.loads(pickle.dumps(fitness))):
        assert copied == fitness
        assert copied.crowding_dist == 0.25
