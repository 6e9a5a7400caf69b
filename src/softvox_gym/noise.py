"""What differs from one trial of a real robot to the next, and how much of it is assumed.

Source: N. Jakobi, P. Husbands, I. Harvey, "Noise and the reality gap: the use of simulation in
evolutionary robotics", ECAL 1995: noise of about the real amount keeps evolution from praising
designs for what only the simulator has.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from softvox_gym.conditions import Conditions, held
from softvox_gym.design import DEFAULT_SHAPE
from softvox_gym.physics import Physics
from softvox_gym.portable import cos_sin, direction, exp, normal

#: A frequency is kept within so many standard deviations, and above this share of the nominal.
FREQUENCY_DEVIATIONS = 5.0
LEAST_FREQUENCY = 0.1


@dataclass(frozen=True, kw_only=True)
class Channels:
    """How much each thing varies at level 1; the other levels scale it.

    Parameters
    ----------
    strain : float
        Standard deviation of each active voxel's amplitude, as a share of it; lasts for the run.
    strain_per_cycle : float
        The same, drawn anew for every voxel and cycle of actuation.
    phase : float
        Standard deviation of each voxel's phase, in cycles.
    frequency : float
        Standard deviation of the frequency of actuation, as a share of it. Actuation still begins
        in the phase in which it nominally does.
    friction : float
        Standard deviation of the logarithm of the static and of the kinetic friction, drawn apart;
        the kinetic is then at most the static.
    stiffness, density : float
        Standard deviation of their logarithms.
    tilt : float
        Standard deviation of the floor's tilt, degrees; towards any azimuth alike.
    leak : float
        Probability of each active voxel that its actuator leaks and it stays passive.

    Raises
    ------
    TypeError, ValueError
        For one that is not a finite number of at least 0, or a leak above 1.
    """

    strain: float = 0.10
    strain_per_cycle: float = 0.10
    phase: float = 0.02
    frequency: float = 0.02
    friction: float = 0.2
    stiffness: float = 0.05
    density: float = 0.05
    tilt: float = 1.0
    leak: float = 0.01

    def __post_init__(self) -> None:
        for f in fields(self):
            object.__setattr__(self, f.name, not_negative(f.name, getattr(self, f.name)))
        if self.leak > 1:
            raise ValueError(f"leak must be a probability, at most 1, got {self.leak}")

    def at(self, level: float) -> Channels:
        """Return the amounts at another level; a leak is at most certain."""
        amounts = {f.name: level * getattr(self, f.name) for f in fields(self)}
        return Channels(**{**amounts, "leak": min(amounts["leak"], 1.0)})

    def disturb(
        self,
        conditions: Conditions,
        rng: np.random.Generator,
        *,
        cycles: int,
        settle_time: float,
    ) -> Conditions:
        """Return the conditions of some trials of one design, disturbed.

        Every channel draws the same random numbers whatever the amounts are, so that a level or a
        channel can be changed with everything else equal.

        Parameters
        ----------
        conditions : Conditions
        rng : numpy.random.Generator
        cycles : int
            For how many cycles of actuation the strain is drawn; see `cycles_to_draw`.
        settle_time : float
            s, when actuation begins.
        """
        k = len(conditions.phase)
        sites = (k, *DEFAULT_SHAPE)
        strain = 1 + self.strain * normal(rng, sites)
        leaks = rng.random(sites) < self.leak
        phase = self.phase * normal(rng, sites)
        deviation = np.clip(normal(rng, k), -FREQUENCY_DEVIATIONS, FREQUENCY_DEVIATIONS)
        frequency = 1 + self.frequency * deviation
        static, kinetic = exp(self.friction * normal(rng, (2, k)))
        stiffness = exp(self.stiffness * normal(rng, k))
        density = exp(self.density * normal(rng, k))
        tilt = np.pi / 180 * (self.tilt * normal(rng, k))
        downhill = direction(rng, k)
        per_cycle = 1 + self.strain_per_cycle * normal(rng, (k, cycles, *DEFAULT_SHAPE))
        per_cycle = held(per_cycle, conditions.strain.shape[1])

        friction_static = conditions.friction_static * static
        frequency_hz = conditions.frequency_hz * np.maximum(frequency, LEAST_FREQUENCY)
        # The pattern's clock runs from the start of settling, the pump's from its end.
        begun = (conditions.frequency_hz - frequency_hz) * settle_time
        return replace(
            conditions,
            # An actuator may fail to inflate, but it does not suck.
            strain=held(conditions.strain, cycles)
            * np.where(leaks, 0.0, np.maximum(strain, 0.0))[:, np.newaxis]
            * np.maximum(per_cycle, 0.0),
            phase=conditions.phase + phase + begun[:, np.newaxis, np.newaxis, np.newaxis],
            frequency_hz=frequency_hz,
            friction_static=friction_static,
            friction_kinetic=np.minimum(conditions.friction_kinetic * kinetic, friction_static),
            youngs_modulus=conditions.youngs_modulus * stiffness,
            density=conditions.density * density,
            gravity=tilted(conditions.gravity, tilt, downhill),
        )

    def cycles_to_draw(self, physics: Physics) -> int:
        """Return how many cycles the fastest actuation has, within the bounds of the frequency."""
        fastest = 1 + FREQUENCY_DEVIATIONS * self.frequency
        return ceil(float(physics.cycles) * fastest) + 1


def tilted(
    gravity: NDArray[np.float64], tilt: NDArray[np.float64], downhill: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return gravity as seen from a tilted floor, shape (k, 3).

    Parameters
    ----------
    gravity : ndarray, shape (k, 3)
        m/s^2, over a level floor.
    tilt : ndarray, shape (k,)
        Radians.
    downhill : ndarray, shape (2, k)
        Horizontal unit vector (x, y) of the direction that goes down.

    Notes
    -----
    Turns gravity in the plane of the vertical and the downhill direction, so that gravity along -z
    gets a part downhill. What is across that plane stays.
    """
    cosine, sine = cos_sin(tilt)
    x, y = downhill
    along = x * gravity[:, 0] + y * gravity[:, 1]
    turned = along * cosine - gravity[:, 2] * sine
    return np.stack(
        [
            gravity[:, 0] + (turned - along) * x,
            gravity[:, 1] + (turned - along) * y,
            along * sine + gravity[:, 2] * cosine,
        ],
        axis=-1,
    )


def not_negative(name: str, value: object) -> float:
    """Return a finite number of at least 0 as a float.

    Raises
    ------
    TypeError, ValueError
        For anything else, naming it.
    """
    if isinstance(value, (bool, np.bool_)) or not isinstance(
        value, (int, float, np.integer, np.floating)
    ):
        raise TypeError(f"{name} must be a number, got {value!r}")
    number = float(value)
    if not 0 <= number < np.inf:
        raise ValueError(f"{name} must be finite and at least 0, got {value}")
    return number
