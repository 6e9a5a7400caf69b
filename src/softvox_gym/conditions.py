"""The conditions under which a design is tried, where they differ from trial to trial."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import DEFAULT_SHAPE
from softvox_gym.physics import Physics

#: Parameters that may differ from trial to trial.
VARIED = (
    "youngs_modulus",
    "density",
    "friction_static",
    "friction_kinetic",
    "frequency_hz",
    "gravity",
)


@dataclass(frozen=True)
class Conditions:
    """The conditions of some trials of one design, or of several designs in a row.

    Parameters
    ----------
    youngs_modulus, density, friction_static, friction_kinetic, frequency_hz : ndarray, shape (k,)
        As in `Physics`.
    gravity : ndarray, shape (k, 3)
        m/s^2.
    strain : ndarray, shape (k, cycles, 2, 2, 2)
        Amplitude of every voxel, cycle by cycle; the last holds on.
    phase : ndarray, shape (k, 2, 2, 2)
        Of every voxel's actuation, cycles.
    """

    youngs_modulus: NDArray[np.float64]
    density: NDArray[np.float64]
    friction_static: NDArray[np.float64]
    friction_kinetic: NDArray[np.float64]
    frequency_hz: NDArray[np.float64]
    gravity: NDArray[np.float64]
    strain: NDArray[np.float64]
    phase: NDArray[np.float64]

    @classmethod
    def nominal(cls, physics: Physics, k: int) -> Conditions:
        """Return k trials under the physics as it stands."""
        numbers = {
            name: np.full(k, float(getattr(physics, name))) for name in VARIED if name != "gravity"
        }
        return cls(
            **numbers,
            gravity=np.tile(physics.gravity_vector, (k, 1)),
            strain=np.full((k, 1, *DEFAULT_SHAPE), float(physics.strain)),
            phase=np.zeros((k, *DEFAULT_SHAPE)),
        )

    @classmethod
    def joined(cls, parts: Sequence[Conditions]) -> Conditions:
        """Return the trials of all parts in a row."""
        cycles = max(part.strain.shape[1] for part in parts)
        columns = {
            name: np.concatenate([getattr(part, name) for part in parts])
            for name in (*VARIED, "phase")
        }
        return cls(**columns, strain=np.concatenate([held(part.strain, cycles) for part in parts]))

    def physics(self, nominal: Physics) -> Physics:
        """Return the nominal physics with these parameters in place of its own."""
        return replace(nominal, **{name: getattr(self, name) for name in VARIED})


def held(strain: NDArray[np.float64], cycles: int) -> NDArray[np.float64]:
    """Return the amplitudes for so many cycles at least; the last is held."""
    missing = max(cycles - strain.shape[1], 0)
    return np.concatenate([strain, np.repeat(strain[:, -1:], missing, axis=1)], axis=1)


#: Changes the conditions of some trials of one design, drawing from the generator.
Disturbance: TypeAlias = Callable[[Conditions, np.random.Generator], Conditions]
