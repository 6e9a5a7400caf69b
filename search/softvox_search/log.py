"""The log of a run: one row per evaluation, in columns."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Design, Lattice
from softvox_search.protocol import Designs

Columns = dict[str, NDArray[Any]]

#: Type of every column, little-endian, so that digests agree on all machines.
COLUMNS: Mapping[str, str] = {
    "sequence": "<i4",
    "unique_sequence": "<i4",
    "design": "<i8",
    "dx": "<f8",
    "dy": "<f8",
    "fitness": "<f8",
    "diverged": "|b1",
    "noise_seed": "<i8",
    "cached": "|b1",
}

#: Stands for the noise seed if no noise was drawn.
NO_SEED = -1


class Log:
    """Rows of evaluations, appended batch by batch.

    The columns are

    =============== ==================================================================
    sequence        number of the evaluation in its run, from 1
    unique_sequence how many evaluations until then were not answered from the cache
    design          its number; its digits, a str, on lattices of 40 sites or more
    dx, dy          displacement in voxel widths; NaN where it diverged
    fitness         the value that the searcher was told, voxel widths
    diverged        whether it diverged
    noise_seed      what the environment was seeded with for this evaluation, or -1
    cached          whether it was answered from the cache
    =============== ==================================================================

    Parameters
    ----------
    space : Lattice
        The lattice of the designs.
    """

    def __init__(self, space: Lattice) -> None:
        self._space = space
        self._types = {
            **COLUMNS,
            "design": COLUMNS["design"] if space.has_int64_numbers else f"<U{space.sites}",
        }
        self._batches: list[Columns] = []

    def append(self, designs: Designs, **columns: NDArray[Any]) -> None:
        """Append a batch: the designs' digits, shape (n, sites), and all other columns."""
        columns["design"] = self._identities(designs)
        self._batches.append(
            {name: columns[name].astype(kind) for name, kind in self._types.items()}
        )

    def columns(self) -> Columns:
        """Return all rows, column by column."""
        return {
            name: np.concatenate([np.zeros(0, kind), *(batch[name] for batch in self._batches)])
            for name, kind in self._types.items()
        }

    def _identities(self, designs: Designs) -> NDArray[Any]:
        if self._space.has_int64_numbers:
            return self._space.numbers(designs)
        text = (designs + ord("0")).astype(np.uint32)  # the characters of a str in NumPy
        return text.view(self._types["design"]).ravel()


def identity(design: Design) -> int | str:
    """Return a design's identity in the log: its number, or its digits if numbers exceed int64."""
    return design.index if design.lattice.has_int64_numbers else design.digits


def digest(columns: Mapping[str, NDArray[Any]], kinds: Mapping[str, str] = COLUMNS) -> str:
    """Return the SHA-256 of all rows, column by column, each in its type."""
    total = hashlib.sha256()
    for name, kind in kinds.items():
        column = np.asarray(columns[name])
        is_text = column.dtype.kind in "OU"
        total.update(column.astype("<U" if is_text else kind).tobytes())
    return total.hexdigest()
