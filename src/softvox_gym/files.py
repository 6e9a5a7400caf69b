"""Writing results: completely or not at all, and never over existing ones unless forced."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import secrets
import shutil
import tempfile
import zipfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

#: Names of what is being written, and of what a killed process left.
PARTIAL = ".*.partial-*"


class OutputError(Exception):
    """Results can't be written to a place; the message gives the reason and the remedy."""


def check_file(path: Path, *, force: bool) -> None:
    """Raise OutputError, before the work, if a file can't be written, or exists without force."""
    if path.is_dir():
        raise OutputError(f"{path} is a folder; name a file")
    if os.path.lexists(path) and not force:
        raise OutputError(f"{path} exists; choose another, or replace it with --force")
    if path.exists() and not path.is_file():
        raise OutputError(f"{path} is a device or pipe; name a file")
    _check_writable(path.parent)


def check_folder(path: Path, names: Iterable[str], *, force: bool) -> None:
    """Raise OutputError, before the work, if files of these names can't be written to a folder.

    Without force, the folder must be new or empty.
    """
    if not path.is_dir():
        if os.path.lexists(path) and not path.is_dir():  # another process may have made it
            raise OutputError(f"{path} is not a folder; choose another")
        _check_writable(path.parent)
        return
    _check_writable(path)
    if any(path.iterdir()) and not force:
        raise OutputError(f"{path} is not empty; choose another, or replace it with --force")
    for name in names:
        if (path / name).is_dir():
            raise OutputError(f"{path / name} is a folder; choose another")


def write_file(path: Path, content: bytes, *, force: bool) -> None:
    """Write a file: after a crash or an interrupt it is complete, or as it was before.

    Raises
    ------
    OutputError
        If writing fails, or the file exists and force is not given.
    """
    with _temporary(path.parent, path) as temporary:
        _write(temporary, content)
        _put(temporary, path, force=force)
        _sync_folder(path.parent)


def archive_of(arrays: Mapping[str, NDArray[Any]], packing: int = zipfile.ZIP_LZMA) -> bytes:
    """Return arrays as an .npz archive that `numpy.load` reads; the same bytes for the same arrays.

    With LZMA, archives of tracks are a third smaller than those of `numpy.savez_compressed`, and
    take four times as long to read as with `zipfile.ZIP_DEFLATED`.
    """
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as archive:
        for name, values in arrays.items():
            array = io.BytesIO()
            np.save(array, values, allow_pickle=False)
            member = zipfile.ZipInfo(f"{name}.npy")  # its date is fixed
            archive.writestr(member, array.getvalue(), packing)
    return content.getvalue()


def write_folder(path: Path, contents: Mapping[str, bytes | str], *, force: bool) -> None:
    """Write a folder of files: after a crash or an interrupt no file in it is incomplete.

    A new folder appears with all its files at once. Into an existing folder the files are moved one
    by one, in the order given; other files there are left alone.

    Raises
    ------
    OutputError
        If writing fails, or a file exists and force is not given.
    """
    exists = path.is_dir()
    with _temporary(path if exists else path.parent, path) as temporary:
        temporary.mkdir()
        for name, content in contents.items():
            _write(temporary / name, content.encode() if isinstance(content, str) else content)
        _sync_folder(temporary)
        if exists:
            for name in contents:
                _put(temporary / name, path / name, force=force)
        else:
            os.rename(temporary, path)
        _sync_folder(path if exists else path.parent)


@contextlib.contextmanager
def _temporary(folder: Path, path: Path) -> Iterator[Path]:
    """Yield an unused hidden name; delete it afterwards, unless the results could not be moved."""
    temporary = folder / f".{path.name[:40]}.partial-{secrets.token_hex(6)}"  # below 255 bytes
    is_stranded = False
    try:
        yield temporary
    except OSError as error:
        if is_stranded := error.errno in (errno.EEXIST, errno.ENOTEMPTY):
            raise OutputError(
                f"{path} was written by another process meanwhile; the results are in {temporary}"
            ) from None
        raise OutputError(f"cannot write {path}: {error.strerror}") from None
    finally:
        if temporary.is_dir() and not is_stranded:
            shutil.rmtree(temporary, ignore_errors=True)
        elif not is_stranded:
            with contextlib.suppress(OSError):
                temporary.unlink()


def _write(path: Path, content: bytes) -> None:
    with path.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _put(source: Path, target: Path, *, force: bool) -> None:
    """Move a file into place; without force, never over one that appeared meanwhile."""
    if not force:
        try:
            os.link(source, target)  # unlike a rename, this refuses where the target exists
        except OSError:  # perhaps a file system without hard links
            if os.path.lexists(target):
                raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST)) from None
            os.replace(source, target)
    else:
        os.replace(source, target)


def _sync_folder(folder: Path) -> None:
    """Flush a folder's entries to the disk, if the file system can."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _check_writable(folder: Path) -> None:
    if not folder.is_dir():
        raise OutputError(f"{folder} is not a folder; make it first, or choose another")
    try:
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise OutputError(
            f"{folder} can't be written to ({error.strerror}); choose another"
        ) from None
