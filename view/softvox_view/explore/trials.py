"""Trials of robots for the page, which shows them beside its simulations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.lattice import Lattice
from softvox_gym.real_tracks import track_at
from softvox_gym.trials import Trial

#: Most points of a track on the page: more would be invisible and make the page large.
MOST = 100


def on_the_map(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """Return the trials on the map's lattice."""
    return tuple(trial for trial in trials if trial.design.lattice == Lattice())


def told(trials: Sequence[Trial]) -> dict[str, dict[str, Any]]:
    """Return trials by their conditions, measured ones first, ready for JSON.

    For each: whether it was measured, and by the number of a design its runs, with points [cycle,
    x, y] in voxel widths.
    """
    groups: dict[str, dict[str, Any]] = {}
    for trial in sorted(on_the_map(trials), key=_order):
        made = groups.setdefault(_name(trial), {"source": trial.source, "designs": {}})
        runs = made["designs"].setdefault(str(trial.design.index), [])
        runs.append({"points": _points(trial).round(4).tolist()})
    return groups


def _order(trial: Trial) -> tuple[Any, ...]:
    when = (trial.date, trial.repetition, trial.digest)
    return trial.source, _name(trial), trial.design.index, *when


def _name(trial: Trial) -> str:
    """Return the conditions of a trial: a pseudo-reality; or surface, powder and pump."""
    if trial.source == "simulated":
        return f"simulated: {trial.reality}"
    known = (trial.surface, trial.powder, *trial.condition.pumped)
    return "measured: " + ", ".join(filter(None, known))


def _points(trial: Trial) -> NDArray[np.float64]:
    """Return points of a track; for a long one, if there is room, those of whole cycles."""
    cycle, position = trial.cycle, trial.position / trial.voxel_cm
    if len(cycle) > MOST:
        end = float(cycle[-1])
        step = 1 / max(int((MOST - 2) / end), 1) if end <= MOST - 2 else end / (MOST - 1)
        times = np.append(np.arange(0, end - step / 2, step), end)
        cycle, position = times, track_at(times, cycle, position)
    return np.column_stack([cycle, position])
