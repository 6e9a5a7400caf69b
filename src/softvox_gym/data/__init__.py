"""Reference data: measured from the authors' own engine, and the published table."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from importlib.resources import files
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Records: TypeAlias = list[dict[str, str]]

_DATA = files("softvox_gym.data")
_FOLDER = _DATA / "authors"


def records(name: str, folder: str = "authors") -> Records:
    """Return the rows of a CSV file."""
    path = _DATA / folder / name
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))


def document(name: str) -> Any:
    """Return the content of a JSON file."""
    return json.loads((_FOLDER / name).read_text(encoding="utf-8"))


def trajectory_names() -> list[str]:
    """Return the designs with a trajectory, as in the files' names."""
    paths = (_FOLDER / "trajectories").iterdir()
    return sorted(path.name.removesuffix(".csv") for path in paths)


def designs(rows: Iterable[Mapping[str, Any]]) -> list[int]:
    """Return the design numbers of some rows."""
    return [int(row["design"]) for row in rows]


def numbers(rows: Sequence[Mapping[str, Any]], *names: str) -> NDArray[np.float64]:
    """Return columns of some rows, shape (n, columns)."""
    return np.array([[float(row[name]) for name in names] for row in rows])


def flags(rows: Iterable[Mapping[str, Any]], name: str) -> NDArray[np.bool_]:
    """Return a column of zeros and ones as booleans."""
    return np.array([row[name] == "1" for row in rows])
