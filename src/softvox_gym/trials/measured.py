"""Measurements of some designs as a reality, in which all other designs are unknown."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import ceil
from typing import Any, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import Design
from softvox_gym.landscapes.analysis.graph import read_only
from softvox_gym.landscapes.section import counted, some
from softvox_gym.lattice import Lattice
from softvox_gym.noise import not_negative
from softvox_gym.physics import Physics
from softvox_gym.real_tracks import MOST_CYCLES, RealTrack, track_at
from softvox_gym.realities import PhysicsLike, Reality, single_physics
from softvox_gym.trials.trial import Condition, Trial, several

Array = NDArray[np.float64]

LATTICE = Lattice()

#: Options of commands that choose trials by a part of their condition, if called otherwise.
OPTIONS = {"reality": "simulated-in", "pressure_kpa": "kpa", "frequency_hz": "hz"}

#: Tolerance, in cycles, between durations that differ only in the last digits.
EXACT = 1e-3


@dataclass(frozen=True)
class MeasuredReality(Reality):
    """A reality known only by measurements of some designs; it can't be simulated.

    `from_trials` makes it. Its `physics` is that of the simulator, and `about` describes the
    trials; the true physics is unknown.

    Parameters
    ----------
    measured : tuple of Trial
        Trials of designs of the 2x2x2 lattice, all under the same conditions.
    cycles : float
        Cycles of actuation after which the robots are compared.
    name, source, nominal
        As in `Reality`.

    Raises
    ------
    TypeError, ValueError
        As `from_trials` does.
    """

    measured: tuple[Trial, ...] = field(default=(), repr=False)
    cycles: float = 0.0

    def __post_init__(self) -> None:
        trials = _checked(self.measured)
        if not 0 < not_negative("cycles", self.cycles) <= MOST_CYCLES:
            raise ValueError(
                f"cycles must be above 0 and at most {MOST_CYCLES}, got {self.cycles:g}"
            )
        early = [
            f"{_run(trial)} after {trial.cycle[-1]:g}"
            for trial in trials
            if trial.cycle[-1] < self.cycles
        ]
        if early:
            raise ValueError(
                f"{len(early)} of {len(trials)} runs end before {self.cycles:g} cycles: "
                f"{some(early)}; give fewer cycles, or leave these runs out"
            )
        changed = {
            "measured": trials,
            "cycles": float(self.cycles),
            "physics": self.nominal,
            "about": _about(trials, self.cycles, self.simulated_cycles),
        }
        for name, value in changed.items():
            object.__setattr__(self, name, value)
        super().__post_init__()

    @property
    def is_plain(self) -> bool:
        """Return False: no `Physics` describes the measurements."""
        return False

    def to_dict(self) -> dict[str, Any]:
        """Return what results depend on, ready for JSON: the trials' digests and the cycles."""
        return {"trials": [trial.digest for trial in self.measured], "cycles": self.cycles}

    @cached_property
    def designs(self) -> NDArray[np.int64]:
        """Numbers of the measured designs, in order, shape (n,)."""
        return np.unique([trial.design.index for trial in self.measured])

    @cached_property
    def testable(self) -> NDArray[np.bool_]:
        """Whether a design was measured, shape (6561,)."""
        return read_only(np.isin(np.arange(LATTICE.n_designs), self.designs))

    @cached_property
    def displacement(self) -> Array:
        """Displacement of every design, voxel widths, the mean over its runs, (6561, 3); dz is 0.

        NaN if nobody measured the design.
        """
        made = np.full((LATTICE.n_designs, 3), np.nan)
        for design, ends in self._ends.items():
            made[design] = (*ends.mean(axis=0), 0.0)
        return read_only(made)

    @cached_property
    def spread(self) -> Array:
        """Root mean square distance of a design's runs from that mean, voxel widths, (6561,).

        0 for a single run; NaN if nobody measured the design.
        """
        made = np.full(LATTICE.n_designs, np.nan)
        for design, ends in self._ends.items():
            made[design] = np.sqrt(np.square(ends - ends.mean(axis=0)).sum(axis=1).mean())
        return read_only(made)

    @property
    def simulated_cycles(self) -> float:
        """Cycles of actuation after which simulated robots are compared."""
        own = float(self.nominal.cycles)
        return self.cycles if abs(own - self.cycles) < EXACT else own

    def against(self, physics: Physics) -> MeasuredReality:
        """Return the reality compared with another simulator, over the same cycles."""
        return replace(self, nominal=for_cycles(physics, self.simulated_cycles))

    @cached_property
    def tracks(self) -> tuple[RealTrack, ...]:
        """Tracks of every run over the reality's cycles, in cm for robots of the nominal size.

        Time is in simulated cycles. The name of a trial is the first twelve digits of its digest,
        with which its file's name begins.
        """
        cycles = self.cycles, self.simulated_cycles
        return tuple(laid(trial, cycles, edge_cm=self._edge_cm) for trial in self.measured)

    def mean_track(self, design: int, per_cycle: int) -> Array:
        """Return the mean track of a design's runs, voxel widths, shape (samples, 3); z is 0.

        The last sample is at the end, even in mid-cycle.

        Raises
        ------
        ValueError
            If nobody measured the design.
        """
        self.check_measured(design)
        samples = ceil(round(self.simulated_cycles * per_cycle, 6)) + 1
        times = np.minimum(np.arange(samples) / per_cycle, self.simulated_cycles)
        own = [one for one in self.tracks if one.design == design]
        mean = np.mean([track_at(times, one.cycle, one.position) for one in own], axis=0)
        return np.column_stack([mean / self._edge_cm, np.zeros(samples)])

    def check_measured(self, design: int) -> None:
        """Raise an error if nobody measured a design.

        Raises
        ------
        ValueError
            The message names the design, and those that were measured.
        """
        if not self.testable[design]:
            raise ValueError(
                f"design {design} was not measured in reality {self.name}; the measured designs "
                f"are {some(self.designs.tolist())}"
            )

    def trials(self, design: NDArray[np.uint8], *_: object, **__: object) -> NoReturn:
        """Raise an error, because there is no physics; everything that simulates calls this.

        Raises
        ------
        ValueError
            Always; the message names the design if nobody measured it.
        """
        if design.any() and Lattice(*design.shape) == LATTICE:
            self.check_measured(Design(design).index)
        self.run()

    def run(self, *_: object, **__: object) -> NoReturn:
        """Raise an error, as `trials` does."""
        raise ValueError(
            f"reality {self.name} was measured and can't be simulated; its displacement and tracks "
            f"have the measurements of designs {some(self.designs.tolist())}"
        )

    @property
    def _edge_cm(self) -> float:
        return float(self.nominal.edge) * 100

    @cached_property
    def _ends(self) -> dict[int, Array]:
        """The ends of the runs of every design, voxel widths, each of shape (runs, 2)."""
        ends: dict[int, list[Array]] = {}
        for one in self.tracks:
            ends.setdefault(one.design, []).append(one.position[-1] / self._edge_cm)
        return {design: np.stack(own) for design, own in ends.items()}


def from_trials(
    trials: Iterable[Trial],
    *,
    name: str = "trials",
    nominal: PhysicsLike = "published",
    cycles: ArrayLike | None = None,
) -> MeasuredReality:
    """Return a reality made from trials of 2x2x2 designs; also `Reality.from_trials`.

    Parameters
    ----------
    trials : iterable of Trial
        As `softvox_gym.trials.read` reads them; all with one surface, powder, pressure and
        frequency, and all measured or all simulated in one reality. Several runs of a design are
        averaged.
    name : str
    nominal : str, dict or Physics
        The simulator that it is compared with; its duration is ignored.
    cycles : float or (float, float), optional
        Cycles of actuation after which every robot, real or simulated, is compared, at most 1000;
        or those of the real and of the simulated robots, such as (90, 23); distances are comparable
        only after equal numbers. By default the cycles of the shortest run.

    Returns
    -------
    MeasuredReality

    Raises
    ------
    TypeError, ValueError
        If they are not trials, have other lattices or several conditions, or end before the cycles;
        the message names them.

    Examples
    --------
    >>> runs = [Trial(design=6453, cycle=[0, 30], position=[[0, 0], [x, 1.0]], repetition=k,
    ...               surface="acrylic", who="softvox-gym", license="CC0-1.0",
    ...               source="simulated", reality="reversal", voxel_cm=1)
    ...         for k, x in enumerate([1.9, 2.1], 1)]
    >>> made = from_trials(runs)
    >>> made.displacement[6453].round(2)
    array([2., 1., 0.])
    >>> made.about
    '2 runs of 1 design, after 30 cycles on acrylic, simulated in reversal'
    """
    made = _checked(trials)
    shortest = min(float(trial.cycle[-1]) for trial in made)
    real, simulated = (shortest, shortest) if cycles is None else pair(cycles)
    return MeasuredReality(
        name,
        source=", ".join(sorted({trial.who for trial in made})),
        nominal=for_cycles(single_physics(nominal), simulated),
        measured=made,
        cycles=real,
    )


Reality.from_trials = staticmethod(from_trials)


def pair(cycles: ArrayLike) -> tuple[float, float]:
    """Return the cycles of the real and of the simulated robots for 23 or (90, 23).

    Raises
    ------
    ValueError
        If it is anything else.
    """
    try:
        real, simulated = np.broadcast_to(np.asarray(cycles, dtype=float), 2).tolist()
    except (TypeError, ValueError):
        real = simulated = 0.0
    if not all(0 < value <= MOST_CYCLES for value in (real, simulated)):
        raise ValueError(
            f"cycles must be a number above 0 and at most {MOST_CYCLES}, or two, of the real and "
            f"of the simulated robots, as (90, 23); got {str(cycles)[:40]}"
        )
    return real, simulated


def for_cycles(physics: Physics, cycles: float) -> Physics:
    """Return a physics with this many cycles.

    For 15 cycles the published physics is returned unchanged, though its duration differs in the
    last digits, because its landscape ships with the package.
    """
    return physics if abs(cycles - float(physics.cycles)) < EXACT else physics.lasting(cycles)


def laid(trial: Trial, cycles: tuple[float, float], *, edge_cm: float = 1.0) -> RealTrack:
    """Return a trial as a track in cm for robots with this voxel width, over simulated cycles.

    The real cycles, the first number, are mapped onto the simulated ones. A track that ends earlier
    stays at its end.
    """
    real, simulated = cycles
    times = np.append(trial.cycle[trial.cycle < real], real)
    position = track_at(times, trial.cycle, trial.position) / trial.voxel_cm * edge_cm
    cycle = np.append(times[:-1] * (simulated / real), simulated)
    return RealTrack(trial.design.index, trial.digest[:12], cycle, position)


def _checked(trials: Iterable[Trial]) -> tuple[Trial, ...]:
    """Return the trials, checked to form one reality, ordered by design and digest."""
    given = several(trials)
    if not given:
        raise ValueError("there are no trials; give at least one")
    others = [
        f"{_run(trial)} of {trial.design.lattice}"
        for trial in given
        if trial.design.lattice != LATTICE
    ]
    if others:
        raise ValueError(
            f"a reality has designs of the lattice {LATTICE}, but {len(others)} of {len(given)} "
            f"runs have others: {some(others)}; leave them out, as --lattice {LATTICE} does"
        )
    for name in Condition._fields:
        counts = Counter(getattr(trial, name) for trial in given)
        if len(counts) > 1:
            told = (f"{n} with {value or 'none given'}" for value, n in counts.most_common())
            raise ValueError(
                f"the trials differ in {name}: {some(told)}; a reality has only one, so select the "
                f"trials with one of them, as --{OPTIONS.get(name, name)} does"
            )
    return tuple(sorted(set(given), key=lambda trial: (trial.design.index, trial.digest)))


def _about(trials: Sequence[Trial], cycles: float, simulated: float) -> str:
    one, runs, designs = trials[0], len(trials), len({trial.design for trial in trials})
    where = f"{one.surface} with {one.powder}" if one.powder else one.surface
    world = f" in {one.reality}" if one.reality else ""
    over = f" laid over {simulated:g} simulated ones" if simulated != cycles else ""
    return (
        f"{counted(runs, 'run')} of {counted(designs, 'design')}, "
        f"after {cycles:g} cycles{over} on {where}, {one.source}{world}"
    )


def _run(trial: Trial) -> str:
    """Return the name of a run in errors."""
    return f"design {trial.design.index} ({trial.digest[:12]})"
