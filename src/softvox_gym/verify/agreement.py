"""The agreement of two sets of numbers, as rows of a table, each with a verdict."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

OK, FAILED, EXCEPTED, NOT_JUDGED = "ok", "FAILED", "known", "not judged"

#: Verdicts of rows that are only reported.
UNJUDGED = NOT_JUDGED, NOT_JUDGED


@dataclass(frozen=True)
class Row:
    """A row of the agreement table: how many of the compared agree within the tolerance.

    The largest difference is NaN if a number is missing.
    """

    name: str
    verdict: str
    agree: int
    compared: int
    largest: float | None = None
    tolerance: float | None = None
    note: str = ""

    @property
    def passed(self) -> bool:
        """Whether the row shows no fault of the build."""
        return self.verdict != FAILED


def count(name: str, agree: ArrayLike, *, largest: float | None = None, note: str = "") -> Row:
    """Return the row for booleans, shape (n,), of whether each agrees."""
    flags = np.asarray(agree, dtype=bool)
    verdict = OK if flags.all() else FAILED
    return Row(name, verdict, int(flags.sum()), len(flags), largest, note=note)


def judge(
    name: str,
    difference: ArrayLike,
    tolerance: float,
    *,
    verdicts: tuple[str, str] = (OK, FAILED),
    note: str = "",
) -> Row:
    """Compare differences, shape (n,), with a tolerance; a NaN is above it.

    The verdicts are for all within the tolerance, and for any outside it.
    """
    values = np.asarray(difference, dtype=np.float64)
    agree = int(np.count_nonzero(values <= tolerance))
    verdict = verdicts[agree < len(values)]
    return Row(name, verdict, agree, len(values), float(values.max(initial=0)), tolerance, note)


def differences(found: ArrayLike, wanted: ArrayLike) -> NDArray[np.float64]:
    """Return the largest absolute difference in each row; NaN if a number is missing."""
    return np.asarray(np.abs(np.subtract(found, wanted)).max(axis=1))
