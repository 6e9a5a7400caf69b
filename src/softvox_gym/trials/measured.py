"""What was measured of some designs, as a reality; of all others nothing is known."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import cached_property
from math import ceil
from typing import Any, NoReturn, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import batch_of
from softvox_gym.lattice import Lattice
from softvox_gym.noise import Trials, not_negative
from softvox_gym.physics import Physics
from softvox_gym.real_tracks import RealTrack, track_at
from softvox_gym.realities import PhysicsLike, Reality, single_physics
from softvox_gym.simulation import Result
from softvox_gym.trials.trial import Trial

Array = NDArray[np.float64]
T = TypeVar("T", bound=np.generic)

LATTICE = Lattice()

#: In which trials may not differ that are one reality.
CONDITIONS = ("source", "reality", "surface", "powder", "pressure_kpa", "frequency_hz")

#: Designs and runs that an error names.
NAMED = 9


@dataclass(frozen=True)
class MeasuredReality(Reality):
    """A reality of which is known what some designs did, and nothing else: it can't be simulated.

    `from_trials` makes it. Its `physics` stands for the simulator's; what is true of the world is
    not known.

    Parameters
    ----------
    measured : tuple of Trial
        Of designs of the 2x2x2 lattice.
    cycles : float
        Of actuation, over which the robots are looked at.
    name, about, source, nominal
        As `Reality` has them.
    """

    measured: tuple[Trial, ...] = field(default=(), repr=False)
    cycles: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "physics", self.nominal)
        super().__post_init__()

    @property
    def is_plain(self) -> bool:
        """Return False: no `Physics` says what was measured."""
        return False

    def to_dict(self) -> dict[str, Any]:
        """Return what results depend on, ready for JSON: the trials' digests, and the cycles."""
        return {"trials": [trial.digest for trial in self.measured], "cycles": self.cycles}

    @cached_property
    def designs(self) -> NDArray[np.int64]:
        """Numbers of the designs that were measured, in order, shape (n,)."""
        return np.unique([trial.design.index for trial in self.measured])

    @cached_property
    def testable(self) -> NDArray[np.bool_]:
        """Whether a design was measured, shape (6561,)."""
        return _frozen(np.isin(np.arange(LATTICE.n_designs), self.designs))

    @cached_property
    def displacement(self) -> Array:
        """Of every design, voxel widths, the mean over its runs, shape (6561, 3); dz is 0.

        NaN of a design that nobody measured.
        """
        made = np.full((LATTICE.n_designs, 3), np.nan)
        for design, ends in self._ends.items():
            made[design] = (*ends.mean(axis=0), 0.0)
        return _frozen(made)

    @cached_property
    def spread(self) -> Array:
        """Root mean square distance of a design's runs from that mean, voxel widths, (6561,).

        0 of a single run; NaN of a design that nobody measured.
        """
        made = np.full(LATTICE.n_designs, np.nan)
        for design, ends in self._ends.items():
            made[design] = np.sqrt(np.square(ends - ends.mean(axis=0)).sum(axis=1).mean())
        return _frozen(made)

    @cached_property
    def tracks(self) -> tuple[RealTrack, ...]:
        """Of every run over the cycles of the reality; see `real_tracks`, which has all of them."""
        edge_cm = float(self.nominal.edge) * 100
        return real_tracks(self.measured, edge_cm=edge_cm, cycles=self.cycles)

    def mean_track(self, design: int, per_cycle: int) -> Array:
        """Return the mean track of a design's runs, voxel widths, shape (samples, 3); z is 0.

        The last sample is at the end, wherever that is in a cycle.

        Raises
        ------
        ValueError
            For a design that nobody measured.
        """
        self.check_measured([design])
        samples = ceil(round(self.cycles * per_cycle, 6)) + 1
        times = np.minimum(np.arange(samples) / per_cycle, self.cycles)
        own = [one for one in self._tracks if one.design == design]
        mean = np.mean([track_at(times, one.cycle, one.position) for one in own], axis=0)
        return np.column_stack([mean, np.zeros(samples)])

    def check_measured(self, designs: Iterable[int]) -> None:
        """Refuse designs that nobody measured.

        Raises
        ------
        ValueError
            Naming the first of them, and those that were.
        """
        missing = [design for design in designs if not self.testable[design]]
        if missing:
            more = f" and {len(missing) - 1} others" if len(missing) > 1 else ""
            raise ValueError(
                f"nobody measured design {missing[0]}{more} in reality {self.name}; measured are "
                f"{_some(self.designs.tolist())}"
            )

    def simulate(self, designs: Any, *, phase: ArrayLike | None = None, **options: Any) -> Result:
        """Refuse: nobody measured them, or they were measured.

        Raises
        ------
        TypeError, ValueError
            Always: for what are no designs, or naming those that nobody measured.
        """
        self._refuse(*batch_of(designs))

    def run(self, stack: NDArray[np.uint8], trials: Trials | None, **options: Any) -> Result:
        """Refuse, as `simulate` does."""
        self._refuse(*batch_of(stack))

    def trials(
        self, design: NDArray[np.uint8], k: int = 1, *, phase: ArrayLike | None = None
    ) -> Trials:
        """Refuse: there is no physics to disturb."""
        self._refuse()

    def of_parts(self, physics: Physics) -> Physics:
        """Refuse: there is no physics."""
        self._refuse()

    def _refuse(
        self, stack: NDArray[np.uint8] | None = None, lattice: Lattice = LATTICE
    ) -> NoReturn:
        if stack is not None and lattice == LATTICE:
            self.check_measured(lattice.numbers(lattice.to_rows(stack)).tolist())
        raise ValueError(
            f"reality {self.name} was measured and can't be simulated; displacement and tracks "
            f"have what is known, of the designs {_some(self.designs.tolist())}"
        )

    @cached_property
    def _tracks(self) -> tuple[RealTrack, ...]:
        """In voxel widths."""
        return real_tracks(self.measured, cycles=self.cycles)

    @cached_property
    def _ends(self) -> dict[int, Array]:
        """Where the runs of every design end, voxel widths, each of shape (runs, 2)."""
        ends: dict[int, list[Array]] = {}
        for one in self._tracks:
            ends.setdefault(one.design, []).append(one.position[-1])
        return {design: np.stack(own) for design, own in ends.items()}


def from_trials(
    trials: Iterable[Trial],
    *,
    name: str = "trials",
    nominal: PhysicsLike = "published",
    cycles: float | None = None,
) -> MeasuredReality:
    """Return what trials of 2x2x2 designs show as a reality; also `Reality.from_trials`.

    Parameters
    ----------
    trials : iterable of Trial
        As `softvox_gym.trials.read` reads them; all of one surface, powder, pressure and frequency,
        and all measured or all simulated in one reality. Several runs of a design are averaged.
    name : str
    nominal : str, dict or Physics
        The simulator that it is held against, over its own cycles: that 90 real ones are laid over
        23 simulated ones is said by ``nominal=Physics.published().lasting(23)``.
    cycles : float, optional
        Of actuation, after which every robot is looked at: distances are comparable after equal
        numbers alone. Where None, as many as the shortest run has.

    Returns
    -------
    MeasuredReality

    Raises
    ------
    TypeError, ValueError
        For what are no trials, trials of other lattices or of several conditions, or runs that end
        before the cycles, naming them.

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
    ends = [float(trial.cycle[-1]) for trial in made]
    if cycles is None:
        cycles = min(ends)
    elif not not_negative("cycles", cycles):
        raise ValueError("cycles must be above 0, got 0")
    early = [
        f"{_run(trial)} after {end:g}"
        for trial, end in zip(made, ends, strict=True)
        if end < cycles
    ]
    if early:
        raise ValueError(
            f"{len(early)} of {len(made)} runs end before {cycles:g} cycles: {_some(early)}; give "
            "fewer cycles, or leave them out"
        )
    one, designs = made[0], len({trial.design for trial in made})
    where = f"{one.surface} with {one.powder}" if one.powder else one.surface
    world = f", simulated in {one.reality}" if one.source == "simulated" else ""
    return MeasuredReality(
        name,
        about=f"{len(made)} run{'s' * (len(made) > 1)} of {designs} design{'s' * (designs > 1)}, "
        f"after {cycles:g} cycles on {where}{world}",
        source=", ".join(sorted({trial.who for trial in made})),
        nominal=single_physics(nominal),
        measured=made,
        cycles=float(cycles),
    )


Reality.from_trials = staticmethod(from_trials)


def real_tracks(
    trials: Iterable[Trial], *, edge_cm: float = 1.0, cycles: float | None = None
) -> tuple[RealTrack, ...]:
    """Return trials of 2x2x2 designs as tracks, in cm of robots whose voxels are so wide.

    A trial is called by the first twelve digits of its digest, with which its file's name begins.

    Parameters
    ----------
    trials : iterable of Trial
    edge_cm : float
        What a voxel width of theirs becomes; 1 is that of the simulated robots.
    cycles : float, optional
        Where tracks are cut; not at all where None.
    """
    made = []
    for trial in trials:
        end = float(trial.cycle[-1] if cycles is None else cycles)
        cycle = np.append(trial.cycle[trial.cycle < end], end)
        position = track_at(cycle, trial.cycle, trial.position) / trial.voxel_cm * edge_cm
        made.append(RealTrack(trial.design.index, trial.digest[:12], cycle, position))
    return tuple(made)


def _checked(trials: Iterable[Trial]) -> tuple[Trial, ...]:
    """Return trials that can be one reality, in the order of their designs and digests."""
    trials = tuple(trials)
    if not all(isinstance(trial, Trial) for trial in trials):
        raise TypeError("trials must be softvox_gym.trials.Trial, as softvox_gym.trials.read reads")
    if not trials:
        raise ValueError("there are no trials; give one at least")
    others = [
        f"{_run(trial)} of {trial.design.lattice}"
        for trial in trials
        if trial.design.lattice != LATTICE
    ]
    if others:
        raise ValueError(
            f"a reality has the designs of {LATTICE}, and {len(others)} of {len(trials)} runs are "
            f"of others: {_some(others)}; leave them out"
        )
    for name in CONDITIONS:
        counts = Counter(getattr(trial, name) for trial in trials)
        if len(counts) > 1:
            told = (f"{n} with {value or 'none said'}" for value, n in counts.most_common())
            raise ValueError(
                f"the trials differ in {name}: {_some(told)}; a reality has one, so give those of "
                "one alone"
            )
    return tuple(sorted(set(trials), key=lambda trial: (trial.design.index, trial.digest)))


def _run(trial: Trial) -> str:
    """Return how errors call a run."""
    return f"design {trial.design.index} ({trial.digest[:12]})"


def _some(values: Iterable[Any]) -> str:
    """Return values as a list, of many the first."""
    told = [str(value) for value in values]
    more = f" and {len(told) - NAMED} more" if len(told) > NAMED else ""
    return ", ".join(told[:NAMED]) + more


def _frozen(values: NDArray[T]) -> NDArray[T]:
    values.flags.writeable = False
    return values
