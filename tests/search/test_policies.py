"""What each policy against luck does, and that a guarded search can be resumed."""

import pickle

import numpy as np
import pytest
from scripted import Script, ScriptWithParents, exact, numbers, tell
from table_answers import FITNESS, NoisyTable, answered

from softvox_gym import Design
from softvox_gym.design import indices_of
from softvox_search.beliefs import RunningMeans
from softvox_search.policies import Guarded, Policy
from softvox_search.registry import make

NAIVE = Policy()
ALL = Policy(running_mean=True, reevaluate_parents=True, final_stage=True)
SIZES = (None, 3, 1, None, 7)


# No switch


@pytest.mark.parametrize("name", ["ga", "hill_climber", "afpo"])
def test_without_any_switch_a_guarded_searcher_is_the_bare_one(name):
    bare = make(name, np.random.default_rng(0))
    guarded = Guarded(make(name, np.random.default_rng(0)), NAIVE, evaluations=1000)
    noise = [NoisyTable(0.3, seed=1), NoisyTable(0.3, seed=1)]
    for n in SIZES * 8:
        designs, values = noise[0].answered(bare, n)
        same, same_values = noise[1].answered(guarded, n)
        np.testing.assert_array_equal(same, designs)
        np.testing.assert_array_equal(same_values, values)
        assert guarded.recommend() == bare.recommend()


def test_without_any_switch_a_design_is_believed_to_be_worth_what_was_told_last():
    guarded = Guarded(Script([5, 6], [5]), NAIVE)
    tell(guarded, guarded.ask(), [1.0, 2.0])
    tell(guarded, guarded.ask(), [4.0])
    assert [guarded.belief(Design(i)) for i in (5, 6)] == [4.0, 2.0]
    assert np.isnan(guarded.belief(Design(7)))


# Running means


def carried(searcher):
    """Return the designs that a searcher carries along, and what it thinks that they are worth."""
    if hasattr(searcher, "elites"):
        designs, values, _ = searcher.elites()
        return indices_of(designs), values
    individuals = searcher._population
    return indices_of(np.array(individuals)), np.array([one.value for one in individuals])


@pytest.mark.parametrize("name", ["ga", "mu_plus_lambda", "afpo", "nsga2", "map_elites"])
def test_means_reach_the_designs_that_a_searcher_carries_along(name):
    inner = make(name, np.random.default_rng(0))
    guarded = Guarded(inner, Policy(running_mean=True))
    noise, told = NoisyTable(0.5, seed=1), {}
    for _ in range(25):
        designs, values = noise.answered(guarded)
        for number, value in zip(indices_of(designs), values, strict=True):
            told.setdefault(number, []).append(value)
        numbers_, believed = carried(inner)
        means = [np.mean(told[number]) for number in numbers_]
        np.testing.assert_allclose(believed, means)
    assert max(map(len, told.values())) > 1


def test_mean_displacements_leave_out_what_diverged():
    means = RunningMeans()
    nan = [np.nan] * 3
    means.add(
        np.array([3, 3, 4, 3, 5]),
        np.array([1.0, 3.0, 1.0, 0.0, 0.0]),
        np.array([[1.0, 0.0, 0.0], [0.0, 3.0, 0.0], [1.0, 1.0, 1.0], nan, nan]),
    )
    assert means.displacements(np.array([4, 3])).tolist() == [[1.0, 1.0, 1.0], [0.5, 1.5, 0.0]]
    assert np.isnan(means.displacements(np.array([5, 6]))).all()


def test_running_means_and_their_errors_are_those_of_all_values():
    rng = np.random.default_rng(0)
    indices = rng.integers(0, 20, 200)
    values = rng.normal(3, 0.5, 200)
    means = RunningMeans()
    for part in np.split(np.arange(200), [7, 50, 51, 120]):
        means.add(indices[part], values[part], np.zeros((len(values[part]), 3)))
    for i in range(20):
        own = values[indices == i]
        assert means.counts[i] == len(own) > 1
        assert means.means[i] == pytest.approx(own.mean(), rel=1e-14)  # of some ten roundings
        error = own.std(ddof=1) / np.sqrt(len(own))
        assert means.standard_errors(np.array([i]))[0] == pytest.approx(error, rel=1e-12)
    assert np.isnan(means.means[20:]).all()


def test_equal_values_have_exactly_that_mean_and_no_error():
    means = RunningMeans()
    means.add(np.array([3, 3, 3]), np.array([0.1, 0.1, 0.1]), np.zeros((3, 3)))
    assert means.means[3] == 0.1
    assert means.standard_errors(np.array([3])) == [0.0]


def test_the_searcher_is_told_the_mean_of_all_values_and_its_error():
    errors = []

    class Listener(Script):
        def tell(self, designs, values, info):
            super().tell(designs, values, info)
            errors.append(info["standard_error"].tolist())

    script = Listener([5, 6], [6, 7], [6])
    guarded = Guarded(script, Policy(running_mean=True))
    tell(guarded, guarded.ask(), [1.0, 2.0], error=0.25)
    tell(guarded, guarded.ask(), [4.0, 2.5], error=0.25)
    tell(guarded, guarded.ask(), [6.0], error=0.25)
    assert [event[1:] for event in script.events if event[0] == "tell"] == [
        ([5, 6], [1.0, 2.0]),
        ([6, 7], [3.0, 2.5]),
        ([6], [4.0]),
    ]
    assert errors == [[0.25, 0.25], [1.0, 0.25], [pytest.approx(2 / np.sqrt(3))]]
    assert guarded.recommend() == Design(6)
    assert guarded.belief(Design(6)) == 4.0


def test_the_best_mean_is_recommended_not_the_luckiest_draw():
    guarded = Guarded(Script([5, 6], [5]), Policy(running_mean=True))
    tell(guarded, guarded.ask(), [9.0, 3.0])
    assert guarded.recommend() == Design(5)
    tell(guarded, guarded.ask(), [-5.0])
    assert guarded.recommend() == Design(6)


# Parents


def test_parents_are_evaluated_anew_and_refreshed_before_the_offspring_are_told():
    script = ScriptWithParents([10, 11, 12], parents=[3, 4])
    guarded = Guarded(script, Policy(reevaluate_parents=True))
    asked = guarded.ask()
    assert numbers(asked) == [3, 4, 10, 11, 12]
    tell(guarded, asked, [1.0, 2.0, 3.0, 4.0, 5.0])
    assert script.events == [
        ("ask", None),
        ("refresh", [3, 4], [1.0, 2.0]),
        ("tell", [10, 11, 12], [3.0, 4.0, 5.0]),
    ]
    assert guarded.belief(Design(3)) == 1.0


def test_asked_for_in_pieces_the_searcher_is_told_its_batch_as_a_whole_and_parents_once():
    script = ScriptWithParents([10, 11, 12], parents=[3, 4])
    guarded = Guarded(script, Policy(reevaluate_parents=True))
    pieces = []
    for value in (1.0, 2.0, 3.0):
        assert len(script.events) < 2
        pieces.append(numbers(asked := guarded.ask(2)))
        tell(guarded, asked, [value] * len(asked))
    assert pieces == [[3, 4], [10, 11], [12]]
    assert script.events[1:] == [
        ("refresh", [3, 4], [1.0, 1.0]),
        ("tell", [10, 11, 12], [2.0, 2.0, 3.0]),
    ]


def test_within_the_first_batch_the_best_value_told_is_recommended():
    guarded = Guarded(ScriptWithParents([10, 11, 12]), Policy(reevaluate_parents=True))
    for value in (1.0, 3.0):
        tell(guarded, guarded.ask(1), [value])
    assert guarded.recommend() == Design(11)


@pytest.mark.parametrize("kept", [1, 2, 4])
def test_a_batch_cut_short_by_the_budget_is_told_as_far_as_it_goes(kept):
    script = ScriptWithParents([10, 11, 12], parents=[3, 4])
    guarded = Guarded(script, Policy(reevaluate_parents=True))
    tell(guarded, guarded.ask()[:kept], np.arange(kept))
    expected = [("refresh", [3, 4][:kept], [0.0, 1.0][:kept])]
    if kept > 2:
        expected.append(("tell", [10, 11], [2.0, 3.0]))
    assert script.events[1:] == expected


def test_parents_are_refreshed_with_the_running_mean_where_that_is_on():
    script = ScriptWithParents([3], [10], parents=[3])
    guarded = Guarded(script, Policy(running_mean=True, reevaluate_parents=True))
    tell(guarded, guarded.ask(), [1.0, 2.0])  # as parent and as offspring
    tell(guarded, guarded.ask(), [6.0, 0.0])
    assert [event for event in script.events if event[0] == "refresh"] == [
        ("refresh", [3, 3], [1.5, 1.5]),
        ("refresh", [3, 10], [3.0, 0.0]),
    ]


def test_of_a_searcher_that_names_no_parents_none_are_evaluated_anew():
    guarded = Guarded(Script([10, 11]), Policy(reevaluate_parents=True))
    assert numbers(guarded.ask()) == [10, 11]


@pytest.mark.parametrize("name", ["ga", "mu_plus_lambda", "afpo", "nsga2", "map_elites"])
def test_the_parents_of_an_evolutionary_searcher_lose_their_lucky_values(name):
    guarded = Guarded(make(name, np.random.default_rng(0)), Policy(reevaluate_parents=True))
    first = guarded.ask()
    tell(guarded, first, FITNESS[indices_of(first)] + 100.0)
    second = numbers(guarded.ask())
    parents = numbers(guarded._searcher.parents())
    assert 0 < len(parents) < len(second)
    assert second[: len(parents)] == parents
    answered(guarded)
    assert [guarded.belief(Design(i)) for i in parents] == FITNESS[parents].tolist()
    np.testing.assert_array_equal(guarded._searcher.values[parents], FITNESS[parents])


# State


@pytest.mark.parametrize("policy", [NAIVE, ALL, Policy(final_stage=True)], ids=str)
@pytest.mark.parametrize("name", ["ga", "map_elites"])
def test_resumed_anywhere_it_goes_on_with_the_same_bits(name, policy):
    def fresh():
        return Guarded(make(name, np.random.default_rng(0)), policy, evaluations=240)

    def value_of(i, designs):
        return exact(designs) + np.random.default_rng([1, i]).normal(0, 0.3, len(designs))

    guarded, states, course = fresh(), [], []
    for i in range(24):
        states.append(pickle.dumps(guarded.state_dict()))
        designs = guarded.ask(10)
        course.append(designs)
        tell(guarded, designs, value_of(i, designs))
    for begin in (0, 1, 4, 5, 7, 12, 15, 16, 17, 20, 23):
        resumed = fresh()
        resumed.load_state_dict(pickle.loads(states[begin]))
        for i in range(begin, 24):
            designs = resumed.ask(10)
            np.testing.assert_array_equal(designs, course[i])
            tell(resumed, designs, value_of(i, designs))
        assert resumed.recommend() == guarded.recommend()
        assert resumed.belief(resumed.recommend()) == guarded.belief(guarded.recommend())


def test_a_state_stays_what_it_was_while_the_search_goes_on():
    guarded = Guarded(make("ga", np.random.default_rng(0)), ALL, evaluations=300)
    for _ in range(2):
        answered(guarded)
    state = guarded.state_dict()
    before = pickle.dumps(state)
    while len(guarded.ask(50)):
        answered(guarded, 50)
    assert pickle.dumps(state) == before


# Bad input


def test_designs_that_were_not_asked_for_are_refused():
    guarded = Guarded(Script([1, 2], [3, 4]), NAIVE)
    with pytest.raises(ValueError, match="that ask returned, in that order"):
        tell(guarded, guarded.ask()[::-1], [1.0, 2.0])


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"running_mean": 1}, TypeError, "running_mean must be True or False, got 1"),
        ({"final_stage": "yes"}, TypeError, "final_stage must be True or False, got 'yes'"),
        ({"finalists": 0}, ValueError, "finalists must be at least 1, got 0"),
        ({"resamples": 2.0}, TypeError, "resamples must be a whole number, got 2.0"),
    ],
)
def test_a_policy_that_is_none_is_refused(options, error, message):
    with pytest.raises(error, match=message):
        Policy(**options)


def test_a_budget_that_is_none_is_refused():
    with pytest.raises(ValueError, match="evaluations must be at least 1, got 0"):
        Guarded(make("ga", np.random.default_rng(0)), NAIVE, evaluations=0)
