"""A simulation that can pause: advanced in pieces, inspected, steered, saved and continued."""

from __future__ import annotations

import hashlib
import io
import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym import engine
from softvox_gym.lattice import Lattice
from softvox_gym.manifest import engine_probe
from softvox_gym.physics import MOST, Physics
from softvox_gym.simulation import (
    check_count,
    check_number,
    check_threads,
    phase_rows,
    prepared,
    strain_rows,
)

#: How a saved simulation begins; another format has another number.
MAGIC = b"softvox simulation 1\n"

#: Cycles from which a double can no longer represent fractions of a turn.
MOST_TURNS = 2.0**50

# Columns of the clock, as softvox.h has them.
_TIME, _STEP, _MEASURING, _ENDED, _TORN = 0, 1, 3, 4, 5
_START, _CENTRE = slice(7, 10), slice(10, 13)

# The parts of `engine.Output` that a run without track and frames has.
_RESULTS = ("status", "steps", "start", "end")


@dataclass(frozen=True, eq=False)
class State:
    """Positions and velocities of all voxels; NaN where a site is empty.

    Parameters
    ----------
    time : ndarray, shape (n,)
        Seconds.
    step : ndarray of int, shape (n,)
        Steps taken.
    centre : ndarray, shape (n, 3)
        Metres, centre of mass: the mean position of the voxels.
    position, velocity : ndarray, shape (n, nx, ny, nz, 3)
        m and m/s, of the centres of the voxels.
    orientation : ndarray, shape (n, nx, ny, nz, 4)
        Unit quaternions w, x, y, z.
    spin : ndarray, shape (n, nx, ny, nz, 3)
        rad/s.
    edge : ndarray, shape (n, nx, ny, nz)
        Metres.
    """

    time: NDArray[np.float64]
    step: NDArray[np.int64]
    centre: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    orientation: NDArray[np.float64]
    spin: NDArray[np.float64]
    edge: NDArray[np.float64]

    @property
    def on_floor(self) -> NDArray[np.bool_]:
        """Whether a voxel touches the floor, shape (n, nx, ny, nz); False without a voxel."""
        return np.asarray(self.position[..., 2] < 0.5 * self.edge)

    @property
    def relative_position(self) -> NDArray[np.float64]:
        """Position relative to the centre of mass, m, shape (n, nx, ny, nz, 3)."""
        return np.asarray(self.position - self.centre[:, np.newaxis, np.newaxis, np.newaxis])

    @property
    def relative_velocity(self) -> NDArray[np.float64]:
        """Velocity minus the mean velocity of the body, m/s, shape (n, nx, ny, nz, 3)."""
        there = np.isfinite(self.edge)[..., np.newaxis]
        total = np.sum(self.velocity, axis=(1, 2, 3), where=there, keepdims=True)
        voxels = np.maximum(np.sum(there, axis=(1, 2, 3), keepdims=True), 1)
        return np.asarray(self.velocity - total / voxels)


class Simulation:
    """A batch of designs that you simulate piece by piece.

    However it is divided into pieces, and on any machine, it gives the bits of one run of
    `simulate`. Strain and phase may change between pieces, so that a controller can steer. You can
    save it as bytes or pickle it, also to copy it, and continue it elsewhere.

    Parameters
    ----------
    designs, physics, strain, phase, threads, isa
        As in `simulate`.

    Raises
    ------
    TypeError, ValueError
        As `simulate` does.

    Examples
    --------
    >>> sim = Simulation(6453)
    >>> sim.advance(cycles=1)  # settles, and pumps once
    >>> half = sim.restore(sim.save())
    >>> sim.advance(cycles=1, strain=np.zeros((1, 2, 2, 2)))  # rests
    >>> half.advance(until=np.inf)  # pumps to the end
    >>> print(half.fitness.round(2))
    [4.66]
    """

    def __init__(
        self,
        designs: Any,
        physics: Physics | None = None,
        *,
        strain: ArrayLike | None = None,
        phase: ArrayLike | None = None,
        threads: int | None = None,
        isa: str | None = None,
    ) -> None:
        check_threads(threads)
        self.designs, self.physics, self._batch = prepared(designs, physics, strain, phase)
        self._start(threads, isa)

    def _start(self, threads: int | None, isa: str | None) -> None:
        n = len(self)
        self.designs = self.designs.copy()  # private copies for the engine to read
        self.designs.setflags(write=False)
        if self._batch.phase is None:
            zeros = np.zeros(self._batch.digits.shape)
            self._batch = engine.Batch(**{**vars(self._batch), "phase": zeros})
        self._threads, self._isa, self._steered = threads, isa, False
        self._run = engine.PausedRun(self._batch, threads=threads, isa=isa)
        # Where counting of each design's whole cycles began, s, and how many have passed.
        self._counted_from = np.full(n, float(self.physics.settle_time))
        self._cycles = np.zeros(n)

    def __len__(self) -> int:
        return len(self.designs)

    def __repr__(self) -> str:
        at = np.nanmax(self._clock[:, _TIME], initial=0.0)
        ended = int(np.count_nonzero(self.ended))
        lattice = Lattice(*self.designs.shape[1:])
        return f"Simulation({len(self)} designs on {lattice}, at {at:.3f} s, {ended} ended)"

    def advance(
        self,
        *,
        cycles: float | None = None,
        steps: int | None = None,
        until: float | None = None,
        strain: ArrayLike | None = None,
        phase: ArrayLike | None = None,
    ) -> None:
        """Advance by some cycles or steps, or to a time, at most to the end.

        Parameters
        ----------
        cycles : float
            Each design stops at the first step after this many more of its own cycles. They are
            counted from the end of settling, without drift, as long as all pieces are given in
            cycles; the first piece includes settling.
        steps : int
            Time steps.
        until : float
            Time, s: each design stops at its first step after it. Infinity is the end.
        strain : array_like, shape (n, nx, ny, nz), optional
            New amplitude of every voxel from now on; unchanged by default.
        phase : array_like, shape (n, nx, ny, nz), optional
            New phase of every voxel in cycles from now on; unchanged by default.

        Raises
        ------
        TypeError, ValueError
            If not exactly one of cycles, steps and until is given, or its value is invalid; for
            strain and phase as `simulate` does.
        """
        given = {"cycles": cycles, "steps": steps, "until": until}
        if sum(value is not None for value in given.values()) != 1:
            raise TypeError("advance takes exactly one of cycles, steps and until")
        if steps is not None:
            check_count("steps", steps, least=0)
        if cycles is not None:
            _check_time("cycles", cycles)
        if until is not None:
            _check_time("until", until)
        new_strain = (
            None
            if strain is None
            else strain_rows(strain, self.physics, self.designs, by_cycle=False)
        )
        new_phase = None if phase is None else phase_rows(phase, self.designs)
        if new_phase is not None and not np.all(np.abs(new_phase) < MOST_TURNS):
            raise ValueError(f"phase must be finite and below {MOST_TURNS:.3g} cycles")
        if new_strain is not None:
            self._batch.strain[:] = new_strain
        if new_phase is not None and self._batch.phase is not None:
            self._batch.phase[:] = new_phase
        self._steered = self._steered or new_strain is not None or new_phase is not None
        if self._steered:
            self._run.steer()
        goal = self._end_of(cycles) if cycles is not None else until
        if goal is None:
            self._run.advance(None, MOST if steps is None else int(steps))
            return
        times = np.broadcast_to(np.float64(goal), len(self)).copy()
        step, end = (self._batch.parameters[name] for name in ("time_step", "duration"))
        left = (np.minimum(times, end) - self._clock[:, _TIME]) / step
        self._run.advance(times, MOST, about=float(np.nanmax(left, initial=0.0)) + 1)

    def _end_of(self, cycles: float) -> NDArray[np.float64]:
        """Return when this many more cycles end, for each design."""
        frequency = self._batch.parameters["frequency_hz"]
        time = self._clock[:, _TIME]
        asked = self._counted_from + self._cycles / frequency
        # A design that was advanced in another way counts from its current time.
        elsewhere = (time > asked + self._batch.parameters["time_step"]) | (
            (self._cycles > 0) & (time <= asked)
        )
        self._counted_from[elsewhere] = time[elsewhere]
        self._cycles[elsewhere] = 0
        self._cycles += cycles
        return np.asarray(self._counted_from + self._cycles / frequency)

    @property
    def _clock(self) -> NDArray[np.float64]:
        return self._run.state("clock")["clock"]

    @property
    def state(self) -> State:
        """The current positions and velocities."""
        parts = self._run.state("clock", "voxel")
        clock = parts["clock"]
        lattice = Lattice(*self.designs.shape[1:])
        values = np.moveaxis(lattice.to_stack(np.moveaxis(parts["voxel"], 1, -1)), 1, -1)
        return State(
            time=clock[:, _TIME],
            step=np.nan_to_num(clock[:, _STEP]).astype(np.int64),
            centre=clock[:, _CENTRE],
            position=values[..., :3],
            velocity=values[..., 8:11],
            orientation=values[..., 4:8],
            spin=values[..., 11:],
            edge=values[..., 3],
        )

    @property
    def ended(self) -> NDArray[np.bool_]:
        """Which designs have reached the end of their duration, shape (n,)."""
        return np.asarray(self._clock[:, _ENDED] != 0)

    @property
    def diverged(self) -> NDArray[np.bool_]:
        """Which designs have diverged so far, shape (n,)."""
        return self._lost(self._clock)

    def _lost(self, clock: NDArray[np.float64]) -> NDArray[np.bool_]:
        centre = clock[:, _CENTRE]
        there = self.designs.any(axis=(1, 2, 3))
        lost = there & ~np.isfinite(centre).all(axis=1)
        return np.asarray((self._run.output.status != 0) | (clock[:, _TORN] == 1) | lost)

    @property
    def displacement(self) -> NDArray[np.float64]:
        """Displacement of the centre of mass since the end of settling, shape (n, 3).

        In voxel widths; NaN during settling and if the design diverged, 0 for the empty design. At
        the end it equals that of `simulate`.
        """
        clock = self._clock
        moved = np.asarray((clock[:, _CENTRE] - clock[:, _START]) / self.physics.edge)
        moved[clock[:, _MEASURING] != 1] = np.nan
        moved[~self.designs.any(axis=(1, 2, 3))] = 0.0
        with np.errstate(over="ignore"):
            far = ~np.isfinite(moved[:, 0] ** 2 + moved[:, 1] ** 2)
        moved[far | self._lost(clock)] = np.nan
        return moved

    @property
    def fitness(self) -> NDArray[np.float64]:
        """Horizontal part of the displacement in voxel widths, shape (n,)."""
        displacement = self.displacement
        return np.asarray(np.sqrt(displacement[:, 0] ** 2 + displacement[:, 1] ** 2))

    def take(self, which: Sequence[int] | NDArray[np.intp]) -> Simulation:
        """Return a simulation of some of the designs in their current state; this one is unchanged.

        Parameters
        ----------
        which : sequence of int
            Their indices in the batch. An index may be repeated, to continue it in several ways.

        Raises
        ------
        IndexError
            If an index is out of range.
        TypeError
            If they are no row of whole numbers, as a mask is none.
        """
        chosen = np.asarray(which)
        if chosen.ndim != 1 or (chosen.size and chosen.dtype.kind not in "iu"):
            raise TypeError(f"which must be a row of indices, got {which!r}")
        rows = np.arange(len(self))[chosen.astype(np.intp)]
        kept = {name: values[rows] for name, values in self._kept().items()}
        own: Any = {name: values[rows] for name, values in self.physics.per_design.items()}
        physics = replace(self.physics, **own) if own else self.physics
        sim = self._resumed(kept, physics, self._threads, self._isa)
        sim._steered = self._steered
        return sim

    def save(self) -> bytes:
        """Return everything needed to continue: designs, physics, actuation and state."""
        about = {"engine": engine_probe(), "physics": self.physics.to_dict()}
        buffer = io.BytesIO()
        arrays: dict[str, Any] = {"steered": np.array(self._steered), **self._kept()}
        np.savez(buffer, about=np.array(json.dumps(about)), **arrays)
        return sealed(MAGIC, buffer.getvalue())

    @classmethod
    def restore(
        cls, saved: bytes, *, threads: int | None = None, isa: str | None = None
    ) -> Simulation:
        """Return the simulation that `save` stored, on any machine and instruction set.

        Raises
        ------
        TypeError, ValueError
            If it is no saved simulation, is damaged, or is of another engine, whose bits would
            differ.
        """
        body = unsealed(MAGIC, saved, "simulation", "Simulation.save")
        with np.load(io.BytesIO(body), allow_pickle=False) as archive:
            kept = dict(archive)
        about, steered = json.loads(str(kept.pop("about"))), bool(kept.pop("steered"))
        if about["engine"] != engine_probe():
            raise ValueError(
                "this simulation was saved by another engine: continuing it would change its bits"
            )
        check_threads(threads)
        sim = cls._resumed(kept, Physics(**about["physics"]), threads, isa)
        sim._steered = steered
        return sim

    def _kept(self) -> dict[str, NDArray[Any]]:
        """Return all per-design data, a row for each design."""
        # Decided at the start, whatever strain was set since: which designs run, and how far.
        taken = np.nan_to_num(self._clock[:, _STEP], nan=-1).astype(np.int32)
        return {
            "designs": self.designs,
            "strain": self._batch.strain,
            "phase": np.asarray(self._batch.phase),
            "counted_from": self._counted_from,
            "cycles": self._cycles,
            "resumed": taken,
            **{name: getattr(self._run.output, name) for name in _RESULTS},
            **self._run.state(*engine.STATE),
        }

    @classmethod
    def _resumed(
        cls, kept: dict[str, NDArray[Any]], physics: Physics, threads: int | None, isa: str | None
    ) -> Simulation:
        sim = cls.__new__(cls)
        sim.designs, sim.physics, batch = prepared(kept["designs"], physics, None, None)
        parts = {name: kept[name] for name in ("strain", "phase", "resumed")}
        sim._batch = engine.Batch(**{**vars(batch), **parts})
        sim._start(threads, isa)
        sim._counted_from[:], sim._cycles[:] = kept["counted_from"], kept["cycles"]
        for name in _RESULTS:
            getattr(sim._run.output, name)[:] = kept[name]
        sim._run.resume({name: kept[name] for name in engine.STATE})
        return sim

    def __reduce__(self) -> tuple[Any, ...]:
        return (_restored, (self.save(), self._threads))


def _restored(saved: bytes, threads: int | None) -> Simulation:
    """Unpickle; the instruction set is not stored, as another machine may lack it."""
    return Simulation.restore(saved, threads=threads)


def sealed(magic: bytes, body: bytes) -> bytes:
    """Return bytes with a header that identifies their kind and reveals damage."""
    return magic + hashlib.sha256(body).digest() + body


def unsealed(magic: bytes, saved: bytes, kind: str, maker: str) -> bytes:
    """Return the body that `sealed` wrapped; the magic of its kind ends in a format number.

    Raises
    ------
    TypeError, ValueError
        If the bytes are of another kind or format, or damaged.
    """
    if not isinstance(saved, (bytes, bytearray, memoryview)):
        raise TypeError(f"saved must be bytes, got {type(saved).__name__}")
    saved = bytes(saved)
    if not saved.startswith(magic):
        what = "in another format" if saved.startswith(magic[:-3]) else f"not a saved {kind}"
        raise ValueError(f"these bytes are {what}; {maker} makes {magic.decode()!r}")
    check, body = saved[len(magic) : len(magic) + 32], saved[len(magic) + 32 :]
    if hashlib.sha256(body).digest() != check:
        raise ValueError(f"this saved {kind} is damaged: its bytes have changed")
    return body


def _check_time(name: str, value: Any) -> None:
    if not check_number(name, value) >= 0:
        raise ValueError(f"{name} must not be negative, got {value}")
