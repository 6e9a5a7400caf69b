"""Recordings: the frames of some designs in a compact form for JSON.

A value takes two bytes. Positions are relative to the robot's middle at that moment, however far it
has gone, in steps of less than 1e-4 voxel widths for a robot on 3x3x3 sites, which is invisible.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import raster, rendering
from softvox_gym.design import Design
from softvox_gym.lattice import Lattice
from softvox_gym.motion import Motion, frames_of
from softvox_gym.rendering import fitting_distance, lanes
from softvox_gym.simulation import Result

FORMAT, VERSION = "softvox-replay", 2

#: The count that stands for 1.
STEPS = 2**15 - 1

#: Most digits of a design in a label; a longer design is labelled by its lattice.
MOST_DIGITS = 27


def recording(result: Result, *designs: int, stride: int = 1) -> dict[str, Any]:
    """Return the recording of some designs of a batch.

    Parameters
    ----------
    result : Result
        Of `simulate(..., frames=every)`.
    *designs : int
        Their indices in the batch, 0 for the first; by default all.
    stride : int
        Keep only every stride-th frame.

    Returns
    -------
    dict
        Plain numbers, strings, lists and dicts, ready for `json.dumps` and for the player. Lengths
        are voxel widths. ``frames`` is the number of frames, ``seconds_per_frame`` the time between
        them, ``cycles`` the number of actuation cycles up to the last. Each of ``robots`` has the
        arrays ``position`` (frames, voxels, 3; from the centre), ``quaternion`` (frames, voxels, 4;
        w, x, y, z) and ``edge`` (frames, voxels): base64 of little-endian signed 16-bit counts, of
        which 32767 stand for 1, or in positions and edges for ``scale``. ``centre`` (frames, 3) is
        the centre of mass, base64 of little-endian 32-bit floats. If a run ends or diverges before
        the others, its last pose stays; ``last`` is that frame. ``shape`` is the lattice of the
        ``digits``. Robots of `versus` have ``world``, its name, ``panel``, which some share, and
        ``shift`` (x, y), the offset at which to draw them. A robot with ``loops`` ends as it
        begins, apart from its position.

    Raises
    ------
    ValueError
        If the result has no frames, the designs do not share one clock, or an index or the stride
        is out of range.
    """
    places = checked_places(result, designs)
    if stride < 1:
        raise ValueError(f"stride must be at least 1, got {stride}")
    clocks = {clock_of(result, i) for i in places}
    if len(clocks) > 1:
        given = ", ".join(f"({step:.4g} s, {frequency:g} Hz)" for step, frequency in sorted(clocks))
        raise ValueError(
            f"the designs of one recording must share time step and frequency, got {given}; "
            "record them one by one"
        )
    kept = np.arange(0, len(frames_of(result).step), stride)
    return {**_clock(result, places, kept), "robots": [_robot(result, i, kept) for i in places]}


def versus(worlds: Mapping[str, Result], *designs: int) -> dict[str, Any]:
    """Return the recording of designs in several worlds, each design's robots in one scene.

    Parameters
    ----------
    worlds : dict of Result
        Results by name, each of the same designs and with frames. The first sets the clock: from
        the others the nearest frames are taken, counted from the moment the pump begins.
    *designs : int
        As in `recording`.

    Raises
    ------
    ValueError
        As `recording` does, or if there is no world.
    """
    if not worlds:
        raise ValueError("versus needs a world or more")
    first, *_ = worlds.values()
    places = checked_places(first, designs)
    moments = shared_moments(list(worlds.values()), np.ptp(frames_of(first).time[0, :2]))
    robots = []
    for panel, i in enumerate(places):
        shifts = lanes([Motion.of(result, i).walk for result in worlds.values()])
        for (name, result), shift in zip(worlds.items(), shifts, strict=True):
            label, short = labels(result, i, world=name, design=first.design(i))
            own = {"label": label, "short_label": short, "world": name}
            shared = {"panel": panel, "shift": shift[:2].tolist()}
            robots.append({**_robot(result, i, frames_at(result, moments)), **own, **shared})
    clock = _clock(first, places, np.arange(len(moments)))
    return {**clock, "settle_time": float(-moments[0]), "robots": robots}


def lap(result: Result) -> dict[str, Any]:
    """Return the recording of the last cycle of each design of a batch, for a loop.

    Raises
    ------
    ValueError
        As `recording` does.
    """
    every = result.physics.frequency_hz * np.ptp(frames_of(result).time[0, :2])
    count = round(1 / float(np.max(every)))
    kept = np.arange(len(frames_of(result).step))[-1 - count :]
    robots = [{**_robot(result, i, kept), "loops": True} for i in range(len(result))]
    return {**_clock(result, [0], np.arange(len(kept))), "settle_time": 0.0, "robots": robots}


def shared_moments(results: Iterable[Result], step: float) -> NDArray[np.float64]:
    """Return moments, s from the pump's start, at intervals of `step`, to the longest run's end."""
    settled = -max(result.physics.settle_time for result in results)
    end = max(frames_of(r).time.max() - r.physics.settle_time for r in results)
    return np.arange(round(settled / step), math.floor(end / step + 1e-6) + 1) * step


def frames_at(result: Result, moments: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the frames of a result nearest to moments, s from the pump's start."""
    time = frames_of(result).time[0]
    frames: NDArray[np.int64] = np.searchsorted(
        (time[1:] + time[:-1]) / 2, moments + result.physics.settle_time
    )
    return frames


def _clock(result: Result, places: list[int], kept: NDArray[np.int64]) -> dict[str, Any]:
    """Return the entries of a recording except its robots."""
    time_step, frequency = clock_of(result, places[0]) if places else (1.0, 1.0)
    step = frames_of(result).step
    every = int(step[1]) * int(kept[1] - kept[0]) if len(kept) > 1 else 1
    seconds = (len(kept) - 1) * every * time_step
    return {
        "format": FORMAT,
        "version": VERSION,
        "frames": len(kept),
        "seconds_per_frame": every * time_step,
        "settle_time": result.physics.settle_time,
        "frequency_hz": frequency,
        "cycles": (seconds - result.physics.settle_time) * frequency,
        "physics": result.physics.to_dict(),
        "style": looks(),
    }


def looks() -> dict[str, Any]:
    """Return camera, light and colours of the still pictures, ready for JSON."""
    constants = {
        name.lower(): value
        for name, value in {**vars(raster), **vars(rendering)}.items()
        if name.isupper() and isinstance(value, float | tuple)
    }
    return {**constants, "light": rendering.LIGHT.tolist()}


def checked_places(result: Result, designs: tuple[int, ...]) -> list[int]:
    """Return indices in the batch, by default all; ValueError if one is out of range."""
    for i in designs:
        if not 0 <= i < len(result):
            last = len(result) - 1
            raise ValueError(f"design {i} of the batch was asked for, which has 0 to {last}")
    return list(designs or range(len(result)))


def bytes_per_frame(designs: Iterable[Design]) -> int:
    """Return the characters per frame of a recording of some designs, rounded up.

    In base64: eight counts per voxel, and the centre.
    """
    return sum(22 * design.n_voxels + 16 for design in designs)


def name_of(design: Design) -> str:
    """Return the name of a design: number and digits; on other lattices shape and digits."""
    digits = design.digits
    if len(digits) > MOST_DIGITS:
        digits = f"{digits[: MOST_DIGITS - 3]}..."
    if design.shape == Lattice():
        phases = f" of {design.lattice.phases} phases" if design.lattice.phases > 1 else ""
        return f"{design.index}{phases} · {digits}"
    return f"{str(design.lattice).replace('x', '×')} · {digits}"  # noqa: RUF001


def labels(
    result: Result, i: int, *, world: str = "", design: Design | None = None
) -> tuple[str, str]:
    """Return the labels of a robot: name, fitness and cycles; shorter if there is little room.

    The name of a world comes first; the world may have refined the design.
    """
    design = design or result.design(i)
    name = name_of(design)
    short = name.split(" · ")[0 if design.lattice == Lattice() else 1]
    cycles = f"{np.broadcast_to(result.physics.cycles, len(result))[i]:.4g}"
    unit = "cycle" if cycles == "1" else "cycles"
    far = f"{result.fitness[i]:.2f}"
    ends = ("diverged",) * 2 if result.diverged[i] else (f"{far} in {cycles} {unit}", far)
    before = f"{world}: " if world else ""
    return f"{before}{name} · {ends[0]}", f"{before}{short} · {ends[1]}"


def clock_of(result: Result, i: int) -> tuple[float, float]:
    """Return the time step, s, and the frequency, Hz, of one design of a batch."""
    physics = result.physics
    step, frequency = (
        float(np.broadcast_to(value, len(result))[i])
        for value in (physics.time_step, physics.frequency_hz)
    )
    return step, frequency


def _robot(result: Result, i: int, frames: NDArray[np.int64]) -> dict[str, Any]:
    """Return the entry of a recording for one design of a batch at some frames, in order."""
    design, motion = result.design(i), Motion.of(result, i)
    position, quaternion, edge, *_ = motion
    shown = frames[frames <= motion.last].max(initial=frames[0])
    last = int(np.flatnonzero(frames == shown)[0])
    kept = np.minimum(frames[np.minimum(np.arange(len(frames)), last)], motion.last)
    centre = motion.centre[:, None]
    scale = max(float(np.abs(values).max(initial=1.0)) for values in (position - centre, edge))
    label, short_label = labels(result, i)

    def counts(values: NDArray[Any]) -> str:
        return _base64(np.rint(values[kept] * STEPS).astype("<i2"))

    return {
        "label": label,
        "short_label": short_label,
        "design": design.index if design.lattice == Lattice() else None,
        "digits": design.digits,
        "shape": list(design.lattice),
        "fitness": None if result.diverged[i] else float(result.fitness[i]),
        "last": last,
        "distance": fitting_distance(motion.pose(0)),
        "active": motion.built.active.astype(int).tolist(),
        "scale": scale,
        "centre": _base64(centre[kept].astype("<f4")),
        "position": counts((position - centre) / scale),
        "quaternion": counts(quaternion),
        "edge": counts(edge / scale),
    }


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")
