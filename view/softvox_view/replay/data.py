"""Recordings: the frames of some designs in a compact form that JSON can carry.

A recording counts every value in 65535 steps between the least and the greatest of its kind, two
bytes each, positions from the robot's middle at that moment, however far it has gone. A step is
less than 1e-4 of a voxel width, which no screen shows.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import rendering
from softvox_gym.design import ABSENT, ACTIVE, Design
from softvox_gym.lattice import Lattice
from softvox_gym.rendering import Pose, fitting_distance
from softvox_gym.simulation import Frames, Result

FORMAT, VERSION = "softvox-replay", 1

STEPS = 2**16 - 1

#: Colour of the path that the centre of mass has taken: neither cyan nor red, and dark.
TRAIL = (0.36, 0.20, 0.52)

#: Digits that a label shows of a design's; beyond them the lattice says enough.
MOST_DIGITS = 27


def recording(result: Result, *designs: int, stride: int = 1) -> dict[str, Any]:
    """Return the recording of some designs of a batch.

    Parameters
    ----------
    result : Result
        Of `simulate(..., frames=every)`.
    *designs : int
        Their places in the batch, 0 for the first; all where none is given.
    stride : int
        Keep every so-manieth frame.

    Returns
    -------
    dict
        Plain numbers, strings, lists and dicts, ready for `json.dumps` and for the player. Lengths
        are voxel widths. ``frames`` counts the frames, ``seconds_per_frame`` is their distance,
        ``cycles`` those of actuation up to the last. Each of ``robots`` has the arrays ``position``
        (frames, voxels, 3; from the centre), ``quaternion`` (frames, voxels, 4; w, x, y, z) and
        ``edge`` (frames, voxels) as ``{"data", "offset", "scale"}``: data is base64 of
        little-endian 16-bit counts c, and a value is offset + scale c, component by component.
        ``centre`` (frames, 3) is the centre of mass, base64 of little-endian 32-bit floats. Where
        a run ends or diverges before the others, its last pose stays; ``last`` is that frame.

    Raises
    ------
    ValueError
        Where the result has no frames, the designs do not share one clock, or a place or the
        stride is out of range.
    """
    frames = frames_of(result)
    places = checked_places(result, designs)
    if stride < 1:
        raise ValueError(f"stride must be at least 1, got {stride}")
    time_step, frequency = _shared_clock(result, places)
    kept = slice(None, None, stride)
    count = len(frames.step[kept])
    every = int(frames.step[1]) * stride if len(frames.step) > 1 else 1
    physics = result.physics
    seconds = (count - 1) * every * time_step
    return {
        "format": FORMAT,
        "version": VERSION,
        "frames": count,
        "seconds_per_frame": every * time_step,
        "settle_time": physics.settle_time,
        "frequency_hz": frequency,
        "cycles": (seconds - physics.settle_time) * frequency,
        "physics": physics.to_dict(),
        "style": appearance(),
        "robots": [_robot(result, i, kept) for i in places],
    }


def frames_of(result: Result) -> Frames:
    """Return the frames of a result; ValueError where it has none."""
    if result.frames is None:
        raise ValueError("the result has no frames; simulate(..., frames=20) keeps every 20th step")
    return result.frames


def checked_places(result: Result, designs: tuple[int, ...]) -> list[int]:
    """Return places in the batch, all where none is given; ValueError for one outside it."""
    for i in designs:
        if not 0 <= i < len(result):
            last = len(result) - 1
            raise ValueError(f"design {i} of the batch was asked for, which has 0 to {last}")
    return list(designs or range(len(result)))


def pose(result: Result, i: int, frame: int) -> Pose:
    """Return one design of a batch at one moment.

    Its place in the batch and the frame count from 0; past the last frame that the design has, that
    one is taken. In voxel widths, the voxels in the order of their sites.

    Raises
    ------
    ValueError
        Where the result has no frames, or the place or the frame is out of range.
    """
    checked_places(result, (i,))
    if frame < 0:
        raise ValueError(f"frame must be at least 0, got {frame}")
    # Of a run that is whole one frame will do; looking for the last one of another takes them all.
    position, quaternion, edge, active = _movement(result, i, slice(frame, frame + 1))
    if not len(edge):
        position, quaternion, edge, active = _movement(result, i, slice(0, frame + 1))
    return Pose(position[-1], quaternion[-1], edge[-1], active)


def rest_pose(digits: NDArray[np.uint8]) -> Pose:
    """Return a design, an array of digits indexed [x, y, z], as it is built.

    Its voxels come in the order of their sites.
    """
    site = np.argwhere(digits.T != ABSENT)[:, ::-1]
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(site), 1))
    return Pose(site + 0.5, upright, np.ones(len(site)), digits[tuple(site.T)] == ACTIVE)


def bytes_per_frame(designs: Iterable[Design]) -> int:
    """Return how many characters a recording of some designs takes per frame, rounded up.

    In base64: eight counts per voxel, and the centre.
    """
    return sum(22 * design.n_voxels + 16 for design in designs)


def name_of(design: Design, *, short: bool = False) -> str:
    """Return what a design is called: number and digits; on other lattices shape and digits."""
    digits = design.digits
    if len(digits) > MOST_DIGITS:
        digits = f"{digits[: MOST_DIGITS - 3]}..."
    if design.lattice == Lattice():
        return str(design.index) if short else f"{design.index} · {digits}"
    return digits if short else f"{str(design.lattice).replace('x', '×')} · {digits}"  # noqa: RUF001


def label(result: Result, i: int) -> str:
    """Return what stands beside a robot: its name and fitness, and in how many cycles."""
    ending = short_label(result, i).rpartition(" · ")[2]
    if not result.diverged[i]:
        cycles = float(np.broadcast_to(result.physics.cycles, len(result))[i])
        ending += f" in {cycles:.4g} cycles"
    return f"{name_of(result.design(i))} · {ending}"


def short_label(result: Result, i: int) -> str:
    """Return what stands beside a robot where there is little room: its name and fitness."""
    name = name_of(result.design(i), short=True)
    return f"{name} · {'diverged' if result.diverged[i] else f'{result.fitness[i]:.2f}'}"


def appearance() -> dict[str, Any]:
    """Return camera, light and colours of the still pictures, for the player."""
    constants = {
        name.lower(): value
        for name, value in vars(rendering).items()
        if name.isupper() and isinstance(value, float | tuple)
    }
    return {**constants, "light": rendering.LIGHT.tolist(), "trail": TRAIL}


def clock_of(result: Result, i: int) -> tuple[float, float]:
    """Return the time step, s, and the frequency, Hz, of one design of a batch."""
    physics = result.physics
    step, frequency = (
        float(np.broadcast_to(value, len(result))[i])
        for value in (physics.time_step, physics.frequency_hz)
    )
    return step, frequency


def _shared_clock(result: Result, places: list[int]) -> tuple[float, float]:
    clocks = {clock_of(result, i) for i in places}
    if len(clocks) > 1:
        given = ", ".join(f"({step:.4g} s, {frequency:g} Hz)" for step, frequency in sorted(clocks))
        raise ValueError(
            f"the designs of one recording must share time step and frequency, got {given}; "
            "record them one by one"
        )
    return next(iter(clocks), (1.0, 1.0))


def _movement(result: Result, i: int, asked: slice = slice(None)) -> tuple[NDArray[Any], ...]:
    """Return position, quaternion and edge of a design's voxels, and which are active.

    Only the frames asked for that it has up to the first that it lacks, in voxel widths; as it is
    built where that is frame 0.
    """
    frames = frames_of(result)
    digits = result.designs[i].ravel(order="F")
    present = digits != ABSENT

    def by_site(values: NDArray[Any]) -> NDArray[Any]:
        swapped = values[i, asked].swapaxes(1, 3)  # [x, y, z] to the order of the sites
        rows: NDArray[Any] = swapped.reshape(len(swapped), len(digits), *values.shape[5:])
        return rows[:, present]

    position, quaternion, edge = map(by_site, (frames.position, frames.quaternion, frames.edge))
    active, width = digits[present] == ACTIVE, result.physics.edge
    finite = np.isfinite(position).all(axis=(1, 2)) & np.isfinite(edge).all(axis=1)
    if not asked.start and not finite[0]:
        built = rest_pose(result.designs[i])
        return built.position[None], built.quaternion[None], built.edge[None], active
    ends = len(finite) if finite.all() else int(np.argmin(finite))
    return position[:ends] / width, quaternion[:ends], edge[:ends] / width, active


def _robot(result: Result, i: int, kept: slice) -> dict[str, Any]:
    design = result.design(i)
    position, quaternion, edge, active = _movement(result, i)
    last = len(range(len(edge))[kept]) - 1
    count = len(frames_of(result).step[kept])
    rest = Pose(position[0], quaternion[0], edge[0], active)

    def whole(values: NDArray[Any]) -> NDArray[Any]:
        """Return the frames kept, the last one held to the end."""
        held: NDArray[Any] = values[kept][np.minimum(np.arange(count), last)]
        return held

    centre = position.mean(axis=1, keepdims=True) if len(active) else np.zeros((len(edge), 1, 3))
    return {
        "label": label(result, i),
        "short_label": short_label(result, i),
        "design": design.index if design.lattice == Lattice() else None,
        "digits": design.digits,
        "shape": list(design.shape),
        "n_voxels": design.n_voxels,
        "n_active": design.n_active,
        "diverged": bool(result.diverged[i]),
        "fitness": _finite(float(result.fitness[i])),
        "displacement": [_finite(value) for value in result.displacement[i].tolist()],
        "last": last,
        "distance": fitting_distance(rest),
        "active": active.astype(int).tolist(),
        "centre": _base64(whole(centre).astype("<f4")),
        "position": counts(whole(position - centre)),
        "quaternion": counts(whole(quaternion)),
        "edge": counts(whole(edge)[..., np.newaxis]),
    }


def counts(values: NDArray[Any]) -> dict[str, Any]:
    """Return an array as 16-bit counts, component (last axis) by component.

    A value is offset + scale times its count, wrong by half a scale at most.
    """
    flat = values.reshape(-1, values.shape[-1])
    low = flat.min(axis=0, initial=np.inf) if len(flat) else np.zeros(values.shape[-1])
    high = flat.max(axis=0, initial=-np.inf) if len(flat) else low
    scale = (high - low) / STEPS
    steps = np.where(scale > 0, scale, 1.0)
    count = np.rint((flat - low) / steps).astype("<u2")
    return {"data": _base64(count), "offset": low.tolist(), "scale": scale.tolist()}


def _base64(values: NDArray[Any]) -> str:
    return base64.b64encode(values.tobytes()).decode("ascii")


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
