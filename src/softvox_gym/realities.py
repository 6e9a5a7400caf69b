"""Pseudo-realities: other physics of the same engine that stand for the real world.

A design is found in a simulator and must keep its fitness in a reality that is not known in
advance. If the reality is also a simulation, everything about it can be computed: how far every
design travels there, which is the best, and what was lost in the transfer.

Source: A. Ligot, M. Birattari, "Simulation-only experiments to mimic the effects of the reality gap
in the automatic design of robot swarms", Swarm Intelligence 14, 2020.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from math import log, pi
from typing import Any, ClassVar, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import EXPANSIONS, batch_of, refined, repeated
from softvox_gym.lattice import Lattice, number_of
from softvox_gym.noise import Trials, not_negative, tilted
from softvox_gym.physics import PRESETS, Physics
from softvox_gym.portable import direction, exp, normal
from softvox_gym.simulation import Result, check_count, pumped, simulate

Array: TypeAlias = NDArray[np.float64]
PhysicsLike: TypeAlias = str | Mapping[str, Any] | Physics

#: Seeds of `Reality.sample` by the name of their set: one for tuning methods, and one that nobody
#: looks at before a method's final run.
SETS: Mapping[str, range] = {"public": range(30), "test": range(2000, 2030)}


@dataclass(frozen=True)
class Reality:
    """A world to try designs in: a physics, and properties that a `Physics` lacks.

    Parameters
    ----------
    name : str
    physics : str, dict or Physics
        As in `Physics.of`, with single numbers.
    about : str
        The difference from the simulator, in one line.
    source : str
        Who measured, assumed or published it.
    strain_error : float
        Standard deviation of every voxel's amplitude, as a share of it, from manufacturing: a
        design has the same errors each time it is tried, and others with another seed.
    phase : array_like
        Phase of every voxel's actuation, cycles; a shape that NumPy broadcasts to (nx, ny, nz).
    resolution : int
        Number of smaller voxels along each edge of a voxel. Their strain is that of the physics;
        see `Design.refined`.
    expansion : {"spherical", "uniform"}
        Expansion of the smaller voxels; see `Design.refined`.
    seed : int
        Seed of the strain errors.
    nominal : str, dict or Physics
        The simulator that it is compared with.

    Raises
    ------
    TypeError, ValueError
        If a value is none of these; the message names it.

    Examples
    --------
    >>> mine = Reality("mine", physics={"youngs_modulus": 3e6}, strain_error=0.2, seed=7)
    >>> mine.simulate([6453, 926]).fitness.shape
    (2,)
    """

    name: str
    physics: Physics = field(default_factory=Physics.published)
    about: str = ""
    source: str = ""
    strain_error: float = 0.0
    phase: Any = 0.0
    resolution: int = 1
    expansion: str = "spherical"
    seed: int = 0
    nominal: Physics = field(default_factory=Physics.published)

    #: `softvox_gym.landscape` of the reality; that module imports this one and sets this attribute.
    landscape: ClassVar[Callable[[Reality], Any]]

    #: `softvox_gym.trials.from_trials`, set likewise: measured trials as a reality.
    from_trials: ClassVar[Callable[..., Any]]

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise TypeError(f"name must be a string, got {self.name!r}")
        check_count("seed", self.seed, least=0)
        check_count("resolution", self.resolution, least=1)
        if self.expansion not in EXPANSIONS:
            raise ValueError(
                f"expansion must be one of {', '.join(EXPANSIONS)}, got {self.expansion!r}"
            )
        if self.expansion == "spherical" and self.resolution % 2 == 0:
            raise ValueError(
                "resolution must be odd if expansion is spherical, to have a middle; got "
                f"{self.resolution}"
            )
        Lattice.of([self.resolution] * 3)  # of one voxel, which must not have too many parts
        changed = {
            "physics": single_physics(self.physics),
            "nominal": single_physics(self.nominal),
            "strain_error": not_negative("strain_error", self.strain_error),
            "phase": _phases(self.phase),
            "seed": int(self.seed),
            "resolution": int(self.resolution),
        }
        for name, value in changed.items():
            object.__setattr__(self, name, value)

    @classmethod
    def of(cls, reality: str | Mapping[str, Any] | Physics | Reality) -> Reality:
        """Return a reality unchanged, or the reality that consists only of a physics.

        Raises
        ------
        TypeError, ValueError
            As `Physics.of` does, or if the physics has arrays or it is the name of a reality.
        """
        if isinstance(reality, Reality):
            return reality
        if isinstance(reality, str) and reality not in PRESETS and reality in realities():
            raise ValueError(f"{reality} is a reality, not a physics; give reality({reality!r})")
        return cls("physics", single_physics(reality))

    @classmethod
    def sample(cls, seed: int) -> Reality:
        """Draw a reality from the prior in docs/reality-gap.md.

        Raises
        ------
        TypeError, ValueError
            If the seed is not a whole number of at least 0.
        """
        check_count("seed", seed, least=0)
        return _sampled(int(seed))

    @property
    def is_plain(self) -> bool:
        """Whether a `Physics` describes it completely."""
        return not self.strain_error and self.phase == 0.0 and self.resolution == 1

    @property
    def plain_physics(self) -> Physics | None:
        """The physics if it describes the reality completely; else None."""
        return self.physics if self.is_plain else None

    def to_dict(self) -> dict[str, Any]:
        """Return everything that results depend on, ready for JSON."""
        names = ("strain_error", "phase", "resolution", "expansion", "seed")
        more = {} if self.is_plain else {name: getattr(self, name) for name in names}
        return {"physics": self.physics.to_dict(), **more}

    def trials(
        self, design: NDArray[np.uint8], k: int = 1, *, phase: ArrayLike | None = None
    ) -> Trials:
        """Return k trials of a design, digits 0, 1, 2 of shape (nx, ny, nz), and its own phases.

        Raises
        ------
        ValueError
            If the phases don't fit its lattice, or that has too many parts.
        """
        lattice = Lattice(*design.shape)
        Lattice.of([self.resolution * side for side in lattice])  # not too many parts
        trials = Trials.of(self.physics, lattice, k)
        try:
            shared = np.broadcast_to(np.asarray(self.phase), design.shape)
        except ValueError:
            raise ValueError(
                f"reality {self.name} has phases of shape {np.shape(self.phase)}, which don't fit "
                f"a {lattice} lattice"
            ) from None
        trials = trials.changed(phase=trials.phase + shared)
        if phase is not None:
            trials = trials.changed(phase=trials.phase + np.asarray(phase, dtype=np.float64))
        if self.strain_error:
            number = number_of(lattice.to_rows(design).tobytes())
            rng = np.random.default_rng([self.seed, *lattice, number])
            # An actuator may fail to inflate, but it does not apply suction.
            factor = np.maximum(1 + self.strain_error * normal(rng, design.shape), 0.0)
            trials = trials.changed(strain=trials.strain * factor)
        return trials

    def simulate(self, designs: Any, *, phase: ArrayLike | None = None, **options: Any) -> Result:
        """Simulate designs in this reality, each once; designs and options are those of `simulate`.

        Lengths are in voxel widths at any resolution. At a resolution above 1, frames and the
        designs of the result are those of the smaller voxels.

        Raises
        ------
        TypeError, ValueError
            As `simulate` does, or if the phases don't fit the designs' lattice.
        """
        given, lattice = batch_of(designs)
        stack, phase = pumped(given, phase, shape=lattice)
        if self.is_plain or not len(stack):
            own: Any = {"phase": phase} if self.is_plain else {}
            return self.run(stack, None, **own, **options).of(given, lattice)
        phases: Any = [None] * len(stack) if phase is None else phase
        trials = [self.trials(one, phase=ahead) for one, ahead in zip(stack, phases, strict=True)]
        return self.run(stack, Trials.joined(trials), **options).of(given, lattice)

    def run(self, stack: NDArray[np.uint8], trials: Trials | None, **options: Any) -> Result:
        """Simulate digits, shape (n, nx, ny, nz), each under its trial, or without trials."""
        parts = self.resolution
        physics = self.of_parts(self.physics if trials is None else trials.physics)
        own: Any = {} if trials is None else {"strain": trials.strain, "phase": trials.phase}
        if parts == 1:
            return simulate(stack, physics, **own, **options)
        own = {name: repeated(values, parts) for name, values in own.items()}
        fine = refined(stack, parts, expansion=self.expansion)
        result = simulate(fine, physics, **own, **options)
        return replace(
            result,
            displacement=result.displacement / parts,
            start=result.start / parts,
            end=result.end / parts,
            track=None if result.track is None else result.track / parts,
            step_error=None if result.step_error is None else result.step_error / parts,
        )

    def of_parts(self, physics: Physics) -> Physics:
        """Return the physics of the smaller voxels for a physics of whole voxels."""
        if self.resolution == 1:
            return physics
        return replace(physics, edge=physics.edge / self.resolution)


def single_physics(physics: PhysicsLike) -> Physics:
    """Return `Physics.of` for all designs; ValueError if a parameter is an array."""
    made = Physics.of(physics)
    if made.n_designs is not None:
        raise ValueError(
            "physics must hold single numbers here, not an array per design; "
            "softvox_gym.simulate takes arrays"
        )
    return made


def reality_of(physics: PhysicsLike, chosen: str | Reality | None) -> Reality:
    """Return the chosen reality or, without one, that of a physics.

    Raises
    ------
    TypeError, ValueError
        As `reality` and `Physics.of` do, or if both a reality and a physics are given.
    """
    if chosen is None:
        return Reality.of(physics)
    if physics != "published":
        raise ValueError("physics and reality both define the world; give only one of them")
    if isinstance(chosen, Reality):
        return chosen
    if not isinstance(chosen, str):
        raise TypeError(f"reality must be a name or a softvox_gym.Reality, got {chosen!r}")
    return reality(chosen)


def realities() -> dict[str, Reality]:
    """Return the named realities, by name, the mildest first."""
    return {one.name: one for one in _named()}


def reality(name: str) -> Reality:
    """Return a reality by its name: one of `realities`, or of a set ("public-0" to "public-29").

    Raises
    ------
    ValueError
        If the name is another; the message suggests the nearest.
    """
    known = realities()
    if name in list(known):
        return known[name]
    group, _, number = str(name).partition("-")
    if group in SETS and number in map(str, range(len(SETS[group]))):
        return replace(Reality.sample(SETS[group][int(number)]), name=name)
    close = difflib.get_close_matches(str(name), known, n=1)
    hint = f"; did you mean {close[0]}?" if close else ""
    sets = ", ".join(f"{group}-0 to {group}-{len(seeds) - 1}" for group, seeds in SETS.items())
    raise ValueError(f"no reality {name!r}{hint}; there are {', '.join(known)}, and {sets}")


@lru_cache(maxsize=1)
def _named() -> tuple[Reality, ...]:
    published = Physics.published()
    slow = published.lasting(23)
    area = replace(published, friction_static=0.0, friction_kinetic=0.0).sheared(0.5)
    kriegman = "Kriegman et al., RoboSoft 2020"
    majidi = "Majidi et al., Journal of Applied Physics 113, 2013: area friction"
    return (
        Reality(
            "clamp",
            replace(published, actuation="clamp"),
            about="active voxels rest in the negative half cycle: a control, almost the simulator",
            source="softvox-gym",
        ),
        Reality(
            "half_step",
            replace(published, time_step_fraction=float(published.time_step_fraction) / 2),
            about="half the time step: the integrator's own share of the gap",
            source="softvox-gym",
        ),
        Reality(
            "fabrication",
            about="every voxel inflates by another amount, +- 20 %, fixed when it is built",
            source="Jakobi, Husbands, Harvey, ECAL 1995: noise on actuators; the amount is assumed",
            strain_error=0.2,
        ),
        Reality(
            "lag",
            about="voxels at x = 1 are actuated a quarter cycle apart from those at x = 0",
            source="softvox-gym",
            phase=np.array([0.0, 0.25]).reshape(2, 1, 1),
        ),
        Reality(
            "slippery",
            replace(published, friction_static=0.2, friction_kinetic=0.1),
            about="a fifth of the friction",
            source=f"{kriegman}, who tried pairs of coefficients",
        ),
        Reality(
            "sticky",
            replace(published, shear_strength=50e3),
            about="a shear strength of 50 kPa (T* = 0.51) besides the friction",
            source=majidi,
        ),
        Reality(
            "soft",
            replace(published, youngs_modulus=0.3 * float(published.youngs_modulus)),
            about="three tenths of the stiffness",
            source="softvox-gym",
        ),
        Reality(
            "reversal",
            replace(area, strain=0.5, frequency_hz=2.0).lasting(15),
            about="area friction alone (T* = 1/2), strain 0.5 at 2 Hz: most robots turn round",
            source=majidi,
        ),
        Reality(
            "area_friction",
            area.lasting(90),
            about="area friction alone (T* = 1/2); 90 cycles held against 23 simulated ones",
            source=f"{majidi}; {kriegman}: the numbers of cycles",
            nominal=slow,
        ),
        Reality(
            "high_resolution",
            replace(published, strain=3.84),
            about="every voxel of 3 x 3 x 3 smaller ones, of which the one in the middle expands",
            source=f"{kriegman}, their model of higher resolution",
            resolution=3,
        ),
    )


def _sampled(seed: int) -> Reality:
    """Draw a reality; every quantity is always drawn, in this order."""
    rng = np.random.default_rng([1911_10290, seed])
    published = Physics.published()

    static = log_between(rng.random(), 0.05, 1.5)
    kinetic = static * between(rng.random(), 0.4, 1.0)
    is_sheared, ratio = rng.random() < 0.5, log_between(rng.random(), 0.05, 1.0)
    stiffness, density = log_between(rng.random(), 0.3, 3.0), log_between(rng.random(), 0.5, 2.0)
    strain, frequency = between(rng.random(), 0.15, 0.5), between(rng.random(), 2.0, 5.0)
    tilt, downhill = normal(rng, 1) * (2.0 * pi / 180), direction(rng, 1)
    lag, strain_error = between(rng.random(), 0.0, 0.15), between(rng.random(), 0.0, 0.2)
    phase = lag * normal(rng, (2, 2, 2))
    physics = replace(
        published,
        friction_static=static,
        friction_kinetic=kinetic,
        youngs_modulus=stiffness * float(published.youngs_modulus),
        density=density * float(published.density),
        strain=strain,
        frequency_hz=frequency,
        gravity=tilted(published.gravity_vector[np.newaxis], tilt, downhill)[0],
    ).lasting(15)
    if is_sheared:
        physics = physics.sheared(ratio)
    return Reality(
        f"sample-{seed}",
        physics,
        about="drawn from the prior",
        source="softvox-gym",
        strain_error=strain_error,
        phase=phase,
        seed=seed,
    )


def between(share: float, low: float, high: float) -> float:
    """Interpolate linearly between low and high."""
    return low + (high - low) * share


def log_between(share: float, low: float, high: float) -> float:
    """Interpolate between low and high in logarithms, with the same bits on every machine."""
    return float(exp(np.array(between(share, round(log(low), 6), round(log(high), 6)))))


def _phases(values: ArrayLike) -> Any:
    """Return phases as a number or nested tuples, which are comparable and hashable."""
    try:
        array = np.asarray(values, dtype=np.float64)
    except (TypeError, ValueError):
        raise TypeError(f"phase must be a number or an array of numbers, got {values!r}") from None
    if array.ndim > 3 or not np.isfinite(array).all():
        raise ValueError(
            f"phase must be finite numbers of at most three dimensions, got shape {array.shape}"
        )

    def frozen(value: Any) -> Any:
        return tuple(map(frozen, value)) if isinstance(value, list) else value

    return frozen(array.tolist())
