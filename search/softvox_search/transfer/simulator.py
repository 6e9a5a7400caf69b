"""The nominal simulator, as transfer methods use it."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

import softvox_gym
from softvox_gym import Physics, noisy_landscape, simulate
from softvox_gym.design import stack_of
from softvox_gym.engine import Progress
from softvox_gym.landscapes.table import N_DESIGNS, displacements, tracks
from softvox_gym.simulation import check_count

Array = NDArray[np.float64]


class SimulationBudgetError(ValueError):
    """A method asked for more simulations than it has."""


class Simulator:
    """The nominal simulator, and other physics of its engine; it counts simulations.

    A design that diverges has the displacement 0.

    Parameters
    ----------
    nominal : Physics
        The believed physics of the world.
    simulations : int, optional
        The most designs that may be simulated, under any physics; unlimited by default. Designs of
        a landscape that was simulated before are not counted again.
    testable : array_like of bool, shape (6561,), optional
        Which designs can be tested in reality; by default all.
    progress : callable (done, total), optional
        Called with the number of landscapes that are done, of several.

    Raises
    ------
    TypeError, ValueError
        If the number of simulations is invalid, or the mask has another shape or type or is empty.

    Attributes
    ----------
    nominal : Physics
    testable : ndarray of bool, shape (6561,)
        Read-only.
    used : int
        Number of simulated designs.
    """

    def __init__(
        self,
        nominal: Physics,
        simulations: int | None = None,
        *,
        testable: ArrayLike | None = None,
        progress: Progress | None = None,
    ) -> None:
        if simulations is not None:
            check_count("simulations", simulations, least=0)
        mask = np.array(np.ones(N_DESIGNS, dtype=bool) if testable is None else testable)
        if mask.shape != (N_DESIGNS,) or mask.dtype != bool or not mask.any():
            raise ValueError(
                f"testable must be {N_DESIGNS} bools, some of them true, got {mask.dtype} of shape "
                f"{mask.shape}"
            )
        mask.flags.writeable = False
        self.testable: NDArray[np.bool_] = mask
        self.nominal = nominal
        self.used = 0
        self._most = simulations
        self._known: set[Physics] = set()
        self._progress = progress

    def landscape(self, physics: Physics | None = None) -> Array:
        """Return the displacement of every design, shape (6561, 3), voxel widths; read-only.

        By default under the nominal physics. Others are simulated and stored, as by
        `softvox_gym.landscape`.

        Raises
        ------
        SimulationBudgetError
            If the budget does not allow as many designs.
        """
        which = self.nominal if physics is None else physics
        if which not in self._known:
            self._spend(N_DESIGNS)
            self._known.add(which)
        return _landscape(which)

    def landscapes(self, models: Sequence[Physics]) -> Array:
        """Return `landscape` under several physics as one array, shape (models, 6561, 3).

        Raises
        ------
        SimulationBudgetError
            As `landscape` does.
        """
        for done, physics in enumerate(models):
            if self._progress:
                self._progress(done, len(models))
            self.landscape(physics)
        return _stack(tuple(models))

    def displacement(self, designs: Any, physics: Physics | None = None) -> Array:
        """Return the displacement of designs, shape (n, 3), under the nominal physics or another.

        Raises
        ------
        SimulationBudgetError
            If the budget does not allow as many designs.
        TypeError, ValueError
            If the designs are invalid; see `softvox_gym.simulate`.
        """
        stack = stack_of(designs)
        self._spend(len(stack))
        result = simulate(stack, self.nominal if physics is None else physics, threads=1)
        return np.nan_to_num(result.displacement)

    def mean_height(self) -> Array:
        """Return the mean height of every design's centre of mass above its start, (6561,).

        Under the nominal physics, one sample per cycle, voxel widths; read-only.

        Raises
        ------
        SimulationBudgetError
            As `landscape` does.
        """
        self.landscape()
        return _mean_height(self.nominal)

    def noisy(self, level: float = 1.0) -> Array:
        """Return the mean displacement of every design under noise at a level, shape (6561, 3).

        The data ships with the package, and costs no simulations; dz is 0. See
        `softvox_gym.noisy_landscape`, which was measured under the published physics.
        """
        table = noisy_landscape(level)
        flat = np.stack([table["dx"], table["dy"], np.zeros(N_DESIGNS)], axis=-1)
        return np.asarray(np.nan_to_num(flat) * (1 - table["p_diverged"])[:, np.newaxis])

    def _spend(self, n: int) -> None:
        if self._most is not None and self.used + n > self._most:
            raise SimulationBudgetError(
                f"the simulator was asked for {n} designs, with {self._most - self.used} of "
                f"{self._most} simulations left; give more simulations, or use a method that needs "
                "fewer"
            )
        self.used += n


@lru_cache(maxsize=512)
def _landscape(physics: Physics) -> Array:
    return displacements(softvox_gym.landscape(physics))


@lru_cache(maxsize=8)
def _stack(models: tuple[Physics, ...]) -> Array:
    """Return landscapes, cached for all runs with the same models."""
    made = np.stack([_landscape(physics) for physics in models])
    made.flags.writeable = False
    return made


@lru_cache(maxsize=4)
def _mean_height(physics: Physics) -> Array:
    if physics == Physics.published():
        track: Array | None = tracks().track
    else:
        track = simulate(np.arange(N_DESIGNS), physics, track=1).track
    assert track is not None
    height = np.nan_to_num(track[..., 2].mean(axis=-1))
    height.flags.writeable = False
    return np.asarray(height)
