"""The only module that touches the C extension: it checks the inputs and runs the threads."""

from __future__ import annotations

import contextlib
import os
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym._engine import ffi, lib
from softvox_gym.physics import SPECS
from softvox_gym.processors import default_threads as default_threads

ISA_VARIABLE = "SOFTVOX_ISA"
POLL_SECONDS = 0.05

Progress = Callable[[int, int], None]


def layout(struct: Any) -> np.dtype[Any]:
    """Return the numpy layout of a C struct of doubles and vectors, given as a cffi type."""
    formats = {"double": np.dtype(np.float64), "double[3]": np.dtype((np.float64, 3))}
    return np.dtype(
        {
            "names": [name for name, _ in struct.fields],
            "formats": [formats[field.type.cname] for _, field in struct.fields],
            "offsets": [field.offset for _, field in struct.fields],
            "itemsize": ffi.sizeof(struct),
        }
    )


#: One row per design, as the compiler laid it out.
PARAMETERS = layout(ffi.typeof("sv_parameters"))

# The per-design parameters of Physics, except the strain, which is an array of its own.
_EXPECTED = {spec.name for spec in SPECS if spec.per_design} - {"strain", "time_step_fraction"}
if set(PARAMETERS.names or ()) != _EXPECTED | {"time_step"}:
    raise ImportError("softvox_gym._engine was built from another version: build it again")


@dataclass(frozen=True, eq=False)
class Batch:
    """The inputs of a run, as the engine needs them: SI, C-contiguous, sites in index order."""

    shape: tuple[int, int, int]
    digits: NDArray[np.uint8]  # (n, sites)
    parameters: NDArray[Any]  # (n,), of PARAMETERS
    strain: NDArray[np.float64]  # (n, cycles, sites)
    phase: NDArray[np.float64] | None  # (n, sites), cycles
    edge: float
    pumped_rest: float
    settle_time: float
    actuation: str
    track_per_cycle: int
    track_samples: int
    frame_every: int
    frame_count: int
    #: Whether to measure the pump's work; impossible in a run that pauses.
    energy: bool = False
    #: For a resumed run: steps taken by each design, (n,), -1 if it could not run.
    resumed: NDArray[np.int32] | None = None


@dataclass(frozen=True, eq=False)
class Output:
    """The outputs of a run, SI; NaN if a design never got there."""

    status: NDArray[np.int32]  # (n,)
    steps: NDArray[np.int32]  # (n,)
    start: NDArray[np.float64]  # (n, 3), centre of mass
    end: NDArray[np.float64]  # (n, 3)
    track: NDArray[np.float64]  # (n, track_samples, 3), from start
    energy: NDArray[np.float64]  # (n,), J, if requested
    frames: NDArray[np.float64]  # (n, frame_count, sites, 8): position, quaternion wxyz, edge


def _text(c_string: Any) -> str:
    text: bytes = ffi.string(c_string)
    return text.decode()


#: The instruction sets that this machine runs, narrowest first.
_ISAS = {
    _text(lib.sv_isa_name(isa)): isa for isa in range(lib.SV_ISA_COUNT) if lib.sv_isa_supported(isa)
}


def isa_names() -> list[str]:
    """Return the instruction sets that this machine runs, narrowest first."""
    return list(_ISAS)


def isa_name(isa: str | None = None) -> str:
    """Return the instruction set of a run: the given one, that of SOFTVOX_ISA, or the widest.

    Raises
    ------
    ValueError
        If this machine does not run it.
    """
    name = (os.environ.get(ISA_VARIABLE) or isa_names()[-1]) if isa is None else isa
    if str(name).lower() not in _ISAS:
        asked = f"{ISA_VARIABLE}={name}" if isa is None else f"isa={isa!r}"
        raise ValueError(
            f"{asked} is not an instruction set of this machine, which runs {', '.join(_ISAS)}"
        )
    return name.lower()


def compiler() -> str:
    """Return the compiler that built the engine, with its version."""
    return _text(lib.sv_compiler())


def compiler_flags() -> str:
    """Return the flags that the engine was compiled with."""
    return _text(lib.sv_flags())


def step_count(time_step: float, duration: float) -> int:
    """Return how many steps a run takes until the time first exceeds the duration."""
    return int(lib.sv_step_count(time_step, duration))


def track_samples(cycles: float, per_cycle: int) -> float:
    """Return how many samples the track of a run has, start included."""
    return float(lib.sv_track_samples(cycles, per_cycle))


def _pointer(array: NDArray[Any], dtype: Any, shape: tuple[int, ...]) -> Any:
    """Return a pointer into an array that is exactly what C expects, or raise."""
    if array.dtype != dtype or array.shape != shape or not array.flags.c_contiguous:
        raise ValueError(
            f"the engine expects a C-contiguous {np.dtype(dtype)} array of shape {shape}, "
            f"got {array.dtype} {array.shape}"
        )
    return ffi.cast("void *", array.ctypes.data)


def _c_batch(batch: Batch) -> Any:
    n, sites = batch.digits.shape
    cycles = batch.strain.shape[1]
    as_they_are = ("edge", "pumped_rest", "settle_time")
    counts = ("track_per_cycle", "track_samples", "frame_every", "frame_count", "energy")
    c = ffi.new("sv_batch *", {name: getattr(batch, name) for name in as_they_are + counts})
    c.nx, c.ny, c.nz = batch.shape
    c.n, c.cycles, c.actuation = n, cycles, getattr(lib, f"SV_{batch.actuation.upper()}")
    c.digits = _pointer(batch.digits, np.uint8, (n, sites))
    c.parameters = _pointer(batch.parameters, PARAMETERS, (n,))
    c.strain = _pointer(batch.strain, np.float64, (n, cycles, sites))
    if batch.phase is not None:
        c.phase = _pointer(batch.phase, np.float64, (n, sites))
    if batch.resumed is not None:
        c.resumed = _pointer(batch.resumed, np.int32, (n,))
    message = lib.sv_batch_error(c)
    if message != ffi.NULL:
        raise ValueError(_text(message))
    return c


_allocate = ffi.new_allocator(should_clear_after_alloc=False)


def _memory(size: int) -> Any:
    return _allocate("char[]", size)


def _expect_done(code: int) -> None:
    if code != lib.SV_DONE:
        raise RuntimeError(f"the engine refused a batch it had accepted (code {code})")


#: Up to this many voxel-steps the calling thread does the work itself: starting threads, and
#: polling for interrupts, costs more than it gains for milliseconds of work.
_SMALL_WORK = 200_000


class _Planned:
    """A batch seated for an instruction set, with its results."""

    def __init__(self, batch: Batch, isa: str | None, seating: str, *, in_step: bool) -> None:
        n, sites = batch.digits.shape
        self.batch = batch
        self.isa = _ISAS[isa_name(isa)]
        self.c_batch = _c_batch(batch)
        self.order = np.empty((n, lib.sv_isa_lanes(self.isa)), dtype=np.int32)
        seats = {"seating": getattr(lib, f"SV_{seating.upper()}"), "in_step": int(in_step)}
        order = ffi.cast("int32_t *", self.order.ctypes.data)
        self.plan = ffi.new("sv_plan *", {"lanes": self.order.shape[1], "order": order, **seats})
        self.scratch = _memory(lib.sv_plan_scratch(self.c_batch))
        _expect_done(lib.sv_plan_batch(self.c_batch, self.plan, self.scratch))
        self.output = Output(
            status=np.zeros(n, dtype=np.int32),
            steps=np.zeros(n, dtype=np.int32),
            start=np.full((n, 3), np.nan),
            end=np.full((n, 3), np.nan),
            track=np.full((n, batch.track_samples, 3), np.nan),
            energy=np.full(n, np.nan),
            frames=np.full((n, batch.frame_count, sites, 8), np.nan),
        )
        arrays = vars(self.output).items()
        pointers = {name: ffi.cast("void *", array.ctypes.data) for name, array in arrays}
        self.results = ffi.new("sv_results *", pointers)
        self.voxels = int(np.count_nonzero(batch.digits))

    def workspace_bytes(self) -> int:
        """Return the memory that a thread needs to simulate it."""
        return int(lib.sv_workspace_bytes(self.c_batch, self.plan, self.isa, self.scratch))

    def drive(
        self,
        call: Callable[[Any], int],
        steps: float,
        threads: int | None,
        progress: Progress | None = None,
        memory: int = 0,
    ) -> None:
        """Run call(shared) on threads, each with this much memory, until all blocks are done."""
        n = len(self.order)
        empty = n - int(np.count_nonzero(self.order[: self.plan.blocks] >= 0))
        shared = ffi.new("sv_progress *")
        codes: list[int] = []

        def work() -> None:
            with contextlib.suppress(MemoryError):  # shown by its missing code
                codes.append(call(shared))

        def report() -> None:
            if progress is not None:
                progress(shared.done + empty, n)

        count = self.plan.blocks  # for one thread, the number of processors is not queried
        if count > 1:
            count = min(default_threads() if threads is None else threads, count)
        if count == 1 and self.voxels * steps <= _SMALL_WORK:
            work()
            report()
            started = 1
        else:
            started = _drive([work] * count, report, shared)
        if len(codes) != started:
            raise MemoryError(f"a worker could not get its {memory} bytes of memory")
        for code in codes:
            _expect_done(code)


def run(
    batch: Batch,
    *,
    threads: int | None = None,
    isa: str | None = None,
    progress: Progress | None = None,
    seating: str = "by_time",
) -> Output:
    """Simulate a batch, with one call into C per thread.

    Uses at most `threads` threads, `default_threads` if None, on one of `isa_names`; by default
    that of SOFTVOX_ISA, or the widest. The calling thread calls progress(done, total) from time to
    time, and at the end. The seating of designs, "by_time", "all_apart" or "all_across", changes
    the speed but no bit.

    Raises
    ------
    ValueError
        If an array is not what C expects, or the machine lacks the instruction set.
    KeyboardInterrupt
        When interrupted; the workers have then stopped.
    """
    made = _Planned(batch, isa, seating, in_step=False)
    size = made.workspace_bytes()

    def work(shared: Any) -> int:
        code: int = lib.sv_run(
            made.c_batch, made.plan, made.results, shared, _memory(size), made.isa
        )
        return code

    with np.errstate(all="ignore"):
        steps = np.max(batch.parameters["duration"] / batch.parameters["time_step"], initial=0)
    made.drive(work, float(steps), threads, progress, size)
    return made.output


def workspace_bytes(batch: Batch, *, isa: str | None = None) -> int:
    """Return the memory that each thread of `run` allocates, besides the arrays of the batch."""
    return _Planned(batch, isa, "by_time", in_step=False).workspace_bytes()


#: The state of a run, by name: the shape of each part after (n, sites), or (n,) for the clock.
STATE = {"clock": (lib.SV_CLOCK,), "voxel": (14,), "link": (3, 10), "surface": (4,)}


class PausedRun:
    """A batch that is simulated in pieces; its blocks live as long as the object.

    Arguments as in `run`. Strain and phase of the batch may be written to between pieces.
    """

    def __init__(
        self,
        batch: Batch,
        *,
        threads: int | None = None,
        isa: str | None = None,
        seating: str = "by_time",
    ) -> None:
        self._made = _Planned(batch, isa, seating, in_step=True)
        self._threads = threads
        self._lock = threading.Lock()  # one piece at a time, even if several threads call
        made = self._made
        facts = (made.c_batch, made.plan)
        sizes = [
            lib.sv_block_bytes(*facts, block, made.isa, made.scratch)
            for block in range(made.plan.blocks)
        ]
        self._memory = [_memory(size) for size in sizes]
        self._blocks = ffi.new("void *[]", self._memory)
        _expect_done(lib.sv_start(*facts, made.results, self._blocks, made.isa))

    def steer(self) -> None:
        """Announce that strain and phase have changed, and may change again."""
        self._made.c_batch.steered = 1

    @property
    def output(self) -> Output:
        """The results so far, in the form that `run` returns."""
        return self._made.output

    def advance(
        self, until: NDArray[np.float64] | None, steps: int, about: float | None = None
    ) -> None:
        """Run until each design's time, s, shape (n,), or the end; at most this many steps.

        Designs with the same time step, frequency and duration must have the same time. `about` is
        the number of steps, if the caller has a better estimate.
        """
        made = self._made
        pointer = ffi.NULL if until is None else _pointer(until, np.float64, (len(made.order),))
        until_c = ffi.cast("double *", pointer)

        def work(shared: Any) -> int:
            code: int = lib.sv_advance(made.plan, shared, self._blocks, until_c, steps, made.isa)
            return code

        with self._lock:
            made.drive(work, steps if about is None else about, self._threads)

    def state(self, *names: str) -> dict[str, NDArray[np.float64]]:
        """Return copies of the named parts of STATE; NaN for a missing voxel or link."""
        arrays = {name: np.full(self._shape_of(name), np.nan) for name in names}
        self._copy(lib.sv_get_state, arrays)
        return arrays

    def resume(self, state: dict[str, NDArray[np.float64]]) -> None:
        """Continue from a `state` of all parts; only possible right after the start."""
        self._copy(lib.sv_set_state, state)

    def _copy(self, function: Any, arrays: dict[str, NDArray[np.float64]]) -> None:
        pointers = {
            name: ffi.cast("double *", _pointer(array, np.float64, self._shape_of(name)))
            for name, array in arrays.items()
        }
        state = ffi.new("sv_state *", pointers)
        with self._lock:
            _expect_done(function(self._made.plan, self._blocks, state, self._made.isa))

    def _shape_of(self, name: str) -> tuple[int, ...]:
        n, sites = self._made.batch.digits.shape
        return (n, *(() if name == "clock" else (sites,)), *STATE[name])


def _drive(works: list[Callable[[], None]], report: Callable[[], None], shared: Any) -> int:
    """Run each of `works` in a thread and report progress; on an interrupt, stop them first.

    Returns the number of threads: if the system refuses more, the existing ones do all the work.
    """
    # Events, because joining a thread again after an interrupted join may return before it has
    # ended.
    ended: list[threading.Event] = []

    def start(work: Callable[[], None]) -> None:
        end = threading.Event()

        def run() -> None:
            try:
                work()
            finally:
                end.set()

        threading.Thread(target=run, name=f"softvox-{len(ended)}").start()
        ended.append(end)

    try:
        for work in works:
            try:
                start(work)
            except RuntimeError:
                break
        if works and not ended:
            raise RuntimeError("the system refuses to start a single thread")
        for end in ended:
            while not end.wait(POLL_SECONDS):
                report()
        report()
    except BaseException:
        shared.cancel = 1
        for end in ended:
            end.wait()
        raise
    return len(ended)
