"""Models of the world: physics drawn from a prior, in three classes by varied parameters.

No model is built from a reality: all are drawn from continuous distributions by seeds of their own,
and `TransferRun.distance` tells how near the nearest comes to the truth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from softvox_gym import Physics
from softvox_gym.realities import between, log_between
from softvox_gym.simulation import check_count
from softvox_search.transfer.simulator import Simulator

Array = NDArray[np.float64]

#: The parameters that a class of models varies; the shear strength is drawn as T*.
CLASSES: Mapping[str, frozenset[str]] = {
    "coulomb": frozenset({"friction_static", "friction_kinetic"}),
    "coulomb_area": frozenset({"friction_static", "friction_kinetic", "shear_strength"}),
    "all": frozenset(
        {
            *("friction_static", "friction_kinetic", "shear_strength", "youngs_modulus"),
            *("density", "strain", "frequency_hz"),
        }
    ),
}

#: The number of coordinates of a physics in the prior.
SHARES = 8

#: How many of them, from the first on, matter in a class.
SHARES_OF: Mapping[str, int] = {"coulomb": 2, "coulomb_area": 4, "all": SHARES}


@dataclass(frozen=True, eq=False)
class Library:
    """Models of a class, with their predictions for every design.

    Parameters
    ----------
    physics : tuple of Physics
    displacement : ndarray, shape (models, 6561, 3)
        Voxel widths; read-only.
    varied : frozenset of str
        Parameters of `Physics` that the class varies.
    """

    physics: tuple[Physics, ...]
    displacement: Array
    varied: frozenset[str]


def library(simulator: Simulator, models: str, n: int) -> Library:
    """Return n models of a class, for the nominal physics of a simulator.

    Each has a landscape, which is simulated once and stored; see `softvox_gym.landscape`.

    Raises
    ------
    TypeError, ValueError
        If the class is unknown, or the number of models is invalid.
    SimulationBudgetError
        If the simulator may not simulate as many.
    """
    check_count("size", n, least=1)
    physics = drawn(simulator.nominal, check_class(models), n)
    return Library(physics, simulator.landscapes(physics), CLASSES[models])


def check_class(models: str) -> str:
    """Return the name of a class of models; ValueError if it is unknown."""
    if models not in CLASSES:
        raise ValueError(f"models must be one of {', '.join(CLASSES)}, got {models!r}")
    return models


@lru_cache(maxsize=64)
def drawn(nominal: Physics, models: str, n: int) -> tuple[Physics, ...]:
    """Return the physics of n models of a class; a larger n begins with the same ones."""
    number = list(CLASSES).index(models)
    shares = (np.random.default_rng([1911, number, i]).random(SHARES) for i in range(n))
    return tuple(physics_at(one, nominal, models) for one in shares)


def physics_at(shares: Array, nominal: Physics, models: str) -> Physics:
    """Return the physics of a class of models at shares of the prior's ranges, shape (8,).

    With uniformly drawn shares this is the prior in docs/transfer.md.
    """
    at = iter(shares.tolist())
    static = log_between(next(at), 0.05, 1.5)
    kinetic = static * between(next(at), 0.4, 1.0)
    kind, ratio = next(at), log_between(next(at), 0.05, 1.0)
    stiffness, density = log_between(next(at), 0.3, 3.0), log_between(next(at), 0.5, 2.0)
    strain, frequency = between(next(at), 0.15, 0.5), between(next(at), 2.0, 5.0)
    physics = replace(nominal, friction_static=static, friction_kinetic=kinetic)
    if models == "all":
        physics = replace(
            physics,
            youngs_modulus=stiffness * float(nominal.youngs_modulus),
            density=density * float(nominal.density),
            strain=strain,
            frequency_hz=frequency,
        ).lasting(round(float(nominal.cycles), 3))
    if models != "coulomb":
        if kind < 1 / 3:
            physics = replace(physics, friction_static=0.0, friction_kinetic=0.0)
        if kind < 2 / 3:
            physics = physics.sheared(ratio)
    return physics
