"""How far two sets of numbers agree, as rows of a table with a verdict each."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

OK, FAILED, EXCEPTED, NOT_JUDGED = "ok", "FAILED", "known", "not judged"


@dataclass(frozen=True)
class Row:
    """One line of the agreement table.

    Parameters
    ----------
    name : str
        What was compared.
    verdict : {"ok", "FAILED", "known", "not judged"}
    agree, compared : int
        How many of how many agree within the tolerance.
    largest : float or None
        Largest difference; NaN where a number is missing.
    tolerance : float or None
    note : str
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


@dataclass(frozen=True)
class Known:
    """A difference above the tolerance that has a reason.

    Parameters
    ----------
    limit : float
        The difference that is accepted.
    reason : str
    """

    limit: float
    reason: str


def differences(found: ArrayLike, wanted: ArrayLike) -> NDArray[np.float64]:
    """Return the largest absolute difference in each row; NaN where a number is missing."""
    difference: NDArray[np.float64] = np.abs(np.asarray(found) - np.asarray(wanted))
    largest: NDArray[np.float64] = difference.max(axis=1)
    return largest


def judge(
    name: str,
    difference: ArrayLike,
    tolerance: float,
    *,
    judged: bool = True,
    note: str = "",
) -> Row:
    """Hold differences against a tolerance; a NaN is a failure.

    Parameters
    ----------
    name : str
    difference : array_like, shape (n,)
    tolerance : float
    judged : bool
        Whether it matters; otherwise it is only reported.
    note : str
    """
    values = np.asarray(difference, dtype=np.float64)
    agree = int(np.count_nonzero(values <= tolerance))
    verdict = (OK if agree == len(values) else FAILED) if judged else NOT_JUDGED
    largest = float(values.max(initial=0.0))
    return Row(name, verdict, agree, len(values), largest, tolerance, note)


def judge_with_exceptions(
    name: str,
    designs: Sequence[int],
    difference: ArrayLike,
    tolerance: float,
    exceptions: Mapping[Hashable, Known],
) -> Iterator[Row]:
    """Hold differences against a tolerance, and those of excepted designs each against its own.

    Parameters
    ----------
    name : str
    designs : sequence of int
    difference : array_like, shape (n,)
    tolerance : float
    exceptions : mapping of (name, design) to Known

    Yields
    ------
    Row
        For all other designs together, then for every exception.
    """
    values = np.asarray(difference, dtype=np.float64)
    excepted = np.array([(name, design) in exceptions for design in designs], dtype=bool)
    yield judge(name, values[~excepted], tolerance)
    for i in np.flatnonzero(excepted).tolist():
        exception = exceptions[name, designs[i]]
        row = judge(f"  design {designs[i]}", values[i : i + 1], exception.limit)
        verdict = EXCEPTED if row.passed else FAILED
        yield Row(row.name, verdict, row.agree, 1, row.largest, row.tolerance, exception.reason)
