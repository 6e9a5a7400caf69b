"""Files of landscapes that were computed here, in the user's cache folder."""

from __future__ import annotations

import contextlib
import hashlib
import io
import json
import os
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softvox_gym.files import OutputError, write_file
from softvox_gym.lattice import Lattice
from softvox_gym.manifest import engine_probe
from softvox_gym.physics import Physics
from softvox_gym.realities import Reality

#: Format of the files; increase it with every change of their content.
FORMAT = 3

#: The lattice that is not named in a file's name.
ONE_PHASE = Lattice(2, 2, 2)


def cache_path(physics: Physics | Reality, lattice: Lattice = ONE_PHASE) -> Path | None:
    """Return the file of a physics' landscape; None if the user has no home folder.

    The name depends on everything that the table depends on: the physics or the reality, the bits
    of the engine (`engine_probe`), and the format.
    """
    facts = Reality.of(physics).to_dict()
    identity = {"format": FORMAT, "engine": engine_probe(), **facts}
    if lattice != ONE_PHASE:
        identity["lattice"] = [*lattice, lattice.phases]
    name = hashlib.sha256(json.dumps(identity, sort_keys=True).encode()).hexdigest()
    folder = os.environ.get("SOFTVOX_CACHE")
    try:
        return (Path(folder) if folder else _user_folder()) / f"landscape-{name}.npy"
    except RuntimeError:  # there is no home folder
        return None


def _user_folder() -> Path:
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches" / "softvox-gym"
    base = Path(os.environ.get("XDG_CACHE_HOME", ""))
    return (base if base.is_absolute() else Path.home() / ".cache") / "softvox-gym"


def write(path: Path, values: NDArray[np.float64]) -> None:
    """Store the values of a table, as `read` returns them, with a digest; do nothing if denied."""
    array = io.BytesIO()
    np.save(array, values)
    content = array.getvalue()
    with contextlib.suppress(OSError, OutputError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, content + _seal(path, content), force=True)


def read(path: Path) -> NDArray[np.float64] | None:
    """Return displacements and steps, shape (n, 4); None if the file is missing or damaged."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    array, seal = content[:-32], content[-32:]
    if seal != _seal(path, array):
        return None
    kept: NDArray[np.float64] = np.load(io.BytesIO(array))
    return kept


def _seal(path: Path, content: bytes) -> bytes:
    return hashlib.sha256(path.name.encode() + content).digest()
