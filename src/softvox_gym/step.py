"""The integrator's error: the change of fitness at half the time step."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.engine import Progress
from softvox_gym.realities import PhysicsLike, single_physics
from softvox_gym.simulation import pumped, simulate


def step_error(
    designs: Any,
    physics: PhysicsLike = "published",
    *,
    shape: Sequence[int] | None = None,
    threads: int | None = None,
    progress: Progress | None = None,
) -> NDArray[np.float64]:
    """Return how much the fitness of designs changes at half the time step.

    The change shows how far the simulator's numbers can be trusted: smaller differences between
    designs may be due to the time step. Takes three times as long as simulating the designs. For
    any batch, use `softvox_gym.simulate(..., check_step=True)`, which gives the same `step_error`.

    Parameters
    ----------
    designs, shape
        As in `softvox_gym.evaluate`.
    physics : str, dict or Physics
        As in `Physics.of`, with single numbers.
    threads, progress
        As in `softvox_gym.simulate`.

    Returns
    -------
    ndarray, shape (n,)
        Absolute change, voxel widths; NaN if a design diverges at either step.

    Raises
    ------
    TypeError, ValueError
        As `softvox_gym.evaluate` does.
    """
    stack, phase = pumped(designs, None, shape=shape)
    error = simulate(
        stack,
        single_physics(physics),
        phase=phase,
        check_step=True,
        threads=threads,
        progress=progress,
    ).step_error
    assert error is not None
    return error
