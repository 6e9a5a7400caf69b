"""Evolutionary searchers do what their names promise, and stay clear of DEAP's traps."""

import pickle
import random
import subprocess
import sys

import numpy as np
import pytest
from deap import tools
from table_answers import FITNESS, SPACE, TABLE, answered, fitness_of, info_of, numbers, rows

from softvox_gym import Design
from softvox_search.evolution import Evolutionary, Individual, Value, ValueAndCost, mutate
from softvox_search.registry import make
from softvox_search.searchers.map_elites import NOWHERE, MapElites, kinds

NAMES = ["ga", "mu_plus_lambda", "afpo", "nsga2", "map_elites"]
WITH_POPULATION = NAMES[:-1]


def made(name, seed=0, **options):
    return make(name, np.random.default_rng(seed), **options)


def values_of(population):
    return [individual.fitness.values[0] for individual in population]


def digits(population):
    return np.array(population, dtype=np.int64).reshape(-1, 8)


# A generation in pieces


class Counter(Evolutionary):
    """Asks for designs 0 ... 4, then 5 ... 9, and so on; the last generation competes again."""

    def __init__(self):
        super().__init__(SPACE, np.random.default_rng(0), population=5, crossover=0.5, mutation=0.1)
        self.selected = []

    def random(self, n):
        return self._breed()

    def _breed(self):
        first = 5 * len(self.selected)
        return [Individual(row, Value()) for row in rows(*range(first, first + 5)).tolist()]

    def _survivors(self, offspring):
        self.selected.append((numbers(digits(offspring)), values_of(offspring)))
        return offspring


@pytest.fixture
def counter():
    return Counter()


def test_pieces_are_handed_out_until_the_generation_is_used_up(counter):
    assert [numbers(answered(counter, n)) for n in (2, 2, 2, None, 9)] == [
        [0, 1],
        [2, 3],
        [4],
        [5, 6, 7, 8, 9],
        [10, 11, 12, 13, 14],
    ]


def test_selection_waits_until_the_last_piece_is_told_and_sees_all_in_order(counter):
    answered(counter, 3)
    assert counter.selected == []
    answered(counter, 3)
    assert counter.selected == [([0, 1, 2, 3, 4], FITNESS[:5].tolist())]


def test_asking_again_before_telling_gives_the_same_designs_again(counter):
    assert numbers(counter.ask(2)) == numbers(counter.ask(2)) == [0, 1]
    counter.ask()[:] = 2
    assert numbers(counter.ask()) == [0, 1, 2, 3, 4]


def test_where_fewer_are_told_than_were_asked_the_rest_comes_next(counter):
    designs = counter.ask()[:3]
    counter.tell(designs, FITNESS[:3], info_of(designs))
    assert numbers(counter.ask()) == [3, 4]
    assert counter.recommend() == Design(int(np.argmax(FITNESS[:3])))


def test_designs_that_were_not_asked_for_are_refused(counter):
    designs = counter.ask()[::-1]
    with pytest.raises(ValueError, match="that ask returned, in that order"):
        counter.tell(designs, np.zeros(5), info_of(designs))


def test_a_nan_is_refused_as_no_selection_would_ever_remove_it(counter):
    designs = counter.ask()
    with pytest.raises(ValueError, match="got NaN; a diverged design is worth 0"):
        counter.tell(designs, np.array([0, 1, np.nan, 3, 4]), info_of(designs))
    assert counter.selected == []


def test_parents_are_each_named_once_and_none_before_the_first_selection(counter):
    assert counter.parents().shape == (0, 8)
    counter.population = [Individual(row, Value()) for row in rows(7, 3, 7).tolist()]
    assert numbers(counter.parents()) == [7, 3]


def test_a_refreshed_parent_is_worth_its_newer_value_alone(counter):
    designs = counter.ask()
    counter.tell(designs, np.array([1.0, 9.0, 2.0, 1.0, 1.0]), info_of(designs))
    assert counter.recommend() == Design(1)
    counter.refresh(designs[1:2], np.array([0.5]), info_of(designs[1:2]))
    assert values_of(counter.population) == [1.0, 0.5, 2.0, 1.0, 1.0]
    assert counter.recommend() == Design(2)
    assert len(counter.selected) == 1


# Operators


@pytest.mark.parametrize("rate", [0.0, 0.05, 1 / 8, 0.5, 1.0])
def test_digits_mutate_at_the_rate_that_was_asked_for_to_another_and_one_always_does(rate):
    random.seed(0)
    parents = SPACE.random(20_000, np.random.default_rng(0))
    steps = (digits([mutate(row, rate)[0] for row in parents.tolist()]) - parents) % 3
    assert (steps != 0).any(axis=1).all()
    expected = rate + (1 - rate) ** 8 / 8  # where no digit is hit, one of eight is after all
    # The number of changes in a design has a variance of 8 rate (1 - rate) at most.
    error = np.sqrt(8 * rate * (1 - rate) / 20_000) / 8
    assert (steps != 0).mean() == pytest.approx(expected, abs=4 * error + 1e-12)
    changed = np.bincount(steps.ravel(), minlength=3)[1:]
    np.testing.assert_allclose(changed, changed.sum() / 2, atol=4 * np.sqrt(changed.sum()) / 2)


def test_random_individuals_have_each_digit_equally_often():
    random.seed(0)
    counts = np.bincount(digits(Counter.__base__.random(Counter(), 10_000)).ravel(), minlength=3)
    # 80,000 draws: the standard deviation of a count is sqrt(80000 * 1/3 * 2/3) = 133
    np.testing.assert_allclose(counts, 80_000 / 3, atol=4 * 133)


def test_a_clone_is_not_evaluated_and_of_its_parents_age():
    parent = Individual([0] * 8, ValueAndCost((2.0, 3.0)), age=4)
    child = parent.clone()
    child[0] = 1
    assert (parent[0], parent.fitness.valid, child.fitness.valid, child.age) == (0, True, False, 4)


def test_no_class_is_made_by_deaps_creator():
    code = (
        "from softvox_search.searchers import afpo, genetic, map_elites, mu_plus_lambda, nsga2\n"
        "import deap.creator\n"
        "made = [one for one in vars(deap.creator).values() if isinstance(one, type)]\n"
        "assert not [one for one in made if issubclass(one, list)]"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


@pytest.mark.parametrize("seed", range(5))
def test_fronts_are_those_that_comparing_all_pairs_gives(seed):
    left = [
        Individual(row, ValueAndCost((FITNESS[SPACE.numbers(row)], row.tolist().count(2))))
        for row in SPACE.random(120, np.random.default_rng(seed))
    ]
    for front in tools.sortLogNondominated(left, len(left)):
        undominated = [
            one for one in left if not any(other.fitness.dominates(one.fitness) for other in left)
        ]
        assert sorted(map(id, front)) == sorted(map(id, undominated))
        left = [one for one in left if all(one is not other for other in front)]
    assert left == []


# Searchers


@pytest.mark.parametrize("name", NAMES)
def test_breeding_leaves_the_population_as_it_is(name):
    def kept():
        if isinstance(searcher, MapElites):
            return searcher.elites()[0].tolist()
        return digits(searcher.population).tolist()

    searcher = made(name)
    for _ in range(2):
        answered(searcher)
    before = pickle.dumps(kept())
    searcher.ask()
    assert pickle.dumps(kept()) == before


@pytest.mark.parametrize("name", NAMES)
def test_offspring_are_fitter_than_random_designs_with_as_many_active_voxels(name):
    later = []
    for seed in range(4):
        searcher = made(name, seed)
        told = [numbers(answered(searcher)) for _ in range(60)]
        later += [number for part in told[30:] for number in part]
    mean = np.array([FITNESS[TABLE["n_active"] == n].mean() for n in range(9)])
    error = FITNESS.std() / np.sqrt(len(later))
    assert (FITNESS[later] - mean[TABLE["n_active"][later]]).mean() > 4 * error


@pytest.mark.parametrize("name", WITH_POPULATION)
def test_the_population_keeps_its_size_and_the_values_told_and_never_loses_the_fittest(name):
    searcher = made(name, population=20)
    best = 0.0
    for _ in range(25):
        best = max(best, fitness_of(answered(searcher)).max())
        values = values_of(searcher.population)
        np.testing.assert_array_equal(values, fitness_of(digits(searcher.population)))
        assert len(values) == 20
        assert max(values) == best == FITNESS[searcher.recommend().index]


def test_without_an_elite_the_genetic_algorithm_carries_nobody_over():
    searcher = made("ga", elite=0)
    for _ in range(3):
        answered(searcher)
        assert len(searcher.ask()) == 50
        assert len(searcher.parents()) == 0


def test_the_parents_of_the_genetic_algorithm_are_its_elite():
    searcher = made("ga", elite=3)
    answered(searcher)
    fittest = sorted(values_of(searcher.population))[-3:]
    searcher.ask()
    assert sorted(fitness_of(searcher.parents())) == fittest


def test_a_tournament_of_many_breeds_from_the_fittest_alone():
    searcher = made("ga", tournament=1000, crossover=0.0, mutation=0.0)
    answered(searcher)
    assert ((searcher.ask() != searcher.best).sum(axis=1) == 1).all()


def test_the_rate_of_mutation_goes_with_the_sites():
    assert made("ga").toolbox.mutate.keywords["indpb"] == 1 / 8
    assert made("map_elites")._mutation == 1 / 8


def test_the_fittest_of_parents_and_offspring_survive():
    searcher = made("mu_plus_lambda", population=10, offspring=30)
    answered(searcher)
    for _ in range(10):
        parents = values_of(searcher.population)
        offspring = fitness_of(answered(searcher))
        survivors = values_of(searcher.population)
        assert survivors == sorted([*parents, *offspring], reverse=True)[:10]


def test_every_survivor_ages_and_has_one_child_and_one_newcomer_joins():
    searcher = made("afpo", population=12, mutation=0.0)
    answered(searcher)
    assert [individual.age for individual in searcher.population] == [0] * 12
    for _ in range(15):
        ages = [individual.age + 1 for individual in searcher.population]
        parents = digits(searcher.population)
        asked = searcher.ask()
        assert [individual.age for individual in searcher.population] == ages
        assert [individual.age for individual in searcher._offspring] == [*ages, 0]
        assert ((asked[:-1] != parents).sum(axis=1) == 1).all()
        answered(searcher)


def test_nobody_survives_whom_someone_left_out_dominates():
    searcher = made("afpo", population=12)
    answered(searcher)
    for _ in range(15):
        asked = searcher.ask()
        pool = [*searcher._offspring, *searcher.population]
        ages = [individual.age for individual in pool]
        values = [*fitness_of(asked), *values_of(searcher.population)]
        answered(searcher)
        survivors = [individual.fitness.values for individual in searcher.population]
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
    ages = {individual.age for individual in searcher.population}
    assert len(ages) > 3
    assert min(ages) < 100 - 1


def test_the_front_of_few_active_voxels_and_far_travel_is_kept():
    searcher = made("nsga2", population=40)
    best = np.full(9, -np.inf)  # by number of active voxels
    for _ in range(40):
        asked = numbers(answered(searcher))
        np.maximum.at(best, TABLE["n_active"][asked], FITNESS[asked])
        front = {
            (best[n], n)
            for n in range(9)
            if best[n] > -np.inf and best[n] > best[:n].max(initial=-np.inf)
        }
        assert front <= {individual.fitness.values for individual in searcher.population}


# MAP-Elites


def test_the_archive_holds_the_fittest_seen_of_every_kind():
    searcher = made("map_elites")
    seen = {}
    for _ in range(40):
        asked = answered(searcher)
        found = kinds(asked, info_of(asked)).tolist()
        for kind, value in zip(map(tuple, found), fitness_of(asked), strict=True):
            seen[kind] = max(value, seen.get(kind, -np.inf))
    designs, values, found = searcher.elites()
    assert dict(zip(map(tuple, found.tolist()), values, strict=True)) == seen
    np.testing.assert_array_equal(values, fitness_of(designs))


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
    designs = rows(*np.random.default_rng(0).permutation(unequal)[:500])
    first.tell(designs, fitness_of(designs), info_of(designs))
    for row in designs[::-1, np.newaxis]:
        second.tell(row, fitness_of(row), info_of(row))
    for one, other in zip(first.elites(), second.elites(), strict=True):
        np.testing.assert_array_equal(one, other)


def test_an_elite_that_turns_out_to_head_elsewhere_moves():
    searcher = made("map_elites")
    designs = rows(6453, 4295)
    info = info_of(designs)
    searcher.tell(designs, FITNESS[[6453, 4295]], info)
    for heading, sector in (((3.0, 0.0, 0.0), 0), ((0.0, 3.0, 0.0), 2)):
        newer = {**info, "displacement": np.array([heading])}
        searcher.refresh(designs[:1], np.array([3.0]), newer)
        found, values, kinds_found = searcher.elites()
        at = numbers(found).index(6453)
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


# Options


@pytest.mark.parametrize(
    ("name", "options", "error", "message"),
    [
        ("ga", {"population": 1}, ValueError, "population must be at least 2 .*, got 1"),
        ("ga", {"population": 2.5}, TypeError, "population must be a whole number, got 2.5"),
        ("ga", {"elite": 50}, ValueError, "elite must be smaller than the population, 50"),
        ("ga", {"elite": -1}, ValueError, "elite must be at least 0"),
        ("ga", {"tournament": 0}, ValueError, "tournament must be at least 1"),
        ("ga", {"crossover": 1.5}, ValueError, "crossover must be from 0 to 1, got 1.5"),
        ("ga", {"mutation": "high"}, TypeError, "mutation must be a number, got 'high'"),
        ("ga", {"mutation": np.nan}, ValueError, "mutation must be finite and at least 0"),
        ("mu_plus_lambda", {"offspring": 0}, ValueError, "offspring must be at least 1"),
        ("mu_plus_lambda", {"population": True}, TypeError, "population must be a whole number"),
        ("afpo", {"population": 0}, ValueError, "population must be at least 1"),
        ("nsga2", {"population": 50}, ValueError, "population must be a multiple of 4, got 50"),
        ("map_elites", {"population": 0}, ValueError, "population must be at least 1"),
        ("map_elites", {"mutation": -0.1}, ValueError, "mutation must be finite and at least 0"),
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
    assert FITNESS[searcher.recommend().index] == max(searcher.values.values())
