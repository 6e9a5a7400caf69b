"""One run: a method in a reality, and the value of its recommendations there."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import MeasuredReality, Reality, Task, landscape
from softvox_gym.landscapes.gap import class_best, srcc
from softvox_gym.landscapes.robustness import kendall_tau
from softvox_gym.landscapes.table import N_DESIGNS, displacements
from softvox_gym.noise import not_negative
from softvox_gym.real_tracks import LITTLE
from softvox_gym.realities import reality as reality_named
from softvox_gym.simulation import check_count
from softvox_search.protocol import SearcherError
from softvox_search.transfer.guard import Guarded
from softvox_search.transfer.methods.simple import Oracle
from softvox_search.transfer.protocol import SAMPLES, Test
from softvox_search.transfer.registry import make
from softvox_search.transfer.simulator import SimulationBudgetError, Simulator

Array = NDArray[np.float64]

#: Default number of tests in reality.
TESTS = 20


@dataclass(frozen=True, kw_only=True, eq=False)
class TransferRun:
    """The record of a method in a reality: its tests, and its recommendation after each.

    Parameters
    ----------
    method, reality : str
        Their names.
    task : softvox_gym.Task
    seed : int
    tested : ndarray of int64, shape (tests,)
        Numbers of the tested designs; fewer if the method ended early.
    rewards : ndarray, shape (tests,)
        Rewards in the tests, voxel widths.
    recommended : ndarray of int64, shape (tests,)
        Recommendation after each test. A method that ended early keeps its last one.
    regret : ndarray, shape (tests,)
        Regret after each test: the loss from building the recommended design, as a share of the
        best reward; above 1 if it goes the wrong way. In a `MeasuredReality` the best is the best
        measured; NaN if nobody measured the recommended design, or nothing measured goes that way.
    class_regret : ndarray, shape (tests,)
        The same if a robot may be turned or mirrored before its run; in a `MeasuredReality` NaN if
        nothing in a robot's class was measured.
    srcc_before, srcc_after : float
        Pearson's correlation of the expected and the real reward over the hundred designs with the
        best expected reward (Kadian et al. 2020), for the nominal simulator and for the method at
        the end; NaN if it expects nothing.
    kendall_before, kendall_after : float
        Kendall's correlation over all designs, likewise. In a `MeasuredReality` these are over the
        designs that were measured and not tested, and NaN if there are fewer than two.
    heading_error_before, heading_error : float
        Mean angle between the expected and the real heading, degrees, over the designs that were
        not tested and travel more than 0.25 voxel widths in both worlds; likewise.
    distance : float
        Distance from the truth to the nearest model of the method: root mean square of the
        difference in displacement, over that of the displacement itself, over all designs, or all
        measured ones; NaN if it has no models.
    is_specified : bool
        Whether its models vary everything in which the reality differs from the nominal simulator;
        False if that is unknown, as in a `MeasuredReality`.
    simulations : int
        Number of designs that the method simulated.
    """

    method: str
    reality: str
    task: Task
    seed: int
    tested: NDArray[np.int64]
    rewards: Array
    recommended: NDArray[np.int64]
    regret: Array
    class_regret: Array
    srcc_before: float
    srcc_after: float
    kendall_before: float
    kendall_after: float
    heading_error_before: float
    heading_error: float
    distance: float
    is_specified: bool
    simulations: int


def transfer(
    method: str | Callable[..., Any],
    *,
    reality: str | Reality = "reversal",
    task: str | Task = "directed",
    heading: float | None = None,
    tests: int | None = None,
    seed: int = 0,
    measurement_noise: float = 0.0,
    simulations: int | None = None,
    **options: Any,
) -> TransferRun:
    """Let a method find a design for a reality that it knows only through tests.

    Parameters
    ----------
    method : str, class or function
        One of `METHODS`, "package.module:name" for your own, its class, or a function ``f(test,
        simulator, task, rng)``; see `TransferMethod` and `FunctionMethod`.
    reality : str or softvox_gym.Reality
        A name for `softvox_gym.reality`, or measurements from `Reality.from_trials`, in which
        designs that nobody measured can't be tested; `Simulator.testable` says which can. The
        method does not learn which reality it is.
    task : str or softvox_gym.Task
    heading : float, optional
        Heading of the directed task, degrees; 0 by default. Report the mean over the four headings
        in `softvox_gym.tasks.HEADINGS`.
    tests : int, optional
        Number of tests, at most the number of designs, or of measured ones; by default 20, or all
        measured designs if these are fewer.
    seed : int
        Seed of all random numbers.
    measurement_noise : float
        Standard deviation of measured dx and dy, and of the points of a track, voxel widths.
    simulations : int, optional
        The most designs that may be simulated; unlimited by default.
    **options
        Options of the method.

    Returns
    -------
    TransferRun

    Raises
    ------
    TypeError, ValueError
        If an argument is none of these; the message names it.
    softvox_search.SearcherError
        If the method breaks the protocol or asks for an unmeasured design; the message names it.
    SimulationBudgetError
        If it simulates more than it may.

    Examples
    --------
    >>> run = transfer("simulator_top", reality="reversal", heading=90, tests=5)
    >>> run.regret.shape
    (5,)
    """
    return prepared(
        method,
        options,
        reality=reality,
        task=task,
        heading=heading,
        tests=tests,
        seed=seed,
        measurement_noise=measurement_noise,
        simulations=simulations,
    )()


def prepared(
    method: str | Callable[..., Any],
    options: Mapping[str, Any],
    *,
    reality: str | Reality = "reversal",
    task: str | Task = "directed",
    heading: float | None = None,
    tests: int | None = None,
    seed: int = 0,
    measurement_noise: float = 0.0,
    simulations: int | None = None,
) -> Callable[[], TransferRun]:
    """Check the arguments of `transfer` and make the method; return a function that runs it.

    Errors in the arguments are raised here, errors of the method in that function.
    """
    check_count("seed", seed, least=0, most=2**64 - 1)
    sigma = not_negative("measurement_noise", measurement_noise)
    where = reality_named(reality) if isinstance(reality, str) else reality
    if not isinstance(where, Reality):
        raise TypeError(f"reality must be a name or a softvox_gym.Reality, got {reality!r}")
    number = number_of_tests(where, tests)
    what = Task.of(task, heading)
    of_method, of_noise = np.random.SeedSequence(seed).spawn(2)
    testable = where.testable if isinstance(where, MeasuredReality) else None
    simulator = Simulator(where.nominal, simulations, testable=testable)
    made = make(method, simulator, what, np.random.default_rng(of_method), **options)
    world = World(where, what, sigma, np.random.default_rng(of_noise))
    return partial(_run, made, simulator, world, number, seed)


def number_of_tests(reality: Reality, tests: int | None, *, name: str = "tests") -> int:
    """Return the number of tests; raises as `transfer` does."""
    most, which = N_DESIGNS, "the designs there are"
    if isinstance(reality, MeasuredReality):
        most, which = len(reality.designs), "the designs that were measured"
    if tests is None:
        return min(TESTS, most)
    check_count(name, tests, least=1)
    if tests > most:
        raise ValueError(f"{name} must be at most {most}, {which}, got {tests}")
    return tests


class World:
    """A reality for tests; the method sees only what `test` returns.

    Parameters
    ----------
    reality : Reality
    task : Task
    sigma : float
        Standard deviation of the measurement noise, voxel widths.
    rng : numpy.random.Generator
        Generator of that noise.
    displacement : ndarray, shape (6561, 3), optional
        Displacement of every design, instead of the reality's.
    """

    def __init__(
        self,
        reality: Reality,
        task: Task,
        sigma: float,
        rng: np.random.Generator,
        *,
        displacement: Array | None = None,
    ) -> None:
        self.reality, self.task = reality, task
        self.displacement = truth(reality) if displacement is None else displacement
        self.rewards: Array = task.reward(self.displacement)
        self._sigma, self._rng = sigma, rng

    def crossed_by(
        self, method: Guarded, tests: int, *, is_advised: bool = True
    ) -> list[tuple[Test, int]]:
        """Let a method test at most so many designs; see `Guarded.course`."""
        if isinstance(method.method, Oracle):
            method.method.truth = self.rewards
        test = partial(self.test, track=bool(getattr(method, "wants_track", False)))
        return method.course(test, tests, may_repeat=self._sigma > 0, is_advised=is_advised)

    def test(self, design: int, *, track: bool = False) -> Test:
        """Test a design; SearcherError if nobody measured it."""
        measured = self.reality if isinstance(self.reality, MeasuredReality) else None
        if measured is not None:
            try:
                measured.check_measured(design)
            except ValueError as error:
                raise SearcherError(f"asked for what can't be tested: {error}") from error
        moved = self.displacement[design].copy()
        if self._sigma:
            moved[:2] += self._sigma * self._rng.standard_normal(2)
        path: Array | None = None
        if track:
            if measured is not None:
                path = measured.mean_track(design, SAMPLES)
            else:
                result = self.reality.simulate([design], track=SAMPLES, threads=1)
                assert result.track is not None
                path = np.nan_to_num(result.track[0])
            if self._sigma:  # otherwise it would reveal what the noise hides
                path[1:, :2] += self._sigma * self._rng.standard_normal((len(path) - 1, 2))
                path[-1] = moved
        return Test(design, float(self.task.reward(moved)), moved, path)


@lru_cache(maxsize=64)
def truth(reality: Reality) -> Array:
    """Return the displacement of every design, (6561, 3); NaN if nobody measured it."""
    if isinstance(reality, MeasuredReality):
        return reality.displacement
    return displacements(landscape(reality))


def _run(method: Guarded, simulator: Simulator, world: World, tests: int, seed: int) -> TransferRun:
    course = world.crossed_by(method, tests)
    simulations = simulator.used  # errors from here on are not the method's
    tested = np.array([test.design for test, _ in course], dtype=np.int64)
    advice = [design for _, design in course]
    recommended = np.array(advice + advice[-1:] * (tests - len(advice)), dtype=np.int64)
    regret, class_regret = regrets(world.rewards, recommended)
    expected, models = beliefs(method)
    nominal = displacements(landscape(simulator.nominal))
    left = simulator.testable.copy()
    left[tested] = False
    if isinstance(world.reality, MeasuredReality):
        # Tests are a large part of the measurements, and knowing those is no merit of a method.
        ranks = [_ranks(one, world.task, world.rewards, left) for one in (nominal, expected)]
    else:
        ranks = [
            _ranks_before(world.reality, world.task),
            _ranks(expected, world.task, world.rewards),
        ]
    off = [_heading_off(one, world, left) for one in (nominal, expected)]
    return TransferRun(
        method=method.name,
        reality=world.reality.name,
        task=world.task,
        seed=seed,
        tested=tested,
        rewards=np.array([test.reward for test, _ in course]),
        recommended=recommended,
        regret=regret,
        class_regret=class_regret,
        srcc_before=ranks[0][0],
        srcc_after=ranks[1][0],
        kendall_before=ranks[0][1],
        kendall_after=ranks[1][1],
        heading_error_before=off[0],
        heading_error=off[1],
        distance=_distance(models, world.displacement),
        is_specified=is_specified(world.reality, frozenset(getattr(method, "varied", ()))),
        simulations=simulations,
    )


def regrets(rewards: Array, recommended: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return the regrets of designs, as shares of the best reward, and the class regrets.

    NaN if the reward of a design is NaN, or for its class if those of all its members are.
    """
    known = ~np.isnan(rewards)
    best = rewards[known].max()
    if best <= 0:  # no positive best: the regret is 0 over all designs, and unknown over a few
        made = np.full(len(recommended), 0.0 if known.all() else np.nan)
        return made, made.copy()
    of_class = class_best(np.where(known, rewards, -np.inf))
    of_class[np.isneginf(of_class)] = np.nan
    return 1 - rewards[recommended] / best, 1 - of_class[recommended] / best


def is_specified(reality: Reality, varied: frozenset[str]) -> bool:
    """Return whether parameters cover every difference of a reality from its simulator."""
    ours, theirs = reality.physics.to_dict(), reality.nominal.to_dict()
    differ = {name for name, value in ours.items() if value != theirs[name]}
    # The duration follows from the frequency if the number of cycles is the same.
    cycles = [round(float(one.cycles), 3) for one in (reality.physics, reality.nominal)]
    if "frequency_hz" in varied and cycles[0] == cycles[1]:
        differ -= {"duration"}
    return reality.is_plain and differ <= varied


def beliefs(method: Guarded) -> tuple[Array | None, Array | None]:
    """Return what a method predicts and its models, as `Method` describes them; None for neither.

    Raises
    ------
    SearcherError
        If one is of another shape, or has a number that is not finite.
    """
    predicted = _held(method, "predict", (N_DESIGNS,), (N_DESIGNS, 3))
    return predicted, _held(method, "models", (-1, N_DESIGNS, 3))


def _held(method: Guarded, name: str, *shapes: tuple[int, ...]) -> Array | None:
    """Return a method's predictions or models; None if it gives none, or can't any more.

    Raises
    ------
    SearcherError
        If it has none of the given shapes, in which -1 is any length, or is not finite.
    """
    ask = getattr(method, name, None)
    try:
        said = None if ask is None else ask()
    except SimulationBudgetError:
        return None
    if said is None:
        return None
    values: Array = np.asarray(said)
    any_length = (-1, *values.shape[1:])
    if values.dtype.kind not in "fiu" or not {values.shape, any_length} & {*shapes}:
        wanted = " or ".join(map(str, shapes)).replace("-1", "n")
        raise SearcherError(
            f"method {method.name} returned {values.dtype} of shape {values.shape} from {name}; it "
            f"must be None or numbers of shape {wanted}"
        )
    # A rank or the nearest of several would silently be taken among what is no number.
    if not np.isfinite(values).all():
        raise SearcherError(
            f"method {method.name} returned numbers from {name} that are not finite; give 0 for a "
            "design that diverges, or None if it expects nothing"
        )
    return values


@lru_cache(maxsize=256)
def _ranks_before(reality: Reality, task: Task) -> tuple[float, float]:
    """Return how well the nominal simulator predicts the rewards, equal for every method."""
    nominal = displacements(landscape(reality.nominal))
    return _ranks(nominal, task, task.reward(truth(reality)))


def _ranks(
    expected: Array | None, task: Task, rewards: Array, among: NDArray[np.bool_] | None = None
) -> tuple[float, float]:
    """Return how well rewards of some or all were predicted: SRCC and Kendall's tau, or NaN."""
    if expected is None or (among is not None and among.sum() < 2):
        return np.nan, np.nan
    reward = expected if expected.ndim == 1 else task.reward(expected)
    if among is not None:
        reward, rewards = reward[among], rewards[among]
    return srcc(reward, rewards), kendall_tau(reward, rewards)


def _heading_off(expected: Array | None, world: World, left: NDArray[np.bool_]) -> float:
    """Return the error of the expected headings; NaN if there are none."""
    if expected is None or expected.ndim == 1:
        return np.nan
    return heading_error(expected[left], world.displacement[left])


def heading_error(expected: Array, real: Array) -> float:
    """Return the mean angle between displacements, degrees, of designs that travel in both."""
    ours, theirs = expected[:, :2], real[:, :2]
    lengths = np.hypot(*ours.T), np.hypot(*theirs.T)
    moves = (lengths[0] > LITTLE) & (lengths[1] > LITTLE)
    if not moves.any():
        return float("nan")
    cosine = (ours * theirs).sum(axis=1)[moves] / (lengths[0] * lengths[1])[moves]
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))).mean())


def _distance(models: Array | None, truth: Array) -> float:
    if models is None or not len(models):
        return float("nan")
    known = ~np.isnan(truth).any(axis=1)
    if not known.all():
        models, truth = models[:, known], truth[known]
    size = float(np.square(truth).sum())
    nearest = min(float(np.square(model - truth).sum()) for model in models)
    return float(np.sqrt(nearest / size)) if size > 0 else float("nan")
