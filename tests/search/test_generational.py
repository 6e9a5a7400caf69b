"""A generation is handed out in pieces, and selected when all of it is told."""

import pickle

import numpy as np
import pytest
from table_answers import FITNESS, answered, info_of

from softvox_gym import Design
from softvox_gym.design import digits_of, indices_of
from softvox_search.generational import Generational
from softvox_search.variation import Individual, individuals, random_designs


class Counter(Generational):
    """Asks for designs 0 ... 4, then 5 ... 9, and so on; carries the last generation."""

    def __init__(self, rng):
        super().__init__(rng)
        self.selected = []
        self.kept = []

    def _carried(self):
        return self.kept

    def _initial(self):
        return digits_of(np.arange(5))

    def _breed(self):
        return digits_of(np.arange(5) + 5 * len(self.selected))

    def _select(self, designs, values, info):
        self.selected.append((indices_of(designs).tolist(), values, info["displacement"]))
        self.kept = individuals(designs, values)


@pytest.fixture
def counter():
    return Counter(np.random.default_rng(0))


def numbers(designs):
    return indices_of(designs).tolist()


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
    ((designs, values, displacement),) = counter.selected
    assert designs == [0, 1, 2, 3, 4]
    np.testing.assert_array_equal(values, FITNESS[:5])
    np.testing.assert_array_equal(displacement, info_of(digits_of(np.arange(5)))["displacement"])


def test_asking_again_before_telling_gives_the_same_designs_again(counter):
    assert numbers(counter.ask(2)) == numbers(counter.ask(2)) == [0, 1]
    assert numbers(counter.ask()) == [0, 1, 2, 3, 4]


def test_where_fewer_are_told_than_were_asked_the_rest_comes_next(counter):
    designs = counter.ask()[:3]
    counter.tell(designs, FITNESS[:3], info_of(designs))
    assert numbers(counter.ask()) == [3, 4]
    assert counter.recommend() == Design(int(np.argmax(FITNESS[:3])))


def test_what_becomes_of_the_asked_array_is_no_concern_of_the_searcher(counter):
    counter.ask()[:] = 2
    assert numbers(counter.ask()) == [0, 1, 2, 3, 4]


def test_designs_that_were_not_asked_for_are_refused(counter):
    designs = counter.ask()[::-1]
    with pytest.raises(ValueError, match="that ask returned, in that order"):
        counter.tell(designs, np.zeros(5), info_of(designs))


def test_a_nan_is_refused_as_no_selection_would_ever_remove_it(counter):
    designs = counter.ask()
    with pytest.raises(ValueError, match="got NaN; a diverged design is worth 0"):
        counter.tell(designs, np.array([0, 1, np.nan, 3, 4]), info_of(designs))
    assert counter.selected == []


def test_parents_are_each_named_once(counter):
    counter.kept = [Individual(row, value=1.0) for row in digits_of(np.array([7, 3, 7])).tolist()]
    assert numbers(counter.parents()) == [3, 7]


def test_before_the_first_selection_there_are_no_parents(counter):
    assert counter.parents().shape == (0, 8)


def test_a_refreshed_parent_is_worth_its_newer_value_alone(counter):
    answered(counter)
    counter.refresh(digits_of(np.array([3])), np.array([9.0]), info_of(digits_of(np.array([3]))))
    assert [individual.value for individual in counter.kept] == [*FITNESS[:3], 9.0, FITNESS[4]]
    assert counter.recommend() == Design(3)
    assert len(counter.selected) == 1


def test_a_lucky_value_is_forgotten_when_the_design_is_evaluated_again(counter):
    designs = counter.ask()
    counter.tell(designs, np.array([1.0, 9.0, 2.0, 1.0, 1.0]), info_of(designs))
    assert counter.recommend() == Design(1)
    counter.refresh(designs[1:2], np.array([0.5]), info_of(designs[1:2]))
    assert counter.recommend() == Design(2)


@pytest.mark.parametrize("told", range(1, 12))
def test_a_state_taken_within_a_generation_goes_on_with_the_rest_of_it(counter, told):
    for _ in range(told):
        answered(counter, 2)
    resumed = Counter(np.random.default_rng(1))
    resumed.load_state_dict(pickle.loads(pickle.dumps(counter.state_dict())))
    for n in (1, None, 2, None):
        assert numbers(answered(resumed, n)) == numbers(answered(counter, n))
    assert len(resumed.selected) == len(counter.selected)


def test_random_designs_have_each_digit_equally_often():
    counts = np.bincount(random_designs(10_000, np.random.default_rng(0)).ravel(), minlength=3)
    # 80,000 draws: the standard deviation of a count is sqrt(80000 * 1/3 * 2/3) = 133
    np.testing.assert_allclose(counts, 80_000 / 3, atol=4 * 133)
