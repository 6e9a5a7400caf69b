"""The exhaustive search: every design of the 2x2x2 lattice, as a table with its manifest."""

from __future__ import annotations

import csv
import io
import json
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import N_DESIGNS
from softvox_gym.engine import Progress
from softvox_gym.manifest import digest, provenance
from softvox_gym.physics import Physics
from softvox_gym.simulation import Result, simulate

TABLE, MANIFEST = "landscape.csv", "manifest.json"
COLUMNS = ("design", "digits", "dx", "dy", "dz", "fitness", "status")

#: What the published run took (Kriegman et al., RoboSoft 2020).
PAPER_CPU_HOURS = 58


@dataclass(frozen=True)
class Landscape:
    """All designs in order, and how they were made.

    Parameters
    ----------
    result : Result
        Row i is design i.
    origin : dict
        What `softvox_gym.manifest.provenance` says.
    seconds, cpu_seconds : float
        s, of the simulation.
    """

    result: Result
    origin: dict[str, Any]
    seconds: float
    cpu_seconds: float

    def manifest(self, arguments: Sequence[str]) -> dict[str, Any]:
        """Return everything about the table that is not in it, ready for JSON.

        Parameters
        ----------
        arguments : sequence of str
            Of the command line that asked for it.
        """
        top = ranking(self.result)[:1]
        return {
            **self.origin,
            "arguments": list(arguments),
            "physics": self.result.physics.to_dict(),
            "n_designs": len(self.result),
            "n_diverged": int(np.count_nonzero(self.result.status != "ok")),
            "best": _summary(self.result, int(top[0])) if len(top) else None,
            "digest": digest(self.result.displacement),
            "seconds": self.seconds,
            "cpu_seconds": self.cpu_seconds,
        }

    def contents(self, arguments: Sequence[str]) -> dict[str, bytes]:
        """Return the table and its manifest as files, by name."""
        return {
            TABLE: table(self.result).encode(),
            MANIFEST: as_json(self.manifest(arguments)).encode(),
        }


def run(
    physics: Physics, *, threads: int | None = None, progress: Progress | None = None
) -> Landscape:
    """Simulate every design of the 2x2x2 lattice.

    Parameters are those of `simulate`, which see.
    """
    origin = provenance(threads=threads)
    wall, cpu = time.perf_counter(), time.process_time()
    result = simulate(np.arange(N_DESIGNS), physics, threads=threads, progress=progress)
    return Landscape(result, origin, time.perf_counter() - wall, time.process_time() - cpu)


def rows(result: Result) -> Iterator[tuple[int | str, ...]]:
    """Yield the table's rows; numbers are written so that they read back to the same bits."""
    for i, (displacement, fitness) in enumerate(
        zip(result.displacement.tolist(), result.fitness.tolist(), strict=True)
    ):
        design = result.design(i)
        numbers = map(repr, (*displacement, fitness))
        yield design.index, design.digits, *numbers, str(result.status[i])


def table(result: Result) -> str:
    """Return a result as CSV."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows(rows(result))
    return text.getvalue()


def as_json(values: dict[str, Any]) -> str:
    """Return JSON as the files of a landscape have it."""
    return json.dumps(values, indent=2, allow_nan=False) + "\n"


def ranking(result: Result) -> NDArray[np.intp]:
    """Return the designs that did not diverge, best first; equal ones by index."""
    order = np.argsort(-result.fitness, kind="stable")
    return order[~np.isnan(result.fitness[order])]


def _summary(result: Result, i: int) -> dict[str, Any]:
    design = result.design(i)
    return {
        "design": design.index,
        "digits": design.digits,
        "fitness": float(result.fitness[i]),
    }
