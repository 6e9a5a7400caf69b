"""All searchers conform, and the check finds out those that don't."""

import random
from functools import partial

import numpy as np
import pytest

from softvox_gym import Design
from softvox_search.conformance import check
from softvox_search.policies import Policy, PolicySearcher
from softvox_search.protocol import SearcherBase, SearcherError
from softvox_search.registry import SEARCHERS, make

#: Evaluations of a run where 200 would take long.
FEW = {"tpe": 30, "nevergrad": 25, "cppn": 70}

ALL_SWITCHES = Policy(
    running_mean=True, reevaluate_parents=True, final_stage=True, finalists=4, resamples=3
)


@pytest.mark.parametrize("name", SEARCHERS)
def test_a_searcher_conforms(name):
    check(name, evaluations=FEW.get(name, 200))


@pytest.mark.parametrize("name", [name for name in SEARCHERS if name not in FEW])
def test_a_searcher_within_a_policy_conforms(name):
    def guarded(space, rng):
        return PolicySearcher(make(name, rng), ALL_SWITCHES, space, evaluations=120)

    check(guarded, evaluations=120)


@pytest.mark.parametrize("switch", ["running_mean", "reevaluate_parents", "final_stage"])
def test_a_policy_of_one_switch_conforms(switch):
    def guarded(space, rng):
        policy = Policy(**{switch: True}, finalists=4, resamples=3)
        return PolicySearcher(make("hill_climber", rng), policy, space, evaluations=120)

    check(guarded, evaluations=120)


def test_a_name_is_taken_as_well_and_nothing_else():
    check("random", evaluations=20)
    with pytest.raises(ValueError, match="there is no searcher 'rondom'"):
        check("rondom")
    with pytest.raises(TypeError, match="make must be the searcher's class, its name, a function"):
        check(3)


class Sound(SearcherBase):
    """Conforms; the others differ from it in one thing."""

    def ask(self, n=None):
        return self.rng.integers(6561, size=5 if n is None else n)


class Unseeded(Sound):
    def __init__(self, space, rng):
        super().__init__(space, np.random.default_rng())


class DrawsFromRandom(Sound):
    def ask(self, n=None):
        return [random.randrange(6561)]


class DrawsFromNumpy(Sound):
    def ask(self, n=None):
        return [int(np.random.randint(6561))]  # noqa: NPY002


class SeedsTheGlobalGenerator(Sound):
    def __init__(self, space, rng):
        super().__init__(space, rng)
        random.seed(3)

    def ask(self, n=None):
        return [random.randrange(6561)]


class Sharing(Sound):
    known = np.zeros(6561, dtype=bool)

    def __init__(self, space, rng):
        super().__init__(space, rng)
        if not self.known.all():  # so that runs one after the other agree
            self.known[:] = False

    def ask(self, n=None):
        asked = np.flatnonzero(~self.known)[: n or 5]
        self.known[asked] = True
        return asked


class EndsWhereAnotherBegan(Sound):
    made = 0

    def __init__(self, space, rng):
        super().__init__(space, rng)
        type(self).made += 1
        self.number = self.made

    def ask(self, n=None):
        return [] if self.number < self.made and len(self.values) > 9 else super().ask(n)


class AsksForMore(Sound):
    def ask(self, n=None):
        return super().ask(None)


class AsksForNothing(Sound):
    def ask(self, n=None):
        return []


class ChangesItsMindWhenAskedForAdvice(Sound):
    def recommend(self):
        self.rng.random()
        return super().recommend()


class NegatesWhatItIsTold(Sound):
    def tell(self, designs, values, info):
        super().tell(designs, values, info)
        values *= -1


class NegatesItLater(Sound):
    def ask(self, n=None):
        self.told = getattr(self, "told", np.zeros(1))
        self.told *= -1
        return super().ask(n)

    def tell(self, designs, values, info):
        super().tell(designs, values, info)
        self.told = values


class AdviceOffTheLattice(Sound):
    def recommend(self):
        return Design([1, 1, 1], shape=(3, 1, 1))


class Numb:
    def __init__(self, space, rng):
        self.rng = rng

    def ask(self, n=None):
        return [0]


class Returns(Sound):
    def __init__(self, space, rng, what):
        super().__init__(space, rng)
        self.what = what

    def ask(self, n=None):
        return self.what


def test_a_sound_searcher_conforms():
    check(Sound)


@pytest.mark.parametrize(
    ("kind", "message"),
    [
        (Unseeded, "made twice with the same generator, asks"),
        (DrawsFromRandom, "drew from a global random generator"),
        (DrawsFromNumpy, "drew from a global random generator"),
        (SeedsTheGlobalGenerator, "drew from a global random generator"),
        (Sharing, "is disturbed by another"),
        (EndsWhereAnotherBegan, "is disturbed by another"),
        (AsksForMore, "returned 5 designs when asked for at most 3"),
        (AsksForNothing, "asked for nothing at all"),
        (ChangesItsMindWhenAskedForAdvice, "was asked for its recommendation, and then"),
        (NegatesItLater, "changed the arrays that it was told"),
        (NegatesWhatItIsTold, "changed the arrays that it was told"),
    ],
)
def test_a_broken_searcher_is_found_out(kind, message):
    with pytest.raises(AssertionError, match=message) as caught:
        check(kind, evaluations=60)
    assert kind.__name__ in str(caught.value)


@pytest.mark.parametrize(
    "what",
    [[6561], [[0, 1, 2, 3, 0, 0, 0, 0]], [np.nan], np.full((2, 8), np.nan), "01", None, [True]],
    ids=str,
)
def test_illegal_designs_are_found_out(what):
    with pytest.raises(SearcherError, match="searcher Returns returned invalid designs"):
        check(partial(Returns, what=what))


def test_a_method_that_is_missing_is_found_out():
    with pytest.raises(TypeError, match="searcher Numb lacks tell, recommend; see"):
        check(Numb)


def test_advice_off_the_lattice_is_found_out():
    with pytest.raises(SearcherError, match="AdviceOffTheLattice recommended an invalid design"):
        check(AdviceOffTheLattice)


class NeedsWholeBatches(Sound):
    def ask(self, n=None):
        asked = super().ask(n)
        self.due = len(asked)
        return asked

    def tell(self, designs, values, info):
        super().tell(designs, values, info)
        if len(designs) != self.due:
            raise ValueError("a batch was cut short")


class NeedsADirection(Sound):
    def tell(self, designs, values, info):
        super().tell(designs, values, info)
        for dx, dy, _ in info["displacement"]:
            int(np.degrees(np.arctan2(dy, dx)) // 45)


@pytest.mark.parametrize(
    ("kind", "message"),
    [(NeedsWholeBatches, "a batch was cut short"), (NeedsADirection, "NaN to integer")],
)
def test_what_a_searcher_itself_raises_says_which_rule_was_tested(kind, message):
    with pytest.raises(ValueError, match=message) as caught:
        check(kind, evaluations=63)
    assert any("The rule under test: " in note for note in caught.value.__notes__)


def test_the_check_leaves_the_global_random_states_alone():
    before = random.getstate(), np.random.get_state()[1].tolist()  # noqa: NPY002
    check(Sound, evaluations=20)
    with pytest.raises(AssertionError):
        check(DrawsFromRandom, evaluations=20)
    assert (random.getstate(), np.random.get_state()[1].tolist()) == before  # noqa: NPY002


def test_a_run_of_one_evaluation_is_too_short_to_check():
    with pytest.raises(ValueError, match=r"evaluations must be at least 2 .*, got 1"):
        check(Sound, evaluations=1)
