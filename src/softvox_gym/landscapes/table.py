"""The landscape: every design of the 2x2x2 lattice with its results, under any physics."""

from __future__ import annotations

import json
import sys
from functools import lru_cache
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import BodyFacts
from softvox_gym.engine import Progress
from softvox_gym.evaluation import DISPLACEMENT, Evaluation
from softvox_gym.landscapes import cache
from softvox_gym.landscapes.section import Column, Section, aligned
from softvox_gym.lattice import Lattice
from softvox_gym.physics import Physics
from softvox_gym.progress import Progress as ProgressBar
from softvox_gym.realities import PhysicsLike, Reality, realities
from softvox_gym.tasks import Task

#: The lattice whose designs can all be simulated.
LATTICE = Lattice(2, 2, 2)
N_DESIGNS = LATTICE.n_designs

#: This project's own results, which ship with the package.
COMPUTED = files("softvox_gym") / "data" / "computed"

#: File in that folder: the movement tracks under `Physics.published`.
TRACKS = "landscape.npz"

#: File in that folder: displacements in the named realities and in their simulators, by the names
#: of `shipped`, and steps under the name with this suffix.
REALITIES, STEPS = "realities.npz", "_steps"

#: File in that folder: displacement and steps of every design of two phases, and of the fittest
#: designs of four, under `Physics.published`; and the digests of both landscapes.
PHASED, PHASED_DIGESTS = "phased.npz", "phased.json"

#: Most phases of a landscape; with more there would be many millions of designs.
MOST_PHASES = 4

#: Designs of several phases that are simulated and stored as one block.
BLOCK = 2**15

AXES = ("dx", "dy", "dz")
_BODY = [("n_voxels", "i8"), ("n_active", "i8"), ("is_connected", "?")]
_NUMBERS = [(name, "f8") for name in (*AXES, "fitness")]
ROW = np.dtype(
    [
        *(("design", "i8"), ("digits", "U8"), *_BODY, *_NUMBERS),
        *(("diverged", "?"), ("steps", "i8"), ("step_error", "f8")),
    ]
)

#: Rows that a displayed table shows at its beginning and at its end.
SHOWN = 5


class Table(np.ndarray[Any, np.dtype[np.void]]):
    """A structured array with a row per design, displayed as a table.

    Its columns and rows are plain arrays.

    Attributes
    ----------
    physics : Physics or None
        The physics of the simulation; None if a physics is not the whole description, as in a
        reality that is not plain, or if it is not known.
    """

    physics: Physics | None

    @classmethod
    def of(cls, rows: NDArray[np.void], physics: Physics | None) -> Table:
        """Return a table of the rows; the array is shared."""
        table = rows.view(cls)
        table.physics = physics
        return table

    def __array_finalize__(self, origin: object) -> None:
        self.physics = getattr(origin, "physics", None)

    def __reduce__(self) -> tuple[Any, ...]:
        return Table.of, (np.asarray(self), self.physics)

    def __getitem__(self, key: Any) -> Any:
        return np.asarray(self)[key]

    def __repr__(self) -> str:
        if self.dtype.names is None or self.ndim != 1:
            return repr(np.asarray(self))
        return "\n".join([*aligned(self._cells()), f"[{len(self)} rows]"])

    __str__ = __repr__

    def _repr_html_(self) -> str | None:
        """Return what a notebook shows: the first and the last rows."""
        if self.dtype.names is None or self.ndim != 1:
            return None
        header, *rows = self._cells()
        lines = [f"<tr><th>{'</th><th>'.join(header)}</th></tr>"]
        lines += [f"<tr><td>{'</td><td>'.join(row)}</td></tr>" for row in rows]
        return f"<table>{''.join(lines)}</table><p>{len(self)} rows</p>"

    def section(self) -> Section:
        """Return the table as a `Section`, which can be written as CSV."""
        titles = {
            name: name.removeprefix("n_").removeprefix("is_") for name in self.dtype.names or ()
        }
        specs = {"f": ".4f"}
        columns = [
            Column(*names, specs.get(self.dtype[names[0]].kind, "")) for names in titles.items()
        ]
        return Section(columns=columns, rows=self.tolist())

    def _cells(self) -> list[list[str]]:
        if len(self) <= 2 * SHOWN:
            return self.section().cells()
        rows = np.concatenate([self[:SHOWN], self[-SHOWN:]])
        cells = Table.of(rows, self.physics).section().cells()
        return [*cells[: SHOWN + 1], ["..."] * len(cells[0]), *cells[SHOWN + 1 :]]


def landscape(physics: PhysicsLike | Reality = "published", *, phases: int = 1) -> Table:
    """Return every design of the 2x2x2 lattice with its exact results.

    The landscapes under `Physics.published` and in the named realities ship with the package. Any
    other is simulated on first use, which takes some seconds, and kept in the user's cache folder
    ($SOFTVOX_CACHE; otherwise ~/Library/Caches/softvox-gym on macOS and $XDG_CACHE_HOME/softvox-gym
    or ~/.cache/softvox-gym elsewhere), if that is writable.

    Parameters
    ----------
    physics : str, dict, Physics or Reality
        As in `Physics.of`: a preset's name, changes to one, or a Physics of single numbers; or a
        reality.
    phases : int
        Phases of active voxels, at most 4: digit 2 + p is active, p / phases cycles ahead, and
        there are (2 + phases)^8 designs. The published landscape of two phases, 65,536 designs,
        ships too; that of four, 1,679,616, takes one core half an hour, once, and then 400 MB of
        memory.

    Returns
    -------
    Table, a structured ndarray of shape (6561,), or of as many designs as the phases make
        Row i is design i: its number, digits, n_voxels, n_active, is_connected; dx, dy, dz, the
        displacement of its centre of mass in voxel widths; fitness, sqrt(dx^2 + dy^2); diverged, if
        so these are NaN; steps, the time steps taken; step_error, the change of the fitness at half
        the step (`softvox_gym.step_error`), known for the published landscape and otherwise NaN. A
        fresh copy; `pandas.DataFrame(softvox_gym.landscape())` makes a data frame of it.

    Raises
    ------
    TypeError, ValueError
        As `Physics.of` does, or if parameters are arrays, the phases are not from 1 to 4, or the
        physics is a `MeasuredReality`, which knows only a few designs.

    Examples
    --------
    >>> table = softvox_gym.landscape()
    >>> table["design"][table["fitness"].argmax()]
    np.int64(6453)
    """
    reality, lattice = Reality.of(physics), phased_lattice(phases)
    if lattice == LATTICE:
        return _landscape(reality).copy()
    with ProgressBar(sys.stderr) as progress:
        return phased(reality, lattice, progress=progress)


Reality.landscape = landscape


@lru_cache(maxsize=16)
def _landscape(reality: Reality) -> Table:
    physics = reality.plain_physics
    if physics == Physics.published():
        table = _table(physics, tracks().track[:, -1], tracks().steps)
        if (halved := _archived("half_step")) is not None:
            fitness = _table(physics, *halved)["fitness"]
            table["step_error"][:] = np.abs(fitness - table["fitness"])
        return table
    if (found := _archived(_names().get(_facts(reality)))) is not None:
        return _table(physics, *found)
    path = cache.cache_path(reality)
    if path is None:
        return compute(reality)
    kept = cache.read(path)
    if kept is not None:
        return _table(physics, kept[:, :3], kept[:, 3].astype(np.int32))
    table = compute(reality)
    cache.write(path, np.stack([table[name] for name in (*AXES, "steps")], axis=-1))
    return table


def phased_lattice(phases: int) -> Lattice:
    """Return the lattice of landscapes with these phases; raises as `landscape` does."""
    lattice = Lattice.of(LATTICE, phases=phases)
    if lattice.phases > MOST_PHASES:
        raise ValueError(f"phases must be at most {MOST_PHASES} for a landscape, got {phases}")
    return lattice


class Known(NamedTuple):
    """The results of every design of several phases, in order."""

    displacement: NDArray[np.float64]  # (n, 3), voxel widths; NaN if it diverged
    steps: NDArray[np.int32]  # (n,)


def phased(
    reality: Reality,
    lattice: Lattice,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Table:
    """Return the landscape of a lattice of several phases; simulate it if it is not known."""
    found = known(reality, lattice)
    if found is None:
        found = simulated(reality, lattice, threads=threads, progress=progress)
    return _table(reality.plain_physics, *found, lattice)


def known(reality: Reality, lattice: Lattice) -> Known | None:
    """Return a landscape of several phases if it ships or is in the user's cache folder."""
    if lattice == phased_lattice(2) and reality.plain_physics == Physics.published():
        return _two_phases()
    path = cache.cache_path(reality, lattice)
    return _kept(path) if path is not None and path.exists() else None


def has_table(lattice: Lattice) -> bool:
    """Return whether the published landscape of a lattice ships or was computed here before."""
    if lattice == LATTICE:
        return True
    return lattice[:] == LATTICE and known(Reality.of(Physics.published()), lattice) is not None


@lru_cache(maxsize=1)
def _two_phases() -> Known:
    with (COMPUTED / PHASED).open("rb") as file, np.load(file) as archive:
        return Known(archive["two"], archive[f"two{STEPS}"])


@lru_cache(maxsize=2)
def _kept(path: Path) -> Known | None:
    values = cache.read(path)
    return None if values is None else Known(values[:, :3], values[:, 3].astype(np.int32))


def simulated(
    reality: Reality,
    lattice: Lattice,
    *,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Known:
    """Simulate all designs, block by block, reusing the blocks that a stopped run has stored."""
    n, path = lattice.n_designs, cache.cache_path(reality, lattice)
    parts, blocks = [], []
    for begin in range(0, n, BLOCK):
        part = None if path is None else path.with_name(f"{path.stem}-{begin}.npy")
        values = None if part is None else cache.read(part)
        if values is None:
            numbers = np.arange(begin, min(begin + BLOCK, n))
            kinds, phase = lattice.pumped(lattice.to_stack(lattice.digits(numbers)))
            result = reality.simulate(
                kinds,
                phase=phase,
                threads=threads,
                progress=progress and _from(begin, n, progress),
            )
            values = np.column_stack([result.displacement, result.steps])
            if part is not None:
                cache.write(part, values)
        parts += [] if part is None else [part]
        blocks.append(values)
    whole = np.concatenate(blocks)
    if path is not None:
        cache.write(path, whole)
        _kept.cache_clear()
        if path.exists():
            for part in parts:
                part.unlink(missing_ok=True)
    return Known(whole[:, :3], whole[:, 3].astype(np.int32))


def _from(begin: int, total: int, progress: Progress) -> Progress:
    """Return a callback that reports a block's progress as progress of the whole."""
    return lambda done, _: progress(begin + done, total)


def displacements(table: Table) -> NDArray[np.float64]:
    """Return the displacement of every design, shape (6561, 3), voxel widths; 0 if it diverged."""
    made: NDArray[np.float64] = np.nan_to_num(np.stack([table[axis] for axis in AXES], axis=-1))
    made.flags.writeable = False
    return made


def compute(
    physics: Physics | Reality,
    *,
    check_step: bool = False,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Table:
    """Simulate every design; see `landscape` for the table, and `simulate` for the parameters."""
    reality = Reality.of(physics)
    result = reality.simulate(
        np.arange(N_DESIGNS), check_step=check_step, threads=threads, progress=progress
    )
    table = _table(reality.plain_physics, result.displacement, result.steps)
    if result.step_error is not None:
        table["step_error"][:] = result.step_error
    return table


def _table(
    physics: Physics | None,
    displacement: NDArray[np.float64],
    steps: NDArray[np.int32],
    lattice: Lattice = LATTICE,
) -> Table:
    rows = _designs().copy() if lattice == LATTICE else _rows(lattice)
    for axis, name in enumerate(AXES):
        rows[name] = displacement[:, axis]
    rows["fitness"] = np.sqrt(displacement[:, 0] ** 2 + displacement[:, 1] ** 2)
    rows["diverged"] = np.isnan(rows["fitness"])
    rows["steps"] = steps
    rows["step_error"] = np.nan
    return Table.of(rows, physics)


@lru_cache(maxsize=1)
def _designs() -> NDArray[np.void]:
    """Return the rows of all designs of one phase, without results."""
    return _rows(LATTICE)


def _rows(lattice: Lattice) -> NDArray[np.void]:
    rows, digits = np.zeros(lattice.n_designs, dtype=ROW), all_digits(lattice)
    rows["design"] = np.arange(lattice.n_designs)
    rows["digits"] = (digits + ord("0")).view(f"S{lattice.sites}")[:, 0]
    facts = bodies() if lattice == LATTICE else BodyFacts.of(digits, lattice)
    for name, values in facts._asdict().items():
        rows[name] = values
    return rows


def all_digits(lattice: Lattice) -> NDArray[np.uint8]:
    """Return the digits of every design of a small lattice, in order, shape (n, sites)."""
    n = lattice.n_designs
    blocks = [np.arange(begin, min(begin + BLOCK, n)) for begin in range(0, n, BLOCK)]
    return np.concatenate([lattice.digits(numbers) for numbers in blocks])


@lru_cache(maxsize=1)
def bodies() -> BodyFacts:
    """Return the facts about the bodies of all designs of one phase, in order."""
    return BodyFacts.of(all_digits(LATTICE), LATTICE)


class Tracks(NamedTuple):
    """The engine's results for every design under `Physics.published`, in order; read-only."""

    track: NDArray[np.float64]  # (6561, 16, 3), as `Result.track` with one sample per cycle
    steps: NDArray[np.int32]  # (6561,)


@lru_cache(maxsize=1)
def tracks() -> Tracks:
    """Return the movement track and the steps of every design."""
    with (COMPUTED / TRACKS).open("rb") as file, np.load(file) as archive:
        made = Tracks(archive["track"], archive["steps"])
    for values in made:
        values.flags.writeable = False
    return made


def shipped() -> dict[str, Reality]:
    """Return the named realities, and their simulators if these are not the published one.

    By their names in the archive.
    """
    named = realities()
    nominals = {
        f"{name}_nominal": Reality.of(one.nominal)
        for name, one in named.items()
        if one.nominal != Physics.published()
    }
    return named | nominals


@lru_cache(maxsize=1)
def _names() -> dict[str, str]:
    """Return the names in the archive, keyed by all that a reality's landscape depends on."""
    return {_facts(one): name for name, one in shipped().items()}


def _archived(name: str | None) -> tuple[NDArray[np.float64], NDArray[np.int32]] | None:
    """Return displacement and steps of every design under a name of `shipped`, if archived."""
    with (COMPUTED / REALITIES).open("rb") as file, np.load(file) as archive:
        return (archive[name], archive[f"{name}{STEPS}"]) if name in archive else None


def _facts(reality: Reality) -> str:
    """Return all that a landscape depends on, as one text."""
    return json.dumps(reality.to_dict(), sort_keys=True)


def looked_up(
    stack: NDArray[np.uint8], task: Task = DISPLACEMENT, lattice: Lattice = LATTICE
) -> Evaluation:
    """Return what `evaluate` would for designs, shape (n, 2, 2, 2), under `Physics.published`.

    With several phases the track has only its start and its end, and there must be a table.
    """
    design = lattice.numbers(lattice.to_rows(stack))
    if lattice == LATTICE:
        track, steps = (values[design] for values in tracks())
    else:
        known_ends, known_steps = _needed(lattice)
        end, steps = known_ends[design], known_steps[design]
        track = np.stack([np.where(np.isnan(end), end, 0.0), end], axis=1)
    end = track[:, -1]
    return Evaluation(
        designs=stack,
        fitness=np.nan_to_num(task.reward(end))[:, np.newaxis],
        displacement=end[:, np.newaxis],
        track=track[:, np.newaxis],
        steps=steps.astype(np.int64)[:, np.newaxis],
        task=task,
        phases=lattice.phases,
    )


@lru_cache(maxsize=2)
def _needed(lattice: Lattice) -> Known:
    """Return the published landscape of several phases; ValueError if it is not here."""
    found = known(Reality.of(Physics.published()), lattice)
    if found is None:
        raise ValueError(no_table(lattice))
    return found


def no_table(lattice: Lattice) -> str:
    """Return the error message for a landscape of several phases that is needed but missing."""
    return (
        f"the landscape of the {lattice} lattice is not on this machine; "
        f"softvox landscape --phases {lattice.phases} makes it"
    )
