"""What a searcher is: anything with these five methods; and a base that brings four of them."""

from __future__ import annotations

from copy import deepcopy
from typing import Any, Protocol, TypeAlias, TypedDict, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Design
from softvox_gym.design import N_DESIGNS, indices_of

#: Rows of digits, int64 of shape (n, 8), as the environment's action space has them.
Designs: TypeAlias = NDArray[np.int64]

State: TypeAlias = dict[str, Any]


class Info(TypedDict):
    """What a searcher is told beside the values.

    displacement : ndarray, shape (n, 3)
        dx, dy, dz in voxel widths; NaN where the design diverged.
    status : ndarray of str, shape (n,)
        "ok" or "diverged".
    standard_error : ndarray, shape (n,)
        Of the values, voxel widths: 0 where they are exact, NaN where a noisy value is a single
        draw.
    """

    displacement: NDArray[np.float64]
    status: NDArray[np.str_]
    standard_error: NDArray[np.float64]


@runtime_checkable
class Searcher(Protocol):
    """An optimiser that is asked for designs and told what they are worth.

    It must draw all its random numbers from the generator that it was made with, so that a run can
    be repeated, and be able to stop and go on: a searcher made alike and given the state of another
    continues with the same bits.
    """

    def ask(self, n: int | None = None) -> Any:
        """Propose designs to evaluate.

        Parameters
        ----------
        n : int, optional
            At most this many; the searcher's own batch where None.

        Returns
        -------
        designs
            Anything that `softvox_gym.simulate` takes for a batch of the 2x2x2 lattice: rows of
            digits, shape (m, 8), an array of design numbers, a list of Design. One design alone is
            a batch of one, ``[[0, 0, 0, 2, 1, 2, 2, 2]]``. None at all ends the search.
        """
        ...

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Learn what the designs of the last `ask` are worth, in the order asked.

        They may be fewer than were asked for: then the budget has ended.

        Parameters
        ----------
        designs : ndarray of int64, shape (n, 8)
        values : ndarray, shape (n,)
            To be maximised; never NaN. A design that diverged has the value 0.
        info : Info
        """
        ...

    def recommend(self) -> Design:
        """Return the design that the searcher would build now.

        It may differ from the one with the best value seen. Called after one `tell` at least.
        """
        ...

    def state_dict(self) -> State:
        """Return everything needed to go on; it can be pickled, and later steps don't change it."""
        ...

    def load_state_dict(self, state: State) -> None:
        """Go on where the searcher that gave this state was."""
        ...


class SearcherBase:
    """Remembers the value told last for every design; a searcher on it needs only an `ask`.

    Parameters
    ----------
    rng : numpy.random.Generator
        The run's own; the only source of random numbers.

    Attributes
    ----------
    rng : numpy.random.Generator
    values : ndarray, shape (6561,)
        The value told last for every design, voxel widths; NaN where none was.
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self.rng = rng
        self.values = np.full(N_DESIGNS, np.nan)

    def ask(self, n: int | None = None) -> Any:
        """Propose designs to evaluate; see `Searcher`."""
        raise NotImplementedError(f"{type(self).__name__} must have an ask(n)")

    def tell(self, designs: Designs, values: NDArray[np.float64], info: Info) -> None:
        """Remember the values."""
        self.values[indices_of(designs)] = values

    def recommend(self) -> Design:
        """Return the design with the best value, of equal ones the first by number.

        Raises
        ------
        ValueError
            Before the first `tell`.
        """
        if np.isnan(self.values).all():
            raise ValueError("nothing to recommend: no design was evaluated yet")
        return Design(int(np.nanargmax(self.values)))

    def state_dict(self) -> State:
        """Return a copy of all attributes."""
        return deepcopy(vars(self))

    def load_state_dict(self, state: State) -> None:
        """Take over a copy of all attributes."""
        vars(self).clear()
        vars(self).update(deepcopy(state))
