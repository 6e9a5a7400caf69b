"""Runs that draw from the global generators disturb neither each other nor their caller."""

import random

import numpy as np
import pytest
from table_answers import SPACE, answered

from softvox_search.global_random import GlobalRandom, global_states_kept
from softvox_search.registry import make


def stream(seed=0):
    return GlobalRandom(np.random.default_rng(seed))


def draws(own, n=3):
    with own.swapped_in():
        return [(random.random(), np.random.rand()) for _ in range(n)]  # noqa: NPY002


def test_the_stream_is_that_of_the_runs_generator_and_goes_on_where_it_ended():
    own = stream(1)
    assert draws(own, 2) + draws(own, 4) == draws(stream(1), 6)
    assert draws(stream(1)) != draws(stream(2))


def test_after_a_block_that_raised_the_callers_state_is_back():
    before = random.getstate()
    own = stream()
    with pytest.raises(ZeroDivisionError), own.swapped_in():
        random.random() / 0
    assert random.getstate() == before


def test_streams_that_are_nested_draw_what_they_draw_alone():
    one, two = stream(1), stream(2)
    with one.swapped_in():
        mixed = [(random.random(), np.random.rand())]  # noqa: NPY002
        assert draws(two, 2) == draws(stream(2), 2)
        mixed.append((random.random(), np.random.rand()))  # noqa: NPY002
    assert mixed == draws(stream(1), 2)


@pytest.mark.parametrize("drawn_outside", [0, 1, 2])
@pytest.mark.parametrize("drawn_inside", [0, 1, 2])
def test_the_global_generators_go_on_as_if_nothing_had_been_swapped_in(drawn_outside, drawn_inside):
    own = stream()
    # Normal numbers: their generators make two at a time and keep one.
    python, numpy = random.Random(1), np.random.RandomState(1)
    with global_states_kept():
        random.seed(1)
        np.random.seed(1)  # noqa: NPY002
        for _ in range(3):
            for _ in range(drawn_outside):
                assert random.gauss(0, 1) == python.gauss(0, 1)
                assert np.random.randn() == numpy.randn()  # noqa: NPY002
            with own.swapped_in():
                for _ in range(drawn_inside):
                    random.gauss(0, 1)
                    np.random.randn()  # noqa: NPY002
        assert random.random() == python.random()
        assert np.random.randn() == numpy.randn()  # noqa: NPY002


@pytest.mark.parametrize("name", ["ga", "map_elites", "nevergrad"])
def test_interleaved_runs_are_equal_to_runs_made_alone(name):
    def made(seed):
        return make(name, np.random.default_rng(seed), space=SPACE)

    caller = random.getstate()
    alone = [[answered(searcher) for _ in range(8)] for searcher in (made(1), made(2))]
    pair = (made(1), made(2))
    for step in range(8):
        for which, searcher in enumerate(pair):
            np.testing.assert_array_equal(answered(searcher), alone[which][step])
    assert random.getstate() == caller
