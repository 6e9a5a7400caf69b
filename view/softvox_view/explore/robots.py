"""One robot or two: what became of them, and their movement."""

from __future__ import annotations

from typing import Any

import numpy as np

from softvox_gym import Design, Result, simulate
from softvox_view import replay
from softvox_view.explore.parameters import Conditions
from softvox_view.replay.still import png

#: Of a recording.
FRAMES_PER_CYCLE = 20

#: A recording has at least and at most so many frames, whatever the frequency.
FEWEST_FRAMES, MOST_FRAMES = 100, 600


def run(designs: list[Design], wanted: Conditions) -> Result:
    """Simulate some designs with frames for a replay."""
    physics = wanted.physics
    step = float(physics.time_step)
    steps = float(physics.duration) / step
    wanted_frames = FRAMES_PER_CYCLE * float(physics.frequency_hz) * float(physics.duration)
    frames = min(max(wanted_frames, FEWEST_FRAMES), MOST_FRAMES)
    return simulate(designs, physics, frames=max(1, round(steps / frames)), threads=1)


def told(designs: list[Design], wanted: Conditions) -> dict[str, Any]:
    """Return what became of some designs and their recording, ready for JSON.

    Returns
    -------
    dict
        robots : for each design, number, digits, status, and fitness, dx, dy, dz in voxel widths,
        None where it diverged; recording : for the player; warnings.
    """
    result = run(designs, wanted)
    return {
        "robots": [
            {
                "design": design.index,
                "digits": design.digits,
                "status": str(result.status[i]),
                "fitness": _finite(result.fitness[i]),
                **dict(zip(("dx", "dy", "dz"), map(_finite, result.displacement[i]), strict=True)),
            }
            for i, design in enumerate(designs)
        ],
        "recording": replay.recording(result),
        "warnings": wanted.warnings,
    }


def page(designs: list[Design], wanted: Conditions) -> str:
    """Return a replay as a page that needs nothing else."""
    result = run(designs, wanted)
    return replay.page(replay.recording(result), replay.still(result))


def still(designs: list[Design], wanted: Conditions) -> bytes:
    """Return a picture of some robots at the end of their run, as PNG."""
    return png(replay.still(run(designs, wanted)))


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None
