"""The landscape as a table that ships with the package: every design under `Physics.published`."""

from __future__ import annotations

import json
from functools import lru_cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import BodyFacts
from softvox_gym.evaluation import Evaluation
from softvox_gym.lattice import Lattice

#: The lattice of the paper.
LATTICE = Lattice(2, 2, 2)
N_DESIGNS = LATTICE.n_designs

#: In the package's folder `data/computed`: the movement tracks, and where they come from.
TRACKS, ORIGIN = "landscape.npz", "landscape.json"

ROW = np.dtype(
    [
        ("design", np.int64),
        ("digits", "U8"),
        ("n_voxels", np.int64),
        ("n_active", np.int64),
        ("is_connected", np.bool_),
        ("dx", np.float64),
        ("dy", np.float64),
        ("dz", np.float64),
        ("fitness", np.float64),
        ("diverged", np.bool_),
    ]
)


class Tracks(NamedTuple):
    """What the engine made of every design, in order.

    track : ndarray, shape (6561, 16, 3)
        As `Result.track` with one sample per cycle.
    steps : ndarray of int32, shape (6561,)
    """

    track: NDArray[np.float64]
    steps: NDArray[np.int32]


def landscape() -> NDArray[np.void]:
    """Return every design of the 2x2x2 lattice and what became of it, exactly.

    Simulated under `Physics.published`; the engine gives the same bits.

    Returns
    -------
    structured ndarray, shape (6561,)
        Row i is design i: its number, digits, n_voxels, n_active, is_connected; dx, dy, dz, the
        displacement of its centre of mass in voxel widths; fitness, sqrt(dx^2 + dy^2); diverged. A
        fresh copy; `pandas.DataFrame(softvox_gym.landscape())` makes a data frame of it.

    Examples
    --------
    >>> table = softvox_gym.landscape()
    >>> table["design"][table["fitness"].argmax()]
    np.int64(6453)
    """
    return _landscape().copy()


@lru_cache(maxsize=1)
def _landscape() -> NDArray[np.void]:
    displacement = tracks().track[:, -1]
    rows = LATTICE.digits(np.arange(N_DESIGNS))
    bodies = BodyFacts.of(rows, LATTICE)
    table = np.empty(N_DESIGNS, dtype=ROW)
    table["design"] = np.arange(N_DESIGNS)
    table["digits"] = ["".join(map(str, row)) for row in rows.tolist()]
    for name in bodies._fields:
        table[name] = getattr(bodies, name)
    for axis, name in enumerate(("dx", "dy", "dz")):
        table[name] = displacement[:, axis]
    table["fitness"] = np.sqrt(displacement[:, 0] ** 2 + displacement[:, 1] ** 2)
    table["diverged"] = False
    return table


@lru_cache(maxsize=1)
def tracks() -> Tracks:
    """Return the movement track and the steps of every design; read-only."""
    with (
        (files("softvox_gym") / "data" / "computed" / TRACKS).open("rb") as file,
        np.load(file) as archive,
    ):
        made = Tracks(archive["track"], archive["steps"])
    for values in made:
        values.flags.writeable = False
    return made


def looked_up(stack: NDArray[np.uint8]) -> Evaluation:
    """Return what `softvox_gym.evaluate` would of designs under `Physics.published`.

    Parameters
    ----------
    stack : ndarray of uint8, shape (n, 2, 2, 2)
    """
    design = LATTICE.numbers(LATTICE.to_rows(stack))
    track, steps = tracks()
    end = track[design, -1]
    return Evaluation(
        designs=stack,
        fitness=np.sqrt(end[:, :1] ** 2 + end[:, 1:2] ** 2),
        displacement=end[:, np.newaxis],
        track=track[design][:, np.newaxis],
        steps=steps[design].astype(np.int64)[:, np.newaxis],
    )


def origin() -> dict[str, Any]:
    """Return where the table comes from: version, commit and digest of the engine's bits."""
    text = (files("softvox_gym") / "data" / "computed" / ORIGIN).read_text(encoding="utf-8")
    known: dict[str, Any] = json.loads(text)
    return known
