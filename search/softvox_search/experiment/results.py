"""A folder of results: one file per run, a summary of all runs, and the reader of both.

A run's file is written atomically, and carries a digest of all its bytes, so any damage is found on
reading. runs.csv has a row per run, and manifest.json describes the experiment; both can be
restored from the files of the runs.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import hashlib
import io
import json
import os
import shutil
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import pyarrow as pa
import pyarrow.parquet as pq

from softvox_gym.files import PARTIAL, write_file
from softvox_search.experiment.schema import Problem, UsageError, of_dict
from softvox_search.log import Columns

if TYPE_CHECKING:
    import pandas as pd

FOLDER, RUNS, FAILED, MANIFEST = "runs", "runs.csv", "failed.csv", "manifest.json"

#: What --force deletes; the manifest first, as it vouches for the others.
OURS = (MANIFEST, RUNS, FAILED, "report.md", FOLDER, "tables", "figures")

_COUNTERS = ("sequence", "unique_sequence")
TEXT_COLUMNS = (
    *("run", "searcher", "physics", "shape", "policy", "status", "digest"),
    *("method", "reality", "task"),
)

_MARK, _BLANK = b"sha256 with zeros here: ", b"0" * 64

Say = Callable[[str], None]


class ResultsError(UsageError):
    """Missing or damaged results: one line, with the command that makes them again."""


class Manifest(msgspec.Struct, kw_only=True):
    """The part of manifest.json that is read; the file has more."""

    experiment: dict[str, Any]  #: As `Experiment.to_dict` returns it.
    command: str  #: The command that reproduces the results, without --out.
    made_with: dict[str, Any]  #: As `run.made_with` returns it.
    code: str  #: Digest of the source.
    failed: list[str]  #: Identities of the runs that failed.
    files: dict[str, str]  #: SHA-256 of runs.csv; empty if runs are missing.
    notes: list[str] = []  #: Events in the history of the folder.


@dataclass(frozen=True, eq=False)
class Results:
    """The results of an experiment.

    Parameters
    ----------
    folder : Path
    title : str
    command : str
        The command that reproduces these results.
    experiment : dict
        As `Experiment.to_dict` returns it.
    runs : DataFrame
        One row per run.

        =========== ======================================================================
        run         its identity
        searcher    label of the searcher
        physics     label of the physics
        shape       of the lattice, "2x2x2"
        level       noise level; NaN if the experiment has no levels
        policy      noise policy; "" if there is none
        seed        index of the seed
        status      "ok" or "failed"
        unique      evaluations used that no cache answered; under noise, all of them
        evaluations evaluations used
        steps       simulated time steps
        recommended number of the design that the searcher recommends in the end; its digits
                    if int64 can't hold the number; None if the run failed
        believed    the searcher's own estimate of that design's fitness, voxel widths
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
            If its file is missing or damaged.
        """
        path = run_path(self.folder, run)
        try:
            table = decode(path.read_bytes(), run)[1]
        except (OSError, ValueError) as error:
            why = error.strerror if isinstance(error, OSError) else error
            raise ResultsError(f"{path}: {why}; {self.repair} makes it again") from None
        return {name: table[name].to_numpy() for name in table.column_names}

    @property
    def is_of_transfer(self) -> bool:
        """Whether they are results of transfer methods, not of searchers."""
        return "methods" in self.experiment

    @property
    def repair(self) -> str:
        """The command that makes the missing results."""
        return f"{self.command} --out {self.folder}"

    @cached_property
    def of_file(self) -> Any:
        """The experiment, as `schema.of_dict` returns it."""
        return of_dict(self.experiment, MANIFEST)

    @property
    def budgets(self) -> dict[str, dict[str, Any]]:
        """The budget of every searcher, by label: "unique", "evaluations", ... or None."""
        choices = self.of_file.searcher_choices()
        return {str(choice.label): vars(choice.budget.checked()) for choice in choices}

    @property
    def problems(self) -> list[Problem]:
        """The problems that the searchers were put to."""
        made: list[Problem] = self.of_file.problems()
        return made


def read(folder: Path, *, of_transfer: bool | None = False) -> Results:
    """Read a folder of finished results: of searchers, of transfer methods, or of either if None.

    Raises
    ------
    ResultsError
        If they are missing, unfinished or damaged; it names the command that makes them.
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
            f"{path} is not as it was written; {manifest.command} --out {folder} writes it again "
            "from the runs"
        )
    if of_transfer is not None and of_transfer != ("methods" in manifest.experiment):
        kinds = ("searchers", "transfer methods")[:: -1 if of_transfer else 1]
        raise ResultsError(
            f"{folder} holds results of {kinds[1]}, and those of {kinds[0]} are needed"
        )
    import pandas as pd

    title = of_dict(manifest.experiment, str(folder / MANIFEST)).title
    runs = read_csv(path, (*TEXT_COLUMNS, "recommended"), level=_number, believed=_number)
    if "recommended" in runs:
        # As text: a missing value would make all floats, which can't hold large integers.
        designs = [_design(text) for text in runs["recommended"]]
        runs["recommended"] = pd.Series(designs, dtype=object if None in designs else None)
    runs["file"] = [f"{FOLDER}/{run_path(Path(), run).name}" for run in runs["run"]]
    return Results(folder, title, manifest.command, manifest.experiment, runs)


def read_manifest(folder: Path) -> Manifest | None:
    """Return the manifest; None if there is none.

    Raises
    ------
    ResultsError
        If it can't be read.
    """
    path, data = folder / MANIFEST, None
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
        return msgspec.convert(data, Manifest)
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (ValueError, msgspec.ValidationError) as error:  # which is a ValueError in some versions
        command = data.get("command") if isinstance(data, dict) else None
        raise ResultsError(
            f"{path} is damaged: {' '.join(str(error).split())}; remove it, and "
            f"{command or 'softvox compare FILE.toml'} --out {folder} writes it again from the runs"
        ) from None


def encode(identity: str, summary: dict[str, Any], columns: Columns) -> bytes:
    """Encode a run as a Parquet file, with its summary and a digest of all bytes in the footer."""
    table, sink = pa.table(columns), io.BytesIO()
    with pq.ParquetWriter(
        sink,
        table.schema,
        compression="zstd",
        store_schema=False,
        use_dictionary=[name for name in columns if name not in _COUNTERS],
        column_encoding={name: "DELTA_BINARY_PACKED" for name in _COUNTERS if name in columns},
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
        If a bit of the file has changed, or it is another run's.
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
    """Return the path of a run's file."""
    return folder / FOLDER / f"{identity[:16]}.parquet"


def finished(folder: Path, identities: Iterable[str], say: Say) -> dict[str, dict[str, Any]]:
    """Return the summaries of the runs that are there; rename damaged files, and report these."""
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
    """Keep other processes from writing there, except those that share the lock.

    Raises
    ------
    UsageError
        If another process is writing there.
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
            for path in folder.rglob(PARTIAL):  # left by a killed process
                path.unlink(missing_ok=True)
        yield
    finally:
        os.close(descriptor)


def clear(folder: Path) -> None:
    """Delete earlier results. Without any there, files of the same names are not ours, and stay."""
    if not (folder / MANIFEST).exists() and not any((folder / FOLDER).glob("*.parquet")):
        return
    for path in (folder / name for name in OURS):
        if path.is_dir():
            shutil.rmtree(path)
        else:
            path.unlink(missing_ok=True)


def write_runs(folder: Path, rows: Sequence[dict[str, Any]], summary: Sequence[str]) -> str:
    """Write runs.csv from names and summaries of one run or more; return its SHA-256.

    A run that failed has only the first column of the summary, its status.
    """
    names = [name for name in rows[0] if name not in summary]
    write_csv(folder / RUNS, (*names, *summary), rows)
    return file_digest(folder / RUNS)


def write_csv(path: Path, header: Sequence[str], rows: Iterable[dict[str, Any]]) -> None:
    """Write a table atomically; None and what a row lacks become empty cells."""
    import pandas as pd

    table = pd.DataFrame(rows, columns=list(header), dtype=object)
    write_file(path, table.to_csv(index=False, lineterminator="\n").encode(), force=True)


def read_csv(path: Path, text: Iterable[str], **readers: Callable[[str], Any]) -> pd.DataFrame:
    """Read a table: some columns as text, some by functions, the rest as numbers, if possible.

    A text may be "nan".
    """
    import pandas as pd

    names = pd.read_csv(path, nrows=0).columns
    numbers = names.difference([*text, *readers])
    return pd.read_csv(
        path,
        dtype=dict.fromkeys(names.intersection(list(text)), str),
        converters=readers,
        keep_default_na=False,
        na_values={name: [""] for name in numbers},
    )


def file_digest(path: Path) -> str:
    """Return the SHA-256 of a file; "" if it doesn't exist."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except FileNotFoundError:
        return ""


def _digest(head: bytes, tail: bytes) -> bytes:
    return hashlib.sha256(head + _MARK + _BLANK + tail).hexdigest().encode()


def _design(text: str) -> int | str | None:
    """Return a design's number, or its digits, which are longer; None for an empty text."""
    return (int(text) if len(text) < 20 else text) if text else None


def _number(text: str) -> float:
    """Return a number exact to the last bit; not every version of pandas reads them so."""
    return float(text or "nan")
