"""Policies against luck: how a searcher under noise is kept from believing its luckiest draws."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import dataclass
from typing import Any, Protocol, cast, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Design
from softvox_gym.design import N_DESIGNS, N_SITES, indices_of
from softvox_search.beliefs import RunningMeans
from softvox_search.final_stage import FinalStage
from softvox_search.options import whole
from softvox_search.oracle import checked
from softvox_search.protocol import Designs, Info, Searcher, State


@dataclass(frozen=True, kw_only=True)
class Policy:
    """What is done against luck; nothing, unless switched on.

    Parameters
    ----------
    running_mean : bool
        Tell the searcher the mean of all values seen for a design, not the last one, and let it
        put that in the place of what it was told before.
    reevaluate_parents : bool
        With every batch that the searcher asks for, evaluate anew the designs that its next
        selection relies on, where it says which (`parents`, `refresh`).
    final_stage : bool
        Keep the last evaluations for fresh draws of the designs believed best, and recommend by
        these alone.
    finalists : int
        How many designs are drawn anew in the final stage.
    resamples : int
        How many fresh draws each of them gets.

    Raises
    ------
    TypeError, ValueError
        For a switch that is not True or False, or a number that is not a positive whole one.
    """

    running_mean: bool = False
    reevaluate_parents: bool = False
    final_stage: bool = False
    finalists: int = 10
    resamples: int = 8

    def __post_init__(self) -> None:
        for name in ("running_mean", "reevaluate_parents", "final_stage"):
            if not isinstance(getattr(self, name), bool):
                raise TypeError(f"{name} must be True or False, got {getattr(self, name)!r}")
        whole("finalists", self.finalists)
        whole("resamples", self.resamples)

    def kept_back(self, evaluations: int | None) -> int:
        """Return how many evaluations of a budget are kept for the final stage; 0 without one.

        Raises
        ------
        ValueError
            Where that would leave fewer than half of the budget for the search, or a final stage
            is switched on and no budget is given.
        """
        if not self.final_stage:
            return 0
        if evaluations is None:
            raise ValueError("evaluations must be given: the final stage takes the last of them")
        stage = self.finalists * self.resamples
        if 2 * stage > evaluations:
            raise ValueError(
                f"a final stage of {self.finalists} finalists x {self.resamples} resamples = "
                f"{stage} evaluations leaves fewer than half of the budget of {evaluations} for "
                f"the search; give at least {2 * stage} evaluations, or fewer finalists or "
                "resamples"
            )
        return stage


@runtime_checkable
class HasParents(Protocol):
    """A searcher that says which earlier values it still relies on, and takes newer ones."""

    def parents(self) -> Designs:
        """Return the designs whose values the next selection relies on, shape (m, 8)."""
        ...

    def refresh(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Take newer values for those that it carries; of others they are only remembered."""
        ...


class Guarded:
    """A searcher within a policy; itself a searcher.

    Without any switch on it asks and recommends exactly as the searcher within does.

    Where parents are evaluated anew, they come first in a batch, and the searcher gets their newer
    values before those of its offspring. It is told a batch as a whole, also where it was asked
    for in pieces.

    Parameters
    ----------
    searcher : Searcher
        Any.
    policy : Policy
    evaluations : int, optional
        The run's budget; needed for a final stage. Without one the search does not end by itself.

    Raises
    ------
    TypeError, ValueError
        For a budget that is no positive whole number, or too small for the final stage.

    Source
    ------
    What noise does to a search, and averaging and evaluating anew against it: Y. Jin, J. Branke,
    *Evolutionary optimization in uncertain environments: a survey*, IEEE Transactions on
    Evolutionary Computation 9(3), 2005.
    """

    def __init__(
        self, searcher: Searcher, policy: Policy, *, evaluations: int | None = None
    ) -> None:
        if evaluations is not None:
            whole("evaluations", evaluations)
        self._searcher = searcher
        self._policy = policy
        stage = policy.kept_back(evaluations)
        self._left = None if evaluations is None or not stage else evaluations - stage
        self._means = RunningMeans()
        self._last = np.full(N_DESIGNS, np.nan)
        self._batch = _Batch.none()
        self._asked = 0
        self._has_told = False
        self._final: FinalStage | None = None

    def ask(self, n: int | None = None) -> Designs:
        """Return the searcher's next designs, parents or finalists; none after the final stage."""
        if self._final is None and self._batch.is_told:
            self._begin(n)
        if self._final is not None:
            return self._final.ask(n)
        self._asked = len(self._batch.untold[:n])
        return self._batch.untold[:n].copy()

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Learn the values, and tell the searcher what the policy makes of them.

        Raises
        ------
        ValueError
            For designs that were not asked for.
        """
        indices = indices_of(designs)
        if self._final is not None:
            self._final.tell(indices, values)
            return
        if not np.array_equal(designs, self._batch.untold[: len(designs)]):
            raise ValueError("tell must get the designs that ask returned, in that order")
        self._last[indices] = values
        if self._policy.running_mean:
            self._means.add(indices, values, info["displacement"])
        if self._left is not None:
            self._left -= len(designs)
        self._batch.take(values, info)
        if self._batch.is_told or len(designs) < self._asked:
            self._hand_over()

    def recommend(self) -> Design:
        """Return the best of the final stage; else the best mean; else the searcher's own.

        A final stage that the budget cut off before every finalist had a draw does not count. While
        the searcher's first batch is still being told, the best value told so far is recommended.
        """
        if self._final is not None and self._final.is_decided:
            return Design(self._final.best)
        if self._policy.running_mean and self._means.counts.any():
            return Design(int(np.nanargmax(self._means.means)))
        if not self._has_told and not np.isnan(self._last).all():
            return Design(int(np.nanargmax(self._last)))
        return self._searcher.recommend()

    def belief(self, design: Design) -> float:
        """Return what a design is believed to be worth, in voxel widths.

        For a finalist the mean of its fresh draws alone: no draw that helped it to get there is in
        it, so that the belief in every single finalist is unbiased. Of the best of them it may
        still be a little too high, as it was chosen among `finalists` by these means. Else the
        mean of all values told where the running mean is on, and the value told last where not.
        NaN for a design never evaluated.
        """
        if self._final is not None and self._final.is_decided and design.index in self._final:
            return self._final.mean(design.index)
        return float(self._beliefs()[design.index])

    def state_dict(self) -> State:
        """Return a copy of the state, the searcher's included."""
        own = {name: value for name, value in vars(self).items() if name != "_searcher"}
        return {"searcher": self._searcher.state_dict(), "own": deepcopy(own)}

    def load_state_dict(self, state: State) -> None:
        """Take over a copy of a state."""
        self._searcher.load_state_dict(state["searcher"])
        vars(self).update(deepcopy(state["own"]))

    def _beliefs(self) -> NDArray[np.float64]:
        return self._means.means if self._policy.running_mean else self._last

    def _begin(self, n: int | None) -> None:
        """Ask the searcher for a batch, or begin the final stage."""
        if self._left != 0:
            parents = np.zeros((0, N_SITES), dtype=np.int64)
            if self._policy.reevaluate_parents and isinstance(self._searcher, HasParents):
                offspring = checked(self._searcher.ask())
                if len(offspring):
                    parents = self._searcher.parents()
            else:
                offspring = checked(self._searcher.ask(n))
            self._batch = _Batch.of(parents, offspring, most=self._left)
        if self._policy.final_stage and self._batch.is_told and not np.isnan(self._last).all():
            self._final = FinalStage.of(
                self._beliefs(),
                finalists=self._policy.finalists,
                resamples=self._policy.resamples,
            )

    def _hand_over(self) -> None:
        """Tell the searcher what is known of the batch, parents first.

        A design of the batch may be one that the searcher has carried along since an earlier draw:
        where means are told, it gets the newer mean for that one too.
        """
        batch, self._batch = self._batch, _Batch.none()
        values, info = batch.told()
        designs = batch.designs[: len(values)]
        if self._policy.running_mean:
            info = self._as_means(designs, info)
            values = self._means.means[indices_of(designs)]
        m = min(batch.n_parents, len(values))
        n = len(values) if self._policy.running_mean else m
        if n and isinstance(self._searcher, HasParents):
            self._searcher.refresh(designs[:n], values[:n], _part(info, slice(n)))
        if m < len(values):
            part = slice(m, len(values))
            self._searcher.tell(designs[part], values[part], _part(info, part))
            self._has_told = True

    def _as_means(self, designs: Designs, info: Info) -> Info:
        """Return what belongs to running means beside them: standard errors, displacements."""
        indices = indices_of(designs)
        errors = self._means.standard_errors(indices)
        known = np.where(np.isnan(errors), info["standard_error"], errors)
        mean = self._means.displacements(indices)
        return cast(Info, {**info, "standard_error": known, "displacement": mean})


@dataclass
class _Batch:
    """Designs on their way: asked for, and told one piece after the other."""

    designs: Designs
    n_parents: int
    pieces: list[tuple[NDArray[np.float64], Info]]
    n_told: int = 0

    @classmethod
    def none(cls) -> _Batch:
        return cls(np.zeros((0, N_SITES), dtype=np.int64), 0, [])

    @classmethod
    def of(cls, parents: Designs, offspring: Designs, *, most: int | None) -> _Batch:
        return cls(np.concatenate([parents, offspring])[:most], len(parents), [])

    @property
    def untold(self) -> Designs:
        return self.designs[self.n_told :]

    @property
    def is_told(self) -> bool:
        return self.n_told == len(self.designs)

    def take(self, values: NDArray[np.float64], info: Info) -> None:
        self.pieces.append((values, info))
        self.n_told += len(values)

    def told(self) -> tuple[NDArray[np.float64], Info]:
        values, infos = zip(*self.pieces, strict=True)
        columns: dict[str, Any] = {
            name: np.concatenate([cast(Any, info)[name] for info in infos]) for name in infos[0]
        }
        return np.concatenate(values), cast(Info, columns)


def _part(info: Info, part: slice) -> Info:
    """Return some rows of what is told beside the values."""
    columns: dict[str, Any] = {name: cast(Any, column)[part] for name, column in info.items()}
    return cast(Info, columns)
