"""Simulation of a batch: from designs and a physics to a result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import prod
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym import engine
from softvox_gym.design import ACTIVE, Design, as_html, batch_of
from softvox_gym.lattice import Lattice
from softvox_gym.physics import MOST, Physics


@dataclass(frozen=True, eq=False)
class Frames:
    """Every voxel of every design at the beginning of every few steps.

    NaN where a voxel is absent or the run has ended.

    Parameters
    ----------
    step : ndarray of int, shape (k,)
    time : ndarray, shape (n, k)
        Seconds.
    position : ndarray, shape (n, k, nx, ny, nz, 3)
        Metres, centres of the voxels.
    quaternion : ndarray, shape (n, k, nx, ny, nz, 4)
        w, x, y, z.
    edge : ndarray, shape (n, k, nx, ny, nz)
        Metres.
    """

    step: NDArray[np.int64]
    time: NDArray[np.float64]
    position: NDArray[np.float64]
    quaternion: NDArray[np.float64]
    edge: NDArray[np.float64]


@dataclass(frozen=True, eq=False, repr=False)
class Result:
    """The results of a simulated batch of designs.

    Parameters
    ----------
    designs : ndarray of uint8, shape (n, nx, ny, nz)
        The digits that were simulated.
    physics : Physics
    diverged : ndarray of bool, shape (n,)
    displacement : ndarray, shape (n, 3)
        dx, dy, dz of the centre of mass in voxel widths (cm for the paper's 1 cm voxel), from the
        end of settling to the end of the run; NaN if the design diverged, 0 for the empty design.
    start, end : ndarray, shape (n, 3)
        Centre of mass, in voxel widths; NaN if the design diverged or is empty.
    steps : ndarray of int32, shape (n,)
        Time steps taken.
    track : ndarray, shape (n, samples, 3), or None
        The centre of mass in voxel widths from its start, sampled `track` times per cycle, start
        included; the end too, unless it lies between two samples. NaN after the end of a run with
        fewer cycles than another in the batch.
    frames : Frames or None
    step_error : ndarray, shape (n,), or None
        Change of the fitness at half the time step, voxel widths; NaN if a design diverges at
        either. None without `check_step`.
    energy : ndarray, shape (n,), or None
        The pump's work on the links in the whole run, J (docs/physics.md, section 12); NaN if the
        design diverged, 0 for the empty design. None if not requested.
    phased : (ndarray, Lattice) or None
        The designs as given, and their lattice, if that has several phases.
    """

    designs: NDArray[np.uint8]
    physics: Physics
    diverged: NDArray[np.bool_]
    displacement: NDArray[np.float64]
    start: NDArray[np.float64]
    end: NDArray[np.float64]
    steps: NDArray[np.int32]
    track: NDArray[np.float64] | None
    frames: Frames | None
    step_error: NDArray[np.float64] | None = None
    energy: NDArray[np.float64] | None = None
    phased: tuple[NDArray[np.uint8], Lattice] | None = None

    def __len__(self) -> int:
        return len(self.designs)

    def __repr__(self) -> str:
        diverged = int(np.count_nonzero(self.diverged))
        best = float(np.nanmax(self.fitness)) if diverged < len(self) else float("nan")
        lattice = Lattice(*self.designs.shape[1:])
        return f"Result({len(self)} designs on {lattice}, {diverged} diverged, best {best:.2f})"

    def _repr_html_(self) -> str | None:
        """Return what a notebook shows: the fittest designs, moving if there are frames."""
        return as_html(self)

    @cached_property
    def fitness(self) -> NDArray[np.float64]:
        """Horizontal travel sqrt(dx^2 + dy^2) in voxel widths, shape (n,); NaN where diverged."""
        return np.asarray(np.sqrt(self.displacement[:, 0] ** 2 + self.displacement[:, 1] ** 2))

    def design(self, i: int) -> Design:
        """Return the i-th design of the batch, with its phases if it has any."""
        if self.phased is not None:
            digits, lattice = self.phased
            return Design(digits[i], shape=lattice)
        return Design(self.designs[i])

    def of(self, designs: NDArray[np.uint8], lattice: Lattice) -> Result:
        """Return the result with the designs as given; with one phase, unchanged."""
        return self if lattice.phases == 1 else replace(self, phased=(designs, lattice))


def simulate(
    designs: Any,
    physics: Physics | None = None,
    *,
    strain: ArrayLike | None = None,
    phase: ArrayLike | None = None,
    track: int = 0,
    frames: int = 0,
    energy: bool = False,
    check_step: bool = False,
    threads: int | None = None,
    isa: str | None = None,
    progress: engine.Progress | None = None,
) -> Result:
    """Simulate a batch of designs.

    The result of a design depends only on the design and its parameters, to the last bit: not on
    the batch, its order, the number of threads, the instruction set or the machine.

    Parameters
    ----------
    designs : Design, int, str, sequence of these, or ndarray
        One design or a batch on one lattice: an (n,) array of numbers or (n, 8) array of digits for
        the 2x2x2 lattice, or an (n, nx, ny, nz) array of digits indexed [x, y, z]. The phases of a
        `Design` of several phases are added to `phase`.
    physics : Physics, optional
        Its arrays hold one value per design. By default `Physics.published()`.
    strain : array_like, shape (n, nx, ny, nz) or (n, cycles, nx, ny, nz), optional
        Amplitude of every voxel instead of `physics.strain`, constant or cycle by cycle from the
        first after settling; a run with more cycles keeps the last. A cycle ends when frequency
        times time plus the voxel's phase is whole. Passive voxels ignore it. A design with an
        amplitude that is not finite is marked as diverged.
    phase : array_like, shape (n, nx, ny, nz), optional
        Phase of every voxel's actuation in cycles, 0 by default. Passive voxels ignore it, and a
        design with a phase that is not finite is marked as diverged.
    track : int
        Samples of the centre of mass per actuation cycle; 0 for none.
    frames : int
        Steps between full frames; 0 for none.
    energy : bool
        Measure the pump's work, for `Result.energy`.
    check_step : bool
        Also simulate at half the time step, for `Result.step_error`; takes three times as long.
    threads : int, optional
        At most this many; by default all processors available to the process.
    isa : str, optional
        Instruction set, one of `softvox_gym.engine.isa_names()`; by default the widest.
    progress : callable (done, total), optional
        Called from time to time with the number of finished designs.

    Returns
    -------
    Result

    Raises
    ------
    TypeError, ValueError
        If a design, array or option does not fit; the message names the argument.

    Examples
    --------
    >>> result = simulate([6453, "20002221"])
    >>> [f"{fitness:.2f}" for fitness in result.fitness]
    ['4.66', '4.65']
    """
    given, lattice = batch_of(designs)
    designs, phase = pumped(given, phase, shape=lattice)
    stack, physics, batch = prepared(designs, physics, strain, phase, track=track, frames=frames)
    batch = replace(batch, energy=bool(energy))
    check_flag("energy", energy)
    check_flag("check_step", check_step)
    check_threads(threads)
    if progress is not None and not callable(progress):
        raise TypeError(f"progress must be a callable (done, total), got {progress!r}")
    output = engine.run(batch, threads=threads, isa=isa, progress=progress)
    result = _result(stack, physics, batch, output).of(given, lattice)
    if not check_step:
        return result
    fine = simulate(
        stack,
        replace(physics, time_step_fraction=np.asarray(physics.time_step_fraction) / 2),
        strain=strain,
        phase=phase,
        threads=threads,
        isa=isa,
        progress=progress,
    )
    return replace(result, step_error=np.abs(fine.fitness - result.fitness))


def prepared(
    designs: Any,
    physics: Physics | None,
    strain: ArrayLike | None,
    phase: ArrayLike | None,
    *,
    track: int = 0,
    frames: int = 0,
) -> tuple[NDArray[np.uint8], Physics, engine.Batch]:
    """Return the digits (n, nx, ny, nz), the physics and the batch for some arguments.

    Raises TypeError and ValueError as `simulate` does.
    """
    physics = Physics.published() if physics is None else physics
    if not isinstance(physics, Physics):
        raise TypeError(
            f"physics must be a Physics, got {type(physics).__name__}; Physics.of(...) makes one "
            "from a preset's name or a dict"
        )
    stack, phase = pumped(designs, phase)
    check_count("track", track, least=0)
    check_count("frames", frames, least=0)
    n = len(stack)
    if physics.n_designs not in (None, n):
        raise ValueError(f"physics has arrays for {physics.n_designs} designs, but there are {n}")
    lattice = Lattice(*stack.shape[1:])
    batch = engine.Batch(
        shape=lattice,
        digits=lattice.to_rows(stack),
        parameters=_parameters(physics, n),
        strain=strain_rows(strain, physics, stack),
        phase=None if phase is None else phase_rows(phase, stack),
        edge=physics.edge,
        pumped_rest=physics.pumped_rest,
        settle_time=physics.settle_time,
        actuation=physics.actuation,
        track_per_cycle=int(track),
        track_samples=sample_count(physics, int(track)),
        frame_every=int(frames),
        frame_count=_frame_count(physics, int(frames)),
    )
    return stack, physics, batch


def pumped(
    designs: Any, phase: ArrayLike | None, *, shape: Sequence[int] | None = None
) -> tuple[NDArray[np.uint8], ArrayLike | None]:
    """Return designs as the digits 0, 1, 2, shape (n, nx, ny, nz), and the phase of their voxels.

    The designs' own phases are added to the given ones. Raises as `stack_of` does.
    """
    stack, lattice = batch_of(designs, shape=shape)
    kinds, own = lattice.pumped(stack)
    if own is None or phase is None:
        return kinds, phase if own is None else own
    return kinds, own + _per_voxel("phase", phase, stack)


def check_threads(threads: int | None) -> None:
    """Check that a number of threads is a count or None; raises as `check_count` does."""
    if threads is not None:
        check_count("threads", threads, least=1)


def check_count(name: str, value: Any, *, least: int, most: int = MOST) -> None:
    """Check that an argument is a whole number within bounds, by default those of the engine.

    Raises
    ------
    TypeError, ValueError
        If it is not; the message names the argument.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
        raise TypeError(f"{name} must be a whole number, got {value!r}")
    if not least <= value <= most:
        raise ValueError(f"{name} must be at least {least} and at most {most}, got {value}")


def check_number(name: str, value: Any) -> float:
    """Return an argument that is a number as a float; NaN and infinity are.

    Raises
    ------
    TypeError, ValueError
        If it is not a number, or is too large for a float; the message names the argument.
    """
    numbers = (int, float, np.integer, np.floating)
    if isinstance(value, (bool, np.bool_)) or not isinstance(value, numbers):
        raise TypeError(f"{name} must be a number, got {value!r}")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{name} must be a number within the range of a float") from None


def check_flag(name: str, value: Any) -> None:
    """Check that an argument is True or False; otherwise TypeError that names it."""
    if not isinstance(value, (bool, np.bool_)):
        raise TypeError(f"{name} must be True or False, got {value!r}")


def spaced(steps: int, count: int) -> int:
    """Return the steps between frames for about `count` frames, the last close to the end."""
    least = max(1, steps // count)
    return min(range(least, least + 1 + least // 4), key=lambda every: steps % every)


def _per_voxel(
    name: str, values: ArrayLike, stack: NDArray[np.uint8], *, by_cycle: bool = False
) -> NDArray[np.float64]:
    """Return values as float64 of the stack's shape, possibly with cycles as second axis."""
    try:
        array = np.asarray(values)
    except ValueError:
        raise ValueError(f"{name} must be an array of numbers of shape {stack.shape}") from None
    if array.dtype.kind not in "iuf":
        raise TypeError(f"{name} must be an array of numbers, got {array.dtype} values")
    if array.shape != stack.shape:
        n, *sites = array.shape or (0,)
        if not (by_cycle and array.ndim == 5) or (n, *sites[1:]) != stack.shape or sites[0] < 1:
            n, nx, ny, nz = stack.shape
            also = f" or ({n}, cycles, {nx}, {ny}, {nz})" if by_cycle else ""
            raise ValueError(
                f"{name} must have shape {stack.shape}{also} for these designs, got {array.shape}"
            )
    return array.astype(np.float64)


def phase_rows(phase: ArrayLike, stack: NDArray[np.uint8]) -> NDArray[np.float64]:
    """Return phases (n, nx, ny, nz) in the order of sites; raises as `simulate` does."""
    return Lattice(*stack.shape[1:]).to_rows(_per_voxel("phase", phase, stack))


def strain_rows(
    values: ArrayLike | None,
    physics: Physics,
    stack: NDArray[np.uint8],
    *,
    by_cycle: bool = True,
) -> NDArray[np.float64]:
    """Return strain by cycle, (n, cycles, sites) in order of sites; raises as `simulate` does."""
    n, sites = len(stack), prod(stack.shape[1:])
    if values is None:
        amplitude = np.broadcast_to(np.asarray(physics.strain), n).reshape(n, 1, 1)
        return np.repeat(amplitude, sites, axis=2)
    array = _per_voxel("strain", values, stack, by_cycle=by_cycle)
    if array.ndim == 4:
        array = array[:, np.newaxis]
    used = array[np.broadcast_to((stack == ACTIVE)[:, np.newaxis], array.shape)]
    if np.any(used <= -1) or (physics.actuation == "expand_and_contract" and np.any(used >= 1)):
        raise ValueError(
            "strain must be above -1, and below 1 if voxels expand and contract: an edge can't "
            "shrink to nothing"
        )
    return Lattice(*stack.shape[1:]).to_rows(array)


def _parameters(physics: Physics, n: int) -> NDArray[Any]:
    parameters = np.empty(n, dtype=engine.PARAMETERS)
    for name in engine.PARAMETERS.names or ():
        value = physics.gravity_vector if name == "gravity" else getattr(physics, name)
        parameters[name] = value
    return parameters


def sample_count(physics: Physics, per_cycle: int) -> int:
    """Return how many samples the longest track of a batch has."""
    if per_cycle == 0:
        return 0
    cycles = np.max(np.asarray(physics.cycles), initial=0.0)
    samples = engine.track_samples(float(cycles), per_cycle)
    if samples > MOST:
        raise ValueError(
            f"track={per_cycle} needs {samples:.3g} samples, but at most {MOST} are possible"
        )
    return int(samples)


def _frame_count(physics: Physics, every: int) -> int:
    """Return how many frames the longest run of a batch has."""
    if every == 0:
        return 0
    steps, durations = np.broadcast_arrays(physics.time_step, physics.duration)
    runs = np.unique(np.stack([steps.ravel(), durations.ravel()], axis=1), axis=0)
    longest = max((engine.step_count(step, duration) for step, duration in runs), default=0)
    return longest // every + 1


def _result(
    stack: NDArray[np.uint8], physics: Physics, batch: engine.Batch, output: engine.Output
) -> Result:
    empty = ~stack.any(axis=(1, 2, 3))
    displacement = (output.end - output.start) / physics.edge
    displacement[empty] = 0.0
    with np.errstate(over="ignore"):  # the square of a finite displacement may overflow
        has_fitness = np.isfinite(displacement[:, 0] ** 2 + displacement[:, 1] ** 2)
    diverged = (output.status != 0) | ~has_fitness
    displacement[diverged] = np.nan
    output.track[empty] = output.energy[empty] = 0.0
    output.energy[diverged] = np.nan
    for values in (output.start, output.end, output.track):
        values[diverged] = np.nan
        values /= physics.edge
    return Result(
        designs=stack,
        physics=physics,
        diverged=diverged,
        displacement=displacement,
        start=output.start,
        end=output.end,
        steps=output.steps,
        track=output.track if batch.track_per_cycle else None,
        frames=_frames(batch, output) if batch.frame_every else None,
        energy=output.energy if batch.energy else None,
    )


def _frames(batch: engine.Batch, output: engine.Output) -> Frames:
    # (n, k, sites, 8): the sites last, split, and the eight values last again.
    values = np.moveaxis(Lattice(*batch.shape).to_stack(np.moveaxis(output.frames, 2, -1)), 2, -1)
    step = np.arange(batch.frame_count) * batch.frame_every
    return Frames(
        step=step,
        time=np.multiply.outer(batch.parameters["time_step"], step),
        position=values[..., :3],
        quaternion=values[..., 3:7],
        edge=values[..., 7],
    )
