"""Evolutionary searchers do what their names promise, and stay clear of DEAP's traps."""

import pickle

import numpy as np
import pytest
from table_answers import FITNESS, TABLE, answered, info_of

from softvox_gym.design import digits_of, indices_of
from softvox_search.registry import make
from softvox_search.searchers.map_elites import NOWHERE, MapElites, kinds
from softvox_search.variation import digits

NAMES = ["ga", "mu_plus_lambda", "afpo", "nsga2", "map_elites"]
WITH_POPULATION = NAMES[:-1]


def made(name, seed=0, **options):
    return make(name, np.random.default_rng(seed), **options)


@pytest.mark.parametrize("name", NAMES)
def test_breeding_leaves_the_population_as_it_is(name):
    searcher = made(name)
    for _ in range(5):
        answered(searcher)
    before = pickle.dumps(designs_kept(searcher))
    searcher.ask()
    assert pickle.dumps(designs_kept(searcher)) == before


def designs_kept(searcher):
    if isinstance(searcher, MapElites):
        return searcher.elites()[0].tolist()
    return digits(searcher._population).tolist()


@pytest.mark.parametrize("name", NAMES)
def test_offspring_are_fitter_than_random_designs_with_as_many_active_voxels(name):
    searcher = made(name)
    told = [indices_of(answered(searcher)) for _ in range(60)]
    later = np.concatenate(told[30:])
    mean = np.array([FITNESS[TABLE["n_active"] == n].mean() for n in range(9)])
    error = FITNESS.std() / np.sqrt(len(later))
    assert (FITNESS[later] - mean[TABLE["n_active"][later]]).mean() > 4 * error


@pytest.mark.parametrize("name", WITH_POPULATION)
def test_the_population_keeps_its_size_and_the_values_told(name):
    searcher = made(name, population=20)
    for _ in range(12):
        answered(searcher)
        values = [individual.value for individual in searcher._population]
        np.testing.assert_array_equal(values, FITNESS[indices_of(digits(searcher._population))])
        assert len(values) == 20


@pytest.mark.parametrize("name", WITH_POPULATION)
def test_the_fittest_is_never_lost(name):
    searcher = made(name)
    best = 0.0
    for _ in range(30):
        best = max(best, FITNESS[indices_of(answered(searcher))].max())
        assert max(individual.value for individual in searcher._population) == best
        assert FITNESS[searcher.recommend().index] == best


def test_without_an_elite_the_genetic_algorithm_carries_nobody_over():
    searcher = made("ga", elite=0)
    for _ in range(3):
        answered(searcher)
        assert len(searcher.ask()) == 50
        assert len(searcher.parents()) == 0


def test_the_parents_of_the_genetic_algorithm_are_its_elite():
    searcher = made("ga", elite=3)
    answered(searcher)
    fittest = sorted(searcher._population, key=lambda one: -one.value)[:3]
    searcher.ask()
    np.testing.assert_array_equal(
        indices_of(searcher.parents()), np.sort(indices_of(digits(fittest)))
    )


def test_a_tournament_of_many_breeds_from_the_fittest_alone():
    searcher = made("ga", tournament=1000, crossover=0.0, mutation=0.0)
    answered(searcher)
    fittest = searcher.recommend()
    changes = (searcher.ask() != digits_of(np.array([fittest.index]))).sum(axis=1)
    assert (changes == 1).all()


def test_the_fittest_of_parents_and_offspring_survive():
    searcher = made("mu_plus_lambda", population=10, offspring=30)
    answered(searcher)
    for _ in range(10):
        parents = [individual.value for individual in searcher._population]
        offspring = FITNESS[indices_of(answered(searcher))]
        survivors = [individual.value for individual in searcher._population]
        assert survivors == sorted([*parents, *offspring], reverse=True)[:10]


def test_every_survivor_ages_and_has_one_child_and_one_newcomer_joins():
    searcher = made("afpo", population=12, mutation=0.0)
    answered(searcher)
    assert [individual.age for individual in searcher._population] == [0] * 12
    for _ in range(15):
        ages = [individual.age for individual in searcher._population]
        parents = digits(searcher._population)
        asked = searcher.ask()
        assert [individual.age for individual in searcher._population] == [a + 1 for a in ages]
        assert searcher._ages == [*(age + 1 for age in ages), 0]
        assert ((asked[:-1] != parents).sum(axis=1) == 1).all()
        answered(searcher)


def test_nobody_survives_whom_someone_left_out_dominates():
    searcher = made("afpo", population=12)
    answered(searcher)
    for _ in range(15):
        asked = searcher.ask()
        ages = [*searcher._ages, *(individual.age for individual in searcher._population)]
        values = [*FITNESS[indices_of(asked)], *(one.value for one in searcher._population)]
        answered(searcher)
        survivors = [(individual.value, individual.age) for individual in searcher._population]
        out = list(zip(values, ages, strict=True))
        for survivor in survivors:
            out.remove(survivor)
        assert not any(
            value >= other_value and age <= other_age and (value, age) != (other_value, other_age)
            for value, age in out
            for other_value, other_age in survivors
        )


def test_newcomers_have_descendants_among_the_survivors():
    searcher = made("afpo")
    for _ in range(100):
        answered(searcher)
    ages = {individual.age for individual in searcher._population}
    assert len(ages) > 3
    assert min(ages) < 100 - 1


def test_the_front_of_few_active_voxels_and_far_travel_is_kept():
    searcher = made("nsga2", population=40)
    best = np.full(9, -np.inf)  # by number of active voxels
    for _ in range(40):
        asked = indices_of(answered(searcher))
        np.maximum.at(best, TABLE["n_active"][asked], FITNESS[asked])
        front = {
            (best[n], n)
            for n in range(9)
            if best[n] > -np.inf and best[n] > best[:n].max(initial=-np.inf)
        }
        assert front <= {(one.value, one.count(2)) for one in searcher._population}


def test_the_archive_holds_the_fittest_seen_of_every_kind():
    searcher = made("map_elites")
    seen = {}
    for _ in range(40):
        asked = answered(searcher)
        found = kinds(asked, info_of(asked)).tolist()
        for kind, value in zip(map(tuple, found), FITNESS[indices_of(asked)], strict=True):
            seen[kind] = max(value, seen.get(kind, -np.inf))
    designs, values, found = searcher.elites()
    assert dict(zip(map(tuple, found.tolist()), values, strict=True)) == seen
    np.testing.assert_array_equal(values, FITNESS[indices_of(designs)])


def kind_of(displacement, digits="02112022"):
    row = np.array([[int(digit) for digit in digits]])
    (kind,) = kinds(row, {"displacement": np.array([displacement], dtype=float)}).tolist()
    return kind


def test_a_kind_is_the_voxels_the_active_ones_and_the_sector_of_the_heading():
    headings = [(1, 0), (1, 1), (0, 2), (-1, 1), (-3, 0), (-1, -1), (0, -1), (1, -1)]
    assert [kind_of((*xy, 0)) for xy in headings] == [[6, 4, sector] for sector in range(8)]


def test_rounding_about_an_axis_does_not_change_the_sector():
    assert kind_of((1, 1e-16, 0)) == kind_of((1, -1e-16, 0)) == [6, 4, 0]
    assert kind_of((-1, 1e-16, 0)) == kind_of((-1, -1e-16, 0)) == [6, 4, 4]


def test_who_diverged_or_stays_where_it_is_has_no_heading():
    assert kind_of((np.nan, np.nan, np.nan)) == [6, 4, NOWHERE]
    assert kind_of((1e-3, 0, 5)) == [6, 4, NOWHERE]


def test_the_order_of_elites_does_not_depend_on_who_came_first():
    first, second = made("map_elites"), made("map_elites")
    unequal = np.unique(FITNESS, return_index=True)[1]  # of equals who came first does stay
    designs = digits_of(np.random.default_rng(0).permutation(unequal)[:500])
    first._select(designs, FITNESS[indices_of(designs)], info_of(designs))
    for row in designs[::-1, np.newaxis]:
        second._select(row, FITNESS[indices_of(row)], info_of(row))
    for one, other in zip(first.elites(), second.elites(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_an_elite_that_turns_out_to_head_elsewhere_moves():
    searcher = made("map_elites")
    designs = digits_of(np.array([6453, 4295]))
    info = info_of(designs)
    searcher._select(designs, FITNESS[[6453, 4295]], info)
    for heading, sector in (((3.0, 0.0, 0.0), 0), ((0.0, 3.0, 0.0), 2)):
        newer = {**info, "displacement": np.array([heading])}
        searcher.refresh(designs[:1], np.array([3.0]), newer)
        found, values, kinds_found = searcher.elites()
        at = indices_of(found).tolist().index(6453)
        assert len(found) == 2
        assert values[at] == 3.0
        assert kinds_found[at, 2] == sector


def test_all_elites_can_be_refreshed_at_once():
    searcher = made("map_elites")
    for _ in range(3):
        answered(searcher)
    designs, values, _ = searcher.elites()
    searcher.refresh(designs, values / 2, info_of(designs))
    np.testing.assert_array_equal(searcher.elites()[0], designs)
    np.testing.assert_array_equal(searcher.elites()[1], values / 2)


def test_the_parents_of_map_elites_are_those_of_the_present_generation():
    searcher = made("map_elites", mutation=0.0)
    answered(searcher)
    asked = searcher.ask()
    distance = (asked[:, np.newaxis] != searcher.parents()).sum(axis=2)
    assert (distance.min(axis=1) <= 1).all()
    assert (distance.min(axis=0) <= 1).all()


@pytest.mark.parametrize(
    ("name", "options", "error", "message"),
    [
        ("ga", {"population": 1}, ValueError, "population must be at least 2, got 1"),
        ("ga", {"population": 2.5}, TypeError, "population must be a whole number, got 2.5"),
        ("ga", {"elite": 50}, ValueError, "elite must be smaller than the population, 50"),
        ("ga", {"elite": -1}, ValueError, "elite must be at least 0"),
        ("ga", {"tournament": 0}, ValueError, "tournament must be at least 1"),
        ("ga", {"crossover": 1.5}, ValueError, "crossover must be from 0 to 1, got 1.5"),
        ("ga", {"mutation": "high"}, TypeError, "mutation must be a number from 0 to 1"),
        ("ga", {"mutation": np.nan}, ValueError, "mutation must be from 0 to 1"),
        ("mu_plus_lambda", {"offspring": 0}, ValueError, "offspring must be at least 1"),
        ("mu_plus_lambda", {"population": True}, TypeError, "population must be a whole number"),
        ("afpo", {"population": 0}, ValueError, "population must be at least 1"),
        ("nsga2", {"population": 50}, ValueError, "population must be a multiple of 4, got 50"),
        ("map_elites", {"population": 0}, ValueError, "population must be at least 1"),
        ("map_elites", {"mutation": -0.1}, ValueError, "mutation must be from 0 to 1"),
    ],
)
def test_an_option_that_is_not_what_it_must_be_is_refused(name, options, error, message):
    with pytest.raises(error, match=message):
        made(name, **options)


@pytest.mark.parametrize(
    ("name", "options"),
    [
        ("ga", {"population": 2, "elite": 1}),
        ("mu_plus_lambda", {"population": 1, "offspring": 1}),
        ("afpo", {"population": 1}),
        ("nsga2", {"population": 4}),
        ("map_elites", {"population": 1}),
    ],
)
def test_the_smallest_population_searches_too(name, options):
    searcher = made(name, **options)
    for _ in range(50):
        answered(searcher)
    assert FITNESS[searcher.recommend().index] == np.nanmax(searcher.values)
