"""Plans for building a design with the paper's kit."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from string import ascii_uppercase

import numpy as np

from softvox_gym.design import ABSENT, ACTIVE, Design, DesignLike, actuators, closed_hollows
from softvox_gym.landscapes.section import counted, some
from softvox_gym.lattice import FACES

Vector = tuple[int, int, int]

#: Order of the sides for an inlet if nothing else decides: +x, which has the mark of the robot's x
#: axis, is the last.
_ORDER: tuple[Vector, ...] = ((-1, 0, 0), (0, -1, 0), (0, 1, 0), (1, 0, 0), *FACES[4:])
_TOP, _UNDERSIDE = FACES[4:]

#: Names of the faces.
TOWARDS = dict(zip(FACES, ("+x", "-x", "+y", "-y", "+z", "-z"), strict=True))

#: Offsets to the sites that share only an edge or a corner with one.
_AROUND = [way for way in product((-1, 0, 1), repeat=3) if sum(map(abs, way)) > 1]

#: Up to this many voxels, or faults of a kind, are listed one by one.
MOST_NAMED = 6
_some = partial(some, most=MOST_NAMED)

#: Steps for every slice with active voxels, before the slices are stacked.
LEAK_CHECK = (
    "Join a group's tube to the 60 mL syringe and hold the slice under water in the beaker.",
    "Inflate it. All voxels of the group bulge; where one does not, its hole is missing or closed.",
    "No passive voxel and no other group bulges; where one does, a wall between them is open.",
    "No bubbles come from the seams between voxels, from the bottom layer or from the inlet.",
    "Where bubbles rise: dry it, close the leak with Sil-Poxy, let that cure, and test again.",
)

#: Last steps for every robot; `softvox trials` stores the results.
MEASUREMENTS = (
    "Before it starts, mark the centre of the robot's top and its +x axis.",
    "Camera above, still, looking straight down; all of the way in the picture. A ruler at the "
    "height of the robot's top gives the scale: cm per pixel.",
    "A flat floor, powdered with cornstarch; the tubes slack, so that they do not pull.",
    "90 actuations at 6 kPa, filmed from the first; note the frequency. Three repetitions, the "
    "floor powdered anew, the robot set down alike.",
    "Of each: x and y of the mark in cm from the start, along the robot's axes, once a cycle or "
    "more often. The paper laid 90 real actuations beside 23 simulated cycles.",
    "Volume under water, relative to rest, at four moments of a cycle.",
)

#: Amounts in the table (52 ft, 65.6 ft and 200) for each of the hundred groups of its robots.
PER_GROUP = {"tube_1_32_in_cm": 15.8496, "tube_1_16_in_cm": 19.99488, "connectors": 2}


@dataclass(frozen=True)
class Inlet:
    """The place where the tube of an actuator group enters.

    The voxel with the hole, the outward unit normal of the hole's face, and the reason for it.
    """

    site: int
    face: Vector
    why: str


@dataclass(frozen=True)
class Group:
    """An actuator group: active voxels of one slice, z, that share their air.

    Names are "A", "B", ... in order. The phase is how far its pump is ahead, in cycles. The inlet
    is None if the group does not reach the surface.
    """

    name: str
    sites: tuple[int, ...]
    z: int
    phase: float
    inlet: Inlet | None


@dataclass(frozen=True)
class Plan:
    """The plan for building a design.

    Parameters
    ----------
    design : Design
    groups : tuple of Group
        In order of their first site.
    bonds, holes : tuple of (int, int)
        Neighbouring voxels that are bonded within a slice, and those of one group, with a hole
        between them.
    problems : tuple of str
        Why the kit can't build the design; empty if it can.
    warnings : tuple of str
        Points that need care.
    steps : tuple of str
        The order of assembly; empty if the design can't be built.
    """

    design: Design
    groups: tuple[Group, ...]
    bonds: tuple[tuple[int, int], ...]
    holes: tuple[tuple[int, int], ...]
    problems: tuple[str, ...]
    warnings: tuple[str, ...]
    steps: tuple[str, ...]


def plan(design: DesignLike) -> Plan:
    """Return the plan for a design; `softvox_gym.design.buildable` checks many at once.

    The design is anything that `Design` accepts; otherwise TypeError or ValueError.

    An inlet goes to a free side, with nothing built in front of it. If there is none, it goes to
    the top, the underside of an overhang, or a gap between voxels; and to the underside, on which
    the robot walks, only if nothing else is free. Among these it goes where the fewest voxels are
    beside the tube, and then to the side where most groups have such a place, so that the tubes
    pull one way.

    Examples
    --------
    >>> full = plan(6560)
    >>> [(group.name, group.sites, group.inlet.face) for group in full.groups]
    [('A', (0, 1, 2, 3), (-1, 0, 0)), ('B', (4, 5, 6, 7), (-1, 0, 0))]
    >>> len(full.holes), full.problems
    (8, ())
    >>> print(*plan(Design("202", shape=(1, 1, 3))).problems)
    it is 2 pieces, (0,0,0) | (0,0,2), that do not touch
    """
    body = _Body(Design(design))
    problems = tuple(body.problems())
    steps = () if problems else tuple(body.steps())
    warnings = tuple(body.warnings())
    return Plan(body.design, body.groups, body.bonds, body.holes, problems, warnings, steps)


def places(design: Design, sites: Iterable[int]) -> str:
    """Return sites as text: (0,1,0), (1,1,0)."""
    return _some("({},{},{})".format(*design.lattice.place(site)) for site in sites)


def digits_of(design: Design) -> str:
    """Return a design's digits, shortened if there are many."""
    return design.digits if len(design.digits) <= 40 else f"{design.digits[:37]}..."


#: Possible places for an inlet, best first, with the care that each needs.
_WHERE = (
    ("a free side", ""),
    ("the top, as no side is free", "leaves through the top: hold it slack above the robot"),
    (
        "the underside of an overhang, as no side and no top is free",
        "leaves under an overhang: lead it out sideways",
    ),
    ("a gap between voxels, as nothing better is free", "leaves into a gap: lead it out upwards"),
    (
        "the underside, as nothing else is free",
        "leaves through the underside, on which the robot walks, so that it may travel otherwise "
        "than simulated: better free a side of the group",
    ),
)

#: Penalty of leading a tube to a face: its index in `_WHERE`, and the voxels beside the tube.
_Rank = tuple[int, int]


class _Body:
    """A design's voxels by place, and questions about them."""

    def __init__(self, design: Design) -> None:
        self.design, self.place = design, design.lattice.place
        self.digits = [int(digit) for digit in design.digits]
        self.sites = {self.place(s): s for s, digit in enumerate(self.digits) if digit != ABSENT}
        self.levels = sorted({z for _, _, z in self.sites})
        self.bonds = tuple(
            (site, self.sites[other])
            for place, site in self.sites.items()
            for way in ((1, 0, 0), (0, 1, 0))
            if (other := _moved(place, way)) in self.sites
        )
        active = [pair for pair in self.bonds if min(map(self.digits.__getitem__, pair)) >= ACTIVE]
        self.holes = tuple((a, b) for a, b in active if self.digits[a] == self.digits[b])
        self.torn = [(a, b) for a, b in active if self.digits[a] != self.digits[b]]
        self.care: list[str] = []
        self.groups = tuple(self._groups())

    def named(self, sites: Iterable[int]) -> str:
        return places(self.design, sites)

    def pairs(self, pairs: Iterable[tuple[int, int]]) -> str:
        return _some(f"{self.named([a])}-{self.named([b])}" for a, b in pairs)

    def _groups(self) -> Iterator[Group]:
        """Yield the actuator groups, each with its inlet, and note points that need care."""
        hollows = closed_hollows((self.design.array != ABSENT)[..., np.newaxis])
        shut = {*self.sites, *((x, y, z) for x, y, z, _ in np.argwhere(hollows).tolist())}
        found, phase = actuators(self.design), self.design.phase.ravel(order="F")
        ranks = [self._ranks(sites, shut) for sites in found]
        best = [[at for at, rank in one.items() if rank == min(one.values())] for one in ranks]
        votes = Counter(face for one in best for face in {face for _, face in one})
        for i, sites in enumerate(found):
            name, inlet = _letters(i), None
            if best[i]:
                site, face = min(best[i], key=lambda at: (-votes[at[1]], _ORDER.index(at[1]), at))
                where, beside = ranks[i][site, face]
                why, care = _WHERE[where]
                why += f", {counted(beside, 'voxel') if beside else 'nothing'} beside the tube"
                if votes[face] > 1:
                    why += f"; {votes[face]} of {len(found)} tubes can go there"
                inlet = Inlet(site, face, why)
                self.care += [f"the tube of group {name} {care}"] if care else []
            yield Group(name, sites, self.place(sites[0])[2], float(phase[sites[0]]), inlet)

    def _ranks(self, sites: Iterable[int], shut: set[Vector]) -> dict[tuple[int, Vector], _Rank]:
        """Return the faces of a group to which a tube can be led, with their penalties."""
        found = {}
        for site, face in product(sites, FACES):
            place = self.place(site)
            if (front := _moved(place, face)) in shut:
                continue
            beyond = (_moved(front, face, k) for k in range(1, max(self.design.shape)))
            where = {_TOP: 1, _UNDERSIDE: 2}.get(face, 0)
            if face == _UNDERSIDE and place[2] == self.levels[0]:
                where = 4
            elif any(one in self.sites for one in beyond):
                where = 3
            around = (_moved(front, way) for way in FACES if way != face)
            beside = sum(one in self.sites for one in around) - 1  # minus the voxel itself
            found[site, face] = where, beside
        return found

    def problems(self) -> Iterator[str]:
        """Yield the reasons why the kit can't build it."""
        pieces = self.design.components
        if not pieces:
            yield "it has no voxels"
        if len(pieces) > 1:
            piece_of = {site: i for i, one in enumerate(pieces) for site in one}
            near = [
                (site, other)
                for (place, site), way in product(self.sites.items(), _AROUND)
                if (other := self.sites.get(_moved(place, way), -1)) > site
                and piece_of[other] != piece_of[site]
            ]
            touch = f"share an edge or a corner only, {self.pairs(near)}, and no face to bond"
            yield (
                f"it is {len(pieces)} pieces, {_some(map(self.named, pieces), ' | ')}, that "
                f"{touch if near else 'do not touch'}"
            )
        if self.torn:
            yield (
                f"active neighbours of a slice share their air, and {self.pairs(self.torn)} differ "
                "in phase; give them one phase, or put a passive voxel between them"
            )
        buried = [group for group in self.groups if group.inlet is None]
        for group in buried[:MOST_NAMED]:
            yield (
                f"group {group.name} is buried: no face of {self.named(group.sites)} is on the "
                "surface, and its tube needs one; leave out a voxel beside it"
            )
        if len(buried) > MOST_NAMED:
            yield f"{len(buried) - MOST_NAMED} more groups are buried"

    def warnings(self) -> Iterator[str]:
        """Yield the points that need care."""
        if self.sites and not self.design.n_active:
            yield "no voxel is active: it has no tube, and will not move"
        for z in self.levels:
            if z and z - 1 not in self.levels:
                yield f"nothing is below slice z = {z}"
        below = {site: _moved(place, _UNDERSIDE) for place, site in self.sites.items()}
        over = [s for s, at in below.items() if at[2] in self.levels and at not in self.sites]
        if over:
            yield (
                f"nothing is below {self.named(over)}: support the overhang while the slices are "
                "bonded"
            )
        for z in self.levels if self.design.is_connected else ():
            flat = Design((self.design.array[:, :, z : z + 1] != ABSENT).astype(np.uint8))
            if len(parts := flat.components) > 1:
                first = z * flat.lattice.sites
                shown = _some((self.named(first + site for site in part) for part in parts), " | ")
                yield (
                    f"slice z = {z} is {len(parts)} parts, {shown}, that share no face: lay them "
                    "out as drawn until the slices are stacked"
                )
        yield from self.care

    def steps(self) -> Iterator[str]:
        """Yield the order of assembly."""
        active, passive = self.design.n_active, self.design.n_voxels - self.design.n_active
        colours = {"pink (active)": active, "blue or yellow (passive)": passive}
        shown = ", ".join(f"{number} {colour}" for colour, number in colours.items() if number)
        degree = "\N{DEGREE SIGN}"
        yield (
            f"Mould {counted(self.design.n_voxels, 'voxel')}: {shown}. Pour, and spread along the "
            f"walls; turn the mould over onto the machine at 45{degree}, which turns it by "
            f"90{degree} every 45 s. Cure for 25 min, then 20 min at 60\N{NO-BREAK SPACE}{degree}C,"
            " or for 75 min at room temperature. Then a second layer in the same way."
        )
        yield "Cut the voxels out and trim them; the lower side of each is still open."
        for z in self.levels:
            bonds, holes = (
                [pair for pair in pairs if self.place(pair[0])[2] == z]
                for pairs in (self.bonds, self.holes)
            )
            if bonds:
                punch = f"punch {counted(len(holes), 'hole')}: {self.pairs(holes)}"
                bonded = f"bond {counted(len(bonds), 'pair')} of neighbours with Sil-Poxy"
                yield f"Slice z = {z}: {bonded}; {punch if holes else 'no hole'}."
        yield (
            "Set every slice, open side down, on a 1 mm layer of uncured silicone between the two "
            "rulers. Cure, cut out, and run silicone along the outer seams, never over a hole."
        )
        thin, thick, _ = PER_GROUP.values()
        ways = [
            f"{group.name} in {self.named([group.inlet.site])} towards {TOWARDS[group.inlet.face]}"
            for group in self.groups
            if group.inlet
        ]
        if ways:
            yield (
                f"Inlets: {_some(ways, '; ')}. Make a hole, glue in {thin:.0f} cm of 1/32 in tube "
                f"with Sil-Poxy; a straight connector joins it to {thick:.0f} cm of 1/16 in tube."
            )
            when = ", before the slices are stacked" if len(self.levels) > 1 else ""
            yield f"Test every group for leaks (check list){when}."
        if len(self.levels) > 1:
            order = ", ".join(map(str, self.levels))
            yield f"Stack the slices, z = {order}, and bond them with a thin layer of silicone."
        phases: dict[float, list[str]] = {}
        for group in self.groups:
            phases.setdefault(group.phase, []).append(group.name)
        if len(phases) > 1:
            ahead = [f"{', '.join(names)} at {phase:g}" for phase, names in sorted(phases.items())]
            yield f"A pump for each phase, in cycles ahead: {'; '.join(ahead)}."
        elif phases:
            several = f"the {len(self.groups)} tubes, by T connectors,"
            yield f"Join {several if len(self.groups) > 1 else 'the tube'} to the pump."


def _moved(place: Vector, way: Sequence[int], times: int = 1) -> Vector:
    (x, y, z), (dx, dy, dz) = place, way
    return x + times * dx, y + times * dy, z + times * dz


def _letters(number: int) -> str:
    """Return the name of a group: A ... Z, AA, AB, ..."""
    more, last = divmod(number, len(ascii_uppercase))
    return (_letters(more - 1) if more else "") + ascii_uppercase[last]
