"""One search, held against the whole landscape where that is known."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from softvox_gym import ENV_ID, TABLE_ENV_ID, Design, Lattice, Physics, landscape, noisy_landscape
from softvox_gym import evaluate as evaluate_designs
from softvox_gym.rendering import png
from softvox_gym.wrappers.vector import JakobiNoise
from softvox_search.global_random import library
from softvox_search.log import NO_SEED, Columns, identity
from softvox_search.oracle import Budget, Oracle, Progress
from softvox_search.policies import Policy, with_policy
from softvox_search.protocol import SearcherError
from softvox_search.registry import make
from softvox_search.run import believed, run


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
class SearchResult:
    """What a search found.

    Parameters
    ----------
    design : Design
        Recommended.
    fitness : float
        Of it without noise, voxel widths.
    truth : Standing or None
        Of it without noise; None on lattices whose landscape is not known.
    level : float or None
        Of the noise; None without.
    believed : float or None
        What the searcher believes it to be worth, voxel widths; None where it can't say.
    noisy : Standing or None
        Of it by mean fitness under the noise, where that is known.
    ended_by : str
        "unique" or another part of the budget, or the "searcher" itself.
    oracle : Oracle
        What was used, of what budget, and the log.
    """

    design: Design
    fitness: float
    truth: Standing | None
    level: float | None
    believed: float | None
    noisy: Standing | None
    ended_by: str
    oracle: Oracle

    @cached_property
    def columns(self) -> Columns:
        """The log."""
        return self.oracle.log.columns()

    @property
    def sequence(self) -> int | None:
        """The first evaluation of the design; None where there was none."""
        at = self.columns["sequence"][self.columns["design"] == identity(self.design)]
        return int(at[0]) if len(at) else None

    def to_dict(self) -> dict[str, Any]:
        """Return it ready for JSON, without the log."""
        truth = self.truth.to_dict() if self.truth else {"fitness": self.fitness}
        return {
            "design": self.design.index,
            "digits": self.design.digits,
            "shape": list(self.design.shape),
            **truth,
            "level": self.level,
            "believed": self.believed,
            "under_noise": self.noisy.to_dict() if self.noisy else None,
            "found_at": self.sequence,
            "unique": self.oracle.unique,
            "evaluations": self.oracle.evaluations,
            "steps": self.oracle.steps,
            "ended_by": self.ended_by,
        }


def search(
    searcher: str,
    *,
    budget: Budget,
    options: dict[str, Any] | None = None,
    seed: int = 0,
    space: Lattice | None = None,
    physics: str | dict[str, Any] = "published",
    level: float | None = None,
    policy: Policy | None = None,
    progress: Progress | None = None,
) -> SearchResult:
    """Let a searcher search once, and hold what it recommends against all designs.

    Parameters
    ----------
    searcher : str
        Its name in the registry, or "package.module:name" of a class or function.
    budget : Budget
    options : dict, optional
        Of the searcher.
    seed : int
        Of all random numbers.
    space : Lattice, optional
        2x2x2 where None.
    physics : str or dict
    level : float, optional
        Of `JakobiNoise`; no noise where None.
    policy : Policy, optional
        Against luck, where there is noise.
    progress : callable (done, total), optional
        As `Oracle` takes it.

    Raises
    ------
    SearchError
        For a searcher, options or a policy that can't be.
    SearcherError
        Where the searcher breaks the protocol.
    RaisedError
        Where the searcher's own code raises anything else.
    """
    space = space or Lattice()
    of_searcher, of_noise = np.random.SeedSequence(seed).spawn(2)
    made = _made(searcher, np.random.default_rng(of_searcher), space, options or {})
    oracle = Oracle(
        lambda n: environment(n, space, physics, level),
        budget,
        rng=np.random.default_rng(of_noise),
        noisy=level is not None,  # at level 0 a repeated evaluation costs what it costs at others
        progress=progress,
    )
    if level is not None:
        try:
            made = with_policy(made, policy or Policy(), space, budget)
        except TypeError as error:
            raise SearchError(f"--searcher {searcher}: {error}") from error
        except ValueError as error:
            raise SearchError(f"--final-stage: {error}") from error
    try:
        design = run(made, oracle, name=searcher)
    except (SearcherError, MemoryError):
        raise
    except (Exception, SystemExit) as error:
        raise RaisedError(searcher, error) from error
    finally:
        oracle.close()
    ended_by = oracle.ended_by or "searcher"
    fitness, truth = _truth(design, physics)
    return SearchResult(
        design=design,
        fitness=fitness,
        truth=truth,
        level=level,
        believed=believed(made, design, oracle.log.columns()),
        noisy=None if level is None or truth is None else _under_noise(design, physics, level),
        ended_by=ended_by,
        oracle=oracle,
    )


def environment(n: int, space: Lattice, physics: Any, level: float | None) -> Any:
    """Return the vector environment of a search: the table where it has the engine's bits."""
    if space == Lattice() and _is_published(physics) and not level:
        env: Any = gym.make_vec(TABLE_ENV_ID, num_envs=n)
    else:
        env = gym.make_vec(ENV_ID, num_envs=n, shape=space, physics=physics)
    return env if not level else JakobiNoise(env, level)


def table(columns: Columns, suffix: str) -> bytes:
    """Return a log as a file, ".csv" or ".parquet"; without noise the seeds are left empty."""
    frame = library("pandas").DataFrame(columns)
    frame["noise_seed"] = frame["noise_seed"].astype("Int64").mask(frame["noise_seed"] == NO_SEED)
    content: bytes = (
        frame.to_csv(index=False).encode() if suffix == ".csv" else frame.to_parquet(index=False)
    )
    return content


def picture(design: Design, physics: Any = "published") -> bytes:
    """Return a picture of a design after its run without noise, as PNG."""
    options = {"shape": design.lattice, "physics": physics, "render_mode": "rgb_array"}
    env = gym.make(ENV_ID, **options)
    try:
        env.reset(seed=0)
        env.step(design.lattice.to_rows(design.array))
        image: Any = env.render()
    finally:
        env.close()
    return png(image)


def _made(searcher: str, rng: np.random.Generator, space: Lattice, options: dict[str, Any]) -> Any:
    try:
        return make(searcher, rng, space=space, **options)
    except (ImportError, TypeError, ValueError) as error:
        raise SearchError(f"--searcher {searcher}: {error}") from error
    except (Exception, SystemExit) as error:  # one's own may raise anything
        raise RaisedError(searcher, error) from error


def _is_published(physics: Any) -> bool:
    return Physics.of(physics) == Physics.published()


def _truth(design: Design, physics: Any) -> tuple[float, Standing | None]:
    """Return a design's fitness without noise, and where it stands if that is known."""
    if design.lattice == Lattice():
        standing = Standing.of(design, landscape(physics)["fitness"])
        return standing.fitness, standing
    return float(evaluate_designs(design, physics).value[0]), None


def _under_noise(design: Design, physics: Any, level: float) -> Standing | None:
    """Return where a design stands under the noise, where that was measured."""
    if not _is_published(physics):
        return None
    try:
        means = np.asarray(noisy_landscape(level)["mean"])
    except ValueError:
        return None
    return None if np.isnan(means[design.index]) else Standing.of(design, means)
