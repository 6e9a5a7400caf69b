"""What each policy against luck does."""

import numpy as np
import pytest
from scripted import Script, ScriptWithParents, tell
from table_answers import FITNESS, SPACE, NoisyTable, answered, fitness_of, numbers, rows

from softvox_gym import Design
from softvox_search.function import FunctionSearcher
from softvox_search.oracle import Budget
from softvox_search.policies import Policy, PolicySearcher, means_of, with_policy
from softvox_search.registry import make

NAIVE = Policy()
SIZES = (None, 3, 1, None, 7)


def within(searcher, policy, **options):
    return PolicySearcher(searcher, policy, SPACE, **options)


# No switch


@pytest.mark.parametrize("name", ["ga", "hill_climber", "afpo"])
def test_without_any_switch_a_guarded_searcher_is_the_bare_one(name):
    bare = make(name, np.random.default_rng(0))
    guarded = within(make(name, np.random.default_rng(0)), NAIVE, evaluations=1000)
    noise = [NoisyTable(0.3, seed=1), NoisyTable(0.3, seed=1)]
    for n in SIZES * 8:
        designs, values = noise[0].answered(bare, n)
        same, same_values = noise[1].answered(guarded, n)
        np.testing.assert_array_equal(same, designs)
        np.testing.assert_array_equal(same_values, values)
        assert guarded.recommend() == bare.recommend()


def test_without_any_switch_a_design_is_believed_to_be_worth_what_was_told_last():
    guarded = within(Script([5, 6], [5]), NAIVE)
    tell(guarded, guarded.ask(), [1.0, 2.0])
    tell(guarded, guarded.ask(), [4.0])
    assert [guarded.belief(Design(i)) for i in (5, 6)] == [4.0, 2.0]
    assert np.isnan(guarded.belief(Design(7)))


# Running means


def carried(searcher):
    """Return the designs that a searcher carries along, and what it thinks that they are worth."""
    if hasattr(searcher, "elites"):
        designs, values, _ = searcher.elites()
        return numbers(designs), values
    population = searcher.population
    return numbers(np.array(population)), [one.fitness.values[0] for one in population]


@pytest.mark.parametrize("name", ["ga", "mu_plus_lambda", "afpo", "nsga2", "map_elites"])
def test_means_reach_the_designs_that_a_searcher_carries_along(name):
    inner = make(name, np.random.default_rng(0))
    guarded = within(inner, Policy(running_mean=True))
    noise, told = NoisyTable(0.5, seed=1), {}
    for _ in range(25):
        designs, values = noise.answered(guarded)
        for number, value in zip(numbers(designs), values, strict=True):
            told.setdefault(number, []).append(value)
        numbers_, believed = carried(inner)
        means = [np.mean(told[number]) for number in numbers_]
        np.testing.assert_allclose(believed, means)
    assert max(map(len, told.values())) > 1


def test_running_means_and_their_errors_are_those_of_all_values():
    draws = np.random.default_rng(0).normal(3, 0.5, (50, 4))
    mean, displacement, error = means_of(draws)
    np.testing.assert_allclose([mean, *displacement], draws.mean(axis=0), rtol=1e-14)
    assert error == pytest.approx(draws[:, 0].std(ddof=1) / np.sqrt(50), rel=1e-12)


def test_mean_displacements_leave_out_what_diverged_and_one_value_has_no_error():
    nan = [np.nan] * 3
    mean, displacement, error = means_of(np.array([[1.0, 1, 2, 3], [0.0, *nan], [5.0, 3, 2, 1]]))
    assert (mean, displacement.tolist()) == (2.0, [2.0, 2.0, 2.0])
    mean, displacement, error = means_of(np.array([[0.0, *nan]]))
    assert mean == 0.0
    assert np.isnan([*displacement, error]).all()


def test_the_searcher_is_told_the_mean_of_all_values_and_its_error():
    errors = []

    class Listener(Script):
        def tell(self, designs, values, info):
            super().tell(designs, values, info)
            errors.append(info["standard_error"].tolist())

    script = Listener([5, 6], [6, 7], [6])
    guarded = within(script, Policy(running_mean=True))
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
    guarded = within(Script([5, 6], [5]), Policy(running_mean=True))
    tell(guarded, guarded.ask(), [9.0, 3.0])
    assert guarded.recommend() == Design(5)
    tell(guarded, guarded.ask(), [-5.0])
    assert guarded.recommend() == Design(6)


# Parents


def test_parents_are_evaluated_anew_and_refreshed_before_the_offspring_are_told():
    script = ScriptWithParents([10, 11, 12], parents=[3, 4])
    guarded = within(script, Policy(reevaluate_parents=True))
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
    guarded = within(script, Policy(reevaluate_parents=True))
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
    guarded = within(ScriptWithParents([10, 11, 12]), Policy(reevaluate_parents=True))
    for value in (1.0, 3.0):
        tell(guarded, guarded.ask(1), [value])
    assert guarded.recommend() == Design(11)


@pytest.mark.parametrize("kept", [1, 2, 4])
def test_a_batch_cut_short_by_the_budget_is_told_as_far_as_it_goes(kept):
    script = ScriptWithParents([10, 11, 12], parents=[3, 4])
    guarded = within(script, Policy(reevaluate_parents=True))
    tell(guarded, guarded.ask()[:kept], np.arange(kept))
    expected = [("refresh", [3, 4][:kept], [0.0, 1.0][:kept])]
    if kept > 2:
        expected.append(("tell", [10, 11], [2.0, 3.0]))
    assert script.events[1:] == expected


def test_parents_are_refreshed_with_the_running_mean_where_that_is_on():
    script = ScriptWithParents([3], [10], parents=[3])
    guarded = within(script, Policy(running_mean=True, reevaluate_parents=True))
    tell(guarded, guarded.ask(), [1.0, 2.0])  # as parent and as offspring
    tell(guarded, guarded.ask(), [6.0, 0.0])
    assert [event for event in script.events if event[0] == "refresh"] == [
        ("refresh", [3, 3], [1.5, 1.5]),
        ("refresh", [3, 10], [3.0, 0.0]),
    ]


def test_of_a_searcher_that_names_no_parents_none_are_evaluated_anew():
    guarded = within(Script([10, 11]), Policy(reevaluate_parents=True))
    assert numbers(guarded.ask()) == [10, 11]


@pytest.mark.parametrize("name", ["ga", "mu_plus_lambda", "afpo", "nsga2", "map_elites"])
def test_the_parents_of_an_evolutionary_searcher_lose_their_lucky_values(name):
    guarded = within(make(name, np.random.default_rng(0)), Policy(reevaluate_parents=True))
    first = guarded.ask()
    tell(guarded, first, fitness_of(first) + 100.0)
    second = numbers(guarded.ask())
    parents = numbers(guarded._searcher.parents())
    assert 0 < len(parents) < len(second)
    assert second[: len(parents)] == parents
    answered(guarded)
    assert [guarded.belief(Design(i)) for i in parents] == FITNESS[parents].tolist()
    known = guarded._searcher.known(rows(*parents))
    np.testing.assert_array_equal(known, FITNESS[parents])


# Bad input


def test_designs_that_were_not_asked_for_are_refused():
    guarded = within(Script([1, 2], [3, 4]), NAIVE)
    with pytest.raises(ValueError, match="that ask returned, in that order"):
        tell(guarded, guarded.ask()[::-1], [1.0, 2.0])


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"running_mean": 1}, TypeError, "running_mean must be True or False, got 1"),
        ({"final_stage": "yes"}, TypeError, "final_stage must be True or False, got 'yes'"),
        ({"finalists": 0}, ValueError, "finalists must be at least 1 and at most .*, got 0"),
        ({"resamples": 2.0}, TypeError, "resamples must be a whole number, got 2.0"),
    ],
)
def test_a_policy_that_is_none_is_refused(options, error, message):
    with pytest.raises(error, match=message):
        Policy(**options)


def test_a_budget_that_is_none_is_refused():
    with pytest.raises(ValueError, match=r"evaluations must be at least 1 and at most .*, got 0"):
        within(make("ga", np.random.default_rng(0)), NAIVE, evaluations=0)


def test_a_policy_is_only_put_around_where_something_is_on_and_the_searcher_can_be_asked():
    script = Script([1])
    assert with_policy(script, NAIVE, SPACE, Budget(unique=9)) is script
    mean = Policy(running_mean=True)
    assert isinstance(with_policy(script, mean, SPACE, Budget(unique=9)), PolicySearcher)
    function = FunctionSearcher(lambda evaluate, space, rng: None, SPACE, script.rng)
    assert with_policy(function, NAIVE, SPACE, Budget(unique=9)) is function
    with pytest.raises(TypeError, match="needs a searcher with ask, not a function"):
        with_policy(function, mean, SPACE, Budget(unique=9))


@pytest.mark.parametrize("budget", [{"steps": 9}, {"cpu_seconds": 1.0}], ids=str)
def test_a_final_stage_needs_to_know_when_the_budget_ends(budget):
    with pytest.raises(ValueError, match="a budget that ends at a known evaluation; drop steps"):
        with_policy(Script(), Policy(final_stage=True), SPACE, Budget(unique=999, **budget))
