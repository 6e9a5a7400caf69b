"""The log of a run: one row per evaluation, in columns."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

#: Type of every column; of a little-endian machine, so that digests agree on all.
COLUMNS = {
    "sequence": "<i4",
    "unique_sequence": "<i4",
    "design": "<i2",
    "dx": "<f8",
    "dy": "<f8",
    "fitness": "<f8",
    "status": "<U8",
    "noise_seed": "<i8",
    "cached": "|b1",
}

#: In place of a noise seed where no noise was drawn.
NO_SEED = -1


@dataclass
class Log:
    """Rows of evaluations, appended batch by batch.

    The columns are

    =============== ==================================================================
    sequence        number of the evaluation in its run, from 1
    unique_sequence how many evaluations until then were not answered from the cache
    design          its number, 0 ... 6560
    dx, dy          displacement in voxel widths; NaN where it diverged
    fitness         the value that the searcher was told, voxel widths
    status          "ok" or "diverged"
    noise_seed      what the environment was seeded with for this evaluation, or -1
    cached          whether it was answered from the cache
    =============== ==================================================================
    """

    _batches: list[dict[str, NDArray[np.generic]]] = field(default_factory=list)

    def append(self, **columns: NDArray[np.generic]) -> None:
        """Append a batch; all columns must be given, with equal lengths."""
        assert set(columns) == set(COLUMNS)
        self._batches.append({name: columns[name].astype(COLUMNS[name]) for name in COLUMNS})

    def columns(self) -> dict[str, NDArray[np.generic]]:
        """Return all rows, column by column."""
        return {
            name: np.concatenate(
                [np.zeros(0, dtype=dtype), *(batch[name] for batch in self._batches)]
            )
            for name, dtype in COLUMNS.items()
        }


def digest(columns: dict[str, NDArray[np.generic]]) -> str:
    """Return the SHA-256 of all rows, column by column."""
    total = hashlib.sha256()
    for name in COLUMNS:
        total.update(np.ascontiguousarray(columns[name]).tobytes())
    return total.hexdigest()
