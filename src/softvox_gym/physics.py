"""The parameters of the physics, their units and the presets."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from decimal import ROUND_DOWN, Context
from fractions import Fraction
from math import inf, pi
from textwrap import wrap
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Parameter: TypeAlias = float | NDArray[np.float64]

ACTUATIONS = ("hold", "clamp", "expand_and_contract")
PRESETS = ("published", "exact")

#: Largest count, as the engine counts in 32 bits.
MOST = 2**31 - 1

#: Steps that a cycle of actuation needs to be resolved; the published run has 552.
STEPS_PER_CYCLE = 50

#: The parameters that decide whether the time step is stable.
STABILITY = (
    "time_step_fraction", "damping_link", "damping_ground", "damping_global", "poisson_ratio"
)  # fmt: skip

#: Amplitude of an edge whose voxel grows by 90 %.
EXPANSION = 1.9 ** (1 / 3) - 1


class ParameterError(ValueError):
    """A parameter is out of its bounds: its name, its bounds and its value."""

    def __init__(self, parameter: str, reason: str) -> None:
        super().__init__(parameter, reason)
        self.parameter = parameter
        self.reason = reason

    def __str__(self) -> str:
        return f"{self.parameter} {self.reason}"


class Bounds(NamedTuple):
    """The bounds of a value: in words, and for numbers as an interval."""

    words: str
    low: float = -inf
    high: float = inf
    #: Whether the interval includes its low end, "[" or "(", and its high end, "]" or ")".
    ends: str = "()"

    def hold(self, value: Any) -> Any:
        """Return whether a number, or every number of an array, is within the bounds."""
        above = value >= self.low if self.ends[0] == "[" else value > self.low
        return above & (value <= self.high if self.ends[1] == "]" else value < self.high)


FINITE = Bounds("finite")
POSITIVE = Bounds("positive and finite", low=0)
NOT_NEGATIVE = Bounds("finite and not negative", low=0, ends="[)")
POISSON = Bounds("above -1 and at most 0.5", low=-1, high=0.5, ends="(]")
AMPLITUDE = Bounds("finite and above -1", low=-1)
STABLE = Bounds("above 0 and at most 1, or the time step is unstable", low=0, high=1, ends="(]")
CHOICE = Bounds(f"one of {', '.join(ACTUATIONS)}")
FLAG = Bounds("True or False")


def _hold(bounds: Bounds, value: Any) -> bool:
    """Whether a number, or every number of an array, is within bounds."""
    array = np.asarray(value)
    return array.dtype.kind in "iuf" and bool(np.all(bounds.hold(array)))


@dataclass(frozen=True)
class ParameterSpec:
    """The facts about one parameter of the physics."""

    #: Its value in the paper; the value's type shows whether it is a number, a choice or a flag.
    default: Any
    #: Empty for a ratio, a choice or a flag.
    unit: str
    bounds: Bounds
    #: Description; the part before the first comma is a name for people.
    about: str
    #: The default as the published run rounded it.
    published: Any = None
    #: Low end, high end and step of the explorer's slider, if it has one.
    slider: tuple[float, float, float] | None = None
    #: Whether each design of a batch may have its own value.
    per_design: bool = True
    name: str = ""

    def checked(self, value: Any) -> Any:
        """Return a value as Physics stores it: float, read-only array, str or bool; or raise."""
        must = f"must be {self.bounds.words}, got"
        if isinstance(self.default, bool):
            if isinstance(value, (bool, np.bool_)):
                return bool(value)
            raise TypeError(f"{self.name} {must} {value!r}")
        if isinstance(self.default, str):
            if isinstance(value, str) and value in ACTUATIONS:
                return str(value)
            raise ParameterError(self.name, f"{must} {value!r}")
        array = self._numbers(value)
        good = self.bounds.hold(array)
        if not np.all(good):
            raise ParameterError(self.name, f"{must} {array[~good].flat[0]}")
        return array if array.ndim else float(array)

    def _numbers(self, value: ArrayLike) -> NDArray[np.float64]:
        """Return a read-only float64 copy of one number, or of one per design."""
        try:
            array = np.array(value)
        except ValueError:
            must = "must be a number or an even array"
            raise ParameterError(self.name, f"{must}, got {value!r}") from None
        if array.dtype.kind not in "iuf":
            raise TypeError(f"{self.name} must be a number or an array of numbers, got {value!r}")
        if array.ndim > 0 and not self.per_design:
            must = "must be one number for the whole batch"
            raise ParameterError(self.name, f"{must}, got {value!r}")
        is_vector = self.name == "gravity"
        if array.ndim > 1 and not (is_vector and array.ndim == 2 and array.shape[1] == 3):
            what = "a number, a vector or an (n, 3) array" if is_vector else "a number or a row"
            raise ParameterError(self.name, f"must be {what}, got an array of shape {array.shape}")
        array = array.astype(np.float64)
        array.setflags(write=False)
        return array


def _load(
    time_step_fraction: Any,
    damping_link: Any,
    damping_ground: Any,
    damping_global: Any,
    poisson_ratio: Any,
) -> NDArray[np.float64]:
    """Return the time step over the longest stable one, damping included.

    Below 1 every body is stable (docs/physics.md 3). It grows at least as fast as the step.
    """
    with np.errstate(all="ignore"):
        step = np.asarray(time_step_fraction) / (2 * pi)
        link = step * (damping_link + step / 2)
        floor = step * (2 * damping_ground + step) / link
        layers = np.where(floor > 2, floor + 1 + 1 / (floor - 1), 4.0)
        moving = (8 + layers) * link / 2 + step * damping_global
        shear = 1 / (2 * (1 + np.asarray(poisson_ratio)))
        turning = step * damping_link * (3 + np.sqrt(shear)) + step**2 * (3 + shear)
        spinning = 20 * np.sqrt(6) * step * damping_global
        return np.asarray(np.maximum(np.maximum(moving, turning), spinning))


def _cube(edge: float) -> float:
    """Return edge^3, correctly rounded, as the power of a C library is not on every machine."""
    try:
        return float(Fraction(edge) ** 3)
    except OverflowError:
        return inf


def _below(value: float) -> str:
    """Return a number rounded down to three digits."""
    return f"{Context(prec=3, rounding=ROUND_DOWN).create_decimal_from_float(float(value)):g}"


def _spec(*facts: Any, **more: Any) -> Any:
    """Return a field of Physics that holds a ParameterSpec, its name still missing."""
    spec = ParameterSpec(*facts, **more)
    return field(default=spec.default, metadata={"spec": spec})


@dataclass(frozen=True, eq=False)
class Physics:
    """Every parameter of the simulation, in SI units; the defaults are the paper's exact values.

    Arrays hold one value per design of the batch. Change a preset with `dataclasses.replace`. A
    single number for gravity acts along z, so negative is down; three numbers are always one
    vector, so a batch of three designs needs a (3, 3) array. A tilted gravity is a tilted floor.
    The paper does not print the density; it follows from its time step. Shear strength times the
    squared edge is added to both friction limits. Kinetic friction above static is allowed, with a
    warning. When the pump asks for less than the resting edge, an edge holds its last value (hold),
    rests (clamp) or contracts (expand_and_contract).

    Parameters
    ----------
    {parameters}

    Raises
    ------
    TypeError, ParameterError
        If a value is out of its bounds, or makes the time step unstable; the message names the
        parameter.

    Notes
    -----
    Source: Kriegman et al., "Scalable sim-to-real transfer of soft robot designs", RoboSoft 2020;
    shear strength: Majidi et al., "Influence of surface traction on soft robot undulation", 2013.
    """

    edge: float = _spec(0.01, "m", POSITIVE, "resting edge of a voxel", per_design=False)
    youngs_modulus: Parameter = _spec(1e7, "Pa", POSITIVE, "Young's modulus")
    poisson_ratio: Parameter = _spec(0.35, "", POISSON, "Poisson's ratio")
    density: Parameter = _spec(1e6, "kg/m^3", POSITIVE, "density")
    friction_static: Parameter = _spec(
        1.0, "", NOT_NEGATIVE, "static friction", slider=(0, 2, 0.05)
    )
    friction_kinetic: Parameter = _spec(
        0.5, "", NOT_NEGATIVE, "kinetic friction", slider=(0, 2, 0.05)
    )
    shear_strength: Parameter = _spec(
        0.0, "Pa", NOT_NEGATIVE, "shear strength, interfacial", slider=(0, 50_000, 500)
    )
    gravity: Parameter = _spec(
        -9.81, "m/s^2", FINITE, "gravity, along z or a vector", slider=(-25, 0, 0.1)
    )
    damping_link: Parameter = _spec(1.0, "", NOT_NEGATIVE, "damping ratio of links")
    damping_ground: Parameter = _spec(0.8, "", NOT_NEGATIVE, "damping ratio of the ground")
    damping_global: Parameter = _spec(0.01, "", NOT_NEGATIVE, "damping ratio of the global drag")
    frequency_hz: Parameter = _spec(
        4.0, "Hz", POSITIVE, "frequency of actuation", 3.999999807746178, slider=(0.5, 12, 0.1)
    )
    strain: Parameter = _spec(
        EXPANSION, "", AMPLITUDE, "strain of active edges", 0.23856233596801757, (0, 0.5, 0.005)
    )
    actuation: str = _spec(
        "hold", "", CHOICE, "what active edges do in the negative half cycle", per_design=False
    )
    settle_time: float = _spec(
        0.25, "s", NOT_NEGATIVE, "time at which actuation and measurement start", per_design=False
    )
    duration: Parameter = _spec(4.0, "s", POSITIVE, "duration of the run, settling included")
    time_step_fraction: Parameter = _spec(
        0.9, "", STABLE, "time step as a share of the largest stable one", 0.9000000153523451
    )
    single_precision_rest: bool = _spec(
        False,
        "",
        FLAG,
        "round the resting edge of active voxels to single precision",
        True,
        per_design=False,
    )

    @classmethod
    def exact(cls) -> Physics:
        """Return the paper's parameters as printed."""
        return cls()

    @classmethod
    def published(cls) -> Physics:
        """Return the rounded values of the published run, which give its table digit for digit."""
        return cls(**{spec.name: spec.published for spec in SPECS})

    @classmethod
    def preset(cls, name: str) -> Physics:
        """Return a preset by its name, "published" or "exact".

        Raises
        ------
        ValueError
            If the name is another.
        """
        if name not in PRESETS:
            raise ValueError(f"physics {name!r} is unknown; the presets are {', '.join(PRESETS)}")
        return cls.exact() if name == "exact" else cls.published()

    @classmethod
    def of(cls, physics: str | Mapping[str, Any] | Physics) -> Physics:
        """Return the physics for a preset's name, a dict of fields, or a Physics.

        A dict holds changes to `exact`, or to the preset that its key "preset" names; its key
        "shear_ratio" gives the shear strength by `shear_ratio`.

        Raises
        ------
        TypeError, ValueError
            If it is anything else, or has an unknown name or field.
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
        ratio = changes.pop("shear_ratio", None)
        if ratio is not None and "shear_strength" in changes:
            raise ValueError("physics has shear_strength and shear_ratio; give only one of them")
        known = [spec.name for spec in SPECS]
        for name in changes:
            if name not in known:
                raise ValueError(
                    f"physics has no parameter {name!r}; the parameters are {', '.join(known)}"
                )
        made = replace(base, **changes)
        return made if ratio is None else made.sheared(ratio)

    def __post_init__(self) -> None:
        for spec in SPECS:
            object.__setattr__(self, spec.name, spec.checked(getattr(self, spec.name)))
        _ = self.n_designs
        if np.any(np.asarray(self.duration) <= self.settle_time):
            must = f"must be longer than settle_time ({self.settle_time} s)"
            raise ParameterError("duration", f"{must}, got {self.duration}")
        self._check_steps()
        self._check_stability()
        if self.actuation == "expand_and_contract" and np.any(np.asarray(self.strain) >= 1):
            must = "must be below 1 where voxels expand and contract"
            raise ParameterError("strain", f"{must}, got {self.strain}")
        if np.any(np.asarray(self.friction_kinetic) > np.asarray(self.friction_static)):
            warnings.warn(
                f"friction_kinetic ({self.friction_kinetic}) is above friction_static "
                f"({self.friction_static}); this is allowed but rarely meant",
                UserWarning,
                stacklevel=3,
            )
        steps = np.min(1 / (np.asarray(self.frequency_hz) * self.time_step), initial=np.inf)
        if steps < STEPS_PER_CYCLE:
            share = steps / STEPS_PER_CYCLE * np.min(self.time_step_fraction)
            warnings.warn(
                f"frequency_hz ({np.max(self.frequency_hz):g}) leaves {steps:.3g} steps a cycle, "
                f"and about {STEPS_PER_CYCLE} are needed to follow it; time_step_fraction "
                f"{_below(share)} would do",
                UserWarning,
                stacklevel=3,
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
            raise ParameterError(
                "duration",
                f"of {duration:g} s in time steps of {step:.3g} s can't be counted (at most {MOST} "
                "steps); change it, or time_step_fraction, edge, youngs_modulus or density",
            )
        most = 1 / (2 * step)
        if np.any(np.asarray(self.frequency_hz) > most):
            raise ParameterError(
                "frequency_hz",
                f"must be at most half the steps per second, here {np.min(most):.4g}, "
                f"got {np.max(self.frequency_hz):g}",
            )

    def _check_stability(self) -> None:
        values = {name: np.asarray(getattr(self, name)) for name in STABILITY}
        load = _load(**values)
        if np.all(load < 1):
            return
        worst = int(np.argmax(np.where(np.isnan(load), np.inf, load)))
        own = {k: float(np.broadcast_to(v, load.shape).flat[worst]) for k, v in values.items()}
        # Blame the parameter whose usual value would help most.
        dampings = STABILITY[1:]
        cured = [_load(**{**own, name: getattr(type(self), name)}) for name in dampings]
        blamed = dampings[int(np.argmin(cured))]
        fraction = own["time_step_fraction"]
        raise ParameterError(
            blamed,
            f"{own[blamed]:g} makes the time step unstable at time_step_fraction {fraction:g}; "
            f"one of {_below(fraction / float(load.flat[worst]))} would do",
        )

    def __setstate__(self, state: dict[str, Any]) -> None:
        for name, value in state.items():
            if isinstance(value, np.ndarray):
                value.setflags(write=False)  # copies and pickles don't keep that
            object.__setattr__(self, name, value)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Physics):
            return NotImplemented
        return self.to_dict() == other.to_dict()

    def __hash__(self) -> int:
        # The shape of an array, not its bytes, because -0.0 equals 0.0.
        return hash(tuple(v.shape if isinstance(v, np.ndarray) else v for v in vars(self).values()))

    @property
    def per_design(self) -> dict[str, NDArray[np.float64]]:
        """The parameters that are arrays, a value per design; gravity as vectors."""
        arrays = {name: v for name, v in vars(self).items() if isinstance(v, np.ndarray)}
        if self.gravity_vector.ndim == 1:
            arrays.pop("gravity", None)
        else:
            arrays["gravity"] = self.gravity_vector
        return arrays

    @property
    def n_designs(self) -> int | None:
        """Length of the arrays among the parameters; None if there are none."""
        lengths = {name: len(values) for name, values in self.per_design.items()}
        if len(set(lengths.values())) > 1:
            raise ValueError(f"parameters must be arrays of one length, got {lengths}")
        return next(iter(lengths.values()), None)

    @property
    def gravity_vector(self) -> NDArray[np.float64]:
        """Gravity as a vector, shape (3,) or (n, 3), m/s^2."""
        gravity = np.asarray(self.gravity)
        is_vector = gravity.ndim == 2 or gravity.shape == (3,)
        return gravity if is_vector else gravity[..., np.newaxis] * np.array([0.0, 0.0, 1.0])

    @property
    def pumped_rest(self) -> float:
        """The edge about which active voxels swing, m.

        Rounded to single precision it is 2e-10 m short, which changes the fifth decimal of a few
        designs. The edges of the published run show the rounding (data/authors/trajectories),
        unless voxels also contract.
        """
        if self.single_precision_rest and self.actuation != "expand_and_contract":
            return float(np.float32(self.edge))
        return self.edge

    @property
    def time_step(self) -> Parameter:
        """Time step, s, a fraction of the fastest axial oscillation that the parameters allow."""
        stiffness = np.asarray(self.youngs_modulus) * self.edge
        mass = np.asarray(self.density) * _cube(self.edge)
        step = np.asarray(self.time_step_fraction) / (2 * pi * np.sqrt(stiffness / mass))
        return float(step) if step.ndim == 0 else step

    @property
    def weight(self) -> Parameter:
        """Weight of a voxel, N."""
        pull = np.linalg.norm(self.gravity_vector, axis=-1)
        weight = np.asarray(self.density) * _cube(self.edge) * pull
        return float(weight) if np.ndim(weight) == 0 else np.asarray(weight)

    @property
    def shear_ratio(self) -> Parameter:
        """T*, the shear strength of a voxel's face over its weight; infinite if weightless."""
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.asarray(self.shear_strength) * self.edge**2 / np.asarray(self.weight)
        return float(ratio) if ratio.ndim == 0 else ratio

    def sheared(self, ratio: Parameter) -> Physics:
        """Return the physics with the shear strength that gives this `shear_ratio`.

        Raises
        ------
        ParameterError
            If the ratio is not finite or is below 0.
        """
        if not _hold(NOT_NEGATIVE, ratio):
            raise ParameterError("shear_ratio", f"must be {NOT_NEGATIVE.words}, got {ratio!r}")
        return replace(self, shear_strength=ratio * np.asarray(self.weight) / self.edge**2)

    @property
    def cycles(self) -> Parameter:
        """Actuation cycles from settle_time to the end."""
        return (self.duration - self.settle_time) * self.frequency_hz

    def lasting(self, cycles: Parameter) -> Physics:
        """Return the physics with a duration of this many actuation cycles after settling.

        Raises
        ------
        ValueError
            If cycles is neither a positive number nor an array of such.
        """
        if not _hold(POSITIVE, cycles):
            raise ValueError(f"cycles must be a positive number, got {cycles!r}")
        return replace(self, duration=self.settle_time + cycles / np.asarray(self.frequency_hz))

    def to_dict(self) -> dict[str, Any]:
        """Return all parameters as plain numbers, strings and lists, ready for JSON."""
        return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in vars(self).items()}


#: The parameters, in order. From them come the checks, the command line's options, the explorer's
#: sliders, the check of the engine's fields and the table in docs/physics.md.
SPECS: tuple[ParameterSpec, ...] = tuple(
    replace(spec, name=f.name, published=spec.default if spec.published is None else spec.published)
    for f in fields(Physics)
    for spec in (f.metadata["spec"],)
)


def _documented(spec: ParameterSpec) -> str:
    """Return the lines for a parameter in the docstring of Physics."""
    kind = "float or array, one per design" if spec.per_design else type(spec.default).__name__
    text = f"{spec.about}; {spec.bounds.words}."
    unit = f"{spec.unit}, " if spec.unit else ""
    indent = "        "
    lines = wrap(unit + text, 100, initial_indent=indent, subsequent_indent=indent)
    return "\n".join([f"    {spec.name} : {kind}, default {spec.default!r}", *lines])


if Physics.__doc__:
    Physics.__doc__ = Physics.__doc__.format(parameters="\n".join(map(_documented, SPECS)).lstrip())
