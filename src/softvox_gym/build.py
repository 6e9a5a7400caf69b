"""What is built of a design with the paper's kit, and what it takes: no drawing.

Source: S. Kriegman et al., "Scalable sim-to-real transfer of soft robot designs", RoboSoft 2020, the
protocol of building and the table of parts.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import product
from string import ascii_uppercase

import numpy as np
from numpy.typing import NDArray

from softvox_gym.design import ABSENT, ACTIVE, Design, actuators
from softvox_gym.lattice import FACES, Lattice

Vector = tuple[int, int, int]

#: In the order in which an inlet goes there where nothing else decides: the sides, that with the
#: mark of the robot's x axis last.
SIDES: tuple[Vector, ...] = ((-1, 0, 0), (0, -1, 0), (0, 1, 0), (1, 0, 0))
TOP, UNDERSIDE = FACES[4:]

#: How people say where a face is.
TOWARDS = dict(zip(FACES, ("+x", "-x", "+y", "-y", "the top", "the underside"), strict=True))

#: What voxels share that touch without a common face, by how many axes part them.
TOUCHES = {2: "an edge", 3: "a corner"}

#: So many voxels are named one by one.
MOST_NAMED = 6


@dataclass(frozen=True)
class Inlet:
    """Where the tube of an actuator group goes in.

    Parameters
    ----------
    site : int
        The voxel that gets the hole.
    face : (int, int, int)
        Outward unit normal of the face that it is in.
    why : str
        Why there, in words.
    """

    site: int
    face: Vector
    why: str


@dataclass(frozen=True)
class Group:
    """An actuator group: active voxels of one slice that share their air.

    Parameters
    ----------
    name : str
        "A", "B", ... in order of the groups.
    sites : tuple of int
    z : int
        The slice.
    phase : float
        By how many cycles its pump is ahead.
    inlet : Inlet or None
        None where the group does not reach the surface.
    """

    name: str
    sites: tuple[int, ...]
    z: int
    phase: float
    inlet: Inlet | None


@dataclass(frozen=True)
class Hole:
    """A hole to punch between two active neighbours of a slice."""

    sites: tuple[int, int]


@dataclass(frozen=True)
class Plan:
    """What is built of a design.

    Parameters
    ----------
    design : Design
    groups : tuple of Group
        In order of their first site.
    bonds : tuple of (int, int)
        The neighbours of a slice that are bonded to each other.
    holes : tuple of Hole
        In those of the bonds that join voxels of a group.
    problems : tuple of str
        Why the kit can't build it; empty where it can.
    warnings : tuple of str
        What needs care.
    steps : tuple of str
        The order of assembly; empty where it can't be built.
    """

    design: Design
    groups: tuple[Group, ...]
    bonds: tuple[tuple[int, int], ...]
    holes: tuple[Hole, ...]
    problems: tuple[str, ...]
    warnings: tuple[str, ...]
    steps: tuple[str, ...]


def plan(design: Design) -> Plan:
    """Return what is built of a design.

    An inlet goes where a tube leaves best: through a side rather than the top, and through the
    underside, on which the robot walks, only where nothing else is free; where no voxel stands
    before the face, and as few as can be beside the tube; then on the side on which most groups of
    the robot can have theirs, so that the tubes pull one way.

    Examples
    --------
    >>> full = plan(Design(6560))
    >>> [(group.name, group.sites, group.inlet.face) for group in full.groups]
    [('A', (0, 1, 2, 3), (-1, 0, 0)), ('B', (4, 5, 6, 7), (-1, 0, 0))]
    >>> len(full.holes), full.problems
    (8, ())
    >>> plan(Design("20000002")).problems[0]
    'it is 2 pieces, (0, 0, 0) and (1, 1, 1)'
    """
    body = _Body(design)
    groups, bonds = body.groups(), tuple(body.bonds())
    of_group = {site: group.name for group in groups for site in group.sites}
    holes = [Hole(bond) for bond in bonds if len({of_group.get(s, s) for s in bond}) == 1]
    problems = tuple(body.problems(groups, bonds))
    return Plan(design, groups, bonds, tuple(holes), problems, (), ())


class _Body:
    """A design with what is asked of it again and again."""

    def __init__(self, design: Design) -> None:
        self.design, self.lattice = design, design.lattice
        self.is_present = np.pad(design.array, 1) != ABSENT
        beyond = Design((~self.is_present).astype(np.uint8))
        outside = np.zeros(beyond.lattice.sites, dtype=np.bool_)
        outside[list(beyond.components[0])] = True  # of the corner, which is never a voxel
        #: Which sites are absent and open to the world, padded by one.
        self.is_outside = outside.reshape(beyond.lattice, order="F")

    def place(self, site: int) -> Vector:
        """Return a site's x, y, z."""
        nx, ny, _ = self.lattice
        return site % nx, site // nx % ny, site // (nx * ny)

    def named(self, sites: Iterable[int]) -> str:
        """Return sites as people read them."""
        places = [str(self.place(site)) for site in sites]
        more = len(places) - MOST_NAMED
        return ", ".join(places[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")

    def holds(self, mask: NDArray[np.bool_], place: Sequence[int]) -> bool:
        """Return what a mask, padded by one, says of a place, which may be outside the lattice."""
        x, y, z = (min(max(c, -1), side) + 1 for c, side in zip(place, self.lattice, strict=True))
        return bool(mask[x, y, z])

    def bonds(self) -> Iterator[tuple[int, int]]:
        """Yield the neighbours of each slice."""
        per_slice = self.lattice.nx * self.lattice.ny
        for site, digit in enumerate(self.design.digits):
            for other in sorted(self.lattice.neighbours(site)) if digit != "0" else ():
                is_level = other // per_slice == site // per_slice
                if is_level and other > site and self.design.digits[other] != "0":
                    yield site, other

    def groups(self) -> tuple[Group, ...]:
        """Return the actuator groups, each with its inlet."""
        found = actuators(self.design)
        best = [_best(self._choices(sites)) for sites in found]
        ways = Counter(face for one in best for face in {face for _, face in one})
        phase = self.design.phase.ravel(order="F")
        groups = []
        for i, (sites, choices) in enumerate(zip(found, best, strict=True)):
            inlet = None
            if choices:
                (site, face) = min(choices, key=lambda one: (-ways[one[1]], _ORDER[one[1]], one[0]))
                inlet = Inlet(site, face, "")
            z = self.place(sites[0])[2]
            groups.append(Group(_letters(i), sites, z, float(phase[sites[0]]), inlet))
        return tuple(groups)

    def _choices(self, sites: Iterable[int]) -> Iterator[tuple[tuple[int, ...], int, Vector]]:
        """Yield the faces of a group that open to the world, each after how bad it is."""
        for site, face in product(sites, FACES):
            place = self.place(site)
            front = _moved(place, face)
            if not self.holds(self.is_outside, front):
                continue
            on_floor = face == UNDERSIDE and not self.is_present[:, :, 1 : place[2] + 1].any()
            kind = 0 if face in SIDES else 1 if face == TOP else 3 if on_floor else 2
            ahead = any(
                self.holds(self.is_present, _moved(front, face, k))
                for k in range(max(self.lattice))
            )
            across = [way for way in FACES if not np.dot(way, face)]
            beside = sum(self.holds(self.is_present, _moved(front, way)) for way in across)
            yield (kind, int(ahead), beside), site, face

    def problems(self, groups: Sequence[Group], bonds: Sequence[tuple[int, int]]) -> Iterator[str]:
        """Yield why it can't be built."""
        pieces = self.design.components
        if not pieces:
            yield "it has no voxels"
        if len(pieces) > 1:
            yield f"it is {len(pieces)} pieces, {' and '.join(map(self.named, pieces))}"
        for group in groups:
            if group.inlet is None:
                yield f"group {group.name}, {self.named(group.sites)}, does not reach the surface"


_ORDER = {face: i for i, face in enumerate([*SIDES, TOP, UNDERSIDE])}


def _best(
    choices: Iterable[tuple[tuple[int, ...], int, Vector]],
) -> list[tuple[int, Vector]]:
    """Return the sites and faces that are as good as any."""
    ranked = list(choices)
    least = min((rank for rank, _, _ in ranked), default=())
    return [(site, face) for rank, site, face in ranked if rank == least]


def _moved(place: Sequence[int], way: Sequence[int], times: int = 1) -> Vector:
    x, y, z = (c + times * d for c, d in zip(place, way, strict=True))
    return x, y, z


def _letters(number: int) -> str:
    """Return the name of a group: A ... Z, AA, AB, ..."""
    more, last = divmod(number, len(ascii_uppercase))
    return (_letters(more - 1) if more else "") + ascii_uppercase[last]
