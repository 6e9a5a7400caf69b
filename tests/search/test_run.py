"""A run drives a searcher to the end of its budget, and names it where it breaks the protocol."""

import gymnasium as gym
import numpy as np
import pytest
from table_answers import SPACE, info_of, numbers, rows

from softvox_gym import TABLE_ENV_ID, Design
from softvox_search.log import digest
from softvox_search.oracle import Budget, Oracle
from softvox_search.protocol import SearcherBase, SearcherError, best_of, keys_of, rows_of
from softvox_search.run import believed, recommended, run


def table(n):
    return gym.make_vec(TABLE_ENV_ID, num_envs=n)


class Drawing(SearcherBase):
    """Draws batches of seven and remembers how it was told."""

    def __init__(self, rng):
        super().__init__(SPACE, rng)
        self.told = []

    def ask(self, n=None):
        return self.rng.integers(6561, size=7)

    def tell(self, designs, values, info):
        super().tell(designs, values, info)
        self.told.append((designs, values))


class Scripted(SearcherBase):
    def __init__(self, *batches, advice=None):
        super().__init__(SPACE, np.random.default_rng(0))
        self.batches = list(batches)
        self.advice = advice

    def ask(self, n=None):
        return self.batches.pop(0)

    def recommend(self):
        return super().recommend() if self.advice is None else self.advice


def test_a_run_ends_with_the_budget_and_tells_what_was_evaluated_of_the_last_batch():
    searcher = Drawing(np.random.default_rng(0))
    oracle = Oracle(table, Budget(evaluations=25))
    design = run(searcher, oracle)
    assert [len(designs) for designs, _ in searcher.told] == [7, 7, 7, 4]
    log = oracle.log.columns()
    assert log["design"].tolist() == numbers(np.concatenate([one for one, _ in searcher.told]))
    np.testing.assert_array_equal(
        log["fitness"], np.concatenate([values for _, values in searcher.told])
    )
    assert design.index == log["design"][log["fitness"].argmax()]


def test_the_same_generator_gives_the_same_log_and_another_another():
    digests = []
    for seed in (0, 0, 1):
        oracle = Oracle(table, Budget(evaluations=25))
        run(Drawing(np.random.default_rng(seed)), oracle)
        digests.append(digest(oracle.log.columns()))
    assert digests[0] == digests[1] != digests[2]


@pytest.mark.parametrize("nothing", [[], np.zeros((0, 8), dtype=int)], ids=["list", "rows"])
def test_a_run_ends_where_nothing_more_is_asked(nothing):
    oracle = Oracle(table, Budget(evaluations=99))
    assert run(Scripted([3, 6453], nothing, [5]), oracle) == Design(6453)
    assert oracle.evaluations == 2


@pytest.mark.parametrize(
    ("illegal", "message"),
    [
        ([6561], "returned invalid designs: design index 6561 is outside"),
        (np.full((1, 8), np.nan), "returned invalid designs"),
        (
            np.ones((1, 3, 2, 2), dtype=int),
            "returned invalid designs: designs must be an array",
        ),
    ],
)
def test_illegal_designs_end_a_run_with_an_error_that_names_the_searcher(illegal, message):
    with pytest.raises(SearcherError, match=f"searcher Scripted {message}"):
        run(Scripted([1], illegal), Oracle(table, Budget(evaluations=9)))
    with pytest.raises(SearcherError, match=f"searcher mine {message}"):
        run(Scripted([1], illegal), Oracle(table, Budget(evaluations=9)), name="mine")


@pytest.mark.parametrize(
    ("advice", "message"),
    [
        (6561, "recommended an invalid design"),
        (np.nan, "recommended an invalid design"),
        (
            Design([1], shape=(1, 1, 1)),
            "recommended an invalid design of 2x2x2: design has",
        ),
    ],
)
def test_an_illegal_recommendation_is_an_error_that_names_the_searcher(advice, message):
    with pytest.raises(SearcherError, match=f"searcher Scripted {message}"):
        run(Scripted([1, 2], advice=advice), Oracle(table, Budget(evaluations=2)))


@pytest.mark.parametrize("form", [6453, "00021222", np.array([0, 0, 0, 2, 1, 2, 2, 2])], ids=str)
def test_a_recommendation_may_have_every_form_of_a_design(form):
    assert recommended(form, SPACE) == Design(6453)


def test_the_value_told_last_counts_for_the_recommendation():
    searcher = Scripted()
    designs = rows(10, 20)
    searcher.tell(designs, np.array([5.0, 1.0]), info_of(designs))
    assert searcher.recommend() == Design(10)
    searcher.tell(designs, np.array([0.5, 1.0]), info_of(designs))
    assert searcher.recommend() == Design(20)
    assert searcher.best.tolist() == rows(20)[0].tolist()
    assert searcher.known(rows(10, 30)).tolist()[0] == 0.5
    assert np.isnan(searcher.known(rows(10, 30))[1])


def test_nothing_can_be_recommended_before_anything_is_known():
    assert Scripted().best is None
    with pytest.raises(ValueError, match="nothing to recommend"):
        Scripted().recommend()


def test_of_equally_good_designs_the_first_by_number_is_recommended():
    keys = keys_of(rows(700, 6, 3000, 9))
    assert best_of(dict(zip(keys, [2.0, 2.0, 2.0, 1.0], strict=True))) == keys[1]
    np.testing.assert_array_equal(rows_of(keys, SPACE), rows(700, 6, 3000, 9))


def test_a_searcher_without_a_policy_believes_what_it_was_told_last():
    oracle = Oracle(table, Budget(evaluations=3))
    searcher = Scripted([3, 6453, 3])
    design = run(searcher, oracle)
    log = oracle.log.columns()
    assert believed(searcher, design, log) == log["fitness"][1]
    assert believed(searcher, Design(5), log) is None
