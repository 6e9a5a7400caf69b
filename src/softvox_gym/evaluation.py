"""Evaluation of designs without Gymnasium: nominal or perturbed, in one or many trials."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from softvox_gym.cluster import evaluate_on
from softvox_gym.design import batch_of
from softvox_gym.engine import isa_name
from softvox_gym.lattice import Lattice
from softvox_gym.noise import Perturbation, Trials
from softvox_gym.objectives import OBJECTIVES, Tried, objectives_of
from softvox_gym.realities import PhysicsLike, Reality
from softvox_gym.simulation import Result, check_count, check_threads, sample_count
from softvox_gym.tasks import Task

Array: TypeAlias = NDArray[np.float64]
Seed: TypeAlias = int | Sequence[np.random.Generator] | None

#: Most trials of all designs in one call; their tracks alone take gigabytes.
MOST_TRIALS = 10**7

#: The task of the paper.
DISPLACEMENT = Task()

#: Samples of a track per cycle of actuation.
SAMPLES_PER_CYCLE = 1


def _cvar25(values: Array) -> Array:
    """Return the mean of the worst quarter over the last axis; one value may count partly.

    Source: R. T. Rockafellar, S. Uryasev, "Optimization of conditional value-at-risk", 2000.
    """
    ordered = np.sort(values, axis=-1)
    quarter = values.shape[-1] / 4
    weights = np.clip(quarter - np.arange(values.shape[-1]), 0.0, 1.0)
    return np.asarray((ordered * weights).sum(axis=-1) / quarter)


#: Functions that reduce the values of a design, over the last axis: the mean, the smallest, the 10
#: % quantile (interpolated linearly), and the mean of the worst quarter.
AGGREGATES: Mapping[str, Callable[[Array], Array]] = {
    "mean": lambda values: np.asarray(values.mean(axis=-1)),
    "min": lambda values: np.asarray(values.min(axis=-1)),
    "q10": lambda values: np.asarray(np.quantile(values, 0.1, axis=-1)),
    "cvar25": _cvar25,
}


def aggregate_of(name: str) -> Callable[[Array], Array]:
    """Return an aggregate by its name; ValueError for an unknown one."""
    if name not in list(AGGREGATES):
        raise ValueError(
            f"aggregate {name!r} is unknown; the aggregates are {', '.join(AGGREGATES)}"
        )
    return AGGREGATES[name]


def standard_error(values: Array) -> Array:
    """Return the standard error of the mean over the last axis; NaN of a single value."""
    n = values.shape[-1]
    if n == 1:
        return np.full(values.shape[:-1], np.nan)
    return np.asarray(values.std(axis=-1, ddof=1) / np.sqrt(n))


@dataclass(frozen=True, eq=False, repr=False)
class Evaluation:
    """The results of n designs, each tried k times.

    Parameters
    ----------
    designs : ndarray of uint8, shape (n, nx, ny, nz)
        The digits; with several phases, as given.
    fitness : ndarray, shape (n, k)
        The task's reward, as measured, voxel widths; 0 if the trial diverged.
    displacement : ndarray, shape (n, k, 3)
        Voxel widths; NaN if the trial diverged.
    track : ndarray, shape (n, k, samples, 3)
        The centre of mass from its start, voxel widths; NaN if the trial diverged. The number of
        samples is one more than the cycles of the nominal actuation: a longer track is cut, a
        shorter one repeats its end.
    steps : ndarray of int64, shape (n, k)
        Time steps.
    aggregate : str
        The name in `AGGREGATES` of the function that gives the value of a design.
    result : Result or None
        The simulation: a row per trial, or per design if trials can't differ; None if no simulation
        was needed.
    task : Task
    energy : ndarray, shape (n, k), or None
        The pump's work, J; NaN if the trial diverged. None unless an objective needs it.
    asked : tuple of str
        Names of the requested objectives.
    phases : int
        Phases of the designs' lattice.
    """

    designs: NDArray[np.uint8]
    fitness: Array
    displacement: Array
    track: Array
    steps: NDArray[np.int64]
    aggregate: str = "mean"
    result: Result | None = None
    task: Task = DISPLACEMENT
    energy: Array | None = None
    asked: tuple[str, ...] = ()
    phases: int = 1

    def __len__(self) -> int:
        return len(self.designs)

    def __repr__(self) -> str:
        n, k = self.fitness.shape
        best = f", best {self.value.max():.2f}" if n else ""
        return f"Evaluation({n} designs on {self.lattice}, trials: {k}{best})"

    @property
    def lattice(self) -> Lattice:
        """The lattice of the designs."""
        return Lattice.of(self.designs.shape[1:], phases=self.phases)

    @property
    def diverged(self) -> NDArray[np.bool_]:
        """Which trials diverged, shape (n, k)."""
        return np.isnan(self.displacement[..., 0])

    @cached_property
    def value(self) -> Array:
        """The aggregate of every design's fitness values, shape (n,)."""
        if self.fitness.shape[1] == 1:
            return self.fitness[:, 0].copy()
        return aggregate_of(self.aggregate)(self.fitness)

    @cached_property
    def objectives(self) -> Array:
        """The aggregate of every design's objectives, shape (n, m), in the requested order.

        More is always better (docs/environments/objectives.md). m is 0 if none was requested.
        """
        values = self.objectives_of_trials
        if values.shape[1] == 1:
            return values[:, 0].copy()
        return aggregate_of(self.aggregate)(np.moveaxis(values, 1, -1))

    @property
    def objectives_of_trials(self) -> Array:
        """The objectives of every trial, shape (n, k, m)."""
        zeros = np.zeros(self.fitness.shape)
        tried = Tried(
            designs=self.designs,
            task=self.task,
            fitness=self.fitness,
            displacement=np.nan_to_num(self.displacement),
            track=np.nan_to_num(self.track),
            energy=zeros if self.energy is None else np.nan_to_num(self.energy),
        )
        values = [OBJECTIVES[name].values(tried) for name in self.asked]
        return np.stack(values, axis=-1) if values else zeros[..., np.newaxis][..., :0]

    @property
    def standard_error(self) -> Array:
        """The standard error of the mean fitness, shape (n,); NaN for a single trial."""
        return standard_error(self.fitness)

    @property
    def mean_displacement(self) -> Array:
        """Mean over the trials that did not diverge, shape (n, 3), voxel widths; NaN if all did."""
        if self.fitness.shape[1] == 1:
            return self.displacement[:, 0].copy()
        is_ok = ~self.diverged[..., np.newaxis]
        total = np.where(is_ok, self.displacement, 0.0).sum(axis=1)
        count = is_ok.sum(axis=1)
        return np.where(count > 0, total / np.maximum(count, 1), np.nan)

    def repeated(self, trials: int) -> Evaluation:
        """Return the evaluation for several trials that can't differ from the existing one.

        The trials count as if all had been simulated, so that a budget means the same with and
        without noise.
        """
        if trials == 1:
            return self
        names = ("fitness", "displacement", "track", "steps", "energy")
        arrays = {name: getattr(self, name) for name in names}
        columns: Any = {
            name: np.repeat(array, trials, axis=1)
            for name, array in arrays.items()
            if array is not None
        }
        return replace(self, **columns)


def evaluate(
    designs: Any,
    physics: PhysicsLike | Reality = "published",
    *,
    shape: Sequence[int] | None = None,
    task: str | Task = DISPLACEMENT,
    perturbations: Sequence[Perturbation] = (),
    trials: int = 1,
    seed: Seed = None,
    aggregate: str = "mean",
    objectives: Sequence[str] | None = None,
    frames: int = 0,
    threads: int | None = None,
    isa: str | None = None,
    client: Any = None,
) -> Evaluation:
    """Evaluate designs: all trials in one call into C, or on the workers of a cluster.

    Parameters
    ----------
    designs : Design, int, str, sequence of these, or array_like
        As in `simulate`.
    physics : str, dict, Physics or Reality
        A preset's name, a dict of changes or a Physics, of single numbers; or a
        `softvox_gym.Reality`, which can specify more.
    shape : (int, int, int), optional
        The lattice of design numbers and rows of digits; by default 2x2x2. For several phases, a
        `Lattice.of(..., phases=P)`.
    task : str or Task
        What counts: the displacement, or `softvox_gym.Task("directed", heading=90.0)`, for example.
    perturbations : sequence of Perturbation
        What varies from trial to trial, such as `softvox_gym.noise.Jakobi(level=1.0)` and
        `MeasurementNoise(sigma=0.1)`; they act one after another.
    trials : int
        Trials per design. Without perturbations they can't differ, and only one is simulated.
    seed : int or sequence of Generator, optional
        Seed of the perturbations: design i draws from ``default_rng(seed + i)``, exactly as in a
        vector environment that was reset with this seed. Or a generator for every design. By
        default different at every call.
    aggregate : {"mean", "min", "q10", "cvar25"}
        How the values of the trials become `Evaluation.value`, and those of each objective; see
        `AGGREGATES`.
    objectives : sequence of str, optional
        The columns of `Evaluation.objectives`, in this order: some of "displacement", "voxels",
        "actuators", "energy", "straightness", "stability" and "heading".
    frames, threads, isa
        As in `simulate`; the frames are in `Evaluation.result`.
    client : object, optional
        A `distributed.Client`, or any object with submit and gather: workers of its cluster do the
        work in chunks, on one thread each, to the same bits. Generators must then differ.

    Returns
    -------
    Evaluation

    Raises
    ------
    TypeError, ValueError
        If an argument does not fit; the message names it, and nothing has been drawn.
    RuntimeError
        If a worker's engine gives other bits.

    Examples
    --------
    >>> from softvox_gym.noise import Jakobi
    >>> noisy = evaluate([6453, 926], perturbations=[Jakobi(1.0)], trials=64, seed=0)
    >>> noisy.fitness.shape
    (2, 64)
    >>> print(evaluate([6453, 926], objectives=("displacement", "voxels")).objectives.round(2))
    [[ 4.66 -5.  ]
     [ 3.96 -5.  ]]
    """
    stack, lattice = batch_of(designs, shape=shape)
    kinds, phase = lattice.pumped(stack)
    reality = Reality.of(physics)
    task = Task.of(task)
    check_count("trials", trials, least=1, most=MOST_TRIALS)
    if trials * len(stack) > MOST_TRIALS:
        raise ValueError(
            f"{len(stack)} designs with {trials} trials each are {trials * len(stack)} trials, but "
            f"one call takes at most {MOST_TRIALS}; give fewer trials or designs"
        )
    check_count("frames", frames, least=0)
    check_threads(threads)
    isa_name(isa)
    aggregate_of(aggregate)
    asked = () if objectives is None else tuple(one.name for one in objectives_of(objectives))
    perturbations = _perturbations(perturbations)
    generators = _generators(seed, len(stack)) if perturbations or seed is not None else []
    if client is not None and len(stack):
        on_cluster: Evaluation = evaluate_on(
            client,
            evaluate,
            stack,
            generators if perturbations else [],
            reality=reality,
            shape=lattice,
            task=task,
            perturbations=perturbations,
            trials=trials,
            aggregate=aggregate,
            objectives=objectives,
            frames=frames,
            threads=threads,
            isa=isa,
        )
        return on_cluster
    samples = sample_count(reality.physics, SAMPLES_PER_CYCLE)
    options: Any = {"track": SAMPLES_PER_CYCLE, "frames": frames, "threads": threads, "isa": isa}
    options["energy"] = "energy" in asked
    if not perturbations or not len(stack):
        result = reality.simulate(kinds, phase=phase, **options)
        evaluation = _evaluation(stack, lattice, result, samples, aggregate, task, asked)
        return evaluation.repeated(trials)
    phases: Any = [None] * len(stack) if phase is None else phase
    drawn = [
        _disturbed(reality.trials(design, trials, phase=ahead), perturbations, rng)
        for design, ahead, rng in zip(kinds, phases, generators, strict=True)
    ]
    result = reality.run(np.repeat(kinds, trials, axis=0), Trials.joined(drawn), **options)
    evaluation = _evaluation(stack, lattice, result, samples, aggregate, task, asked)
    measure(evaluation.fitness, evaluation.diverged, perturbations, generators)
    return evaluation


def measure(
    fitness: Array,
    diverged: NDArray[np.bool_],
    perturbations: Sequence[Perturbation],
    generators: Sequence[np.random.Generator],
) -> None:
    """Measure fitness values in place, shape (n, k); those of diverged trials do not change.

    Each design's errors, shape (k,), come from its own generator.
    """
    for row, lost, rng in zip(fitness, diverged, generators, strict=True):
        measured = row.copy()
        for perturbation in perturbations:
            measured = perturbation.measure(measured, rng)
        row[:] = np.where(lost, row, measured)


def _perturbations(given: Sequence[Perturbation]) -> list[Perturbation]:
    """Return the argument if it is a sequence of perturbations, else raise TypeError."""
    perturbations = list(given) if isinstance(given, Sequence) else [None]
    for one in perturbations:
        methods = (getattr(one, name, None) for name in ("disturb", "measure"))
        if isinstance(one, type) or not all(map(callable, methods)):
            raise TypeError(
                "perturbations must be a sequence of objects with the methods disturb and measure, "
                f"such as [softvox_gym.noise.Jakobi(1.0)], got {given!r}"
            )
    return perturbations


def _generators(seed: Seed, n: int) -> list[np.random.Generator]:
    """Return the generator of every design."""
    if seed is None:
        return np.random.default_rng().spawn(n)
    if isinstance(seed, (int, np.integer)) and not isinstance(seed, (bool, np.bool_)):
        if seed < 0:
            raise ValueError(f"seed must not be negative, got {seed}")
        return [np.random.default_rng(int(seed) + i) for i in range(n)]
    generators = list(seed) if isinstance(seed, Sequence) else []
    if len(generators) != n or not all(isinstance(g, np.random.Generator) for g in generators):
        raise TypeError(
            f"seed must be a whole number or a sequence of {n} numpy generators, one for every "
            f"design, got {seed!r}"
        )
    return generators


def _disturbed(
    trials: Trials, perturbations: Sequence[Perturbation], rng: np.random.Generator
) -> Trials:
    for perturbation in perturbations:
        trials = perturbation.disturb(trials, rng)
    return trials


def _evaluation(
    stack: NDArray[np.uint8],
    lattice: Lattice,
    result: Result,
    samples: int,
    aggregate: str,
    task: Task,
    asked: tuple[str, ...],
) -> Evaluation:
    """Return the evaluation of a simulation that has one or more rows for every design."""
    n = len(stack)
    k = len(result) // n if n else 1
    assert result.track is not None
    track = result.track[:, :samples]
    missing = samples - track.shape[1]
    track = np.pad(track, ((0, 0), (0, missing), (0, 0)), constant_values=np.nan)
    track = np.where(np.isnan(track), result.displacement[:, np.newaxis], track)
    return Evaluation(
        designs=stack,
        fitness=np.where(result.diverged, 0.0, task.reward(result.displacement)).reshape(n, k),
        displacement=result.displacement.reshape(n, k, 3),
        track=track.reshape(n, k, samples, 3),
        steps=result.steps.astype(np.int64).reshape(n, k),
        aggregate=aggregate,
        result=result.of(np.repeat(stack, k, axis=0), lattice),
        task=task,
        energy=None if result.energy is None else result.energy.reshape(n, k),
        asked=asked,
        phases=lattice.phases,
    )
