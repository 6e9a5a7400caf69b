"""One search, held against the whole landscape."""

from __future__ import annotations

import csv
import io
import struct
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

import softvox_gym
from softvox_gym import Design, Physics, simulate
from softvox_gym.design import N_DESIGNS
from softvox_search.experiment.environments import Environments, evaluations
from softvox_search.experiment.run import Columns, do
from softvox_search.experiment.schema import PolicyChoice, Problem, Run, SearcherChoice
from softvox_search.log import NO_SEED
from softvox_search.oracle import Budget, SearcherError
from softvox_search.policies import Guarded, Policy
from softvox_search.registry import make
from softvox_search.report.truth import truth_at


class SearchError(Exception):
    """A search that can't be made; one line, in the words of the command line."""


class RaisedError(Exception):
    """The searcher's own code raised an error, which is the cause of this one; one line says so."""

    def __init__(self, searcher: str, error: BaseException) -> None:
        super().__init__(f"searcher {searcher} raised {type(error).__name__}: {error}")


@dataclass(frozen=True)
class Standing:
    """Where a design stands among all.

    Parameters
    ----------
    fitness, best : float
        Its own and the best, voxel widths.
    rank : int
        From 1; one more than there are better designs.
    """

    fitness: float
    best: float
    rank: int

    @classmethod
    def of(cls, design: Design, values: NDArray[np.float64]) -> Standing:
        """Return where a design stands among the values of all designs; NaN counts as 0."""
        values = np.nan_to_num(values, nan=0.0)
        own = values[design.index]
        return cls(float(own), float(values.max()), 1 + int((values > own).sum()))

    @property
    def regret(self) -> float:
        """What it lacks to the best, voxel widths."""
        return self.best - self.fitness

    def to_dict(self) -> dict[str, float]:
        """Return it ready for JSON."""
        return {**vars(self), "regret": self.regret}


@dataclass(frozen=True, eq=False)
class Found:
    """What a search found.

    Parameters
    ----------
    design : Design
        Recommended.
    truth : Standing
        Of it without noise.
    level : float or None
        Of the noise; None without.
    believed : float or None
        What the searcher believes it to be worth, voxel widths; None where it can't say.
    noisy : Standing or None
        Of it by mean fitness under the noise, where that is known.
    sequence : int or None
        The first evaluation of it; None where there was none.
    unique, evaluations, steps : int
        What was used.
    budget : Budget
        What might have been.
    columns : dict of ndarray
        The log.
    """

    design: Design
    truth: Standing
    level: float | None
    believed: float | None
    noisy: Standing | None
    sequence: int | None
    unique: int
    evaluations: int
    steps: int
    budget: Budget
    columns: Columns

    @property
    def ended_by(self) -> str:
        """What ended it: "unique" or "evaluations" of the budget, or the "searcher" itself."""
        if self.budget.unique is not None and self.unique >= self.budget.unique:
            return "unique"
        assert self.budget.evaluations is not None
        return "evaluations" if self.evaluations >= self.budget.evaluations else "searcher"

    def to_dict(self) -> dict[str, Any]:
        """Return it ready for JSON, without the log."""
        return {
            "design": self.design.index,
            "digits": self.design.digits,
            **self.truth.to_dict(),
            "level": self.level,
            "believed": self.believed,
            "under_noise": self.noisy.to_dict() if self.noisy else None,
            "found_at": self.sequence,
            "unique": self.unique,
            "evaluations": self.evaluations,
            "steps": self.steps,
            "ended_by": self.ended_by,
        }


def run_of(
    searcher: str,
    *,
    options: dict[str, Any],
    seed: int,
    unique: int,
    evaluations: int | None = None,
    level: float | None = None,
    policy: Policy | None = None,
    physics: str | dict[str, Any] = "published",
) -> Run:
    """Return a search as a run of an experiment.

    Parameters
    ----------
    searcher : str
        Its name in the registry, or "package.module:Class".
    options : dict
        Of the searcher.
    seed : int
        Of all random numbers.
    unique, evaluations : int
        The budget.
    level : float, optional
        Of `JakobiNoise`.
    policy : Policy, optional
        Against luck, where there is noise.
    physics : str or dict

    Raises
    ------
    SearchError
        For a searcher, options or a policy that can't be.
    RaisedError
        Where the searcher's module or class raises anything but an error about its options.
    """
    budget = Budget(unique=unique, evaluations=evaluations)
    choice = None if level is None else PolicyChoice(name="own", policy=policy or Policy())
    _check(searcher, options, budget, choice)
    return Run(
        searcher=SearcherChoice(name=searcher, label=searcher, options=options, budget=budget),
        problem=Problem(values=physics, level=level),
        policy=choice,
        entropy=seed,
    )


def search(run: Run, *, progress: Callable[[int, int], None] | None = None) -> Found:
    """Do a run, and hold what it recommends against all designs.

    Raises
    ------
    SearcherError
        Where the searcher breaks the protocol.
    RaisedError
        Where it raises anything else.
    """
    try:
        summary, columns = do(run, Environments(), progress=progress)
    except (SearcherError, MemoryError):
        raise
    except (Exception, SystemExit) as error:
        raise RaisedError(run.searcher.label, error) from error
    design = Design(summary["recommended"])
    rows = np.flatnonzero(columns["design"] == design.index)
    return Found(
        design=design,
        truth=Standing.of(design, _landscape(run.problem)),
        level=summary["level"],
        believed=summary["believed"],
        noisy=_under_noise(run.problem, design),
        sequence=int(columns["sequence"][rows[0]]) if len(rows) else None,
        unique=summary["unique"],
        evaluations=summary["evaluations"],
        steps=summary["steps"],
        budget=run.searcher.budget,
        columns=columns,
    )


def table(columns: Columns, suffix: str) -> bytes:
    """Return a log as a file, ".csv" or ".parquet"; without noise the seeds are left empty.

    Raises
    ------
    SearchError
        Where a library is missing.
    """
    if suffix == ".csv":
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(columns)
        for row in zip(*(column.tolist() for column in columns.values()), strict=True):
            writer.writerow("" if value == NO_SEED else value for value in row)
        return text.getvalue().encode()
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ModuleNotFoundError as error:
        raise SearchError(
            f"--out in Parquet needs {error.name}: pip install 'softvox-gym[search]'"
        ) from error
    content = io.BytesIO()
    pq.write_table(pa.table(columns), content)
    return content.getvalue()


def picture(problem: Problem, design: Design) -> bytes:
    """Return a picture of a design after its run without noise, as PNG."""
    env = gym.make(softvox_gym.ENV_ID, physics=problem.values, render_mode="rgb_array")
    try:
        env.reset(seed=0)
        env.step(np.array([int(digit) for digit in design.digits]))
        image: Any = env.render()
    finally:
        env.close()
    return png(np.asarray(image))


def png(image: NDArray[np.uint8]) -> bytes:
    """Return an image, shape (height, width, 3), as PNG.

    Source: W3C, "Portable Network Graphics (PNG) Specification", 2003: colour type 2, no filter.
    """
    height, width, _ = image.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)  # the first byte: no filter
    rows[:, 1:] = image.reshape(height, -1)

    def chunk(kind: bytes, content: bytes) -> bytes:
        checksum = zlib.crc32(kind + content)
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", checksum)

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(rows.tobytes(), 9))
        + chunk(b"IEND", b"")
    )


def _check(
    searcher: str, options: dict[str, Any], budget: Budget, choice: PolicyChoice | None
) -> None:
    try:
        made = make(searcher, np.random.default_rng(0), **options)
    except (ImportError, TypeError, ValueError) as error:
        raise SearchError(f"--searcher {searcher}: {error}") from error
    except (Exception, SystemExit) as error:  # one's own may raise anything
        raise RaisedError(searcher, error) from error
    if choice is not None:
        try:
            Guarded(made, choice.policy, evaluations=evaluations(budget))
        except ValueError as error:
            raise SearchError(f"--final-stage: {error}") from error


def _landscape(problem: Problem) -> NDArray[np.float64]:
    """Return the fitness of every design under the problem's physics, shape (6561,)."""
    if problem.is_published:
        values: NDArray[np.float64] = softvox_gym.landscape()["fitness"]
        return values
    return simulate(np.arange(N_DESIGNS), Physics.of(problem.values)).fitness


def _under_noise(problem: Problem, design: Design) -> Standing | None:
    """Return where a design stands under the noise, where that was measured."""
    if problem.level is None or not problem.is_published:
        return None
    truth = truth_at(problem.level)
    return None if np.isnan(truth.value[design.index]) else Standing.of(design, truth.value)
