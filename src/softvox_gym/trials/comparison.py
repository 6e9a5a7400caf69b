"""Comparison of trials with the simulator, design by design, and with each other.

The difference between a robot and its simulation says little without the difference between two
trials of the robot, so every error is given beside that. docs/trials-compare.md defines the
numbers.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import combinations, groupby
from math import ceil, floor, sqrt
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import Design, called
from softvox_gym.landscapes.gap import pearson
from softvox_gym.landscapes.robustness import kendall_tau
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.lattice import Lattice
from softvox_gym.real_tracks import (
    LITTLE,
    MOST_CYCLES,
    PER_CYCLE,
    WITHIN,
    Compared,
    RealTrack,
    heading,
    short,
    track_at,
)
from softvox_gym.real_tracks import compare as compare_tracks
from softvox_gym.realities import PhysicsLike, Reality
from softvox_gym.trials.measured import laid, pair
from softvox_gym.trials.trial import Condition, Trial, several

Array: TypeAlias = NDArray[np.float64]

#: A film that ends at most this share of the requested cycles too early counts as complete.
SHORT = 0.02

#: Points of each track for dynamic time warping; designs needed for a correlation.
SAMPLES, LEAST = 200, 4

#: Pairs of tracks that are warped at once; a few megabytes.
AT_ONCE = 16

#: Errors between two tracks: heading and decimals of the display, "" for JSON and CSV only.
ERRORS = {
    "distance_error": ("", ".2f"),
    "heading_error": ("heading off", ".0f"),
    "end_point_error": ("end off", ".2f"),
    "speed_error": ("", ".3f"),
    "rms_error": ("RMS", ".2f"),
    "dtw": ("DTW", ".2f"),
}


def _design(called: int | str) -> str:
    """Return a design as displayed; of more than 27 digits, the first and the last ones."""
    return short(str(called), 27)


#: Displayed columns of all other numbers.
_SHOWN: dict[str, tuple[str, str | Callable[[Any], str]]] = {
    "design": ("design", _design),
    "trials": ("trials", ""),
    "distance_simulated": ("distance", ".2f"),
    "distance_real": ("real", ".2f"),
    "distance_real_spread": ("+-", ".2f"),
    "speed_simulated": ("speed", ".3f"),
    "speed_real": ("real", ".3f"),
}

MEANING = f"""\
Numbers are means over the trials of a design; lengths are in voxel widths. distance: from start to
end, simulated and real, with the standard deviation over trials (+-). speed: displacement per
cycle, simulated and real. heading off: angle between the two displacements, degrees; none if either
is shorter than {LITTLE:g}. end off: distance between the two ends. RMS: root mean square distance
at equal times. DTW: mean distance of the points that dynamic time warping matches. x: the error
divided by the same between two trials of the design; 1 is as good as another run of the same robot.
SRCC: Pearson's correlation of simulated and real distance over designs (Kadian et al. 2020), with
its 95 % interval by Fisher's transformation. tau: Kendall's rank correlation of the same.
"""


@dataclass(frozen=True, kw_only=True, eq=False)
class Row:
    """The trials of one design under one condition, and its simulation.

    Parameters
    ----------
    trials : tuple of Trial
    cycles : (float, float)
        Cycles of the real and of the simulated robot after which they are compared.
    diverged : bool
        Whether the simulated robot diverged; it then stands still.
    tracks : tuple of RealTrack
        The simulated track and that of each trial, in voxel widths; time is in simulated cycles.
    """

    trials: tuple[Trial, ...]
    cycles: tuple[float, float]
    diverged: bool
    tracks: tuple[RealTrack, ...]

    @property
    def design(self) -> Design:
        """The design of all trials."""
        return self.trials[0].design

    @property
    def condition(self) -> Condition:
        """The condition of all trials."""
        return self.trials[0].condition

    @cached_property
    def compared(self) -> tuple[Compared, ...]:
        """The comparison of every trial with the simulated track, lengths in voxel widths."""
        return tuple(_compared(track, self.tracks[0]) for track in self.tracks[1:])

    @cached_property
    def speeds(self) -> Array:
        """Speed of each track, voxel widths per cycle; NaN without a whole cycle."""
        real, own = self.cycles
        return np.array([speed(track, real if i else own) for i, track in enumerate(self.tracks)])

    @cached_property
    def errors(self) -> Array:
        """Errors of each trial against the simulated track, in the order of `ERRORS`, (n, 6)."""
        return self._errors((i, 0) for i in range(1, len(self.tracks)))

    @cached_property
    def repeatability(self) -> Array:
        """Errors between each pair of trials, shape (n (n - 1) / 2, 6)."""
        return self._errors(combinations(range(1, len(self.tracks)), 2))

    def _errors(self, pairs: Iterable[tuple[int, int]]) -> Array:
        first, second = np.array([*pairs], dtype=np.intp).reshape(-1, 2).T
        times = np.linspace(0.0, self.cycles[1], SAMPLES)
        points = np.stack([track_at(times, one.cycle, one.position) for one in self.tracks])
        parts = (slice(at, at + AT_ONCE) for at in range(0, len(first), AT_ONCE))
        dtw = [one for part in parts for one in warped(points[first[part]], points[second[part]])]
        rows = []
        for i, j, matched in zip(first, second, dtw, strict=True):
            held = _compared(self.tracks[i], self.tracks[j])
            off = abs(held.distance_real - held.distance_simulated)
            faster = abs(self.speeds[i] - self.speeds[j])
            rows.append((off, held.angle, held.end_point_error, faster, held.rms_error, matched))
        return np.array(rows, dtype=np.float64).reshape(len(rows), len(ERRORS))

    def record(self) -> dict[str, Any]:
        """Return all numbers by name; None if there is none."""
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
    """Trials compared with a simulator.

    Parameters
    ----------
    rows : tuple of Row
        One per design and condition, ordered by condition and then by design.
    world : Reality
        The simulator.
    left_out : tuple of Trial
        Trials that are shorter than requested.
    """

    rows: tuple[Row, ...]
    world: Reality
    left_out: tuple[Trial, ...]

    def __repr__(self) -> str:
        trials = sum(len(row.trials) for row in self.rows)
        return f"Comparison({len(self.rows)} rows, {trials} trials, against {self.world.name})"

    @cached_property
    def conditions(self) -> dict[Condition, Section]:
        """The table of each condition, with statistics over all its designs as facts."""
        groups = groupby(self.rows, key=lambda row: row.condition)
        return {condition: _section(list(rows)) for condition, rows in groups}

    def section(self) -> Section:
        """Return the table of all conditions."""
        tables = list(self.conditions.values())
        return replace(tables[0], rows=[row for table in tables for row in table.rows])


def compare(
    trials: Iterable[Trial],
    physics: PhysicsLike | Reality = "published",
    *,
    cycles: ArrayLike | None = None,
    **options: Any,
) -> Comparison:
    """Compare trials with the simulator, grouping those of a design under one condition.

    Parameters
    ----------
    trials : iterable of Trial
        Trials of designs on any lattice.
    physics : str, dict, Physics or Reality
        The simulator; its duration is ignored. The conditions recorded in the trials do not change
        it.
    cycles : float or (float, float), optional
        Cycles after which both are compared, or those of the real and of the simulated robots, such
        as the paper's (90, 23): the time of the real track is then mapped onto that of the
        simulated one. By default those of the shortest trial under the condition.
    **options
        Threads and progress, as in `softvox_gym.simulate`.

    Returns
    -------
    Comparison

    Raises
    ------
    TypeError, ValueError
        If there is nothing to compare, or the cycles are invalid.

    Notes
    -----
    Sources: S. Kriegman et al., "Scalable sim-to-real transfer of soft robot designs", RoboSoft
    2020, who laid 90 real cycles over 23 simulated ones; A. Kadian et al., "Sim2Real
    predictivity", IEEE RA-L 5(4), 2020, for the SRCC.

    Examples
    --------
    Two runs made from a pseudo-reality in which most robots turn round:

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
    given = several(trials)
    if not given:
        raise ValueError("there are no trials to compare; give at least one")
    world = Reality.of(physics)
    world = replace(world, name=physics) if isinstance(physics, str) else world
    asked = None if cycles is None else pair(cycles)
    least = (1 - SHORT) * asked[0] if asked else 0.0
    trials = sorted(set(given), key=_order)
    kept = [trial for trial in trials if _end(trial) >= least]
    if asked and not kept:
        raise ValueError(
            f"no trial has {asked[0]:g} cycles: the longest has {max(map(_end, given)):g}; give "
            "fewer cycles"
        )
    over = {
        condition: asked or (min(map(_end, own)),) * 2
        for condition, own in groupby(kept, key=lambda one: one.condition)
    }
    last = max(simulated for _, simulated in over.values())
    if last > MOST_CYCLES:
        raise ValueError(
            f"a trial lasts {last:g} cycles, but at most {MOST_CYCLES} can be simulated; give "
            "cycles"
        )
    simulated = _simulated(dict.fromkeys(one.design for one in kept), world, last, **options)
    return Comparison(
        rows=tuple(
            _row(tuple(own), over[condition], simulated[design])
            for (condition, design), own in groupby(kept, lambda one: (one.condition, one.design))
        ),
        world=world,
        left_out=tuple(trial for trial in trials if _end(trial) < least),
    )


def warped(first: Array, second: Array) -> Array:
    """Return the distances of tracks, shapes (..., n, 2) and (..., m, 2), by dynamic time warping.

    Points are matched in order, without leaving any out, so that the sum of distances is least. A
    step along both tracks counts twice, and the sum is divided by n + m: a mean distance.

    Notes
    -----
    Source: H. Sakoe, S. Chiba, "Dynamic programming algorithm optimization for spoken word
    recognition", IEEE Transactions on Acoustics, Speech, and Signal Processing 26(1), 1978: the
    symmetric form without a slope constraint and without a window.
    """
    n, m = first.shape[-2], second.shape[-2]
    apart = np.hypot(*np.moveaxis(first[..., np.newaxis, :] - second[..., np.newaxis, :, :], -1, 0))
    # Least sums on the two previous diagonals, at i + 1; at 0 there is nothing, or the start.
    earlier, before = np.full((2, *apart.shape[:-2], n + 1), np.inf)
    earlier[..., 0] = 0.0
    for diagonal in range(n + m - 1):
        i = np.arange(max(0, diagonal - m + 1), min(diagonal, n - 1) + 1)
        here, sums = apart[..., i, diagonal - i], np.full_like(before, np.inf)
        along_one = np.minimum(before[..., i], before[..., i + 1]) + here
        sums[..., i + 1] = np.minimum(along_one, earlier[..., i] + 2 * here)
        earlier, before = before, sums
    return np.asarray(before[..., n] / (n + m))


def speed(track: RealTrack, cycles: float) -> float:
    """Return a robot's speed per cycle, the mean over whole cycles; NaN without a whole cycle.

    The track lasts this many cycles of the robot, whatever its unit of time.
    """
    whole = floor(cycles + 1e-9)
    times = np.linspace(0.0, float(track.cycle[-1]) * (whole / cycles), whole + 1)
    steps = np.diff(track_at(times, track.cycle, track.position), axis=0)
    return float(np.hypot(*steps.T).mean()) if whole else float("nan")


def _end(trial: Trial) -> float:
    return float(trial.cycle[-1])


def _order(trial: Trial) -> tuple[Any, ...]:
    design, condition = trial.design, trial.condition
    place = tuple(design.shape), design.lattice.phases, design.index
    run = trial.date, trial.who, trial.repetition, trial.digest
    return str(condition), repr(condition), *place, *run


def _samples(cycles: float) -> int:
    """Return how many samples after the start reach the end of this many cycles."""
    return max(1, ceil(cycles * PER_CYCLE - 1e-6))


def _simulated(
    designs: Iterable[Design], world: Reality, cycles: float, **options: Any
) -> dict[Design, Array]:
    """Return the tracks of designs in a world for some cycles, one batch per lattice."""
    made: dict[Design, Array] = {}
    lasting = replace(world, physics=world.physics.lasting(_samples(cycles) / PER_CYCLE))
    lattices: dict[Lattice, list[Design]] = {}
    for design in designs:
        lattices.setdefault(design.lattice, []).append(design)
    for batch in lattices.values():
        track = lasting.simulate(batch, track=PER_CYCLE, **options).track
        assert track is not None
        made |= zip(batch, track[..., :2], strict=True)
    return made


def _row(trials: tuple[Trial, ...], cycles: tuple[float, float], simulated: Array) -> Row:
    times = np.minimum(np.arange(_samples(cycles[1]) + 1) / PER_CYCLE, cycles[1])
    first = track_at(times, np.arange(len(simulated)) / PER_CYCLE, simulated)
    if diverged := not np.isfinite(first).all():
        first = np.zeros_like(first)
    own = RealTrack(trials[0].design.index, "simulated", times, first)
    real = (replace(laid(trial, cycles), trial=str(trial.repetition)) for trial in trials)
    return Row(trials=trials, cycles=cycles, diverged=diverged, tracks=(own, *real))


def _compared(first: RealTrack, second: RealTrack) -> Compared:
    """Compare a track with another one of equal duration."""
    grid = np.arange(_samples(float(first.cycle[-1])) + 1) / PER_CYCLE
    other = track_at(grid, second.cycle, second.position)
    return compare_tracks(first, other, PER_CYCLE)


def _mean(values: Array) -> float | None:
    known = values[np.isfinite(values)]
    return float(known.mean()) if known.size else None


def _spread(values: Array) -> float | None:
    """Return the standard deviation; None for fewer than two values."""
    known = values[np.isfinite(values)]
    return float(known.std(ddof=1)) if known.size > 1 else None


def _section(rows: Sequence[Row]) -> Section:
    """Return the table of a condition, with statistics over its designs."""
    records = [row.record() for row in rows]
    simulated, real, errors, multiples = (
        np.array([record[name] for record in records], dtype=np.float64)
        for name in ("distance_simulated", "distance_real", "heading_error", "rms_error_multiple")
    )
    angles, usual = errors[np.isfinite(errors)], multiples[np.isfinite(multiples)]
    found = _correlation(simulated, real)
    facts = {
        "cycles": _about(rows),
        "designs": len(records),
        "trials": sum(record["trials"] for record in records),
        **found,
        "with_heading": len(angles),
        "within_45": int((angles <= WITHIN).sum()),
        "turned": int((angles > 90).sum()),
        "rms_multiple": float(np.median(usual)) if usual.size else None,
    }
    told = [
        f"No SRCC: it takes {LEAST} designs that do not all go equally far."
        if found["srcc"] is None
        else "SRCC {srcc:.2f} ({srcc_low:.2f} to {srcc_high:.2f}), tau {tau:.2f}, over {designs} "
        "designs.",
        f"{{within_45}} of {{with_heading}} headings within {WITHIN} degrees, {{turned}} turned by "
        "more than 90."
        if angles.size
        else "No design has a heading in both worlds.",
        "\nRMS errors are {rms_multiple:.1f} times the difference between trials (median)."
        if usual.size
        else "\nNo design has two trials that differ, so errors have no scale.",
    ]
    return Section(
        title=str(rows[0].condition),
        note=MEANING,
        columns=[_column(name) for name in records[0]],
        rows=[tuple(record.values()) for record in records],
        facts=facts | {"words": " ".join(told).replace(" \n", "\n").format_map(facts)},
        sentence="{words}",
    )


def _about(rows: Sequence[Row]) -> str:
    """Return the compared cycles of a condition, in words."""
    real, simulated = rows[0].cycles
    if real != simulated:
        return f"{real:g} real cycles laid over {simulated:g} simulated ones"
    ends = {_end(trial): called(row.design) for row in rows for trial in row.trials}
    words = f"{real:g} cycles, real and simulated alike"
    if max(ends) > real and real in ends:
        words += (
            f", as the shortest trial, of design {ends[real]}, has; the longest has {max(ends):g}"
        )
    return words


def _correlation(simulated: Array, real: Array) -> dict[str, float | None]:
    """Return Pearson's correlation with Fisher's band, and Kendall's; None if undefined."""
    values: Iterable[float | None] = [None] * 4
    if len(real) >= LEAST and np.ptp(simulated) > 0 and np.ptp(real) > 0:
        srcc = np.clip(pearson(simulated, real), -1, 1)  # rounding aside
        half = 1.96 / sqrt(len(real) - 3)
        with np.errstate(divide="ignore"):  # a correlation of 1 has no band
            band = np.tanh(np.arctanh(srcc) + np.array([-half, half]))
        values = map(float, (srcc, *band, kendall_tau(simulated, real)))
    return dict(zip(("srcc", "srcc_low", "srcc_high", "tau"), values, strict=True))


def _column(name: str) -> Column:
    base = name.removesuffix("_multiple")
    if base != name:
        return Column(name, "x" if ERRORS[base][0] else "", ".1f")
    return Column(name, *(ERRORS | _SHOWN).get(name, ("", "")))
