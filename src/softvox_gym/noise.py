"""Noise: the assumed variation from one trial of a real robot to the next.

Source: N. Jakobi, P. Husbands, I. Harvey, "Noise and the reality gap: the use of simulation in
evolutionary robotics", ECAL 1995: noise of about the real amount keeps evolution from exploiting
features that only the simulator has.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import ceil
from textwrap import fill, indent
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from softvox_gym.lattice import Lattice
from softvox_gym.physics import Physics
from softvox_gym.portable import cos_sin, direction, exp, normal
from softvox_gym.simulation import check_number

Array = NDArray[np.float64]

#: Frequencies stay within this many standard deviations, and above this share of the nominal.
FREQUENCY_DEVIATIONS = 5.0
LEAST_FREQUENCY = 0.1


@dataclass(frozen=True, eq=False)
class Trials:
    """The parameters of k trials of one design, or of several designs in a row.

    Parameters
    ----------
    nominal : Physics
        The parameters that do not vary.
    values : mapping of str to ndarray, shape (k,), for gravity (k, 3)
        Parameters of the physics that differ from trial to trial.
    strain : ndarray, shape (k, cycles, nx, ny, nz)
        Amplitude of every voxel, cycle by cycle; later cycles repeat the last.
    phase : ndarray, shape (k, nx, ny, nz)
        Phase of every voxel's actuation, cycles.
    """

    nominal: Physics
    values: Mapping[str, Array]
    strain: Array
    phase: Array

    @classmethod
    def of(cls, physics: Physics, lattice: Lattice, k: int) -> Trials:
        """Return k trials under the unchanged physics."""
        strain = np.full((k, 1, *lattice), float(physics.strain))
        return cls(physics, {}, strain, np.zeros((k, *lattice)))

    @classmethod
    def joined(cls, parts: Sequence[Trials]) -> Trials:
        """Return the trials of all parts in a row; they share their nominal physics."""
        cycles = max(part.strain.shape[1] for part in parts)
        names = {name: None for part in parts for name in part.values}
        return cls(
            parts[0].nominal,
            {name: np.concatenate([part[name] for part in parts]) for name in names},
            np.concatenate([held(part.strain, cycles) for part in parts]),
            np.concatenate([part.phase for part in parts]),
        )

    def __len__(self) -> int:
        return len(self.phase)

    def __getitem__(self, name: str) -> Array:
        """Return a parameter of the physics for every trial, shape (k,), gravity (k, 3)."""
        if name in self.values:
            return self.values[name]
        if name == "gravity":
            return np.tile(self.nominal.gravity_vector, (len(self), 1))
        return np.full(len(self), float(getattr(self.nominal, name)))

    def changed(self, **values: Array) -> Trials:
        """Return the trials with other amplitudes, phases or parameters of the physics."""
        own: Any = {name: values.pop(name) for name in ("strain", "phase") if name in values}
        return replace(self, values={**self.values, **values}, **own)

    @property
    def physics(self) -> Physics:
        """The nominal physics with the parameters of the trials."""
        values: dict[str, Any] = dict(self.values)
        return replace(self.nominal, **values)


def held(strain: Array, cycles: int) -> Array:
    """Return the amplitudes for at least this many cycles, repeating the last."""
    missing = max(cycles - strain.shape[1], 0)
    return np.concatenate([strain, np.repeat(strain[:, -1:], missing, axis=1)], axis=1)


class Perturbation(Protocol):
    """Something that differs from trial to trial, for `softvox_gym.evaluate`.

    Both methods draw from the design's own generator, so a design's trials do not depend on the
    other designs of the batch.
    """

    def disturb(self, trials: Trials, rng: np.random.Generator) -> Trials:
        """Return the trials with parameters drawn anew."""
        ...

    def measure(self, fitness: Array, rng: np.random.Generator) -> Array:
        """Return measured values of fitness values, shape (k,), voxel widths."""
        ...


class Source(NamedTuple):
    """One thing that varies in `Jakobi` noise.

    Parameters
    ----------
    name : str
    default : float
        Its amount at level 1.
    about : str
    draw : callable (rng, trials, cycles) -> ndarray
        Random numbers that do not depend on the amount.
    apply : callable (trials, draws, amount) -> Trials
    """

    name: str
    default: float
    about: str
    draw: Callable[[np.random.Generator, Trials, int], Any]
    apply: Callable[[Trials, Any, float], Trials]


#: In drawing order. Add a new source at the end, so that it changes no other's draws.
SOURCES: list[Source] = []


def _source(
    name: str, default: float, about: str, draw: Callable[[np.random.Generator, Trials, int], Any]
) -> Callable[[Callable[[Trials, Any, float], Trials]], None]:
    """Register the decorated function, which applies the noise, as a `Source`."""
    return lambda apply: SOURCES.append(Source(name, default, about, draw, apply))


def _per_voxel(rng: np.random.Generator, trials: Trials, cycles: int) -> Array:
    return normal(rng, trials.phase.shape)


def _per_trial(rng: np.random.Generator, trials: Trials, cycles: int) -> Array:
    return normal(rng, len(trials))


@_source(
    "strain",
    0.10,
    "standard deviation of each active voxel's amplitude, as a share of it; lasts for the run",
    _per_voxel,
)
def _strain(trials: Trials, draws: Array, amount: float) -> Trials:
    # An actuator may fail to inflate, but it does not apply suction.
    factor = np.maximum(1 + amount * draws, 0.0)
    return trials.changed(strain=trials.strain * factor[:, np.newaxis])


@_source(
    "leak",
    0.01,
    "probability of each active voxel that its actuator leaks and it stays passive",
    lambda rng, trials, cycles: rng.random(trials.phase.shape),
)
def _leak(trials: Trials, draws: Array, amount: float) -> Trials:
    leaks = (draws < amount)[:, np.newaxis]
    return trials.changed(strain=np.where(leaks, 0.0, trials.strain))


@_source("phase", 0.02, "standard deviation of each voxel's phase, cycles", _per_voxel)
def _phase(trials: Trials, draws: Array, amount: float) -> Trials:
    return trials.changed(phase=trials.phase + amount * draws)


@_source(
    "frequency",
    0.02,
    "standard deviation of the frequency of actuation, as a share of it; actuation still begins in "
    "the phase in which it nominally does",
    _per_trial,
)
def _frequency(trials: Trials, draws: Array, amount: float) -> Trials:
    deviation = np.clip(draws, -FREQUENCY_DEVIATIONS, FREQUENCY_DEVIATIONS)
    nominal = trials["frequency_hz"]
    frequency = nominal * np.maximum(1 + amount * deviation, LEAST_FREQUENCY)
    # The pattern's clock runs from the start of settling, the pump's from its end.
    begun = (nominal - frequency) * trials.nominal.settle_time
    phase = trials.phase + begun[:, np.newaxis, np.newaxis, np.newaxis]
    return trials.changed(frequency_hz=frequency, phase=phase)


@_source(
    "friction",
    0.2,
    "standard deviation of the logarithm of the static and of the kinetic friction, drawn apart; "
    "the kinetic is then at most the static",
    lambda rng, trials, cycles: normal(rng, (2, len(trials))),
)
def _friction(trials: Trials, draws: Array, amount: float) -> Trials:
    static, kinetic = exp(amount * draws)
    friction_static = trials["friction_static"] * static
    friction_kinetic = np.minimum(trials["friction_kinetic"] * kinetic, friction_static)
    return trials.changed(friction_static=friction_static, friction_kinetic=friction_kinetic)


@_source("stiffness", 0.05, "standard deviation of the logarithm of Young's modulus", _per_trial)
def _stiffness(trials: Trials, draws: Array, amount: float) -> Trials:
    return trials.changed(youngs_modulus=trials["youngs_modulus"] * exp(amount * draws))


@_source("density", 0.05, "standard deviation of the logarithm of the density", _per_trial)
def _density(trials: Trials, draws: Array, amount: float) -> Trials:
    return trials.changed(density=trials["density"] * exp(amount * draws))


@_source(
    "tilt",
    1.0,
    "standard deviation of the floor's tilt, degrees; towards any azimuth alike",
    lambda rng, trials, cycles: (normal(rng, len(trials)), direction(rng, len(trials))),
)
def _tilt(trials: Trials, draws: tuple[Array, Array], amount: float) -> Trials:
    tilt = np.pi / 180 * (amount * draws[0])
    return trials.changed(gravity=tilted(trials["gravity"], tilt, draws[1]))


@_source(
    "strain_per_cycle",
    0.10,
    "as strain, drawn anew for every voxel and cycle of actuation",
    lambda rng, trials, cycles: normal(rng, (len(trials), cycles, *trials.phase.shape[1:])),
)
def _strain_per_cycle(trials: Trials, draws: Array, amount: float) -> Trials:
    factor = held(1 + amount * draws, trials.strain.shape[1])
    strain = held(trials.strain, draws.shape[1])
    return trials.changed(strain=strain * np.maximum(factor, 0.0))


#: Names and amounts at level 1.
AMOUNTS = {source.name: source.default for source in SOURCES}


def _inset(text: str, by: int = 4) -> str:
    return indent(text, " " * by)


@dataclass(frozen=True, init=False)
class Jakobi:
    """Noise on the properties of a real robot and its floor, drawn anew for every trial.

    Parameters
    ----------
    level : float
        0 is no noise, 1 the assumed real variability, 2 twice that.
    **amounts
        At level 1:

        {sources}

    Raises
    ------
    TypeError, ValueError
        If a source of noise is unknown, a level or an amount is not a finite number of at least 0,
        or a leak is above 1.

    Notes
    -----
    Every source draws the same random numbers whatever the amounts are, so you can change a level
    or a source with everything else equal. The duration of a run is fixed, so a faster actuation
    has more cycles.
    """

    level: float
    amounts: Mapping[str, float] = field(hash=False)

    def __init__(self, level: float = 1.0, **amounts: float) -> None:
        for name in amounts:
            if name not in AMOUNTS:
                raise ValueError(
                    f"JakobiNoise has no source {name!r}; the sources are {', '.join(AMOUNTS)}"
                )
        checked = {
            name: not_negative(name, amounts.get(name, default))
            for name, default in AMOUNTS.items()
        }
        if checked["leak"] > 1:
            raise ValueError(f"leak must be a probability, at most 1, got {checked['leak']}")
        object.__setattr__(self, "level", not_negative("level", level))
        object.__setattr__(self, "amounts", checked)

    def disturb(self, trials: Trials, rng: np.random.Generator) -> Trials:
        """Return the trials with every source drawn anew; at level 0 unchanged."""
        if not self.level:
            return trials
        amounts = {name: self.level * amount for name, amount in self.amounts.items()}
        # For as many cycles of actuation as the fastest trial has.
        fastest = 1 + FREQUENCY_DEVIATIONS * amounts["frequency"]
        cycles = ceil(float(trials.nominal.cycles) * fastest) + 1
        for source in SOURCES:
            draws = source.draw(rng, trials, cycles)
            trials = source.apply(trials, draws, amounts[source.name])
        return trials

    def measure(self, fitness: Array, rng: np.random.Generator) -> Array:
        """Return the fitness unchanged."""
        return fitness


@dataclass(frozen=True)
class MeasurementNoise:
    """A normally distributed error on the measured fitness; the robot's motion is unchanged.

    Parameters
    ----------
    sigma : float
        Standard deviation, voxel widths.

    Raises
    ------
    TypeError, ValueError
        If sigma is not a finite number of at least 0.
    """

    sigma: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "sigma", not_negative("sigma", self.sigma))

    def disturb(self, trials: Trials, rng: np.random.Generator) -> Trials:
        """Return the trials unchanged."""
        return trials

    def measure(self, fitness: Array, rng: np.random.Generator) -> Array:
        """Return the fitness with an error on every value; nothing is drawn if sigma is 0."""
        return fitness + self.sigma * normal(rng, fitness.shape) if self.sigma else fitness


if Jakobi.__doc__:
    _listed = [
        f"{s.name} : float, default {s.default}\n{_inset(fill(s.about, 88))}" for s in SOURCES
    ]
    Jakobi.__doc__ = Jakobi.__doc__.format(sources=_inset("\n".join(_listed), 8).lstrip())


def tilted(gravity: Array, tilt: Array, downhill: Array) -> Array:
    """Return gravity as seen from a tilted floor, shape (k, 3).

    Parameters
    ----------
    gravity : ndarray, shape (k, 3)
        m/s^2, over a level floor.
    tilt : ndarray, shape (k,)
        Radians.
    downhill : ndarray, shape (2, k)
        Horizontal unit vector (x, y) of the downhill direction.

    Notes
    -----
    Rotates gravity in the plane of the vertical and the downhill direction, so that gravity along
    -z gets a downhill component. The component across that plane does not change.
    """
    cosine, sine = cos_sin(tilt)
    x, y = downhill
    gx, gy, gz = gravity.T
    along = x * gx + y * gy
    change = along * cosine - gz * sine - along
    return np.stack([gx + change * x, gy + change * y, along * sine + gz * cosine], axis=-1)


def not_negative(name: str, value: object) -> float:
    """Return a finite number of at least 0 as a float.

    Raises
    ------
    TypeError, ValueError
        If it is not; the message names it.
    """
    number = check_number(name, value)
    if not 0 <= number < np.inf:
        raise ValueError(f"{name} must be finite and at least 0, got {value}")
    return number
