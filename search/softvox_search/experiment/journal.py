"""The journal: what an experiment has done so far, safe against being killed at any moment.

A file of records, appended by one process. A record is its length and the SHA-256 of its content,
then the content; the first record says what the results depend on, each of the others holds a run.
Whatever a crash leaves at the end is found by its checksum, and cut off.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import struct
import time
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any

from softvox_gym.files import write_file

MAGIC = b"softvox journal 1\n"

#: s between two calls that bring the file to the disk: a power cut costs the runs of so long.
SYNC_EVERY = 1.0

_HEAD = struct.Struct("<Q32s")
_RUN = struct.Struct("<I")


class JournalError(Exception):
    """A file that is no journal, or one of something else; one line, with the mend."""


class Journal:
    """A journal open for appending.

    Parameters
    ----------
    path : Path
        Created where it doesn't exist, or where not even its first record is whole.
    identity : dict
        What the results depend on, ready for JSON.

    Attributes
    ----------
    dropped : int
        Bytes at its end that were damaged, and were cut off.

    Raises
    ------
    JournalError
        Where the file is no journal.
    OSError
        Where it can't be read or written.
    """

    def __init__(self, path: Path, identity: dict[str, Any]) -> None:
        self.dropped = 0
        found = _first(path)
        if found is None:
            self.dropped = path.stat().st_size if path.exists() else 0
            content = json.dumps(identity, sort_keys=True).encode()
            write_file(path, MAGIC + _framed(content), force=True)
            found = content
        self.identity: dict[str, Any] = json.loads(found)
        self._file = os.open(path, os.O_RDWR | os.O_APPEND | getattr(os, "O_CLOEXEC", 0))
        self._where: dict[int, tuple[int, int]] = {}
        self._size = len(MAGIC) + _HEAD.size + len(found)
        self._synced = time.monotonic()

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            self.sync()
        finally:
            os.close(self._file)

    @property
    def runs(self) -> list[int]:
        """Numbers of the runs that it holds, in order."""
        return sorted(self._where)

    def load(self) -> None:
        """Read which runs it holds, as far as its records are whole; cut off the rest.

        To be called before anything is appended, once it is known whose journal it is.
        """
        end = os.fstat(self._file).st_size
        while (content := self._record(self._size, end)) is not None:
            (run,) = _RUN.unpack_from(content)
            self._where[run] = (self._size + _HEAD.size + _RUN.size, len(content) - _RUN.size)
            self._size += _HEAD.size + len(content)
        self.dropped += end - self._size
        os.ftruncate(self._file, self._size)

    def append(self, run: int, content: bytes) -> None:
        """Append a run: it is in the journal in full, or not at all.

        Raises
        ------
        OSError
            Where it can't be written.
        """
        framed = _framed(_RUN.pack(run) + content)
        try:
            _write(self._file, framed)
        except BaseException:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, self._size)
            raise
        self._where[run] = (self._size + _HEAD.size + _RUN.size, len(content))
        self._size += len(framed)
        if time.monotonic() - self._synced > SYNC_EVERY:
            self.sync()

    def sync(self) -> None:
        """Bring it to the disk."""
        os.fsync(self._file)
        self._synced = time.monotonic()

    def contents(self) -> Iterator[bytes]:
        """Yield the content of every run, in the order of their numbers, one at a time."""
        for run in self.runs:
            offset, length = self._where[run]
            yield _read(self._file, length, offset)

    def _record(self, offset: int, end: int) -> bytes | None:
        """Return the content of the record at an offset, or None where none is whole."""
        head = _read(self._file, _HEAD.size, offset)
        if len(head) < _HEAD.size:
            return None
        length, digest = _HEAD.unpack(head)
        if not _RUN.size <= length <= end - offset - _HEAD.size:
            return None
        content = _read(self._file, length, offset + _HEAD.size)
        return content if hashlib.sha256(content).digest() == digest else None


def _first(path: Path) -> bytes | None:
    """Return the content of a journal's first record; None where there is no whole one."""
    try:
        content = path.open("rb")
    except FileNotFoundError:
        return None
    with content as file:
        magic = file.read(len(MAGIC))
        if not MAGIC.startswith(magic):
            raise JournalError(f"{path} is not a journal of this version; choose another folder")
        head = file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            return None
        length, digest = _HEAD.unpack(head)
        if length > path.stat().st_size:
            return None
        first = file.read(length)
    return first if hashlib.sha256(first).digest() == digest else None


def _framed(content: bytes) -> bytes:
    return _HEAD.pack(len(content), hashlib.sha256(content).digest()) + content


def _write(file: int, content: bytes) -> None:
    left = memoryview(content)
    while left:
        left = left[os.write(file, left) :]


def _read(file: int, length: int, offset: int) -> bytes:
    parts = []
    while length and (part := os.pread(file, length, offset)):
        parts.append(part)
        offset, length = offset + len(part), length - len(part)
    return b"".join(parts)
