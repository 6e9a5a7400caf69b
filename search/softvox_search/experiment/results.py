"""A folder of results: one file per run, a summary of them all, and the one reader of both.

A run's file appears whole, and carries a digest of all its bytes: whatever happened to it is found
when it is read. runs.csv has a row per run and manifest.json says what it is the result of; both
can be written again from the files of the runs.
"""

from __future__ import annotations

import contextlib
import csv
import errno
import fcntl
import hashlib
import io
import json
import os
import secrets
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from softvox_gym.files import write_file
from softvox_search.experiment.run import SUMMARY
from softvox_search.experiment.schema import Problem, UsageError, of_dict
from softvox_search.log import Columns

if TYPE_CHECKING:
    import pandas as pd

FOLDER, RUNS, FAILED, MANIFEST = "runs", "runs.csv", "failed.csv", "manifest.json"

#: What is thrown away to start anew; the manifest first, as it vouches for the others.
OURS = (MANIFEST, RUNS, FAILED, "report.md", FOLDER, "tables", "figures")

_COUNTERS = ("sequence", "unique_sequence")
_TEXT = ("run", "searcher", "physics", "shape", "policy", "status", "digest")

_MARK, _BLANK = b"sha256 with zeros here: ", b"0" * 64

Say = Callable[[str], None]


class ResultsError(UsageError):
    """Results that are missing or damaged: one line, with the command that makes them again."""


class Manifest(msgspec.Struct, kw_only=True):
    """What is read of manifest.json, which has more.

    Parameters
    ----------
    experiment : dict
        As `Experiment.to_dict` returns it.
    command : str
        What to type to make the results again.
    made_with : dict
        As `softvox_search.experiment.run.made_with` returns it.
    code : str
        Digest of the source.
    failed : list of str
        Identities of the runs that failed.
    files : dict of str
        SHA-256 of runs.csv.
    notes : list of str
        What happened to the folder.
    """

    experiment: dict[str, Any]
    command: str
    made_with: dict[str, Any]
    code: str
    failed: list[str]
    files: dict[str, str]
    notes: list[str] = []


@dataclass(frozen=True, eq=False)
class Results:
    """The results of an experiment.

    Parameters
    ----------
    folder : Path
    title : str
    command : str
        What to type to make these results again.
    experiment : dict
        As `Experiment.to_dict` returns it.
    runs : DataFrame
        One row per run.

        =========== ======================================================================
        run         its identity
        searcher    label of the searcher
        physics     label of the physics
        shape       of the lattice, "2x2x2"
        level       of the noise; NaN where the experiment has no such axis
        policy      against luck; "" where there is none
        seed        index of the seed
        status      "ok" or "failed"
        unique      evaluations used that no cache answered; under noise each is one
        evaluations evaluations used
        steps       simulated time steps
        recommended number of the design that the searcher recommends in the end; its digits
                    where int64 can't hold that
        believed    what the searcher believes that design to be worth, voxel widths
        digest      of the run's log
        file        of the run, relative to the folder
        =========== ======================================================================
    """

    folder: Path
    title: str
    command: str
    experiment: dict[str, Any]
    runs: pd.DataFrame

    def evaluations(self, run: str) -> Columns:
        """Return the log of a run, column by column; see `softvox_search.log`.

        Raises
        ------
        ResultsError
            Where its file is missing or damaged.
        """
        path = run_path(self.folder, run)
        try:
            table = decode(path.read_bytes(), run)[1]
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) else error
            raise ResultsError(f"{path}: {why}; {self.command} makes it again") from None
        return {name: table[name].to_numpy() for name in table.column_names}

    @property
    def budgets(self) -> dict[str, dict[str, Any]]:
        """The budget of every searcher, by label: "unique", "evaluations", ... or None."""
        choices = of_dict(self.experiment, MANIFEST).searcher_choices()
        return {choice.label: dict(vars(choice.budget)) for choice in choices}

    @property
    def problems(self) -> list[Problem]:
        """The problems that the searchers were put to."""
        return of_dict(self.experiment, MANIFEST).problems()


def read(folder: Path) -> Results:
    """Read a folder of finished results.

    Raises
    ------
    ResultsError
        Where they are missing, unfinished or damaged; it names the command that makes them.
    """
    manifest = read_manifest(folder)
    if manifest is None:
        state = "are not finished" if (folder / FOLDER).is_dir() else "are not there"
        raise ResultsError(
            f"{folder}: results {state}; softvox compare FILE.toml --out {folder} makes them"
        )
    if RUNS not in manifest.files:
        raise ResultsError(
            f"{folder} holds only a part of the results; softvox merge {folder} ... --out ALL puts "
            "the parts together"
        )
    path = folder / RUNS
    if file_digest(path) != manifest.files[RUNS]:
        raise ResultsError(
            f"{path} is not as it was written; {manifest.command} writes it again from the runs"
        )
    experiment = of_dict(manifest.experiment, str(folder / MANIFEST))
    return Results(folder, experiment.title, manifest.command, manifest.experiment, _frame(path))


def read_manifest(folder: Path) -> Manifest | None:
    """Return the manifest; None where there is none.

    Raises
    ------
    ResultsError
        Where it can't be read as one.
    """
    path, data = folder / MANIFEST, None
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        return msgspec.convert(data, Manifest)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except ValueError as error:  # msgspec.ValidationError is one
        command = data.get("command") if isinstance(data, dict) else None
        raise ResultsError(
            f"{path} is damaged: {' '.join(str(error).split())}; remove it, and "
            f"{command or 'softvox compare FILE.toml'} writes it again from the runs"
        ) from None


def encode(identity: str, summary: dict[str, Any], columns: Columns) -> bytes:
    """Return a run as a Parquet file, with its summary and a digest of all bytes in the footer."""
    table, sink = pa.table(columns), io.BytesIO()
    with pq.ParquetWriter(
        sink,
        table.schema,
        compression="zstd",
        store_schema=False,
        use_dictionary=[name for name in columns if name not in _COUNTERS],
        column_encoding=dict.fromkeys(_COUNTERS, "DELTA_BINARY_PACKED"),
    ) as writer:
        writer.write_table(table)
        facts = json.dumps({"run": identity, **summary})
        writer.add_key_value_metadata({"run": facts, "digest": (_MARK + _BLANK).decode()})
    head, tail = sink.getvalue().split(_MARK + _BLANK)
    return head + _MARK + _digest(head, tail) + tail


def decode(content: bytes, identity: str) -> tuple[dict[str, Any], pa.Table]:
    """Return summary and log of a run from its file.

    Raises
    ------
    ValueError
        Where a bit of the file is not as it was written, or it is another run's.
    """
    head, _, rest = content.rpartition(_MARK)
    if rest[:64] != _digest(head, rest[64:]):
        raise ValueError("is damaged")
    table = pq.read_table(pa.BufferReader(content), use_threads=False)
    metadata = pq.read_metadata(pa.BufferReader(content)).metadata
    summary: dict[str, Any] = json.loads(metadata[b"run"])
    if summary.pop("run") != identity:
        raise ValueError("is another run's")
    return summary, table


def run_path(folder: Path, identity: str) -> Path:
    """Return where the file of a run is."""
    return folder / FOLDER / f"{identity[:16]}.parquet"


def write_run(folder: Path, identity: str, content: bytes) -> None:
    """Write the file of a run, which appears whole.

    It is not brought to the disk at once: what a power cut damages is found by its digest.

    Raises
    ------
    OSError
        Where it can't be written.
    """
    path = run_path(folder, identity)
    temporary = path.with_name(f".{path.name}.partial-{secrets.token_hex(6)}")
    try:
        temporary.write_bytes(content)
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def finished(folder: Path, identities: Iterable[str], say: Say) -> dict[str, dict[str, Any]]:
    """Return the summaries of the runs that are there; set damaged files aside.

    Parameters
    ----------
    folder : Path
    identities : iterable of str
        Of the runs to look for.
    say : callable (message)
        Called for every file that is damaged, and was renamed.
    """
    summaries = {}
    for identity in identities:
        path = run_path(folder, identity)
        try:
            summaries[identity] = decode(path.read_bytes(), identity)[0]
        except FileNotFoundError:
            continue
        except ValueError as error:
            aside = path.with_suffix(".damaged")
            path.rename(aside)
            say(f"{path} {error}: it is set aside as {aside.name}, and the run is missing")
    return summaries


@contextlib.contextmanager
def locked(folder: Path, say: Say, *, shared: bool) -> Iterator[None]:
    """Keep other processes from writing there, but for those that share it as well.

    Raises
    ------
    UsageError
        Where another process is writing there.
    """
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            kind = fcntl.LOCK_SH if shared else fcntl.LOCK_EX
            fcntl.flock(descriptor, kind | fcntl.LOCK_NB)
        except BlockingIOError:
            raise UsageError(
                f"{folder} is being written by another process; wait for it, or choose another"
            ) from None
        except OSError as error:
            if error.errno not in (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP):
                raise
            say(
                f"{folder} is on a file system without locks ({error.strerror}): two processes "
                "that write there do the same runs twice"
            )
        if not shared:
            for path in folder.rglob(".*.partial-*"):  # what a killed process left
                path.unlink(missing_ok=True)
        yield
    finally:
        os.close(descriptor)


def clear(folder: Path) -> None:
    """Throw earlier results away."""
    for path in (folder / name for name in OURS):
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def write_runs(folder: Path, rows: dict[str, dict[str, Any]]) -> str:
    """Write runs.csv from the summaries of the runs, by identity; return its SHA-256."""
    table = [[run, *(_cell(row.get(name)) for name in SUMMARY)] for run, row in rows.items()]
    write_csv(folder / RUNS, ("run", *SUMMARY), table)
    return file_digest(folder / RUNS)


def write_csv(path: Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table, which appears whole."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    write_file(path, text.getvalue().encode(), force=True)


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file; "" where it doesn't exist."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except FileNotFoundError:
        return ""


def _digest(head: bytes, tail: bytes) -> bytes:
    return hashlib.sha256(head + _MARK + _BLANK + tail).hexdigest().encode()


def _cell(value: Any) -> Any:
    """Return a value as CSV has it: nothing for None, floats so that they read back the same."""
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else value


def _frame(path: Path) -> pd.DataFrame:
    """Return runs.csv as a data frame; only numbers can be missing, a text may be "nan"."""
    import pandas as pd

    table = pd.read_csv(path, dtype=str, keep_default_na=False)
    for name in table.columns.difference(list(_TEXT)):
        table[name] = pd.Series([_number(text) for text in table[name]])
    table["file"] = [f"{FOLDER}/{run_path(Path(), run).name}" for run in table["run"]]
    return table


def _number(text: str) -> int | float | str:
    if text.isdecimal():  # digits of a design are longer than any number of one
        return int(text) if len(text) < 20 else text
    return float(text or "nan")
