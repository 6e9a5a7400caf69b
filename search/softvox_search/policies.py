"""Policies against luck, which keep a searcher under noise from believing its luckiest draws."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import fmean
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Design, Lattice
from softvox_gym.evaluation import standard_error
from softvox_gym.simulation import check_count
from softvox_search.function import FunctionSearcher
from softvox_search.oracle import Budget, checked
from softvox_search.protocol import Designs, Info, Searcher, best_of, keys_of, rows_of

_SWITCHES = ("running_mean", "reevaluate_parents", "final_stage")


@dataclass(frozen=True, kw_only=True)
class Policy:
    """The measures against luck; all are off by default.

    Parameters
    ----------
    running_mean : bool
        Tell the searcher the mean of all values seen for a design instead of the last one, and let
        it replace what it was told before.
    reevaluate_parents : bool
        With every batch that the searcher asks for, evaluate again the designs that its next
        selection relies on, if it declares them (`parents`, `refresh`).
    final_stage : bool
        Reserve the last evaluations for fresh draws of the designs believed best, and recommend by
        these alone.
    finalists : int
        Number of designs that are drawn anew in the final stage.
    resamples : int
        Number of fresh draws for each finalist.

    Raises
    ------
    TypeError, ValueError
        If a switch is not True or False, or a number is not a positive whole number.
    """

    running_mean: bool = False
    reevaluate_parents: bool = False
    final_stage: bool = False
    finalists: int = 10
    resamples: int = 8

    def __post_init__(self) -> None:
        for name in _SWITCHES:
            if not isinstance(getattr(self, name), bool):
                raise TypeError(f"{name} must be True or False, got {getattr(self, name)!r}")
        for name in ("finalists", "resamples"):
            check_count(name, getattr(self, name), least=1)

    @property
    def is_on(self) -> bool:
        """Whether any measure is on."""
        return any(getattr(self, name) for name in _SWITCHES)


def with_policy(searcher: Searcher, policy: Policy, space: Lattice, budget: Budget) -> Searcher:
    """Return a searcher within a policy, for a noisy run; the searcher itself if none is on.

    Raises
    ------
    TypeError
        If the searcher is a function, which can't be asked in turn.
    ValueError
        If there is a final stage and the budget is too small for it, or may end at any evaluation.
    """
    if not policy.is_on:
        return searcher
    if isinstance(searcher, FunctionSearcher):
        raise TypeError("a policy against luck needs a searcher with ask, not a function")
    if policy.final_stage and (budget.steps is not None or budget.cpu_seconds is not None):
        raise ValueError(
            "final_stage needs a budget that ends at a known evaluation; drop steps and "
            "cpu_seconds, or final_stage"
        )
    return PolicySearcher(searcher, policy, space, evaluations=budget.most_evaluations(noisy=True))


@runtime_checkable
class HasParents(Protocol):
    """A searcher that declares which earlier values it still relies on, and accepts newer ones."""

    def parents(self) -> Designs:
        """Return the designs whose values the next selection relies on, shape (m, sites)."""
        ...

    def refresh(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Take newer values of the parents that it still has; values of others are only stored."""
        ...


class PolicySearcher:
    """A searcher within a policy; itself a searcher.

    Parents that are evaluated again come first in a batch, and the searcher gets their newer values
    before those of its offspring. It is told a batch as a whole, even if it was asked for in
    pieces.

    Parameters
    ----------
    searcher : Searcher
        Any searcher with `ask`.
    policy : Policy
    space : Lattice
    evaluations : int, optional
        The run's budget; needed for a final stage. Without it the search does not end by itself.

    Raises
    ------
    TypeError, ValueError
        If the budget is no positive whole number, or too small for the final stage.

    Source
    ------
    On the effect of noise on a search, and on averaging and repeated evaluation against it: Y. Jin,
    J. Branke, *Evolutionary optimization in uncertain environments: a survey*, IEEE Transactions on
    Evolutionary Computation 9(3), 2005.
    """

    def __init__(
        self, searcher: Searcher, policy: Policy, space: Lattice, *, evaluations: int | None = None
    ) -> None:
        if evaluations is not None:
            check_count("evaluations", evaluations, least=1)
        stage = policy.finalists * policy.resamples
        self._left: int | None = None
        if policy.final_stage:
            if evaluations is None:
                raise ValueError("evaluations must be given: the final stage takes the last")
            if 2 * stage > evaluations:
                raise ValueError(
                    f"a final stage of {policy.finalists} finalists x {policy.resamples} resamples "
                    f"= {stage} evaluations leaves fewer than half of the budget of {evaluations} "
                    f"for the search; give at least {2 * stage}, or fewer finalists or resamples"
                )
            self._left = evaluations - stage
        self._searcher = searcher
        self._policy = policy
        self._space = space
        self._told: dict[bytes, list[NDArray[np.float64]]] = {}  # value, dx, dy, dz of every draw
        self._batch = self._none = np.zeros((0, space.sites), dtype=np.int64)
        self._n_parents = 0
        self._pieces: list[tuple[NDArray[np.float64], Info]] = []
        self._asked = 0
        self._has_told = False
        self._finalists: Designs | None = None  # in the final stage, believed best first

    def ask(self, n: int | None = None) -> Designs:
        """Return the searcher's next designs, parents or finalists; none after the final stage."""
        if not len(self._untold) and self._finalists is None:
            self._begin(n)
        asked = self._untold[:n].copy()
        self._asked = len(asked)
        return asked

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Store the values, and tell the searcher those that result from the policy.

        Raises
        ------
        ValueError
            If designs were not asked for.
        """
        if not np.array_equal(designs, self._untold[: len(designs)]):
            raise ValueError("tell must get the designs that ask returned, in that order")
        self._pieces.append((values, info))
        if self._finalists is not None:
            return
        draws = np.column_stack([values, info["displacement"]])
        for key, draw in zip(keys_of(designs), draws, strict=True):
            self._told.setdefault(key, []).append(draw)
        if self._left is not None:
            self._left -= len(designs)
        if not len(self._untold) or len(designs) < self._asked:
            self._hand_over()

    def recommend(self) -> Design:
        """Return the best of the final stage, else the best mean, else the searcher's own choice.

        A final stage that the budget ended before every finalist had a draw does not count. While
        the searcher's first batch is still being told, the best value told so far is recommended.
        """
        best = None
        if means := self._final_means():
            best = max(means, key=lambda key: means[key])
        elif self._told and (self._policy.running_mean or not self._has_told):
            best = best_of(self._beliefs())
        if best is not None:
            return Design(rows_of([best], self._space)[0], shape=self._space)
        return self._searcher.recommend()

    def belief(self, design: Design) -> float:
        """Return the believed value of a design, voxel widths.

        For a finalist this is the mean of its fresh draws alone, which is unbiased for every single
        finalist; for the best of them it may still be a little too high, because these means
        selected it. Otherwise it is the mean of all values told if the running mean is on, or else
        the value told last; NaN for a design that was never evaluated.
        """
        beliefs = self._beliefs() | self._final_means()
        return beliefs.get(self._space.to_rows(design.array).tobytes(), np.nan)

    def _final_means(self) -> dict[bytes, float]:
        """Return the mean of every finalist's fresh draws; empty before all have one."""
        if self._finalists is None:
            return {}
        k, values = len(self._finalists), [value for piece, _ in self._pieces for value in piece]
        if len(values) < k:
            return {}
        return {key: fmean(values[i::k]) for i, key in enumerate(keys_of(self._finalists))}

    @property
    def _untold(self) -> Designs:
        """The rest of the batch."""
        return self._batch[sum(len(values) for values, _ in self._pieces) :]

    def _beliefs(self) -> dict[bytes, float]:
        """Return the believed value of every evaluated design, ignoring the final stage."""
        mean = self._policy.running_mean
        return {
            key: fmean(draw[0] for draw in draws) if mean else float(draws[-1][0])
            for key, draws in self._told.items()
        }

    def _begin(self, n: int | None) -> None:
        """Ask the searcher for a batch, or begin the final stage."""
        if self._left != 0:
            parents = self._none
            if self._policy.reevaluate_parents and isinstance(self._searcher, HasParents):
                offspring = checked(self._searcher.ask(), self._space)
                if len(offspring):
                    parents = self._searcher.parents()
            else:
                offspring = checked(self._searcher.ask(n), self._space)
            self._batch = np.concatenate([parents, offspring])[: self._left]
            self._n_parents = len(parents)
        if self._policy.final_stage and not len(self._batch) and self._told:
            beliefs = self._beliefs()
            # Ties go to the smaller number.
            order = sorted(beliefs, key=lambda key: (-beliefs[key], key[::-1]))
            self._finalists = rows_of(order[: self._policy.finalists], self._space)
            # In turn, so that if the budget ends before the stage, all have equally many draws, to
            # within one; if fewer designs are known than finalists, these get all draws.
            draws = np.arange(self._policy.finalists * self._policy.resamples)
            self._batch = self._finalists[draws % len(self._finalists)]

    def _hand_over(self) -> None:
        """Tell the searcher the values of the batch, parents first.

        A design of the batch may be one that the searcher has carried since an earlier draw: if
        means are told, it gets the newer mean for that one too.
        """
        pieces, infos = zip(*self._pieces, strict=True)
        values = np.concatenate(pieces)
        info: Any = {name: np.concatenate([one[name] for one in infos]) for name in infos[0]}
        designs, m = self._batch[: len(values)], min(self._n_parents, len(values))
        self._batch, self._pieces = self._none, []
        n = m
        if self._policy.running_mean:
            rows = [means_of(np.array(self._told[key])) for key in keys_of(designs)]
            values, moved, errors = (np.array(column) for column in zip(*rows, strict=True))
            errors = np.where(np.isnan(errors), info["standard_error"], errors)
            diverged = np.isnan(moved[:, 0])
            info = {"displacement": moved, "diverged": diverged, "standard_error": errors}
            n = len(values)

        def part(begin: int, end: int) -> tuple[Designs, NDArray[np.float64], Any]:
            some = slice(begin, end)
            return designs[some], values[some], {name: info[name][some] for name in info}

        if n and isinstance(self._searcher, HasParents):
            self._searcher.refresh(*part(0, n))
        if m < len(values):
            self._searcher.tell(*part(m, len(values)))
            self._has_told = True


def means_of(draws: NDArray[np.float64]) -> tuple[float, NDArray[np.float64], float]:
    """Return the mean value, mean displacement and standard error of draws of one design.

    Parameters
    ----------
    draws : ndarray, shape (n, 4)
        Value, dx, dy, dz of each, voxel widths; the displacement is NaN where it diverged.

    Returns
    -------
    float, ndarray of shape (3,), float
        Draws that diverged count in the mean but not in the displacement, which is NaN if all did.
        The error is that of the mean, from the spread of the values; NaN for a single draw.
    """
    values, moved = draws[:, 0], draws[~np.isnan(draws[:, 1]), 1:]
    displacement = moved.sum(axis=0) / (len(moved) or np.nan)
    return fmean(values), displacement, float(standard_error(values))
