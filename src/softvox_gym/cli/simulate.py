"""softvox simulate: simulate one design."""

from __future__ import annotations

import io
import json
from argparse import Namespace
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from softvox_gym.cli.parser import add_physics, add_shape, add_threads, physics_of, whole_number
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.design import Design, written
from softvox_gym.design_files import is_design_file
from softvox_gym.files import check_file, write_file
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.lattice import Lattice
from softvox_gym.physics import Physics
from softvox_gym.simulation import Result, simulate

DESCRIPTION = """\
Simulate one design, and print its fitness (horizontal displacement of the
centre of mass in voxel widths, cm for the 1 cm voxel), its displacement, and
its track with a row per cycle of actuation.

DESIGN is one of
  a number   from 0 to 6560 on the 2x2x2 lattice
  digits     one per site (0 absent, 1 passive, 2 active), in the order
             x + nx (y + ny z): 00021222 is the design 6453
  a file     .json as written by Design.save, or VoxCad's .vxa
Other lattices (--shape) have other numbers and as many digits as sites.
"""

FRAMES_HELP = """\
also save every voxel's movement, as a numpy archive: step (k,), time (k,) in s, position
(k, nx, ny, nz, 3) in m, quaternion (k, nx, ny, nz, 4) as w x y z, edge (k, nx, ny, nz) in m,
digits (nx, ny, nz), physics (JSON)"""

FRAMES_PER_CYCLE = 50
MOST_CYCLES = 10**6

#: Bytes of a voxel in a frame: position, quaternion and edge.
FRAME_BYTES = 8 * 8
MOST_FRAME_BYTES = 2**30


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "simulate",
        help="simulate one design: fitness, displacement, track",
        description=DESCRIPTION,
        usage="softvox simulate DESIGN [--json] [--frames FILE.npz] [options]",
    )
    parser.add_argument("design", metavar="DESIGN", help="a number, digits or a file")
    add_shape(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument(
        "--check-step",
        action="store_true",
        help="also simulate at half the time step, and report the change of the fitness",
    )
    parser.add_argument("--frames", type=Path, metavar="FILE.npz", help=FRAMES_HELP)
    parser.add_argument(
        "--every",
        type=whole_number,
        metavar="STEPS",
        help=f"time steps between frames (default: about {FRAMES_PER_CYCLE} frames per cycle)",
    )
    parser.add_argument("--force", action="store_true", help="replace FILE.npz if it exists")
    add_threads(parser)
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check everything, simulate, save the frames, then print."""
    design = design_of(args.design, args.shape, args.phases)
    physics = physics_of(args)
    if not physics.cycles <= MOST_CYCLES:
        raise BadInputError(
            f"the track would have {physics.cycles:.3g} cycles, but at most {MOST_CYCLES} are "
            "possible; give a lower --frequency-hz or a shorter --duration"
        )
    if args.every and not args.frames:
        raise BadInputError("--every needs --frames FILE.npz; give that as well")
    every = 0
    if args.frames:
        with bad_input("--frames"):
            check_file(args.frames, force=args.force)
        steps_per_cycle = 1 / (float(physics.frequency_hz) * float(physics.time_step))
        every = args.every or max(1, round(steps_per_cycle / FRAMES_PER_CYCLE))
        _check_frames(design, physics, every)
    with bad_input():
        result = simulate(
            design,
            physics,
            track=1,
            frames=every,
            check_step=args.check_step,
            threads=args.threads,
        )
    if args.frames:
        with bad_input("--frames"):
            write_file(args.frames, frames_archive(result), force=args.force)
    print(as_json(result) if args.json else as_text(result))
    return 0


def design_of(text: str, shape: tuple[int, int, int], phases: int = 1) -> Design:
    """Return the design for a number, digits or a file; BadInputError for anything else.

    A file has its own lattice, which a shape or phases other than the default must match.
    """
    try:
        lattice = Lattice.of(shape, phases=phases)
    except ValueError as error:
        raise BadInputError(f"--{error}") from None
    if is_design_file(text):
        with bad_input("DESIGN"):
            design = Design.load(text)
        if lattice not in (Lattice(), design.lattice):
            raise BadInputError(
                f"{text} is on {design.lattice}, not {lattice}; drop --shape and --phases"
            )
        return design
    try:
        return written(text, lattice)
    except ValueError as error:
        raise BadInputError(
            f"{error}, for the lattice {lattice}; give --shape NX NY NZ for another lattice, and "
            "--phases P for digits above 2"
        ) from None


def _check_frames(design: Design, physics: Physics, every: int) -> None:
    count = physics.duration / physics.time_step / every
    size = count * len(design.digits) * FRAME_BYTES
    if size > MOST_FRAME_BYTES:
        raise BadInputError(
            f"{count:.3g} frames would take {size / 2**30:.3g} GiB, but at most "
            f"{MOST_FRAME_BYTES / 2**30:g} GiB are allowed; give a larger --every than {every}"
        )


def frames_archive(result: Result) -> bytes:
    """Return the frames of a single design as the bytes of a numpy archive."""
    assert result.frames is not None
    arrays = vars(result.frames)
    arrays = {name: values if name == "step" else values[0] for name, values in arrays.items()}
    physics = np.array(json.dumps(result.physics.to_dict()))
    archive = io.BytesIO()
    np.savez_compressed(archive, **arrays, digits=result.designs[0], physics=physics)
    return archive.getvalue()


def track(result: Result) -> Section:
    """Return the track of the centre of mass, in voxel widths from the start of actuation."""
    assert result.track is not None
    begin, period = result.physics.settle_time, 1 / float(result.physics.frequency_hz)
    return Section(
        columns=(
            Column("cycle", "cycle"),
            Column("time", "time s", ".4f"),
            *(Column(axis, axis, ".6f") for axis in "xyz"),
        ),
        rows=[
            (cycle, begin + cycle * period, *map(_finite, point))
            for cycle, point in enumerate(result.track[0].tolist())
        ],
    )


def as_text(result: Result) -> str:
    """Return the result as text."""
    design = result.design(0)
    dx, dy, dz = result.displacement[0]
    error = result.step_error
    checked = "" if error is None else f"\nstep error    {error[0]:.6f} voxel widths"
    return f"""\
design        {"-" if (number := _number(design)) is None else number}
digits        {design.digits}
shape         {" x ".join(map(str, design.shape))}
voxels        {design.n_voxels}, {design.n_active} active
diverged      {"yes" if result.diverged[0] else "no"}
fitness       {result.fitness[0]:.6f} voxel widths{checked}
displacement  {dx:.6f} {dy:.6f} {dz:.6f}

{track(result).text()}"""


def as_json(result: Result) -> str:
    """Return the result as JSON; null if the design diverged."""
    design = result.design(0)
    data = {
        "design": _number(design),
        "digits": design.digits,
        "shape": design.shape,
        "n_voxels": design.n_voxels,
        "n_active": design.n_active,
        "diverged": bool(result.diverged[0]),
        "fitness": _finite(float(result.fitness[0])),
        "displacement": [_finite(value) for value in result.displacement[0].tolist()],
        "steps": int(result.steps[0]),
        "step_error": None if result.step_error is None else _finite(float(result.step_error[0])),
        "track": track(result).records(),
        "physics": result.physics.to_dict(),
    }
    return json.dumps(data, indent=2, allow_nan=False)


def _number(design: Design) -> int | None:
    """Return a design's number; None on a large lattice, where it would have hundreds of digits."""
    return design.index if design.lattice.has_int64_numbers else None


def _finite(value: float) -> float | None:
    return value if isfinite(value) else None
