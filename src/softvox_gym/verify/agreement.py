"""How far two sets of numbers agree, as rows of a table with a verdict each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

OK, FAILED, EXCEPTED, NOT_JUDGED = "ok", "FAILED", "known", "not judged"

#: Verdicts of what is reported only.
UNJUDGED = NOT_JUDGED, NOT_JUDGED


@dataclass(frozen=True)
class Row:
    """One line of the agreement table: how many of those compared agree within the tolerance.

    The largest difference is NaN where a number is missing.
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
        """Whether nothing speaks against the build."""
        return self.verdict != FAILED


def count(name: str, agree: ArrayLike, *, largest: float | None = None, note: str = "") -> Row:
    """Return the row of things each of which agrees or does not, shape (n,)."""
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
    """Hold differences, shape (n,), against a tolerance; a NaN is above it.

    The verdicts are for where all are within the tolerance, and where one is not.
    """
    values = np.asarray(difference, dtype=np.float64)
    agree = int(np.count_nonzero(values <= tolerance))
    verdict = verdicts[agree < len(values)]
    return Row(name, verdict, agree, len(values), float(values.max(initial=0)), tolerance, note)


def differences(found: ArrayLike, wanted: ArrayLike) -> NDArray[np.float64]:
    """Return the largest absolute difference in each row; NaN where a number is missing."""
    return np.asarray(np.abs(np.subtract(found, wanted)).max(axis=1))
