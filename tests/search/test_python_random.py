"""Runs that draw from the global `random` disturb neither each other nor their caller."""

import pickle
import random

import numpy as np
import pytest
from table_answers import answered

from softvox_search.python_random import PythonRandom
from softvox_search.registry import make

DRAWERS = ["ga", "mu_plus_lambda", "nsga2"]


def stream(seed=0):
    return PythonRandom(np.random.default_rng(seed))


def draws(lent, n=3):
    with lent.swapped_in():
        return [random.random() for _ in range(n)]


def test_after_the_block_the_callers_state_is_back():
    before = random.getstate()
    draws(stream())
    assert random.getstate() == before


def test_after_a_block_that_raised_the_callers_state_is_back():
    before = random.getstate()
    lent = stream()
    with pytest.raises(ZeroDivisionError), lent.swapped_in():
        random.random() / 0
    assert random.getstate() == before
    assert draws(lent, 2) == draws(stream(), 3)[1:]


def test_the_next_block_goes_on_where_the_last_one_ended():
    lent = stream()
    assert draws(lent, 2) + draws(lent, 4) == draws(stream(), 6)


def test_whatever_the_caller_draws_in_between_makes_no_difference():
    lent = stream()
    first = draws(lent)
    random.Random().seed()
    random.random()
    assert first + draws(lent) == draws(stream(), 6)


def test_the_stream_is_that_of_the_runs_generator():
    assert draws(stream(1)) == draws(stream(1))
    assert draws(stream(1)) != draws(stream(2))


def test_streams_that_take_turns_or_are_nested_draw_what_they_draw_alone():
    one, two = stream(1), stream(2)
    with one.swapped_in():
        mixed_one = [random.random()]
        mixed_two = draws(two, 2)
        mixed_one.append(random.random())
    assert mixed_one == draws(stream(1), 2)
    assert mixed_two == draws(stream(2), 2)


def test_a_pickled_stream_goes_on_with_the_same_draws():
    lent = stream()
    draws(lent)
    copied = pickle.loads(pickle.dumps(lent))
    assert draws(copied) == draws(lent)


@pytest.mark.parametrize("name", DRAWERS)
def test_interleaved_runs_are_equal_to_runs_made_alone(name):
    def alone(seed):
        searcher = make(name, np.random.default_rng(seed))
        return [answered(searcher) for _ in range(8)]

    caller = random.getstate()
    searchers = [make(name, np.random.default_rng(seed)) for seed in (1, 2)]
    together = [[answered(searcher) for searcher in searchers] for _ in range(8)]
    assert random.getstate() == caller
    for which, seed in enumerate((1, 2)):
        for designs, expected in zip(together, alone(seed), strict=True):
            np.testing.assert_array_equal(designs[which], expected)
