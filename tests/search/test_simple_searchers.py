"""Exhaustive and random search do what theory says; the hill climber climbs."""

import numpy as np
import pytest
from table_answers import FITNESS, SPACE, answered, info_of, numbers, rows

from softvox_gym import Design
from softvox_search.protocol import keys_of
from softvox_search.searchers.exhaustive import Exhaustive
from softvox_search.searchers.hill_climber import HillClimber, neighbours
from softvox_search.searchers.random_search import RandomSearch, Urn

N_DESIGNS = SPACE.n_designs
RANKING = np.argsort(-FITNESS)
SEEDS = 200


def made(kind, seed=0, **options):
    return kind(SPACE, np.random.default_rng(seed), **options)


def around(number):
    """The numbers of a design's neighbours."""
    return np.array(numbers(neighbours(rows(number)[0])))


def order_of(searcher, *, n=N_DESIGNS):
    """The numbers of the first n designs asked, or of all until nothing more is."""
    parts, count = [], 0
    while count < n and len(asked := answered(searcher)):
        parts.append(numbers(asked))
        count += len(asked)
    return np.concatenate(parts)[:n]


def test_exhaustive_search_asks_for_every_design_by_number_and_then_for_nothing():
    searcher = made(Exhaustive)
    np.testing.assert_array_equal(order_of(searcher), np.arange(N_DESIGNS))
    assert searcher.ask().shape == (0, 8)
    assert searcher.recommend() == Design(6453)


def test_without_replacement_the_order_is_that_of_the_generator():
    first, again, other = (order_of(made(RandomSearch, seed)) for seed in (0, 0, 1))
    np.testing.assert_array_equal(np.sort(first), np.arange(N_DESIGNS))
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


@pytest.mark.parametrize("kind", [Exhaustive, RandomSearch])
def test_at_most_as_many_as_wanted_are_asked(kind):
    searcher = made(kind, batch=10)
    assert [len(searcher.ask(n)) for n in (None, 3, 1)] == [10, 3, 1]


@pytest.fixture(scope="module")
def orders():
    return [order_of(made(RandomSearch, seed)) for seed in range(SEEDS)]


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
        searcher = made(RandomSearch, seed, replacement=True)
        drawn = np.concatenate([numbers(searcher.ask()) for _ in range(30)])
        hits.append(1 + np.flatnonzero(np.isin(drawn, RANKING[:k]))[0])
    error = np.sqrt(1 - k / n) * n / k / np.sqrt(SEEDS)  # of a geometric law
    assert abs(np.mean(hits) - n / k) < 3 * error


def test_with_replacement_designs_come_again():
    searcher = made(RandomSearch, replacement=True)
    drawn = order_of(searcher)
    # Of n draws from n designs a share of 1 - 1/e is expected to be different, with a variance of
    # n (1/e - 2/e^2) as n grows.
    deviation = np.sqrt(N_DESIGNS * (np.exp(-1) - 2 * np.exp(-2)))
    assert abs(len(np.unique(drawn)) - N_DESIGNS * (1 - np.exp(-1))) < 3 * deviation


@pytest.mark.parametrize("batch", [1, 8, 16])
def test_the_climber_asks_for_every_design_once_and_then_for_nothing(batch):
    searcher = made(HillClimber, batch=batch)
    np.testing.assert_array_equal(np.sort(order_of(searcher)), np.arange(N_DESIGNS))
    assert searcher.ask().shape == (0, 8)
    assert searcher.parents().shape == (0, 8)
    assert searcher.recommend() == Design(6453)


def summit_above(point, known):
    """Where the way upwards by the best neighbours known ends."""
    while np.nanmax(values := known(neighbours(rows(point)[0]))) > known(rows(point))[0]:
        point = around(point)[np.nanargmax(values)]
    return point


@pytest.mark.parametrize("batch", [1, 8, 16])
def test_the_climber_asks_for_neighbours_of_where_it_stands_and_moves_upwards(batch):
    searcher = made(HillClimber, 3, batch=batch)
    restarts = 0
    stood = None
    for _ in range(300):
        asked = numbers(searcher.ask())
        here = numbers(searcher.parents())
        if not here:
            assert len(asked) == 1
            if stood is not None:
                top = summit_above(stood, searcher.known)
                assert FITNESS[top] >= FITNESS[around(top)].max()
            restarts += 1
        else:
            assert len(asked) <= batch
            assert set(asked) <= set(around(here[0]).tolist())
            assert stood is None or here[0] == stood or FITNESS[here[0]] > FITNESS[stood]
        stood = here[0] if here else None
        searcher.tell(rows(*asked), FITNESS[asked], info_of(rows(*asked)))
    assert restarts > 1


def test_steepest_ascent_asks_for_all_sixteen_neighbours_and_takes_the_best():
    searcher = made(HillClimber, batch=16)
    (start,) = numbers(answered(searcher))
    asked = numbers(answered(searcher))
    assert sorted(asked) == sorted(around(start).tolist())
    searcher.ask()
    assert numbers(searcher.parents()) == [around(start)[FITNESS[around(start)].argmax()]]


def test_the_climber_comes_to_one_of_the_best_twenty_sooner_than_chance():
    best, needed = set(RANKING[:20].tolist()), []
    for seed in range(80):
        searcher, order = made(HillClimber, seed), []
        while not best & set(order):
            order += numbers(answered(searcher))
        needed.append(1 + min(order.index(one) for one in best & set(order)))
    # Random search needs (6561 + 1) / (20 + 1) on average.
    assert np.mean(needed) + 3 * np.std(needed) / np.sqrt(len(needed)) < 6562 / 21


def test_the_climber_believes_refreshed_values():
    searcher = made(HillClimber, batch=16)
    answered(searcher)
    start = searcher.parents()
    answered(searcher)
    searcher.refresh(start, np.array([100.0]), info_of(start))
    (asked,) = numbers(searcher.ask())  # a restart: nothing around is better
    assert asked not in around(numbers(start)[0])
    assert searcher.recommend() == Design(start[0])


def test_the_urn_skips_what_is_known_and_what_it_drew():
    known = set(keys_of(rows(*range(3000))))
    urn = Urn(SPACE, np.random.default_rng(0))
    drawn = [numbers(urn.draw(100, known)) for _ in range(36)]
    assert sorted(number for part in drawn for number in part) == list(range(3000, N_DESIGNS))
    assert len(urn.draw(1)) == 0


@pytest.mark.parametrize(
    ("kind", "options", "error", "named"),
    [
        (Exhaustive, {"batch": 0}, ValueError, "batch"),
        (RandomSearch, {"batch": 1.5}, TypeError, "batch"),
        (HillClimber, {"batch": 17}, ValueError, "batch"),
        (HillClimber, {"batch": True}, TypeError, "batch"),
    ],
)
def test_a_bad_option_is_refused_by_name(kind, options, error, named):
    with pytest.raises(error, match=named):
        made(kind, **options)
