"""The integrator's own error: what a design does at half the time step."""

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
    """Return by how much the fitness of designs changes at half the time step.

    It tells how far a number of this simulator can be trusted, as one that the step itself decides
    says nothing of a robot. Takes three times as long as simulating the designs. It is the
    `step_error` of `softvox_gym.simulate(..., check_step=True)`, which takes any batch.

    Parameters
    ----------
    designs, shape
        As `softvox_gym.evaluate` takes them.
    physics : str, dict or Physics
        As `Physics.of` takes it, of single numbers.
    threads, progress
        As `softvox_gym.simulate` takes them.

    Returns
    -------
    ndarray, shape (n,)
        Not negative, voxel widths; NaN where a design diverges at either step.

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
