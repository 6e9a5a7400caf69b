"""A function that calls evaluate is a searcher, too."""

import time

import gymnasium as gym
import numpy as np
import pytest
from scipy.optimize import dual_annealing
from table_answers import FITNESS, SPACE, rows

from softvox_gym import TABLE_ENV_ID, Design, Lattice
from softvox_gym.wrappers.vector import FitnessNoise
from softvox_search import BudgetEnd, FunctionSearcher, SearcherError, check, make, run
from softvox_search.function import is_function
from softvox_search.oracle import Budget, Oracle


def table(n):
    return gym.make_vec(TABLE_ENV_ID, num_envs=n)


def climbs(evaluate, space, rng, *, size=4):
    """A loop of one's own: mutants of the best so far."""
    best = space.random(1, rng)
    value = evaluate(best)[0]
    while True:
        mutants = np.where(rng.random((size, space.sites)) < 0.3, space.random(size, rng), best)
        values = evaluate(mutants)
        if values.max() > value:
            best, value = mutants[[values.argmax()]], values.max()


def anneals(evaluate, space, rng):
    """SciPy's, as its users call it."""
    dual_annealing(lambda x: -evaluate(x.astype(int))[0], [(0, 2.999)] * space.sites, seed=rng)


def searched(function, budget, make_env=table, **options):
    oracle = Oracle(make_env, budget, rng=np.random.default_rng(1))
    searcher = FunctionSearcher(function, SPACE, np.random.default_rng(0), **options)
    return run(searcher, oracle), oracle.log.columns(), oracle


@pytest.mark.parametrize("function", [climbs, anneals])
def test_a_function_conforms(function):
    check(function, evaluations=60)


@pytest.mark.parametrize("function", [climbs, anneals])
@pytest.mark.parametrize("budget", [Budget(unique=50), Budget(evaluations=50)], ids=str)
def test_the_budget_ends_a_function_and_the_best_told_is_recommended(function, budget):
    design, log, oracle = searched(function, budget)
    assert oracle.ended_by == ("unique" if budget.unique else "evaluations")
    assert FITNESS[design.index] == log["fitness"].max()


def test_scipys_annealing_finds_a_better_design_than_most():
    design, *_ = searched(anneals, Budget(unique=400))
    assert (FITNESS[design.index] < FITNESS).sum() < 100


def test_options_reach_the_function():
    sizes = []

    def counts(evaluate, space, rng, *, size=1):
        while True:
            sizes.append(len(evaluate(space.random(size, rng))))

    searched(counts, Budget(evaluations=9), size=3)
    assert sizes == [3, 3, 3]


def test_every_form_of_a_design_and_of_a_batch_has_its_values():
    def asks(evaluate, space, rng):
        row = rows(6453)[0]
        for one in (6453, "00021222", Design(6453), row, row.tolist(), [6453], row[np.newaxis]):
            values = evaluate(one)
            assert values.shape == (1,)
            assert values[0] == FITNESS[6453]
        assert evaluate([6453, 5]).tolist() == FITNESS[[6453, 5]].tolist()
        assert evaluate([]).shape == (0,)
        return 5

    assert searched(asks, Budget(evaluations=99))[0] == Design(5)


def test_a_row_of_digits_is_one_design_on_a_lattice_of_phases_too():
    lattice = Lattice.of([2, 2, 2], phases=2)

    def asks(evaluate, space, rng):
        assert evaluate([0, 3, 0, 2, 1, 2, 2, 2]).shape == (1,)

    oracle = Oracle(
        lambda n: gym.make_vec(TABLE_ENV_ID, num_envs=n, phases=2), Budget(evaluations=9)
    )
    run(FunctionSearcher(asks, lattice, np.random.default_rng(0)), oracle)
    assert oracle.evaluations == 1


def test_what_a_function_does_before_its_first_evaluation_counts_as_processor_time():
    def prepares(evaluate, space, rng):
        began = time.process_time()
        while time.process_time() < began + 0.03:
            pass
        for number in range(3):
            evaluate([number])

    _, log, oracle = searched(prepares, Budget(cpu_seconds=0.02))
    assert (log["design"].tolist(), oracle.ended_by) == ([0], "cpu_seconds")


def test_the_end_of_the_budget_passes_through_except_exception_and_a_batch_is_cut():
    told = []

    def swallows(evaluate, space, rng):
        while True:
            try:
                told.append(len(evaluate(space.random(4, rng))))
            except Exception:
                told.append("swallowed")

    _, log, _ = searched(swallows, Budget(evaluations=10))
    assert told == [4, 4]
    assert len(log["design"]) == 10


def test_a_function_may_catch_the_end_and_recommend():
    def recommends(evaluate, space, rng):
        try:
            while True:
                evaluate([6453])
        except BudgetEnd:
            return Design(7)

    assert searched(recommends, Budget(evaluations=3))[0] == Design(7)


def test_under_noise_the_value_told_last_counts():
    def repeats(evaluate, space, rng):
        while True:
            evaluate([6453, 5])

    design, log, oracle = searched(
        repeats, Budget(unique=20), lambda n: FitnessNoise(table(n), sigma=9.0)
    )
    assert (oracle.unique, log["cached"].any()) == (20, False)
    assert design.index == log["design"][-2:][log["fitness"][-2:].argmax()]


@pytest.mark.parametrize(
    ("function", "message"),
    [
        (lambda evaluate, space, rng: evaluate([6561]), "returned invalid designs"),
        (lambda evaluate, space, rng: evaluate(np.ones(8)), "returned invalid designs"),
        (lambda evaluate, space, rng: evaluate([[0, 1], [2]]), "returned invalid designs"),
        (lambda evaluate, space, rng: None, "proposed no design at all"),
        (lambda evaluate, space, rng: evaluate([5])[0], "recommended an invalid design"),
    ],
)
def test_what_breaks_the_protocol_is_named(function, message):
    with pytest.raises(SearcherError, match=f"searcher <lambda> {message}"):
        searched(function, Budget(evaluations=9))


def test_a_function_that_draws_from_elsewhere_is_found_out():
    def careless(evaluate, space, rng):
        while True:
            evaluate(space.random(3, np.random.default_rng()))

    with pytest.raises(AssertionError, match="searcher careless made twice with the same"):
        check(careless, evaluations=30)


def test_a_function_is_told_from_a_class_and_from_what_makes_searchers():
    assert is_function(climbs)
    assert is_function(anneals)
    assert not is_function(FunctionSearcher)
    assert not is_function(lambda space, rng: None)
    assert not is_function(len)


def test_a_function_is_found_by_its_place(tmp_path, monkeypatch):
    (tmp_path / "my_functions.py").write_text(
        "def draws(evaluate, space, rng, *, size=2):\n"
        "    while True:\n"
        "        evaluate(space.random(size, rng))\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    searcher = make("my_functions:draws", np.random.default_rng(0), size=3)
    oracle = Oracle(table, Budget(evaluations=9))
    run(searcher, oracle, name="my_functions:draws")
    assert oracle.evaluations == 9
    with pytest.raises(ValueError, match="its options are: size"):
        make("my_functions:draws", np.random.default_rng(0), batch=3)
