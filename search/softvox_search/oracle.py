"""The oracle: the only way from a searcher to the physics, and who counts what it costs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from gymnasium.vector import VectorEnv
from numpy.typing import NDArray

from softvox_gym.design import ACTIVE, DEFAULT_SHAPE, N_DESIGNS, N_SITES, indices_of, stack_of
from softvox_gym.wrappers import is_noisy, silent
from softvox_search.log import NO_SEED, Log
from softvox_search.protocol import Designs, Info

#: Makes a vector environment of so many; whatever is wrapped around it reaches every searcher.
MakeEnv = Callable[[int], "VectorEnv[Any, Any, Any]"]

#: A larger batch is evaluated in pieces.
MOST_ENVS = 1024

#: Evaluations per unit of the unique budget, where the budget doesn't say: an end for searchers
#: that propose nothing new.
PATIENCE = 20


class SearcherError(Exception):
    """A searcher broke the protocol; the message says how."""


@dataclass(frozen=True, kw_only=True)
class Budget:
    """When a search ends: at the first of these that is used up.

    Parameters
    ----------
    unique : int, optional
        Evaluations that were not answered from the cache: without noise the number of different
        designs; with noise every evaluation is a fresh draw and counts.
    evaluations : int, optional
        All evaluations, duplicates included; `PATIENCE` times `unique` where None. One of an
        environment that resamples is one, however many simulations it takes; `steps` counts those.
    steps : int, optional
        Simulated time steps. A batch is not broken off: the last may go beyond it.

    Raises
    ------
    TypeError, ValueError
        For a budget that is not a positive whole number, or neither `unique` nor `evaluations`.
    """

    unique: int | None = None
    evaluations: int | None = None
    steps: int | None = None

    def __post_init__(self) -> None:
        for name in ("unique", "evaluations", "steps"):
            value = getattr(self, name)
            if value is None:
                continue
            if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)):
                raise TypeError(f"budget {name} must be a whole number, got {value!r}")
            if value < 1:
                raise ValueError(f"budget {name} must be at least 1, got {value}")
        if self.evaluations is None:
            if self.unique is None:
                raise ValueError("budget must have unique, evaluations or both")
            object.__setattr__(self, "evaluations", PATIENCE * self.unique)


class Answer(NamedTuple):
    """What the oracle knows of a batch, in the order asked; as `Searcher.tell` takes it."""

    designs: Designs
    values: NDArray[np.float64]
    info: Info


class Oracle:
    """Evaluates designs on an environment, within a budget, and writes everything down.

    Parameters
    ----------
    make_env : callable (num_envs) -> VectorEnv
        One of this package's vector environments, with any wrappers.
    budget : Budget
    rng : numpy.random.Generator, optional
        Where the noise seeds come from; needed where the environment is noisy.
    noisy : bool, optional
        Whether two evaluations of one design may differ. Where None, what the wrappers say: one
        that has a true attribute `is_noisy` makes the environment noisy. A wrapper from elsewhere
        must have one, true or false.

    Attributes
    ----------
    unique, evaluations, steps : int
        What was used so far.
    log : Log
        One row per evaluation.

    Raises
    ------
    ValueError
        For a noisy environment without a generator, or one that doesn't say whether it is noisy.
    """

    def __init__(
        self,
        make_env: MakeEnv,
        budget: Budget,
        *,
        rng: np.random.Generator | None = None,
        noisy: bool | None = None,
    ) -> None:
        self._make_env = make_env
        self._envs: dict[int, VectorEnv[Any, Any, Any]] = {}
        self.budget = budget
        self.noisy = _noisy(self._env(1)) if noisy is None else noisy
        if self.noisy and rng is None:
            raise ValueError("rng must be given: the environment is noisy")
        self._rng = rng
        self._cache = _Outcomes.empty(N_DESIGNS)
        self._is_known = np.zeros(N_DESIGNS, dtype=np.bool_)
        self.log = Log()
        self.unique = 0
        self.evaluations = 0
        self.steps = 0

    @property
    def is_exhausted(self) -> bool:
        """Whether a budget is used up."""
        assert self.budget.evaluations is not None
        return (
            self.evaluations >= self.budget.evaluations
            or (self.budget.unique is not None and self.unique >= self.budget.unique)
            or (self.budget.steps is not None and self.steps >= self.budget.steps)
        )

    def evaluate(self, designs: Any) -> Answer:
        """Evaluate a batch of designs, or as many of its first as the budget allows.

        Parameters
        ----------
        designs : batch of designs
            As `Searcher.ask` returns it.

        Raises
        ------
        SearcherError
            For what is no batch of designs of the 2x2x2 lattice.
        ValueError
            Where the environment rewards with NaN, which no searcher could use.
        """
        rows = checked(designs)
        indices = indices_of(rows)
        fresh = self._fresh(indices)
        kept = self._affordable(fresh)
        rows, indices, fresh = rows[:kept], indices[:kept], fresh[:kept]
        seeds = self._seeds(fresh)
        outcomes = self._outcomes(rows, indices, fresh, seeds)
        sequence = self.evaluations + 1 + np.arange(kept)
        unique_sequence = self.unique + np.cumsum(fresh)
        self.evaluations += kept
        self.unique += int(fresh.sum())
        self.steps += int(outcomes.steps[fresh].sum())
        self.log.append(
            sequence=sequence,
            unique_sequence=unique_sequence,
            design=indices,
            dx=outcomes.displacement[:, 0],
            dy=outcomes.displacement[:, 1],
            fitness=outcomes.value,
            status=_STATUS[outcomes.is_ok.astype(np.intp)],
            noise_seed=seeds,
            cached=~fresh,
        )
        return Answer(
            rows,
            outcomes.value,
            {
                "displacement": outcomes.displacement,
                "status": _STATUS[outcomes.is_ok.astype(np.intp)],
                "standard_error": outcomes.standard_error,
            },
        )

    def close(self) -> None:
        """Close the environments."""
        for env in self._envs.values():
            env.close()
        self._envs.clear()

    def _fresh(self, indices: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Return which evaluations the cache can't answer: without noise, first occurrences."""
        if self.noisy:
            return np.ones(len(indices), dtype=np.bool_)
        first = np.zeros(len(indices), dtype=np.bool_)
        first[np.unique(indices, return_index=True)[1]] = True
        return first & ~self._is_known[indices]

    def _affordable(self, fresh: NDArray[np.bool_]) -> int:
        """Return how many of the first evaluations the budget allows."""
        assert self.budget.evaluations is not None
        if self.is_exhausted:
            return 0
        kept = min(len(fresh), self.budget.evaluations - self.evaluations)
        if self.budget.unique is not None:
            left = self.budget.unique - self.unique
            kept = min(kept, int(np.searchsorted(np.cumsum(fresh), left, side="left")) + 1)
        return kept

    def _seeds(self, fresh: NDArray[np.bool_]) -> NDArray[np.int64]:
        """Return a noise seed for every evaluation."""
        if not self.noisy:
            return np.full(len(fresh), NO_SEED)
        assert self._rng is not None
        return self._rng.integers(0, 2**62, size=len(fresh))

    def _outcomes(
        self,
        rows: Designs,
        indices: NDArray[np.int64],
        fresh: NDArray[np.bool_],
        seeds: NDArray[np.int64],
    ) -> _Outcomes:
        """Return the outcomes of a batch, from the cache where it has them."""
        if self.noisy:
            return self._simulated(rows, seeds)
        if fresh.any():
            self._cache[indices[fresh]] = self._simulated(rows[fresh], None)
            self._is_known[indices[fresh]] = True
        return self._cache[indices]

    def _simulated(self, rows: Designs, seeds: NDArray[np.int64] | None) -> _Outcomes:
        """Return the outcomes of a batch from the environment."""
        outcomes = _Outcomes.empty(len(rows))
        for begin in range(0, len(rows), MOST_ENVS):
            part = slice(begin, begin + MOST_ENVS)
            actions = rows[part]
            env = self._env(len(actions))
            env.reset(seed=None if seeds is None else seeds[part].tolist())
            _, rewards, _, _, infos = env.step(actions)
            if np.isnan(rewards).any():
                raise ValueError(f"{env} gave a reward of NaN; a diverged design is worth 0")
            outcomes[part] = _Outcomes.of(rewards, infos)
        return outcomes

    def _env(self, n: int) -> VectorEnv[Any, Any, Any]:
        """Return the environment for batches of n."""
        if n not in self._envs:
            self._envs[n] = self._make_env(n)
        return self._envs[n]


def _noisy(env: VectorEnv[Any, Any, Any]) -> bool:
    """Return whether an environment says that it is noisy; refuse one that doesn't say."""
    if (wrapper := silent(env)) is not None:
        raise ValueError(
            f"{type(wrapper).__name__} doesn't say whether two evaluations of one design may "
            "differ: give it an attribute is_noisy, True or False"
        )
    return is_noisy(env)


_STATUS = np.array(["diverged", "ok"])


@dataclass
class _Outcomes:
    """What the environment says of a batch, in columns."""

    value: NDArray[np.float64]
    displacement: NDArray[np.float64]
    standard_error: NDArray[np.float64]
    is_ok: NDArray[np.bool_]
    steps: NDArray[np.int64]

    @classmethod
    def empty(cls, n: int) -> _Outcomes:
        return cls(
            np.zeros(n), np.zeros((n, 3)), np.zeros(n), np.zeros(n, bool), np.zeros(n, np.int64)
        )

    @classmethod
    def of(cls, rewards: NDArray[np.float64], infos: dict[str, Any]) -> _Outcomes:
        return cls(
            value=rewards,
            displacement=infos["displacement"],
            standard_error=infos.get("standard_error", np.zeros(len(rewards))),
            is_ok=infos["status"] == "ok",
            steps=infos["steps"],
        )

    def __getitem__(self, which: Any) -> _Outcomes:
        return _Outcomes(**{name: column[which] for name, column in vars(self).items()})

    def __setitem__(self, which: Any, others: _Outcomes) -> None:
        for name, column in vars(self).items():
            column[which] = getattr(others, name)


def checked(designs: Any) -> Designs:
    """Return a batch of designs as rows of digits, shape (n, 8).

    Raises
    ------
    SearcherError
        For what is no batch of designs of the 2x2x2 lattice.
    """
    try:
        stack = stack_of(designs)
    except (TypeError, ValueError) as error:
        raise SearcherError(f"returned what are no designs: {error}") from error
    if _looks_like_digits(designs):
        raise SearcherError(
            f"returned {designs}: as a flat row these are eight design numbers, but they look like "
            "the digits of one design; give [[...]] for that"
        )
    if stack.shape[1:] != DEFAULT_SHAPE:
        raise SearcherError(
            f"returned designs on a lattice of {stack.shape[1:]}, not {DEFAULT_SHAPE}"
        )
    return stack.transpose(0, 3, 2, 1).reshape(len(stack), N_SITES).astype(np.int64)


def _looks_like_digits(designs: Any) -> bool:
    """Return whether a batch is a flat row of eight numbers 0, 1, 2."""
    row = np.asarray(designs)
    return bool(row.shape == (N_SITES,) and row.dtype.kind in "iu" and (row <= ACTIVE).all())
