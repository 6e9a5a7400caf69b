"""Exhaustive and random search do what theory says; the hill climber climbs."""

import numpy as np
import pytest

from softvox_gym import Design, landscape
from softvox_gym.design import N_DESIGNS, digits_of, indices_of
from softvox_gym.landscapes.analysis import neighbours
from softvox_search.searchers.exhaustive import Exhaustive
from softvox_search.searchers.hill_climber import HillClimber
from softvox_search.searchers.random_search import RandomSearch

FITNESS = landscape()["fitness"]
RANKING = np.argsort(-FITNESS)
SEEDS = 400


def told(searcher, asked):
    """Answer from the table."""
    n = len(asked)
    values = FITNESS[indices_of(asked)]
    info = {
        "displacement": np.zeros((n, 3)),
        "status": np.full(n, "ok"),
        "standard_error": np.zeros(n),
    }
    searcher.tell(asked, values, info)


def order_of(searcher, *, n=N_DESIGNS, until=None):
    """The numbers of the first n designs asked, or of those until one is or nothing more is."""
    parts, count = [], 0
    while count < n and len(asked := searcher.ask()):
        told(searcher, asked)
        parts.append(indices_of(asked))
        count += len(asked)
        if until in parts[-1]:
            break
    return np.concatenate(parts)[:n]


def test_exhaustive_search_asks_for_every_design_by_number_and_then_for_nothing():
    searcher = Exhaustive(np.random.default_rng(0))
    np.testing.assert_array_equal(order_of(searcher), np.arange(N_DESIGNS))
    assert searcher.ask().shape == (0, 8)
    assert searcher.recommend() == Design(6453)


def test_shuffled_it_asks_for_every_design_once_in_an_order_of_the_generator():
    first, again, other = (
        order_of(Exhaustive(np.random.default_rng(seed), shuffled=True)) for seed in (0, 0, 1)
    )
    np.testing.assert_array_equal(np.sort(first), np.arange(N_DESIGNS))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


@pytest.mark.parametrize("kind", [Exhaustive, RandomSearch])
def test_at_most_as_many_as_wanted_are_asked(kind):
    searcher = kind(np.random.default_rng(0), batch=10)
    assert [len(searcher.ask(n)) for n in (None, 3, 1)] == [10, 3, 1]


@pytest.fixture(scope="module")
def orders():
    return [order_of(RandomSearch(np.random.default_rng(seed))) for seed in range(SEEDS)]


def test_without_replacement_every_design_is_drawn_once_and_then_none(orders):
    for order in orders[:10]:
        np.testing.assert_array_equal(np.sort(order), np.arange(N_DESIGNS))


@pytest.mark.parametrize("k", [1, 4, 100])
def test_without_replacement_the_first_of_k_optima_comes_when_theory_says(orders, k):
    hits = [1 + np.flatnonzero(np.isin(order, RANKING[:k]))[0] for order in orders]
    n = N_DESIGNS
    expected = (n + 1) / (k + 1)
    # The smallest of k numbers drawn without replacement from 1 ... n has this variance.
    variance = k * (n - k) * (n + 1) / ((k + 1) ** 2 * (k + 2))
    error = np.sqrt(variance / SEEDS)
    assert abs(np.mean(hits) - expected) < 3 * error  # 0.3 % of all seeds would fail it
    # The spread of a sample's variance, from the fourth moment: that of an exponential law at most,
    # (9 - 1) variance^2 / SEEDS.
    assert abs(np.var(hits) - variance) < 3 * variance * np.sqrt(8 / SEEDS)


def test_with_replacement_the_first_of_k_optima_comes_when_theory_says():
    k, n = 100, N_DESIGNS
    hits = []
    for seed in range(SEEDS):
        searcher = RandomSearch(np.random.default_rng(seed), replacement=True)
        drawn = np.concatenate([indices_of(searcher.ask()) for _ in range(30)])
        hits.append(1 + np.flatnonzero(np.isin(drawn, RANKING[:k]))[0])
    error = np.sqrt(1 - k / n) * n / k / np.sqrt(SEEDS)  # of a geometric law
    assert abs(np.mean(hits) - n / k) < 3 * error


def test_with_replacement_designs_come_again():
    searcher = RandomSearch(np.random.default_rng(0), replacement=True)
    drawn = order_of(searcher)
    # Of n draws from n designs a share of 1 - 1/e is expected to be different, with a variance of
    # n (1/e - 2/e^2) as n grows.
    deviation = np.sqrt(N_DESIGNS * (np.exp(-1) - 2 * np.exp(-2)))
    assert abs(len(np.unique(drawn)) - N_DESIGNS * (1 - np.exp(-1))) < 3 * deviation


@pytest.mark.parametrize("batch", [1, 8, 16])
def test_the_climber_asks_for_every_design_once_and_then_for_nothing(batch):
    searcher = HillClimber(np.random.default_rng(0), batch=batch)
    np.testing.assert_array_equal(np.sort(order_of(searcher)), np.arange(N_DESIGNS))
    assert searcher.ask().shape == (0, 8)
    assert searcher.parents().shape == (0, 8)
    assert searcher.recommend() == Design(6453)


def summit_above(point, values):
    """Where the way upwards by the best neighbours known ends."""
    while np.nanmax(values[neighbours()[point]]) > values[point]:
        point = neighbours()[point][np.nanargmax(values[neighbours()[point]])]
    return point


@pytest.mark.parametrize("batch", [1, 8, 16])
def test_the_climber_asks_for_neighbours_of_where_it_stands_and_moves_upwards(batch):
    searcher = HillClimber(np.random.default_rng(3), batch=batch)
    restarts = 0
    stood = None
    for _ in range(300):
        asked = indices_of(searcher.ask())
        here = indices_of(searcher.parents())
        if len(here) == 0:
            assert len(asked) == 1
            if stood is not None:
                top = summit_above(stood, searcher.values)
                assert FITNESS[top] >= FITNESS[neighbours()[top]].max()
            restarts += 1
        else:
            assert len(asked) <= batch
            assert set(asked) <= set(neighbours()[here[0]])
            assert stood is None or here[0] == stood or FITNESS[here[0]] > FITNESS[stood]
        stood = here[0] if len(here) else None
        told(searcher, digits_of(asked))
    assert restarts > 1


def test_steepest_ascent_asks_for_all_sixteen_neighbours_and_takes_the_best():
    searcher = HillClimber(np.random.default_rng(0), batch=16)
    start = searcher.ask()
    told(searcher, start)
    around = neighbours()[indices_of(start)[0]]
    asked = searcher.ask()
    assert sorted(indices_of(asked)) == sorted(around)
    told(searcher, asked)
    searcher.ask()
    assert indices_of(searcher.parents())[0] == around[FITNESS[around].argmax()]


def test_the_climber_needs_fewer_designs_than_chance():
    needed = []
    for seed in range(40):
        searcher = HillClimber(np.random.default_rng(seed))
        order = order_of(searcher, until=RANKING[0])
        needed.append(1 + np.flatnonzero(order == RANKING[0])[0])
    # Random search needs 3281 on average.
    assert np.mean(needed) + 3 * np.std(needed) / np.sqrt(len(needed)) < 3281


def test_the_climber_believes_refreshed_values():
    searcher = HillClimber(np.random.default_rng(0), batch=16)
    told(searcher, searcher.ask())
    start = searcher.parents()
    told(searcher, searcher.ask())
    info = {
        "displacement": np.zeros((1, 3)),
        "status": np.array(["ok"]),
        "standard_error": np.zeros(1),
    }
    searcher.refresh(start, np.array([100.0]), info)
    asked = searcher.ask()  # a restart: nothing around is better
    assert len(asked) == 1
    assert indices_of(asked)[0] not in neighbours()[indices_of(start)[0]]
    assert searcher.recommend() == Design(start[0])


@pytest.mark.parametrize(
    ("kind", "options", "error", "named"),
    [
        (Exhaustive, {"shuffled": 1}, TypeError, "shuffled"),
        (Exhaustive, {"batch": 0}, ValueError, "batch"),
        (RandomSearch, {"replacement": "no"}, TypeError, "replacement"),
        (RandomSearch, {"batch": 1.5}, TypeError, "batch"),
        (HillClimber, {"batch": 17}, ValueError, "batch"),
        (HillClimber, {"batch": True}, TypeError, "batch"),
    ],
)
def test_a_bad_option_is_refused_by_name(kind, options, error, named):
    with pytest.raises(error, match=named):
        kind(np.random.default_rng(0), **options)
