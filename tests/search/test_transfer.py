"""Transfer methods are held to a protocol, and told exactly what they lose."""

import random
import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kendalltau

from softvox_gym import Design, Physics, Reality, Task, landscape, reality
from softvox_gym.landscapes.gap import class_best
from softvox_search import BudgetEnd, SearcherError
from softvox_search.transfer import (
    Method,
    SimulationBudgetError,
    Simulator,
    Test,
    TransferMethod,
    check,
    make,
    transfer,
)
from softvox_search.transfer.guard import Guarded
from softvox_search.transfer.library import CLASSES
from softvox_search.transfer.run import World, heading_error, is_specified, regrets

PUBLISHED = Physics.published()
TASK = Task("directed", 90.0)
SHOWN = np.zeros(3)


def moved(table):
    return np.nan_to_num(np.stack([table[axis] for axis in ("dx", "dy", "dz")], axis=-1))


def real(name="reversal", task=TASK):
    return task.reward(moved(reality(name).landscape()))


class Sound(Method):
    """Conforms; the others differ from it in one thing."""

    def ask(self):
        return int(self.rng.choice(np.flatnonzero(self.untested())))


def by_hand(method=Sound, **options):
    return make(method, Simulator(PUBLISHED), TASK, np.random.default_rng(0), **options)


def test_a_method_may_be_driven_by_hand():
    method = by_hand("simulator_top")
    assert isinstance(method, TransferMethod)
    rewards = {}
    for _ in range(5):
        design = method.ask()
        rewards[design] = float(real()[design])
        method.tell(Test(design, rewards[design], SHOWN))
        assert method.recommend() == max(rewards, key=rewards.get)
    said = TASK.reward(moved(landscape()))
    assert list(rewards) == np.argsort(-said, kind="stable")[:5].tolist()
    assert len(method.tests) == 5
    assert method.predict().shape == (6561, 3)


@pytest.mark.parametrize(
    ("before", "call", "message"),
    [
        (["ask"], "ask", "was asked twice in a row; tell it first what the test of design"),
        ([], "recommend", "was asked for its recommendation before any test; ask it, test, and"),
        (["ask"], "recommend", "was asked for its recommendation before any test"),
        ([], "tell", "was told of design 5, for which it had not asked; ask it first"),
        (["ask"], "tell", "was told of design 5 where it had asked for [0-9]+; tell it what"),
    ],
)
def test_calls_out_of_order_are_refused_in_a_line_that_names_the_remedy(before, call, message):
    method = by_hand()
    for name in before:
        getattr(method, name)()
    told = [Test(5, 0.0, SHOWN)] if call == "tell" else []
    with pytest.raises(SearcherError, match=f"^method Sound {message}") as caught:
        getattr(method, call)(*told)
    assert "\n" not in str(caught.value)


def test_a_refused_call_can_be_mended():
    method = by_hand()
    design = method.ask()
    with pytest.raises(SearcherError, match="twice"):
        method.ask()
    method.tell(Test(design, 1.0, SHOWN))
    assert method.recommend() == design
    assert method.ask() != design


def test_a_function_cant_be_driven_by_hand():
    with pytest.raises(SearcherError, match="method tries_some is a function, which can't be"):
        by_hand(tries_some).ask()


@pytest.mark.parametrize("task", [TASK, Task()], ids=str)
def test_a_run_tells_what_the_tables_say(task):
    run = transfer("simulator_top", reality="soft", task=task, tests=12)
    said, truth = moved(landscape()), moved(reality("soft").landscape())
    expected, rewards = task.reward(said), task.reward(truth)
    # Mirror images are alike but for the last bit.
    order = np.argsort(-np.round(expected, 9), kind="stable")[:12]
    assert run.tested.tolist() == order.tolist()
    assert run.rewards.tolist() == rewards[order].tolist()
    best = [order[: k + 1][rewards[order[: k + 1]].argmax()] for k in range(12)]
    assert run.recommended.tolist() == best
    assert run.regret.tolist() == (1 - rewards[best] / rewards.max()).tolist()
    in_class = class_best(rewards)[best]
    assert run.class_regret.tolist() == (1 - in_class / rewards.max()).tolist()
    tau = kendalltau(expected, rewards).statistic
    assert run.kendall_before == run.kendall_after == pytest.approx(tau, abs=1e-12)
    top = np.argsort(-expected, kind="stable")[:100]
    srcc = np.corrcoef(expected[top], rewards[top])[0, 1]
    assert run.srcc_before == run.srcc_after == pytest.approx(srcc, abs=1e-12)
    left = np.setdiff1d(np.arange(6561), order)
    turn = np.degrees(np.angle((said[left] @ [1, 1j, 0]) * np.conj(truth[left] @ [1, 1j, 0])))
    far = [np.hypot(*world[left, :2].T) > 0.25 for world in (said, truth)]
    error = np.abs(turn[far[0] & far[1]]).mean()
    assert run.heading_error_before == run.heading_error == pytest.approx(error, abs=1e-6)
    distance = np.sqrt(((said - truth) ** 2).mean() / (truth**2).mean())
    assert run.distance == pytest.approx(distance, abs=1e-12)
    assert (run.method, run.reality, run.task) == ("simulator_top", "soft", task)
    assert run.simulations == 6561


def test_regret_is_a_share_of_the_best_and_above_one_the_wrong_way():
    rewards = np.zeros(6561)
    a, b = Design("20000000").index, Design("02000000").index  # turned by a quarter
    rewards[[a, b, 5]] = -1.0, 3.0, 4.0
    regret, class_regret = regrets(rewards, np.array([a, b, 5, 7]))
    assert regret.tolist() == [1.25, 0.25, 0.0, 1.0]
    assert class_regret[:3].tolist() == [0.25, 0.25, 0.0]
    nothing = regrets(-np.ones(6561), np.array([3]))
    assert [one.tolist() for one in nothing] == [[0.0], [0.0]]


def test_a_heading_is_only_compared_where_both_travel():
    ours = np.array([[1.0, 0, 0], [0, 1, 0], [0.1, 0, 0], [1, 1, 5]])
    theirs = np.array([[-1.0, 0, 0], [0, 2, 9], [0, 3, 0], [0, 0.2, 0]])
    assert heading_error(ours, theirs) == 90.0  # 180 and 0 degrees; the others stay
    assert np.isnan(heading_error(ours[2:], theirs[2:]))


def test_the_oracle_loses_nothing():
    for task in (TASK, Task()):
        run = transfer("oracle", task=task, tests=3)
        assert run.regret.tolist() == run.class_regret.tolist() == [0, 0, 0]
        assert run.kendall_after == pytest.approx(1)


@pytest.mark.parametrize("method", ["random", "gp_ucb", "transferability"])
def test_a_seed_repeats_to_the_bit_and_another_does_not(method):
    first, again, other = (
        transfer(method, tests=8, seed=seed, measurement_noise=0.1) for seed in (3, 3, 4)
    )
    for name in ("tested", "rewards", "recommended", "regret"):
        assert getattr(first, name).tobytes() == getattr(again, name).tobytes()
    assert first.rewards.tobytes() != other.rewards.tobytes()


def test_noise_is_of_the_measurement_not_of_the_truth():
    run = transfer("random", task=TASK, tests=600, measurement_noise=0.2)
    off = run.rewards - real()[run.tested]
    assert off.std() == pytest.approx(0.2, rel=0.1)
    assert abs(off.mean()) < 0.03
    assert (run.regret == 1 - real()[run.recommended] / real().max()).all()


def test_noise_hides_the_track_as_well():
    class Tracked(Sound):
        wants_track = True

    def tracks(noise):
        told = []

        class Keeps(Tracked):
            def tell(self, test):
                super().tell(test)
                told.append(test)

        transfer(Keeps, reality="soft", tests=2, measurement_noise=noise)
        return told

    for exact, noisy in zip(tracks(0.0), tracks(0.1), strict=True):
        truth = reality("soft").simulate(exact.design, track=4).track[0]
        assert exact.track.tolist() == truth.tolist()
        assert exact.track[-1].tolist() == exact.displacement.tolist()
        assert noisy.track[-1].tolist() == noisy.displacement.tolist()
        off = noisy.track - truth
        assert (off[0] == 0).all()
        assert off[1:, :2].std() == pytest.approx(0.1, rel=0.3)
        assert (off[:, 2] == 0).all()


def test_under_noise_a_design_may_be_tested_again_and_else_not():
    class Same(Method):
        def ask(self):
            return 6453

    run = transfer(Same, tests=4, measurement_noise=0.1)
    assert run.tested.tolist() == [6453] * 4
    assert len(set(run.rewards.tolist())) == 4
    with pytest.raises(SearcherError, match="method Same asked for design 6453 a second time"):
        transfer(Same, tests=4)


def test_simulations_are_counted_and_end_with_the_budget():
    simulator = Simulator(PUBLISHED, simulations=6561 + 3)
    simulator.landscape()
    simulator.landscape()
    assert simulator.displacement([6453, 5]).shape == (2, 3)
    assert simulator.used == 6563
    with pytest.raises(SimulationBudgetError, match=r"asked for 2 designs, with 1 of 6564 .* left"):
        simulator.displacement([6453, 5])
    with pytest.raises(SimulationBudgetError):
        transfer("simulator_top", simulations=6560)
    assert transfer("simulator_top", simulations=6561, tests=1).simulations == 6561


@pytest.mark.parametrize("method", ["random", "gp_ucb", "jakobi"])
def test_what_needs_no_simulator_runs_without(method):
    run = transfer(method, simulations=0, tests=3)
    assert run.simulations == 0


def test_what_the_simulator_says_is_read_only():
    table = Simulator(PUBLISHED).landscape()
    with pytest.raises(ValueError, match="read-only"):
        table[0] = 1


def test_what_diverges_is_worth_nothing():
    class Tests(Method):
        def ask(self):
            return 6453

    table = np.ones((6561, 3))
    where = Reality("made up")
    world = World(where, TASK, 0.0, np.random.default_rng(0), displacement=table)
    assert world.test(7).reward == 1
    assert Simulator(PUBLISHED).displacement(0).tolist() == [[0, 0, 0]]


def test_a_method_may_end_early_and_stays_with_what_it_said():
    class Short(Sound):
        def ask(self):
            return None if len(self.tests) == 3 else super().ask()

    run = transfer(Short, tests=9)
    assert len(run.tested) == len(run.rewards) == 3
    assert len(run.recommended) == len(run.regret) == 9
    assert set(run.recommended[2:].tolist()) == {run.recommended[2]}
    with pytest.raises(SearcherError, match="method ends_at_once tested no design at all"):
        transfer(ends_at_once)


def test_ite_stops_where_it_is_told_to():
    run = transfer("ite", reality="clamp", tests=20, stop=0.9)
    assert len(run.tested) == 1
    assert run.regret.tolist() == [0.0] * 20


def ends_at_once(test, simulator, task, rng):
    pass


def tries_some(test, simulator, task, rng, *, size=4):
    for design in rng.permutation(6561)[:size]:
        test(design)


def test_a_function_tests_until_there_are_no_more_tests():
    run = transfer(tries_some, tests=3)
    assert len(run.tested) == 3
    assert run.recommended[-1] == run.tested[run.rewards.argmax()]
    assert len(transfer(tries_some, tests=9).tested) == 4
    assert len(transfer(tries_some, tests=9, size=2).tested) == 2
    check(tries_some)


def test_a_function_may_recommend_something_else_in_the_end():
    def recommends(test, simulator, task, rng):
        assert test("00021222").design == 6453
        try:
            test(Design(5))
            test([2, 1, 0, 0, 0, 0, 0, 0])
        except BudgetEnd:
            pass
        return Design(7)

    run = transfer(recommends, tests=2)
    assert run.tested.tolist() == [6453, 5]
    assert run.recommended[-1] == 7
    check(recommends, tests=2)


@pytest.mark.parametrize(
    ("name", "varied", "expected"),
    [
        ("slippery", {"friction_static", "friction_kinetic"}, True),
        ("slippery", {"friction_static"}, False),
        # 90 cycles, where every model has 23.
        ("area_friction", {"friction_static", "friction_kinetic", "shear_strength"}, False),
        ("area_friction", CLASSES["all"], False),
        ("reversal", CLASSES["all"], True),
        ("reversal", {"friction_static", "friction_kinetic", "shear_strength"}, False),
        (
            "reversal",
            {"friction_static", "friction_kinetic", "shear_strength", "strain", "frequency_hz"},
            True,
        ),
        ("fabrication", {"strain"}, False),
        ("lag", set(), False),
    ],
)
def test_a_run_is_specified_where_the_models_vary_all_that_differs(name, varied, expected):
    assert is_specified(reality(name), frozenset(varied)) is expected

    class Varies(Sound):
        pass

    Varies.varied = frozenset(varied)
    assert transfer(Varies, reality=name, tests=1).is_specified is expected


def test_the_distance_is_that_of_the_nearest_model():
    truth = moved(reality("soft").landscape())

    class Holds(Sound):
        def models(self):
            return np.stack([truth + 5, truth * 0.5, truth * 4])

    assert transfer(Holds, reality="soft", tests=1).distance == pytest.approx(0.5)
    assert np.isnan(transfer("random", reality="soft", tests=1).distance)


def test_a_method_may_say_nothing_of_what_it_expects():
    class Silent:
        def __init__(self, simulator, task, rng):
            self.rng = rng

        def ask(self):
            return self.rng.integers(6561)

        def tell(self, test):
            self.best = test.design

        def recommend(self):
            return self.best

    run = transfer(Silent, tests=2)
    assert np.isnan([run.srcc_after, run.kendall_after, run.heading_error, run.distance]).all()
    assert not run.is_specified


@pytest.mark.parametrize(
    "said", [np.zeros(5), "much", np.zeros((6561, 2)), np.full(6561, None)], ids=np.shape
)
def test_expectations_of_another_shape_are_named(said):
    class Odd(Sound):
        def predict(self):
            return said

    with pytest.raises(SearcherError, match=r"method Odd returned .* from predict; it must be"):
        transfer(Odd, tests=1)
    with pytest.raises(SearcherError, match=r"method Odd returned .* from predict; it must be"):
        check(Odd, tests=2)


@pytest.mark.parametrize("name", ["predict", "models"])
def test_expectations_that_are_no_numbers_are_named(name):
    """A rank among them, or which model is nearest, would depend on their order."""

    class Odd(Sound):
        pass

    said = np.zeros((2, 6561, 3))
    said[1, 17, 2] = np.nan
    setattr(Odd, name, lambda self: said if name == "models" else said[1])
    with pytest.raises(SearcherError, match=f"Odd returned numbers from {name} that are not fini"):
        transfer(Odd, tests=1)


def test_what_models_vary_may_be_any_collection():
    class Lists(Sound):
        varied = ["friction_static"]  # noqa: RUF012, as somebody may write it

    assert not transfer(Lists, reality="lag", tests=1).is_specified


@pytest.mark.parametrize(
    ("options", "error", "message"),
    [
        ({"method": "itee"}, ValueError, "did you mean 'ite'"),
        ({"method": "ite", "kernal": 1}, ValueError, "has no option 'kernal'; its options are: k"),
        ({"reality": "revrsal"}, ValueError, "no reality 'revrsal'; did you mean reversal"),
        ({"reality": PUBLISHED}, TypeError, "reality must be a name or a softvox_gym.Reality"),
        ({"task": "direct"}, ValueError, "did you mean directed"),
        ({"heading": np.nan}, ValueError, "heading must be finite"),
        ({"task": "displacement", "heading": 3}, ValueError, "has no heading"),
        ({"task": TASK, "heading": 3}, ValueError, "the Task given has its own"),
        ({"tests": 0}, ValueError, "tests must be at least 1"),
        ({"tests": 6562}, ValueError, "tests must be at most 6561, the designs there are"),
        ({"tests": 2.0}, TypeError, "tests must be a whole number"),
        ({"seed": -1}, ValueError, "seed must be at least 0"),
        ({"simulations": -1}, ValueError, "simulations must be at least 0"),
        ({"measurement_noise": -1}, ValueError, "measurement_noise must be finite"),
        ({"method": 3}, TypeError, "method must be a name"),
        ({"method": object}, TypeError, "method object lacks ask, tell, recommend; see"),
    ],
)
def test_arguments_that_cant_be_say_why(options, error, message):
    with pytest.raises(error, match=message):
        transfer(**{"method": "random", **options})


def test_a_method_is_found_by_its_place(tmp_path, monkeypatch):
    (tmp_path / "my_methods.py").write_text(
        "def some(test, simulator, task, rng, *, first=3):\n"
        "    for design in range(first, 6561):\n"
        "        test(design)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    run = transfer("my_methods:some", tests=2, first=7)
    assert (run.method, run.tested.tolist()) == ("my_methods:some", [7, 8])
    with pytest.raises(ValueError, match="its options are: first"):
        transfer("my_methods:some", frist=7)


# What the check finds out.


class DrawsFromRandom(Sound):
    def ask(self):
        return random.randrange(6561)


class DrawsFromNumpy(Sound):
    def ask(self):
        return int(np.random.randint(6561))  # noqa: NPY002


class Unseeded(Sound):
    def __init__(self, simulator, task, rng):
        super().__init__(simulator, task, np.random.default_rng())


class Sharing(Sound):
    calls = 0

    def ask(self):
        Sharing.calls += 1
        return Sharing.calls


class ChangesItsMindWhenAskedForAdvice(Sound):
    def recommend(self):
        self.rng.random()
        return super().recommend()


def truth_upstairs():
    """Walk the frames up to what knows the truth."""
    frame = sys._getframe()
    while frame:
        for value in frame.f_locals.values():
            if isinstance(value, World):
                return value.rewards
        frame = frame.f_back
    raise LookupError


class Peeks(Sound):
    def ask(self):
        return int(np.where(self.untested(), truth_upstairs(), -np.inf).argmax())


class PeeksForAdvice(Sound):
    def recommend(self):
        return int(truth_upstairs().argmax())


class PeeksWithinTheTest(Sound):
    """Keeps what the guard hands on, and finds the truth in what called it."""

    def tell(self, test):
        super().tell(test)
        self.known = truth_upstairs()

    def ask(self):
        if not self.tests:
            return 17
        return int(np.where(self.untested(), self.known, -np.inf).argmax())


class PeeksForItsPrediction(Sound):
    def tell(self, test):
        super().tell(test)
        self.known = truth_upstairs()

    def predict(self):
        return self.known


class DrawsItsPrediction(Sound):
    def predict(self):
        return np.random.rand(6561)  # noqa: NPY002


class DrawsModels(Sound):
    def models(self):
        return np.random.default_rng().normal(size=(1, 6561, 3))


def peeking(test, simulator, task, rng):
    for design in np.argsort(-truth_upstairs()):
        test(design)


class ChangesWhatItIsTold(Sound):
    def tell(self, test):
        super().tell(test)
        test.displacement[:] *= -1


def changes_what_it_is_told(test, simulator, task, rng):
    while True:
        test(int(rng.integers(6561))).displacement[:] = 0


@pytest.mark.parametrize(
    ("method", "message"),
    [
        (DrawsFromRandom, "drew from a global random generator"),
        (DrawsFromNumpy, "drew from a global random generator"),
        (Unseeded, "made twice with the same generator acts in two ways"),
        (Sharing, "made twice with the same generator acts in two ways"),
        (ChangesItsMindWhenAskedForAdvice, "was asked for its recommendation, and then"),
        (Peeks, "acts on what it has not tested"),
        (PeeksForAdvice, "acts on what it has not tested"),
        (PeeksWithinTheTest, "acts on what it has not tested"),
        (PeeksForItsPrediction, "acts on what it has not tested"),
        (DrawsItsPrediction, "drew from a global random generator"),
        (DrawsModels, "made twice with the same generator acts in two ways"),
        (peeking, "acts on what it has not tested"),
        (ChangesWhatItIsTold, "changed the test that it was told"),
        (changes_what_it_is_told, "changed the test that it was told"),
    ],
)
def test_a_broken_method_is_found_out(method, message):
    with pytest.raises(AssertionError, match=f"^method {method.__name__} {message}"):
        check(method)


class Recommends(Sound):
    def __init__(self, simulator, task, rng, *, what):
        super().__init__(simulator, task, rng)
        self.what = what

    def recommend(self):
        return self.what


class Asks(Recommends):
    def ask(self):
        return self.what

    recommend = Method.recommend


@pytest.mark.parametrize("what", [6561, -1, "0123", None, [1, 2], 3.5, True], ids=str)
def test_nonsense_is_found_out(what):
    with pytest.raises(SearcherError, match="method Recommends recommended an invalid design of"):
        check(Recommends, what=what)
    said = "asked for an invalid design" if what is not None else "tested no design at all"
    with pytest.raises(SearcherError, match=f"method Asks {said}"):
        check(Asks, what=what)


def test_a_function_that_tests_or_recommends_nonsense_is_found_out():
    def tries_nonsense(test, simulator, task, rng):
        test(6561)

    def recommends_nonsense(test, simulator, task, rng):
        test(5)
        return "none"

    with pytest.raises(SearcherError, match="method tries_nonsense tested an invalid design"):
        check(tries_nonsense)
    with pytest.raises(SearcherError, match="method recommends_nonsense recommended an invalid"):
        check(recommends_nonsense)


def test_a_design_asked_for_twice_is_found_out():
    with pytest.raises(SearcherError, match="method Asks asked for design 5 a second time"):
        check(Asks, what=5)


def test_a_method_that_lacks_a_method_is_found_out():
    class Numb:
        def __init__(self, simulator, task, rng):
            pass

        def ask(self):
            return 0

    with pytest.raises(TypeError, match="method Numb lacks tell, recommend; see"):
        check(Numb)


def test_a_method_of_ones_own_with_a_run_of_its_own_is_asked():
    class Runs(Sound):
        def run(self):
            raise AssertionError

    check(Runs)


def test_the_check_leaves_the_global_random_states_alone():
    before = random.getstate(), np.random.get_state()[1].tolist()  # noqa: NPY002
    check(Sound, tests=3)
    with pytest.raises(AssertionError):
        check(DrawsFromRandom, tests=3)
    assert (random.getstate(), np.random.get_state()[1].tolist()) == before  # noqa: NPY002
    with pytest.raises(ValueError, match="tests must be at least 2"):
        check(Sound, tests=1)


def test_a_guard_is_transparent():
    method = by_hand("ite")
    assert isinstance(method, Guarded)
    assert method.process.mean.shape == (6561,)
    with pytest.raises(AttributeError):
        _ = method.nothing


def test_a_reality_of_ones_own_is_taken():
    brief = replace(reality("soft"), name="mine")
    run = transfer("simulator_top", reality=brief, tests=1)
    assert run.reality == "mine"
    assert run.regret[0] == transfer("simulator_top", reality="soft", tests=1).regret[0]
