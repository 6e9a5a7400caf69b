"""Trials held against the simulator, design by design, and against each other.

By how much a robot moves another way than simulated says little without by how much two trials of
it differ: every error is told beside that. docs/trials-compare.md defines the numbers.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations
from math import ceil, floor
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym import real_tracks
from softvox_gym.design import Design, called
from softvox_gym.landscapes.gap import pearson
from softvox_gym.landscapes.robustness import kendall_tau
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.real_tracks import (
    LITTLE,
    PER_CYCLE,
    WITHIN,
    Compared,
    RealTrack,
    heading,
    track_at,
)
from softvox_gym.realities import PhysicsLike, Reality
from softvox_gym.trials.trial import Trial

Array: TypeAlias = NDArray[np.float64]

#: Robots are compared after at most so many cycles.
MOST_CYCLES = 1000

#: Of the cycles asked for: a film that ends no earlier before their end is taken to show it.
SHORT = 0.02

#: Points of each track that dynamic time warping matches.
SAMPLES = 200

#: Of the SRCC: designs that it takes; draws of its band, their seed, and the band's ends.
LEAST, RESAMPLES, SEED, TAILS = 3, 2000, 2020, (0.025, 0.975)

#: What is told of two tracks: heading and places for people, "" for what is for programs only.
ERRORS = {
    "distance_error": ("", ".2f"),
    "heading_error": ("heading off", ".0f"),
    "end_point_error": ("end off", ".2f"),
    "speed_error": ("", ".3f"),
    "rms_error": ("RMS", ".2f"),
    "dtw": ("DTW", ".2f"),
}

#: What people see of all else.
_SHOWN = {
    "design": ("design", ""),
    "trials": ("trials", ""),
    "cycles_real": ("cycles", ".4g"),
    "distance_simulated": ("distance", ".2f"),
    "distance_real": ("real", ".2f"),
    "distance_real_spread": ("+-", ".2f"),
    "speed_simulated": ("speed", ".3f"),
    "speed_real": ("real", ".3f"),
}

MEANING = f"""\
Means over the trials of a design. distance: from start to end, simulated and real, voxel widths,
and the standard deviation over trials. speed: voxel widths that a robot gets on in a cycle. heading
off: the angle between the two displacements, degrees; none where one is less than {LITTLE:g}. end
off: between the two ends. RMS: root of the mean squared distance at the same time. DTW: the mean
distance of points that dynamic time warping matches. x: how many times what two trials of the
design differ by; 1 is as good as another run of the same robot. SRCC: Pearson's correlation of
simulated and real distance over designs (Kadian et al. 2020), in brackets its 95 % band by the
bootstrap over designs; tau: Kendall's of the same.
"""


class Condition(NamedTuple):
    """What the trials that are compared together share."""

    source: str
    reality: str
    surface: str
    powder: str
    pressure_kpa: float | None
    frequency_hz: float | None

    def __str__(self) -> str:
        kpa, hz = self.pressure_kpa, self.frequency_hz
        numbers = [f"{value:g} {unit}" for value, unit in ((kpa, "kPa"), (hz, "Hz")) if value]
        source = f"{self.reality} (simulated)" if self.reality else self.source
        return ", ".join(filter(None, [source, self.surface, self.powder, *numbers]))


@dataclass(frozen=True, kw_only=True, eq=False)
class Row:
    """The trials of one design under one condition, and how the simulator moves it.

    Parameters
    ----------
    design : Design
    condition : Condition
    trials : tuple of Trial
    cycles : (float, float)
        Of the real and of the simulated robot, after which they are compared.
    diverged : bool
        Whether the simulated one did; it then stands still.
    tracks : tuple of RealTrack
        The simulated one and that of each trial, in voxel widths; time is in simulated cycles.
    """

    design: Design
    condition: Condition
    trials: tuple[Trial, ...]
    cycles: tuple[float, float]
    diverged: bool
    tracks: tuple[RealTrack, ...]

    @cached_property
    def compared(self) -> tuple[Compared, ...]:
        """Every trial held against the simulated track, lengths in voxel widths."""
        return tuple(_compared(track, self.tracks[0]) for track in self.tracks[1:])

    @cached_property
    def speeds(self) -> Array:
        """Voxel widths per cycle, of each of the tracks; NaN where they have no whole cycle."""
        real, own = self.cycles
        return np.array([speed(track, real if i else own) for i, track in enumerate(self.tracks)])

    @cached_property
    def errors(self) -> Array:
        """Of each trial against the simulated track, in the order of `ERRORS`, shape (n, 6)."""
        return self._errors((i, 0) for i in range(1, len(self.tracks)))

    @cached_property
    def repeatability(self) -> Array:
        """The same of each pair of trials, shape (n (n - 1) / 2, 6)."""
        return self._errors(combinations(range(1, len(self.tracks)), 2))

    def _errors(self, pairs: Iterable[tuple[int, int]]) -> Array:
        rows = []
        for i, j in pairs:
            held = _compared(self.tracks[i], self.tracks[j])
            off = abs(held.distance_real - held.distance_simulated)
            faster = float(abs(self.speeds[i] - self.speeds[j]))
            matched = warped(*(_resampled(self.tracks[k]) for k in (i, j)))
            rows.append((off, held.angle, held.end_point_error, faster, held.rms_error, matched))
        return np.array(rows).reshape(len(rows), len(ERRORS))

    def record(self) -> dict[str, Any]:
        """Return all numbers by name; None for what there is not."""
        end, *ends = (track.position[-1] for track in self.tracks)
        far = np.hypot(*np.transpose(ends))
        made = {
            "design": called(self.design),
            "digits": self.design.digits,
            "lattice": str(self.design.lattice),
            **self.condition._asdict(),
            "trials": len(self.trials),
            "cycles_real": self.cycles[0],
            "cycles_simulated": self.cycles[1],
            "diverged": self.diverged,
            "distance_simulated": float(np.hypot(*end)),
            "distance_real": _mean(far),
            "distance_real_spread": _spread(far),
            "heading_simulated": _mean(np.array([heading(end)])),
            "heading_real": _mean(np.array([heading(np.mean(ends, axis=0))])),
            "speed_simulated": _mean(self.speeds[:1]),
            "speed_real": _mean(self.speeds[1:]),
            "speed_real_spread": _spread(self.speeds[1:]),
        }
        for name, own, others in zip(ERRORS, self.errors.T, self.repeatability.T, strict=True):
            error, usual = _mean(own), _mean(others)
            made[name] = error
            made[f"{name}_spread"] = _spread(own)
            made[f"{name}_repeatability"] = usual
            made[f"{name}_multiple"] = error / usual if usual and error is not None else None
        return made


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Comparison:
    """Trials held against a simulator.

    Parameters
    ----------
    rows : tuple of Row
        For every design and condition, by condition and then by design.
    world : Reality
        The simulator.
    about_cycles : str
        Which cycles are compared, in words.
    left_out : tuple of Trial
        Those that are shorter.
    """

    rows: tuple[Row, ...]
    world: Reality
    about_cycles: str
    left_out: tuple[Trial, ...]

    def __repr__(self) -> str:
        trials = sum(len(row.trials) for row in self.rows)
        return f"Comparison({len(self.rows)} rows, {trials} trials, against {self.world.name})"

    @property
    def conditions(self) -> tuple[Condition, ...]:
        """Those that there are rows of."""
        return tuple(dict.fromkeys(row.condition for row in self.rows))

    @property
    def summary(self) -> dict[Condition, Mapping[str, Any]]:
        """What holds over the designs of every condition; None for what there is not."""
        return {condition: self.section(condition).facts for condition in self.conditions}

    def section(self, condition: Condition | None = None) -> Section:
        """Return the table of a condition, with its summary, or of all."""
        records = [row.record() for row in self.rows if condition in (None, row.condition)]
        return Section(
            title=str(condition or ""),
            note=MEANING,
            columns=[_column(name) for name in records[0]],
            rows=[tuple(record.values()) for record in records],
            facts=_summary(records) if condition else {},
            sentence="{words}" if condition else "",
        )


def compare(
    trials: Iterable[Trial],
    physics: PhysicsLike | Reality = "published",
    *,
    cycles: ArrayLike | None = None,
    **options: Any,
) -> Comparison:
    """Hold trials against the simulator, those of a design under one condition together.

    Parameters
    ----------
    trials : iterable of Trial
        Of designs on any lattice.
    physics : str, dict, Physics or Reality
        The simulator, but for the duration. What the trials say of their condition changes nothing
        of it.
    cycles : float, (float, float) or str, optional
        After which both are compared, or those of the real and of the simulated robots, as the
        paper's (90, 23) or "90:23": the time of the real track is then mapped onto that of the
        simulated one. Where None, those of the shortest trial of the design under the condition.
    **options
        Threads and progress, as `softvox_gym.simulate` takes them.

    Returns
    -------
    Comparison

    Raises
    ------
    TypeError, ValueError
        Where there is nothing to compare, or for cycles that can't be.

    Notes
    -----
    Sources: S. Kriegman et al., "Scalable sim-to-real transfer of soft robot designs", RoboSoft
    2020, who laid 90 real cycles over 23 simulated ones; A. Kadian et al., "Sim2Real
    predictivity", IEEE RA-L 5(4), 2020, for the SRCC.

    Examples
    --------
    Two runs made of a pseudo-reality, in which most robots turn round:

    >>> from softvox_gym import reality
    >>> from softvox_gym.calibration import tracks_of
    >>> from softvox_gym.trials import Trial, compare
    >>> (track,) = tracks_of(reality("reversal"), [6453])
    >>> about = dict(design=6453, surface="a plane", who="softvox-gym", license="CC0-1.0",
    ...              source="simulated", reality="reversal", voxel_cm=1, cycle=track.cycle)
    >>> runs = [Trial(position=track.position * far, repetition=i, **about)
    ...         for i, far in enumerate((1, 1.1), start=1)]
    >>> made = compare(runs)
    >>> made
    Comparison(1 rows, 2 trials, against published)
    >>> row = made.rows[0].record()
    >>> f"{row['heading_error']:.0f} degrees, {row['rms_error_multiple']:.0f} times"
    '164 degrees, 29 times'
    """
    given = list(trials)
    if others := [one for one in given if not isinstance(one, Trial)]:
        raise TypeError(f"trials must be Trials, got a {type(others[0]).__name__}")
    if not given:
        raise ValueError("there are no trials to compare; give one at least")
    world = Reality.of(physics)
    world = replace(world, name=physics) if isinstance(physics, str) else world
    asked = cycles_of(cycles)
    kept = [one for one in given if asked is None or _end(one) >= (1 - SHORT) * asked[0]]
    if asked and not kept:
        raise ValueError(
            f"no trial has {asked[0]:g} cycles: the longest has {max(map(_end, given)):g}; give "
            "fewer cycles"
        )
    groups: dict[tuple[Condition, Design], list[Trial]] = {}
    for trial in sorted(kept, key=_order):
        groups.setdefault((_condition(trial), trial.design), []).append(trial)
    over = {key: asked or (min(map(_end, own)),) * 2 for key, own in groups.items()}
    last: dict[Design, float] = {}
    for (_, design), (_, own) in over.items():
        last[design] = max(own, last.get(design, 0.0))
    if max(last.values()) > MOST_CYCLES:
        raise ValueError(
            f"a trial goes on for {max(last.values()):g} cycles, and at most {MOST_CYCLES} are "
            "simulated; give cycles"
        )
    simulated = _simulated(last, world, **options)
    return Comparison(
        rows=tuple(_row(*key, own, over[key], simulated[key[1]]) for key, own in groups.items()),
        world=world,
        about_cycles=_about(asked),
        left_out=tuple(set(given) - set(kept)),
    )


def cycles_of(cycles: ArrayLike | None) -> tuple[float, float] | None:
    """Return the cycles of the real and of the simulated robots, of 23, (90, 23) or "90:23".

    Raises
    ------
    ValueError
        For anything else but None.
    """
    if cycles is None:
        return None
    parts = cycles.split(":") if isinstance(cycles, str) else np.ravel(cycles).tolist()
    try:
        real, simulated = map(float, parts * (3 - len(parts)))
    except (TypeError, ValueError):
        real = simulated = 0.0
    if not all(1 <= value <= MOST_CYCLES for value in (real, simulated)):
        raise ValueError(
            f"cycles must be a number from 1 to {MOST_CYCLES}, or two for the real and the "
            f"simulated robots, as 90:23; got {str(cycles)[:40]!r}"
        )
    return real, simulated


def warped(first: Array, second: Array) -> float:
    """Return the distance of two tracks, shapes (n, 2) and (m, 2), by dynamic time warping.

    Their points are matched in order, none left out, so that the sum of distances is least. A step
    along both tracks counts twice, and the sum is divided by n + m: a mean distance.

    Notes
    -----
    Source: H. Sakoe, S. Chiba, "Dynamic programming algorithm optimization for spoken word
    recognition", IEEE Transactions on Acoustics, Speech, and Signal Processing 26(1), 1978: the
    symmetric form without a slope constraint and without a window.
    """
    n, m = len(first), len(second)
    apart = np.hypot(*np.moveaxis(first[:, np.newaxis] - second, -1, 0))
    # Least sums on the two diagonals before, at i + 1; at 0 there is nothing, or the start.
    earlier, before = np.full((2, n + 1), np.inf)
    earlier[0] = 0.0
    for diagonal in range(n + m - 1):
        i = np.arange(max(0, diagonal - m + 1), min(diagonal, n - 1) + 1)
        here, sums = apart[i, diagonal - i], np.full(n + 1, np.inf)
        along_one = np.minimum(before[i], before[i + 1]) + here
        sums[i + 1] = np.minimum(along_one, earlier[i] + 2 * here)
        earlier, before = before, sums
    return float(before[n] / (n + m))


def speed(track: RealTrack, cycles: float) -> float:
    """Return how far a robot gets in a cycle, the mean over whole cycles; NaN where there is none.

    The track lasts so many cycles of the robot, whatever its time is counted in.
    """
    whole = floor(cycles + 1e-9)
    times = np.linspace(0.0, float(track.cycle[-1]) * (whole / cycles), whole + 1)
    steps = np.diff(track_at(times, track.cycle, track.position), axis=0)
    return float(np.hypot(*steps.T).mean()) if whole else float("nan")


def _condition(trial: Trial) -> Condition:
    return Condition(*(getattr(trial, name) for name in Condition._fields))


def _end(trial: Trial) -> float:
    return float(trial.cycle[-1])


def _order(trial: Trial) -> tuple[Any, ...]:
    design = trial.design
    run = trial.date, trial.who, trial.repetition, trial.digest
    return str(_condition(trial)), tuple(design.shape), design.lattice.phases, design.index, *run


def _about(asked: tuple[float, float] | None) -> str:
    if asked is None:
        return "each design over the cycles of its shortest trial, real and simulated alike"
    if asked[0] == asked[1]:
        return f"{asked[0]:g} cycles, real and simulated alike"
    return f"{asked[0]:g} real cycles laid over {asked[1]:g} simulated ones"


def _samples(cycles: float) -> int:
    """Return how many samples after the start reach to the end of so many cycles."""
    return max(1, ceil(cycles * PER_CYCLE - 1e-6))


def _simulated(
    last: Mapping[Design, float], world: Reality, **options: Any
) -> dict[Design, RealTrack]:
    """Return how designs move in a world for at least so many cycles, one batch per lattice."""
    made: dict[Design, RealTrack] = {}
    for lattice in dict.fromkeys(design.lattice for design in last):
        designs = [design for design in last if design.lattice == lattice]
        samples = max(_samples(last[design]) for design in designs)
        lasting = replace(world, physics=world.physics.lasting(samples / PER_CYCLE))
        track = lasting.simulate(designs, track=PER_CYCLE, **options).track
        assert track is not None
        cycle = np.arange(track.shape[1]) / PER_CYCLE
        for design, own in zip(designs, track, strict=True):
            made[design] = RealTrack(design.index, "simulated", cycle, own[:, :2])
    return made


def _row(
    condition: Condition,
    design: Design,
    trials: Sequence[Trial],
    cycles: tuple[float, float],
    simulated: RealTrack,
) -> Row:
    real, own = cycles
    first = _cut(simulated, own, own)
    if diverged := not np.isfinite(first.position).all():
        first = replace(first, position=np.zeros_like(first.position))
    tracks = [
        RealTrack(design.index, str(one.repetition), one.cycle, one.position / one.voxel_cm)
        for one in trials
    ]
    return Row(
        design=design,
        condition=condition,
        trials=tuple(trials),
        cycles=cycles,
        diverged=diverged,
        tracks=(first, *(_cut(track, real, own) for track in tracks)),
    )


def _cut(track: RealTrack, cycles: float, onto: float) -> RealTrack:
    """Return a track up to a cycle, its time mapped; what ends before stays where it is."""
    times = np.append(track.cycle[track.cycle < cycles], cycles)
    position = track_at(times, track.cycle, track.position)
    return replace(track, cycle=np.append(times[:-1] * (onto / cycles), onto), position=position)


def _compared(first: RealTrack, second: RealTrack) -> Compared:
    """Hold a track against another one that lasts as long."""
    grid = np.arange(_samples(float(first.cycle[-1])) + 1) / PER_CYCLE
    other = track_at(grid, second.cycle, second.position)
    return real_tracks.compare(first, other, PER_CYCLE)


def _resampled(track: RealTrack) -> Array:
    times = np.linspace(0.0, float(track.cycle[-1]), SAMPLES)
    return track_at(times, track.cycle, track.position)


def _mean(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else None


def _spread(values: Array) -> float | None:
    """Return the standard deviation; None of fewer than two values."""
    known = values[np.isfinite(values)]
    return float(known.std(ddof=1)) if known.size > 1 else None


def _summary(records: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what holds over the designs of a condition, and all of it in words."""
    simulated, real, errors, multiples = (
        np.array([record[name] for record in records], dtype=np.float64)
        for name in ("distance_simulated", "distance_real", "heading_error", "rms_error_multiple")
    )
    angles, n = errors[np.isfinite(errors)], len(records)
    srcc, reason = dict.fromkeys(("srcc", "srcc_low", "srcc_high", "tau")), ""
    if n < LEAST:
        reason = f"No SRCC: it takes {LEAST} designs, and there are {n}."
    elif np.ptp(simulated) == 0 or np.ptp(real) == 0:
        reason = "No SRCC: all designs go equally far."
    else:
        drawn = np.random.default_rng(SEED).integers(n, size=(RESAMPLES, n))
        band = np.nanquantile(pearson(simulated[drawn], real[drawn]), TAILS)
        values = (pearson(simulated, real), *band, kendall_tau(simulated, real))
        srcc = dict(zip(srcc, np.clip(values, -1, 1).tolist(), strict=True))  # rounding aside
        reason = (
            "SRCC {:.2f} ({:.2f} to {:.2f}), tau {:.2f}, ".format(*srcc.values())
            + f"over {n} designs."
        )
    within, turned = int((angles <= WITHIN).sum()), int((angles > 90).sum())
    multiple = float(np.nanmedian(multiples)) if np.isfinite(multiples).any() else None
    headings = (
        f"{within} of {len(angles)} headings within {WITHIN} degrees, {turned} turned by more than "
        "90."
        if len(angles)
        else "No design has a heading in both worlds."
    )
    usual = (
        "No design has two trials that differ, so nothing says how large these errors are."
        if multiple is None
        else f"RMS errors are {multiple:.1f} times what trials of a design differ by (median)."
    )
    return {
        "designs": n,
        "trials": sum(record["trials"] for record in records),
        **srcc,
        "with_heading": len(angles),
        "within_45": within,
        "turned": turned,
        "rms_multiple": multiple,
        "words": f"{reason} {headings}\n{usual}",
    }


def _column(name: str) -> Column:
    base = name.removesuffix("_multiple")
    if base != name:
        return Column(name, "x" if ERRORS[base][0] else "", ".1f")
    return Column(name, *(ERRORS | _SHOWN).get(name, ("", "")))
