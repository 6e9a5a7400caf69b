"""The folder of results: one writer at a time, every file whole, and its manifest last."""

from __future__ import annotations

import contextlib
import csv
import fcntl
import hashlib
import io
import json
import os
import secrets
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq

from softvox_gym.files import write_file
from softvox_search.experiment.config import Experiment
from softvox_search.experiment.encoding import SCHEMA, Decoded
from softvox_search.experiment.job import SUMMARY
from softvox_search.experiment.journal import Journal
from softvox_search.experiment.pool import Failed

EVALUATIONS, RUNS, IMPROVEMENTS = "evaluations.parquet", "runs.csv", "improvements.csv"
FAILED, MANIFEST, JOURNAL = "failed.csv", "manifest.json", "journal.bin"
REPORT = "report.md"

#: Files that hold the results; the same experiment gives the same bytes.
DATA = (EVALUATIONS, RUNS, IMPROVEMENTS)

#: Those of which the report is made.
REPORTED = (RUNS, IMPROVEMENTS)

IMPROVEMENT = ("run", "terms", "sequence", "unique_sequence", "design", "fitness")

#: A group of rows ends with the run that fills it: so much is held in memory at a time.
ROWS_PER_GROUP = 500_000

_COUNTERS = ("sequence", "unique_sequence")


class FolderError(Exception):
    """A folder that results can't go to; one line, with the mend."""


@dataclass
class Totals:
    """Sums over the runs of a cell.

    Parameters
    ----------
    runs, evaluations, steps : int
    cpu_seconds : float
    """

    runs: int = 0
    evaluations: int = 0
    steps: int = 0
    cpu_seconds: float = 0.0

    def add(self, summary: dict[str, Any], seconds: float) -> None:
        """Add a run."""
        self.runs += 1
        self.evaluations += summary["evaluations"]
        self.steps += summary["steps"]
        self.cpu_seconds += seconds

    def to_dict(self) -> dict[str, Any]:
        """Return them ready for JSON, with evaluations per second of processor time."""
        speed = self.evaluations / self.cpu_seconds if self.cpu_seconds > 0 else None
        return {**vars(self), "evaluations_per_cpu_second": speed}


@dataclass
class Written:
    """What was written, and the sums for the manifest, cell by cell."""

    digests: dict[str, str] = field(default_factory=dict)
    cells: dict[int, Totals] = field(default_factory=dict)
    total: Totals = field(default_factory=Totals)


@contextlib.contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Keep other processes from writing there; clear away what a killed one left half written.

    Raises
    ------
    FolderError
        Where another process is writing there.
    """
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise FolderError(
                f"{folder} is being written by another process; wait for it, or choose another"
            ) from None
        for path in folder.glob(".*.partial-*"):
            if path.is_file():
                path.unlink()
        yield
    finally:
        os.close(descriptor)


def write_data(
    folder: Path, journal: Journal, experiment: Experiment, failed: Sequence[Failed]
) -> Written:
    """Write the results from the journal, in the order of the runs, one run at a time.

    Raises
    ------
    OutputError, OSError
        Where they can't be written.
    """
    runs = {run.number: run for run in experiment.runs()}
    written = Written()
    rows: dict[int, Sequence[Any]] = {
        failure.run: _failed_row(runs[failure.run]) for failure in failed
    }
    found = io.StringIO()
    improvements = csv.writer(found, lineterminator="\n")
    improvements.writerow(IMPROVEMENT)
    with _parquet(folder / EVALUATIONS) as evaluations:
        for record in map(Decoded, journal.contents()):
            facts = record.facts()
            summary, number = facts["summary"], facts["summary"]["run"]
            evaluations.add(record.evaluations())
            rows[number] = [_cell(summary[name]) for name in SUMMARY]
            columns = record.improvements()
            for row in zip(*(columns[name] for name in IMPROVEMENT[1:]), strict=True):
                improvements.writerow([number, *map(_cell, row)])
            cell = runs[number].cell.number
            written.cells.setdefault(cell, Totals()).add(summary, facts["seconds"])
            written.total.add(summary, facts["seconds"])
    _write_csv(folder / RUNS, SUMMARY, [rows[number] for number in sorted(rows)])
    write_file(folder / IMPROVEMENTS, found.getvalue().encode(), force=True)
    _write_failed(folder, failed, runs)
    written.digests = {name: file_digest(folder / name) for name in DATA}
    return written


def write_manifest(folder: Path, manifest: dict[str, Any]) -> None:
    """Write the manifest; from then on the results are complete."""
    text = json.dumps(manifest, indent=2, allow_nan=False) + "\n"
    write_file(folder / MANIFEST, text.encode(), force=True)


def read_manifest(folder: Path) -> dict[str, Any] | None:
    """Return the manifest; None where there is none.

    Raises
    ------
    FolderError
        Where it can't be read as one.
    """
    try:
        manifest = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except ValueError:
        manifest = None
    if not isinstance(manifest, dict) or not isinstance(manifest.get("files"), dict):
        raise FolderError(f"{folder / MANIFEST} is no manifest of results; choose another folder")
    return manifest


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file; "" where it doesn't exist."""
    try:
        with path.open("rb") as file:
            return hashlib.file_digest(file, "sha256").hexdigest()
    except FileNotFoundError:
        return ""


class _Groups:
    """Collects tables until they fill a group of rows."""

    def __init__(self, writer: Any) -> None:
        self._writer = writer
        self._tables: list[pa.Table] = []
        self._rows = 0

    def add(self, table: pa.Table) -> None:
        self._tables.append(table)
        self._rows += len(table)
        if self._rows >= ROWS_PER_GROUP:
            self.flush()

    def flush(self) -> None:
        if self._rows:
            self._writer.write_table(pa.concat_tables(self._tables), row_group_size=self._rows)
        self._tables, self._rows = [], 0


@contextlib.contextmanager
def _parquet(path: Path) -> Iterator[_Groups]:
    """Write a Parquet file that is there in full, or as it was before."""
    temporary = path.with_name(f".{path.name}.partial-{secrets.token_hex(6)}")
    options: dict[str, Any] = {
        "compression": "zstd",
        "use_dictionary": [name for name in SCHEMA.names if name not in _COUNTERS],
        "column_encoding": dict.fromkeys(_COUNTERS, "DELTA_BINARY_PACKED"),
    }
    try:
        with pq.ParquetWriter(temporary, SCHEMA, **options) as writer:
            groups = _Groups(writer)
            yield groups
            groups.flush()
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _write_csv(path: Path, header: Iterable[str], rows: Iterable[Sequence[Any]]) -> None:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    write_file(path, text.getvalue().encode(), force=True)


def _write_failed(folder: Path, failed: Sequence[Failed], runs: dict[int, Any]) -> None:
    if not failed:
        (folder / FAILED).unlink(missing_ok=True)
        return
    header = ("run", "searcher", "level", "policy", "seed", "error", "trace")
    rows = [
        (*_failed_row(runs[failure.run])[:5], failure.error, failure.trace)
        for failure in sorted(failed, key=lambda failure: failure.run)
    ]
    _write_csv(folder / FAILED, header, rows)


def _failed_row(run: Any) -> list[Any]:
    cell = run.cell
    policy = cell.policy.name if cell.policy else ""
    known = [run.number, cell.searcher.label, _cell(cell.level), policy, run.seed, "failed"]
    return [*known, *[""] * (len(SUMMARY) - len(known))]


def _cell(value: Any) -> Any:
    """Return a value as CSV has it: nothing for None, floats so that they read back the same."""
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else value
