"""The oracle: the only way from a searcher to the physics; it counts the costs."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from itertools import compress
from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray

from softvox_gym import Lattice
from softvox_gym.design import stack_of
from softvox_gym.noise import not_negative
from softvox_gym.physics import MOST
from softvox_gym.simulation import check_count
from softvox_gym.wrappers import is_noisy, silent
from softvox_search.log import NO_SEED, Log
from softvox_search.protocol import Designs, Info, SearcherError, keys_of

#: Makes a vector environment for n designs; its wrappers affect every searcher.
MakeEnv = Callable[[int], "VectorEnv[Any, Any, Any]"]

#: Receives the progress of a run: (done, total).
Progress = Callable[[int, int], None]

#: Larger batches are evaluated in pieces.
MOST_ENVS = 1024

#: Default number of evaluations per unit of the unique budget: an end for searchers that propose
#: nothing new.
PATIENCE = 20


@dataclass(frozen=True, kw_only=True)
class Budget:
    """The budget of a search, which ends when the first of these is used up.

    Parameters
    ----------
    unique : int, optional
        Evaluations that the cache did not answer: without noise the number of different designs;
        with noise every evaluation is a fresh draw and counts.
    evaluations : int, optional
        All evaluations, duplicates included; by default `PATIENCE` times `unique`, if that is
        given. In an environment that resamples, one evaluation counts once, however many
        simulations it takes; `steps` counts those.
    steps : int, optional
        Simulated time steps. A batch is never interrupted, so the last may exceed the budget.
    cpu_seconds : float, optional
        Processor time of the process, s, for the searcher and the simulations, from the first use
        of the budget. A batch is never interrupted, and at least one is evaluated. Such a run is
        not repeatable to the bit.

    Raises
    ------
    TypeError, ValueError
        If a budget is not a positive number, or none is given that surely ends a search: `unique`,
        `evaluations` or `cpu_seconds`.
    """

    unique: int | None = None
    evaluations: int | None = None
    steps: int | None = None
    cpu_seconds: float | None = None

    def __post_init__(self) -> None:
        for name, most in (("unique", MOST), ("evaluations", MOST), ("steps", 10**15)):
            if getattr(self, name) is not None:
                check_count(f"budget {name}", getattr(self, name), least=1, most=most)
        seconds = self.cpu_seconds
        if seconds is not None and not_negative("budget cpu_seconds", seconds) == 0:
            raise ValueError("budget cpu_seconds must be above 0, got 0")
        if self.evaluations is None and self.unique is not None:
            object.__setattr__(self, "evaluations", PATIENCE * self.unique)
        if self.evaluations is None and self.cpu_seconds is None:
            raise ValueError("budget must have unique, evaluations or cpu_seconds")

    def most_evaluations(self, *, noisy: bool) -> int | None:
        """Return the most evaluations it allows; None if only time ends it."""
        if noisy and self.unique is not None and self.evaluations is not None:
            return min(self.unique, self.evaluations)
        return self.evaluations


class Answer(NamedTuple):
    """The oracle's results for a batch, in the order asked, for `Searcher.tell`."""

    designs: Designs
    values: NDArray[np.float64]
    info: Info


#: The environment's results for one design.
_RECORD = np.dtype(
    [
        ("value", np.float64),
        ("displacement", np.float64, 3),
        ("standard_error", np.float64),
        ("diverged", np.bool_),
        ("steps", np.int64),
    ]
)


class Oracle:
    """Evaluates designs on an environment, within a budget, and logs everything.

    Parameters
    ----------
    make_env : callable (num_envs) -> VectorEnv
        One of this package's vector environments, with any wrappers.
    budget : Budget
    rng : numpy.random.Generator, optional
        Source of the noise seeds; needed if the environment is noisy.
    noisy : bool, optional
        Whether two evaluations of one design may differ. By default the wrappers decide: one with a
        true attribute `is_noisy` makes the environment noisy. A wrapper of another package must
        have the attribute, true or false.
    progress : callable (done, total), optional
        Called after every batch with unique designs or, if the budget has no such part or the
        environment is noisy, evaluations; not called if only time ends the search.

    Attributes
    ----------
    space : Lattice
        The environment's lattice.
    unique, evaluations, steps : int
        The amounts used so far.
    log : Log
        One row per evaluation.

    Raises
    ------
    ValueError
        If a noisy environment has no generator, or a wrapper doesn't declare whether it is noisy.
    """

    def __init__(
        self,
        make_env: MakeEnv,
        budget: Budget,
        *,
        rng: np.random.Generator | None = None,
        noisy: bool | None = None,
        progress: Progress | None = None,
    ) -> None:
        self._make_env = make_env
        self._envs: dict[int, VectorEnv[Any, Any, Any]] = {}
        self.budget = budget
        first: Any = self._env(1)
        self.space: Lattice = first.unwrapped.evaluator.lattice
        if noisy is None and (wrapper := silent(first)) is not None:
            raise ValueError(
                f"{type(wrapper).__name__} doesn't say whether two evaluations of one design may "
                "differ: give it an attribute is_noisy, True or False"
            )
        self.noisy = is_noisy(first) if noisy is None else noisy
        if self.noisy and rng is None:
            raise ValueError("rng must be given: the environment is noisy")
        self._rng: Any = rng
        self._progress = progress
        self._started: float | None = None
        self._cache: dict[bytes, bytes] = {}  # records by the designs' keys
        self.log = Log(self.space)
        self.unique = 0
        self.evaluations = 0
        self.steps = 0

    @property
    def cpu_seconds(self) -> float:
        """Seconds of processor time since the first use of the budget."""
        now = time.process_time()
        if self._started is None:
            self._started = now
        return now - self._started

    @property
    def ended_by(self) -> str | None:
        """The first part of the budget that is used up; None while none is."""
        for name in ("unique", "evaluations", "steps", "cpu_seconds"):
            limit = getattr(self.budget, name)
            if limit is not None and getattr(self, name) >= limit and self.evaluations:
                return name
        return None

    @property
    def is_exhausted(self) -> bool:
        """Whether a part of the budget is used up."""
        return self.ended_by is not None

    def evaluate(self, designs: Any) -> Answer:
        """Evaluate a batch from `Searcher.ask`, as many designs as the budget allows.

        Raises
        ------
        SearcherError
            If it is no batch of designs of the oracle's lattice.
        ValueError
            If the environment's reward is NaN, which no searcher could use.
        """
        rows = checked(designs, self.space)
        keys = keys_of(rows)
        fresh = self._fresh(keys)
        kept = self._affordable(fresh)
        rows, keys, fresh = rows[:kept], keys[:kept], fresh[:kept]
        none = np.full(kept, NO_SEED)
        seeds = self._rng.integers(0, 2**62, size=kept) if self.noisy else none
        records = self._records(rows, keys, fresh, seeds)
        self.log.append(
            rows,
            sequence=self.evaluations + 1 + np.arange(kept),
            unique_sequence=self.unique + np.cumsum(fresh),
            dx=records["displacement"][:, 0],
            dy=records["displacement"][:, 1],
            fitness=records["value"],
            diverged=records["diverged"],
            noise_seed=seeds,
            cached=~fresh,
        )
        self.evaluations += kept
        self.unique += int(fresh.sum())
        self.steps += int(records["steps"][fresh].sum())
        if self._progress is not None:
            if self.budget.unique is not None and not self.noisy:
                self._progress(self.unique, self.budget.unique)
            elif (total := self.budget.most_evaluations(noisy=self.noisy)) is not None:
                self._progress(self.evaluations, total)
        info: Any = {name: records[name].copy() for name in Info.__annotations__}
        return Answer(rows, records["value"].copy(), info)

    def close(self) -> None:
        """Close the environments."""
        for env in self._envs.values():
            env.close()
        self._envs.clear()

    def _fresh(self, keys: list[bytes]) -> NDArray[np.bool_]:
        """Return which evaluations the cache can't answer: without noise, first occurrences."""
        if self.noisy:
            return np.ones(len(keys), dtype=np.bool_)
        first = dict(zip(reversed(keys), range(len(keys) - 1, -1, -1), strict=True))
        fresh = np.zeros(len(keys), dtype=np.bool_)
        fresh[[i for key, i in first.items() if key not in self._cache]] = True
        return fresh

    def _affordable(self, fresh: NDArray[np.bool_]) -> int:
        """Return how many of the first evaluations the budget allows."""
        if self.is_exhausted:
            return 0
        kept = len(fresh)
        if self.budget.evaluations is not None:
            kept = min(kept, self.budget.evaluations - self.evaluations)
        if self.budget.unique is not None:
            left = self.budget.unique - self.unique
            kept = min(kept, int(np.searchsorted(np.cumsum(fresh), left, side="left")) + 1)
        return kept

    def _records(
        self, rows: Designs, keys: list[bytes], fresh: NDArray[np.bool_], seeds: NDArray[np.int64]
    ) -> NDArray[np.void]:
        """Return the records of a batch, from the cache if it has them."""
        if self.noisy:
            return self._simulated(rows, seeds)
        if fresh.any():
            added = self._simulated(rows[fresh], None).view(np.dtype((np.void, _RECORD.itemsize)))
            self._cache.update(zip(compress(keys, fresh), added.tolist(), strict=True))
        return np.frombuffer(b"".join([self._cache[key] for key in keys]), dtype=_RECORD)

    def _simulated(self, rows: Designs, seeds: NDArray[np.int64] | None) -> NDArray[np.void]:
        """Return the environment's results for a batch."""
        records = np.zeros(len(rows), dtype=_RECORD)
        for begin in range(0, len(rows), MOST_ENVS):
            part = slice(begin, begin + MOST_ENVS)
            actions = rows[part]
            env = self._env(len(actions))
            env.reset(seed=None if seeds is None else seeds[part].tolist())
            _, rewards, _, _, infos = env.step(actions)
            if np.ndim(rewards) != 1:
                raise ValueError(
                    f"{env} returned reward vectors, but a searcher needs one number per design: "
                    "make it without objectives, or with a wrapper that weighs them"
                )
            if np.isnan(rewards).any():
                raise ValueError(f"{env} returned a reward of NaN; a diverged design is worth 0")
            records["value"][part] = rewards
            for name in ("displacement", "diverged", "steps"):
                records[name][part] = infos[name]
            of_one = np.nan if self.noisy else 0.0
            records["standard_error"][part] = infos.get("standard_error", of_one)
        return records

    def _env(self, n: int) -> VectorEnv[Any, Any, Any]:
        """Return the environment for batches of n."""
        if n not in self._envs:
            self._envs[n] = self._make_env(n)
        return self._envs[n]


def checked(designs: Any, space: Lattice) -> Designs:
    """Return a batch of designs as rows of digits, shape (n, sites), a copy; or SearcherError."""
    is_rows = isinstance(designs, np.ndarray) and designs.shape[1:] == (space.sites,)
    is_whole = is_rows and designs.dtype.kind in "iu"
    # The fast path, for what most searchers return.
    if is_whole and not ((designs < 0) | (designs >= space.states)).any():
        return np.array(designs, dtype=np.int64)
    try:
        stack = stack_of(designs, shape=space)
    except (TypeError, ValueError) as error:
        raise SearcherError(f"returned invalid designs: {error}") from error
    return space.to_rows(stack).astype(np.int64)
