"""The parameters of the physics, their units and the presets."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from math import pi
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Parameter: TypeAlias = float | NDArray[np.float64]

ACTUATIONS = ("hold", "clamp", "expand_and_contract")
PRESETS = ("published", "exact")

#: The engine counts in 32 bits.
MOST = 2**31 - 1


def _about(unit: str, bounds: str, meaning: str) -> dict[str, str]:
    return {"unit": unit, "bounds": bounds, "meaning": meaning}


@dataclass(frozen=True, eq=False)
class Physics:
    """Every parameter of the simulation, in SI units; the defaults are the paper's exact values.

    All but `edge`, `settle_time` and `actuation` may be arrays with one value per design of the
    batch. A preset changes with `dataclasses.replace`.

    Parameters
    ----------
    edge : float
        m, resting edge of a voxel.
    youngs_modulus : float or (n,) array
        Pa.
    poisson_ratio : float or (n,) array
        Above -1 and at most 0.5.
    density : float or (n,) array
        kg/m^3. Not printed in the paper; it follows from its time step.
    friction_static, friction_kinetic : float or (n,) array
        Coefficients of Coulomb friction. Kinetic above static is allowed, with a warning.
    shear_strength : float or (n,) array
        Pa, interfacial; adds shear_strength times the squared edge to both friction limits.
    gravity : float, (3,) vector, (n,) or (n, 3) array
        m/s^2. A number is along z, so negative is down; three numbers are always one vector, so
        that a batch of three designs needs a (3, 3) array. A tilted floor is a tilted gravity.
    damping_link, damping_ground, damping_global : float or (n,) array
        Damping ratios of links, of contact with the ground, and of a slow drag on every voxel.
    frequency_hz : float or (n,) array
        Hz, of the actuation.
    strain : float or (n,) array
        Amplitude of an active voxel's edge, 1.9^(1/3) - 1 for +90 % volume.
    actuation : {"hold", "clamp", "expand_and_contract"}
        What an edge does in the half cycle in which its pump asks for less than the resting edge:
        hold its last value, rest, or contract.
    settle_time : float
        s, when actuation and measuring start.
    duration : float or (n,) array
        s, of the whole run, settling included.
    time_step_fraction : float or (n,) array
        Share of the largest stable time step, above 0 and at most 1.
    single_precision_rest : bool
        Whether an actuated edge swings about the resting edge rounded to single precision, as it
        did in the published run; see `pumped_rest`.

    Raises
    ------
    TypeError, ValueError
        For a value out of its bounds, naming the parameter.

    Notes
    -----
    Source: Kriegman et al., "Scalable sim-to-real transfer of soft robot designs", RoboSoft 2020;
    shear strength: Majidi et al., "Influence of surface traction on soft robot undulation", 2013.
    """

    edge: float = field(default=0.01, metadata=_about("m", "positive", "resting edge of a voxel"))
    youngs_modulus: Parameter = field(
        default=1e7, metadata=_about("Pa", "positive", "Young's modulus")
    )
    poisson_ratio: Parameter = field(
        default=0.35, metadata=_about("", "poisson", "Poisson's ratio")
    )
    density: Parameter = field(default=1e6, metadata=_about("kg/m^3", "positive", "density"))
    friction_static: Parameter = field(
        default=1.0, metadata=_about("", "not negative", "static friction")
    )
    friction_kinetic: Parameter = field(
        default=0.5, metadata=_about("", "not negative", "kinetic friction")
    )
    shear_strength: Parameter = field(
        default=0.0, metadata=_about("Pa", "not negative", "interfacial shear strength")
    )
    gravity: Parameter = field(
        default=-9.81, metadata=_about("m/s^2", "finite", "gravity along z, or a vector")
    )
    damping_link: Parameter = field(
        default=1.0, metadata=_about("", "not negative", "damping ratio of links")
    )
    damping_ground: Parameter = field(
        default=0.8, metadata=_about("", "not negative", "damping ratio of the ground")
    )
    damping_global: Parameter = field(
        default=0.01, metadata=_about("", "not negative", "damping ratio of a slow drag")
    )
    frequency_hz: Parameter = field(
        default=4.0, metadata=_about("Hz", "positive", "frequency of actuation")
    )
    strain: Parameter = field(
        default=1.9 ** (1 / 3) - 1, metadata=_about("", "strain", "amplitude of active edges")
    )
    actuation: str = field(
        default="hold", metadata=_about("", "actuation", "edges in the negative half cycle")
    )
    settle_time: float = field(
        default=0.25, metadata=_about("s", "not negative", "when actuation starts")
    )
    duration: Parameter = field(default=4.0, metadata=_about("s", "positive", "of the whole run"))
    time_step_fraction: Parameter = field(
        default=0.9, metadata=_about("", "fraction", "of the largest stable step")
    )
    single_precision_rest: bool = field(
        default=False,
        metadata=_about("", "flag", "round the edge that actuated voxels swing about"),
    )

    @classmethod
    def exact(cls) -> Physics:
        """Return the paper's parameters as printed."""
        return cls()

    @classmethod
    def published(cls) -> Physics:
        """Return the values that the published run rounded to, for its table digit for digit."""
        return cls(
            strain=0.23856233596801757,
            frequency_hz=3.999999807746178,
            time_step_fraction=0.9000000153523451,
            single_precision_rest=True,
        )

    @classmethod
    def preset(cls, name: str) -> Physics:
        """Return a preset by its name, "published" or "exact".

        Raises
        ------
        ValueError
            For any other name.
        """
        if name not in PRESETS:
            raise ValueError(f"physics {name!r} is unknown; the presets are {', '.join(PRESETS)}")
        preset: Callable[[], Physics] = getattr(cls, name)
        return preset()

    @classmethod
    def of(cls, physics: str | Mapping[str, Any] | Physics) -> Physics:
        """Return the physics that a preset's name, a dict of fields or a Physics stands for.

        A dict holds changes to `exact`, or to the preset that its key "preset" names.

        Raises
        ------
        TypeError, ValueError
            For anything else, or an unknown name or field.
        """
        if isinstance(physics, Physics):
            return physics
        if isinstance(physics, str):
            return cls.preset(physics)
        if not isinstance(physics, Mapping):
            raise TypeError(
                "physics must be a preset's name, a dict of fields or a Physics, "
                f"got {type(physics).__name__}"
            )
        changes = dict(physics)
        base = cls.preset(changes.pop("preset", "exact"))
        known = [f.name for f in fields(cls)]
        for name in changes:
            if name not in known:
                raise ValueError(
                    f"physics has no parameter {name!r}; the parameters are {', '.join(known)}"
                )
        return replace(base, **changes)

    def __post_init__(self) -> None:
        for f in fields(self):
            value = _checked(f.name, f.metadata["bounds"], getattr(self, f.name))
            object.__setattr__(self, f.name, value)
        self._check_together()

    def _check_together(self) -> None:
        _ = self.n_designs
        if np.any(np.asarray(self.duration) <= self.settle_time):
            raise ValueError(
                f"duration must be longer than settle_time ({self.settle_time} s), "
                f"got {self.duration}"
            )
        self._check_steps()
        if self.actuation == "expand_and_contract" and np.any(np.asarray(self.strain) >= 1):
            raise ValueError(
                f"strain must be below 1 where voxels expand and contract, got {self.strain}"
            )
        if np.any(np.asarray(self.friction_kinetic) > np.asarray(self.friction_static)):
            warnings.warn(
                f"friction_kinetic ({self.friction_kinetic}) is above friction_static "
                f"({self.friction_static}); this is allowed but rarely meant",
                UserWarning,
                stacklevel=4,
            )

    def _check_steps(self) -> None:
        with np.errstate(all="ignore"):
            step = np.asarray(self.time_step)
            steps = np.asarray(self.duration) / step
        countable = np.isfinite(step) & (step > 0) & (steps <= MOST)
        if not np.all(countable):
            duration, step = (
                np.broadcast_to(value, countable.shape)[~countable].flat[0]
                for value in (self.duration, step)
            )
            raise ValueError(
                f"duration of {duration:g} s in time steps of {step:.3g} s can't be counted "
                f"(at most {MOST} steps); change it, or time_step_fraction, edge, "
                "youngs_modulus or density"
            )
        most = 1 / (2 * step)
        if np.any(np.asarray(self.frequency_hz) > most):
            raise ValueError(
                f"frequency_hz must be at most half the steps per second, here "
                f"{np.min(most):.4g}, got {np.max(self.frequency_hz):g}"
            )

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Physics):
            return NotImplemented
        return all(
            np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self)
        )

    def __hash__(self) -> int:
        values = (getattr(self, f.name) for f in fields(self))
        # -0.0 equals 0.0 and so must hash alike; + 0.0 makes them one.
        return hash(tuple((v + 0.0).tobytes() if isinstance(v, np.ndarray) else v for v in values))

    @property
    def n_designs(self) -> int | None:
        """How many designs the arrays among the parameters are for; None where there are none."""
        lengths = {
            f.name: len(value)
            for f in fields(self)
            if isinstance(value := getattr(self, f.name), np.ndarray)
            and (f.name != "gravity" or value.shape != (3,))
        }
        if len(set(lengths.values())) > 1:
            raise ValueError(f"parameters must be arrays of one length, got {lengths}")
        return next(iter(lengths.values()), None)

    @property
    def gravity_vector(self) -> NDArray[np.float64]:
        """Gravity as a vector, shape (3,) or (n, 3), m/s^2."""
        gravity = np.asarray(self.gravity)
        if gravity.ndim == 2 or gravity.shape == (3,):
            return gravity
        vector: NDArray[np.float64] = gravity[..., np.newaxis] * np.array([0.0, 0.0, 1.0])
        return vector

    @property
    def pumped_rest(self) -> float:
        """Edge that actuated voxels swing about, m.

        Rounded to single precision it is 2e-10 m short, which matters to a few designs in the
        fifth decimal. The published run's edges show it (data/authors/trajectories), except where
        voxels contract as well.
        """
        if self.single_precision_rest and self.actuation != "expand_and_contract":
            return float(np.float32(self.edge))
        return self.edge

    @property
    def time_step(self) -> Parameter:
        """Time step, s: the fraction of the fastest axial oscillation that the parameters allow."""
        stiffness = np.asarray(self.youngs_modulus) * self.edge
        mass = np.asarray(self.density) * np.float64(self.edge) ** 3
        step = np.asarray(self.time_step_fraction) / (2 * pi * np.sqrt(stiffness / mass))
        return float(step) if step.ndim == 0 else step

    @property
    def cycles(self) -> Parameter:
        """Actuation cycles from settle_time to the end."""
        return (self.duration - self.settle_time) * self.frequency_hz

    def lasting(self, cycles: float) -> Physics:
        """Return the same physics with the duration of so many actuation cycles after settling.

        Raises
        ------
        ValueError
            Where cycles is not a positive number.
        """
        if not isinstance(cycles, (int, float, np.number)) or not 0 < cycles < np.inf:
            raise ValueError(f"cycles must be a positive number, got {cycles!r}")
        return replace(self, duration=self.settle_time + cycles / np.asarray(self.frequency_hz))

    def to_dict(self) -> dict[str, Any]:
        """Return all parameters as plain numbers, strings and lists, ready for JSON."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in values.items()}


_SCALARS = ("edge", "settle_time")

_BOUNDS: dict[str, tuple[str, Callable[[NDArray[np.float64]], NDArray[np.bool_]]]] = {
    "finite": ("finite", np.isfinite),
    "positive": ("positive and finite", lambda v: np.isfinite(v) & (v > 0)),
    "not negative": ("finite and not negative", lambda v: np.isfinite(v) & (v >= 0)),
    "poisson": ("above -1 and at most 0.5", lambda v: (v > -1) & (v <= 0.5)),
    "strain": ("finite and above -1", lambda v: np.isfinite(v) & (v > -1)),
    "fraction": (
        "above 0 and at most 1, or the time step is unstable",
        lambda v: (v > 0) & (v <= 1),
    ),
}


def _checked(name: str, bounds: str, value: Any) -> Any:
    if bounds == "actuation":
        if value not in ACTUATIONS:
            raise ValueError(f"actuation must be one of {', '.join(ACTUATIONS)}, got {value!r}")
        return value
    if bounds == "flag":
        if not isinstance(value, (bool, np.bool_)):
            raise TypeError(f"{name} must be True or False, got {value!r}")
        return bool(value)
    array = _as_numbers(name, value)
    if array.ndim > 0 and name in _SCALARS:
        raise ValueError(f"{name} must be one number for the whole batch, got {value!r}")
    if array.ndim > 1 and not (name == "gravity" and array.ndim == 2 and array.shape[1] == 3):
        what = "a number, a vector or an (n, 3) array" if name == "gravity" else "a number or a row"
        raise ValueError(f"{name} must be {what}, got an array of shape {array.shape}")
    words, holds = _BOUNDS[bounds]
    good = holds(array)
    if not np.all(good):
        raise ValueError(f"{name} must be {words}, got {array[~good].flat[0]}")
    return array if array.ndim else float(array)


def _as_numbers(name: str, value: ArrayLike) -> NDArray[np.float64]:
    """Return a read-only float64 copy, or raise TypeError naming the parameter."""
    try:
        array = np.asarray(value)
    except ValueError:
        raise ValueError(f"{name} must be a number or an even array, got {value!r}") from None
    if array.dtype.kind not in "iuf":
        raise TypeError(f"{name} must be a number or an array of numbers, got {value!r}")
    array = np.array(array, dtype=np.float64)
    array.setflags(write=False)
    return array
