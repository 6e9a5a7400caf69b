"""What is built of a design with the paper's kit, and what that takes; nothing is drawn here.

Source: S. Kriegman et al., "Scalable sim-to-real transfer of soft robot designs", RoboSoft 2020:
the protocol of building, and the table of parts.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from importlib.resources import files
from itertools import product
from math import ceil
from string import ascii_uppercase

import numpy as np

from softvox_gym.design import ABSENT, ACTIVE, Design, actuators, closed_hollows
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.lattice import FACES

Vector = tuple[int, int, int]

#: Where an inlet goes if nothing else decides: the side with the mark of the robot's x axis last.
SIDES: tuple[Vector, ...] = ((-1, 0, 0), (0, -1, 0), (0, 1, 0), (1, 0, 0))
TOP, UNDERSIDE = FACES[4:]

#: How people say where a face is.
TOWARDS = dict(zip(FACES, ("+x", "-x", "+y", "-y", "the top", "the underside"), strict=True))

#: What two voxels have in common, by how many of x, y, z differ by one.
_SHARED = {2: "an edge", 3: "a corner"}
_AROUND = [way for way in product((-1, 0, 1), repeat=3) if sum(map(abs, way)) in _SHARED]

#: So many voxels, or faults of a kind, are named one by one.
MOST_NAMED = 6

#: Before the slices are stacked, of every slice with active voxels.
LEAK_CHECK = (
    "Join a group's tube to the 60 mL syringe and hold the slice under water in the beaker.",
    "Inflate it. All voxels of the group bulge; where one does not, its hole is missing or closed.",
    "No passive voxel and no other group bulges; where one does, a wall between them is open.",
    "No bubbles come from the seams between voxels, from the bottom layer or from the inlet.",
    "Where bubbles rise: dry it, close the leak with Sil-Poxy, let that cure, and test again.",
)

#: Of every robot; `softvox trials` keeps what comes of it.
MEASUREMENTS = (
    "Before it starts, mark the centre of the robot's top and its +x axis, as on this sheet.",
    "Camera above, looking straight down, still; all of the way in the picture. A ruler at the "
    "height of the robot's top gives the scale: cm per pixel.",
    "A flat floor, powdered with cornstarch; the tubes slack, so that they do not pull.",
    "90 actuations at 6 kPa, filmed from the first; note the frequency. Three repetitions, the "
    "floor powdered anew, the robot set down alike.",
    "Of each: x and y of the mark in cm from the start, along the robot's axes, once a cycle or "
    "more often. The paper laid 90 real actuations beside 23 simulated cycles.",
    "Volume under water, relative to rest, at four moments of a cycle.",
)

#: Of the kit: g, with its tube and without connectors.
VOXEL_G = 1.2

#: g per ml of Dragon Skin 10, whichever speed. Source: Smooth-On, Dragon Skin Series, technical
#: bulletin.
SILICONE_G_PER_ML = 1.07

#: Two layers, each so many minutes: at room temperature and then at 60 C; or at room temperature.
LAYERS, CURE_MINUTES, CURE_MINUTES_ROOM = 2, 25 + 20, 75

#: Voxels of one filling of the mould. An assumption: the paper says 26 interlocking strips, and
#: 13 across 13 have 12 x 12 cells between them.
MOULD_VOXELS = 144

#: What the paper's table of parts is for.
TABLE_ROBOTS, TABLE_DESIGN = 50, 6560

#: Of the table, for its robots: cm of tube (52 ft and 65.6 ft), and connectors.
_PNEUMATICS = {"tube_1_32_in_cm": 52 * 30.48, "tube_1_16_in_cm": 65.6 * 30.48, "connectors": 200}


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
    """Return what is built of a design; `softvox_gym.design.buildable` tells alone whether it can.

    An inlet goes where a tube leaves best: through a side before which nothing is built; where
    there is none through the top, or else the underside of an overhang; then where a voxel stands
    further out; and only where nothing else is free through the underside, on which the robot
    walks. Of these, where fewest voxels are beside the tube; and then on the side where most groups
    have such a place, so that the tubes pull one way.

    Examples
    --------
    >>> full = plan(Design(6560))
    >>> [(group.name, group.sites, group.inlet.face) for group in full.groups]
    [('A', (0, 1, 2, 3), (-1, 0, 0)), ('B', (4, 5, 6, 7), (-1, 0, 0))]
    >>> len(full.holes), full.problems
    (8, ())
    >>> print(*plan(Design("202", shape=(1, 1, 3))).problems)
    it is 2 pieces, (0, 0, 0) | (0, 0, 2), that do not touch
    """
    body = _Body(design)
    bonds = tuple(body.bonds())
    groups, care = body.groups()
    of_group = {site: group.name for group in groups for site in group.sites}
    holes = [Hole((a, b)) for a, b in bonds if a in of_group and of_group[a] == of_group.get(b)]
    problems, warnings = tuple(body.problems(groups, bonds)), (*body.warnings(), *care)
    made = Plan(design, tuple(groups), bonds, tuple(holes), problems, warnings, ())
    return made if problems else replace(made, steps=tuple(body.steps(made)))


#: How bad it is to lead a tube to a face: whether that is the underside, whether a voxel stands
#: before it further out, its place in `_WHERE`, and how many voxels stand beside the tube.
_Rank = tuple[bool, bool, int, int]
_Opening = tuple[_Rank, int, Vector]

_ORDER = {face: i for i, face in enumerate([*SIDES, TOP, UNDERSIDE])}

_WHERE = (
    "a side",
    "the top, as no side is clear",
    "the underside of an overhang, as neither side nor top is clear",
    "the underside, as nothing else is free",
)

#: What a builder has to do about inlets that are not in a side, by place in `_WHERE`.
_CARE = {
    1: "the tube of group {} leaves through the top: lead it up, and hold it slack over the robot",
    2: "the tube of group {} leaves under an overhang: lead it out sideways",
    3: "the tube of group {} leaves through the underside, on which the robot walks, so that it "
    "may travel otherwise than simulated: better free a side of the group",
}


class _Body:
    """A design's voxels by their places, and what is asked of them."""

    def __init__(self, design: Design) -> None:
        self.design, self.place = design, design.lattice.place
        self.digits = [int(digit) for digit in design.digits]
        self.sites = {self.place(s): s for s, digit in enumerate(self.digits) if digit != ABSENT}
        hollows = closed_hollows((design.array != ABSENT)[..., np.newaxis])
        #: Where something is built, or no tube can be led.
        self.shut = {*self.sites, *((x, y, z) for x, y, z, _ in np.argwhere(hollows).tolist())}
        self.levels = sorted({z for _, _, z in self.sites})

    def named(self, sites: Iterable[int]) -> str:
        """Return sites as people read them."""
        return _some([str(self.place(site)) for site in sites])

    def pairs(self, pairs: Iterable[tuple[int, int]]) -> str:
        """Return pairs of sites as people read them."""
        return _some([f"{self.place(a)} - {self.place(b)}" for a, b in pairs])

    def bonds(self) -> Iterator[tuple[int, int]]:
        """Yield the neighbours of each slice."""
        for place, site in self.sites.items():
            for way in ((1, 0, 0), (0, 1, 0)):
                if (other := self.sites.get(_moved(place, way))) is not None:
                    yield site, other

    def groups(self) -> tuple[list[Group], list[str]]:
        """Return the actuator groups, each with its inlet, and what needs care about inlets."""
        found = actuators(self.design)
        best = [_best(self._openings(sites)) for sites in found]
        votes = Counter(face for one in best for face in {face for _, _, face in one})
        phase = self.design.phase.ravel(order="F")
        groups, care = [], []
        for i, (sites, openings) in enumerate(zip(found, best, strict=True)):
            name, inlet = _letters(i), None
            if openings:
                rank, site, face = min(openings, key=lambda o: (-votes[o[2]], _ORDER[o[2]], o[1]))
                inlet = Inlet(site, face, _why(rank, votes[face], len(found)))
                care += [_CARE[rank[2]].format(name)] if rank[2] in _CARE else []
            groups.append(
                Group(name, sites, self.place(sites[0])[2], float(phase[sites[0]]), inlet)
            )
        return groups, care

    def _openings(self, sites: Iterable[int]) -> Iterator[_Opening]:
        """Yield the faces of a group to which a tube can be led."""
        for site, face in product(sites, FACES):
            place = self.place(site)
            front = _moved(place, face)
            if front in self.shut:
                continue
            kind = 0 if face in SIDES else 1 if face == TOP else 2 + (place[2] == self.levels[0])
            further = [_moved(front, face, k) for k in range(1, max(self.design.shape))]
            around = [_moved(front, way) for way in FACES if way != face]
            is_blocked = any(one in self.sites for one in further)
            beside = sum(one in self.sites for one in around) - 1  # less the voxel itself
            yield (kind == 3, is_blocked, kind, beside), site, face

    def problems(self, groups: Sequence[Group], bonds: Iterable[tuple[int, int]]) -> Iterator[str]:
        """Yield why the kit can't build it."""
        pieces = self.design.components
        if not pieces:
            yield "it has no voxels"
        if len(pieces) > 1:
            named = _some([self.named(one) for one in pieces], " | ")
            shared = [f"share {what}, {self.pairs(p)}" for what, p in self._touching().items()]
            touch = f"{' and '.join(shared)}, but no face to bond" if shared else "do not touch"
            yield f"it is {len(pieces)} pieces, {named}, that {touch}"
        digits = self.digits
        active = [pair for pair in bonds if min(digits[site] for site in pair) >= ACTIVE]
        torn = [(a, b) for a, b in active if digits[a] != digits[b]]
        if torn:
            yield (
                f"active neighbours of a slice share their air, and {self.pairs(torn)} differ in "
                "phase; give them one phase, or put a passive voxel between them"
            )
        buried = [group for group in groups if group.inlet is None]
        for group in buried[:MOST_NAMED]:
            yield (
                f"group {group.name} is buried: no face of {self.named(group.sites)} is on the "
                "surface, and its tube needs one; leave out a voxel beside it"
            )
        if len(buried) > MOST_NAMED:
            yield f"{len(buried) - MOST_NAMED} more groups are buried"

    def _touching(self) -> dict[str, list[tuple[int, int]]]:
        """Return what voxels of different pieces share, and which these are."""
        piece_of = {site: i for i, one in enumerate(self.design.components) for site in one}
        found: dict[str, list[tuple[int, int]]] = {what: [] for what in _SHARED.values()}
        for (place, site), way in product(self.sites.items(), _AROUND):
            other = self.sites.get(_moved(place, way), -1)
            if other > site and piece_of[other] != piece_of[site]:
                found[_SHARED[sum(map(abs, way))]].append((site, other))
        return {what: pairs for what, pairs in found.items() if pairs}

    def warnings(self) -> Iterator[str]:
        """Yield what needs care, but for inlets."""
        if self.sites and not self.design.n_active:
            yield "no voxel is active: it has no tube, and will not move"
        lowest = self.levels[0] if self.levels else 0
        if lowest:
            yield f"nothing is below slice z = {lowest}: the robot stands on that"
        for z in sorted({*range(lowest, max(self.levels, default=0))} - {*self.levels}):
            yield f"slice z = {z} is empty, and the slices above it have nothing to stand on"
        below = {site: _moved(place, UNDERSIDE) for place, site in self.sites.items()}
        over = [s for s, under in below.items() if under[2] >= lowest and under not in self.sites]
        if over:
            yield (
                f"nothing is below {self.named(over)}: support the overhang while the slices are "
                "bonded"
            )
        for z in self.levels if self.design.is_connected else ():
            flat = Design((self.design.array[:, :, z : z + 1] != ABSENT).astype(np.uint8))
            if len(parts := flat.components) > 1:
                first = z * flat.lattice.sites
                named = [self.named(first + site for site in part) for part in parts]
                shown = _some(named, " | ")
                yield (
                    f"slice z = {z} is {len(parts)} parts, {shown}, that share no face: nothing "
                    "holds them together until the slices are stacked; lay them out as drawn"
                )

    def steps(self, made: Plan) -> Iterator[str]:
        """Yield the order of assembly."""
        active, passive = self.design.n_active, self.design.n_voxels - self.design.n_active
        colours = {"pink (active)": active, "blue or yellow (passive)": passive}
        shown = ", ".join(f"{number} {colour}" for colour, number in colours.items() if number)
        yield (
            f"Mould {_count(self.design.n_voxels, 'voxel')}: {shown}. Pour, and spread along the "
            "walls; turn the mould over onto the machine at 45\N{DEGREE SIGN}, which turns it by "
            "90\N{DEGREE SIGN} every 45 s. Cure for 25 min, then 20 min at 60 \N{DEGREE SIGN}C, or "
            "for 75 min at room temperature. Then a second layer in the same way."
        )
        yield "Cut the voxels out and trim them; the lower side of each is still open."
        for z in self.levels:
            bonds = [pair for pair in made.bonds if self.place(pair[0])[2] == z]
            holes = [hole.sites for hole in made.holes if self.place(hole.sites[0])[2] == z]
            if bonds:
                cut = f"punch {_count(len(holes), 'hole')}: {self.pairs(holes)}" if holes else ""
                bonded = _count(len(bonds), "pair") + " of neighbours with Sil-Poxy"
                yield f"Slice z = {z}: bond {bonded}; {cut or 'no hole'}."
        yield (
            "Set every slice, open side down, on a 1 mm layer of uncured silicone between the two "
            "rulers. Cure, cut out, and run silicone along the outer seams, never over a hole."
        )
        ways = [
            f"{group.name} in {self.place(group.inlet.site)} towards {TOWARDS[group.inlet.face]}"
            for group in made.groups
            if group.inlet
        ]
        if ways:
            yield (
                f"Inlets: {_some(ways, '; ')}. Make a hole, glue in 1/32 in tube with Sil-Poxy; a "
                "straight connector joins it to 1/16 in tube."
            )
            yield "Test every group for leaks (check list)."
        if len(self.levels) > 1:
            order = ", ".join(map(str, self.levels))
            yield f"Stack the slices, z = {order}, and bond them with a thin layer of silicone."
        phases: dict[float, list[str]] = {}
        for group in made.groups:
            phases.setdefault(group.phase, []).append(group.name)
        if len(phases) > 1:
            ahead = [f"{', '.join(names)} at {phase:g}" for phase, names in sorted(phases.items())]
            yield f"A pump for each phase, in cycles ahead: {'; '.join(ahead)}."


def _best(openings: Iterable[_Opening]) -> list[_Opening]:
    """Return those that are as good as any."""
    every = list(openings)
    least = min(every)[0] if every else None
    return [one for one in every if one[0] == least]


def _why(rank: _Rank, votes: int, groups: int) -> str:
    """Return why an inlet is where it is."""
    _, is_blocked, kind, beside = rank
    before = "a voxel further out" if is_blocked else "nothing before it"
    stands = _count(beside, "voxel") if beside else "nothing"
    words = f"{_WHERE[kind]}, with {before} and {stands} beside the tube"
    if votes > 1:
        words += f"; {'all' if votes == groups else votes} tubes can leave that way"
    return words


def _moved(place: Vector, way: Sequence[int], times: int = 1) -> Vector:
    (x, y, z), (dx, dy, dz) = place, way
    return x + times * dx, y + times * dy, z + times * dz


def _letters(number: int) -> str:
    """Return the name of a group: A ... Z, AA, AB, ..."""
    more, last = divmod(number, len(ascii_uppercase))
    return (_letters(more - 1) if more else "") + ascii_uppercase[last]


def _some(words: Sequence[str], comma: str = ", ") -> str:
    """Return a list that is cut where it gets long."""
    more = len(words) - MOST_NAMED
    return comma.join(words[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


@dataclass(frozen=True)
class Line:
    """A line of the bill: a part of the paper's table, and how much of it a batch takes.

    Parameters
    ----------
    no : int
        Of the part in the table.
    part, section, use : str
    usd : Fraction
        What the paper's robots took of it cost: a package.
    scales_with : str
        What drives how much is needed: "once", or a quantity of the bill.
    share : Fraction
        Of what the paper's robots took; 1 of what is bought once.
    """

    no: int
    part: str
    section: str
    use: str
    usd: Fraction
    scales_with: str
    share: Fraction

    @property
    def packages(self) -> int:
        """How many packages have to be bought."""
        return ceil(self.share)


@dataclass(frozen=True)
class Bill:
    """What a batch of robots takes, and costs.

    Parameters
    ----------
    quantities : mapping of str to number
        `robots`, `voxels` of which `active` and `passive`, `slices`, `joints`, `holes`, `groups`,
        `mould_fillings`, `silicone_ml`, `tube_1_32_in_cm`, `tube_1_16_in_cm`, `connectors` and
        `cure_hours`.
    lines : tuple of Line
    """

    quantities: Mapping[str, float]
    lines: tuple[Line, ...]

    @property
    def used_usd(self) -> float:
        """The cost where a package counts by the share of it that is used."""
        return float(sum(line.share * line.usd for line in self.lines))

    @property
    def total_usd(self) -> float:
        """The cost of all that has to be bought, in whole packages."""
        return float(sum(line.packages * line.usd for line in self.lines))

    def amounts(self) -> Section:
        """Return what the batch takes, for people and programs."""
        columns = Column("what", "it takes"), Column("key"), Column("amount", "amount", ",.7g")
        rows = [
            (_AMOUNTS[key][0], key, round(value, 1), _AMOUNTS[key][1])
            for key, value in self.quantities.items()
        ]
        return Section(columns=(*columns, Column("unit", "unit")), rows=rows)

    def materials(self) -> Section:
        """Return the bill of materials, for people and programs."""
        told = "no", "part", "section", "use", "scales_with"
        titles = {"part": "part", "scales_with": "goes by"}
        money = {"usd": "", "used_usd": "USD used", "bought_usd": "to buy"}
        rows = [
            (
                *(getattr(line, name) for name in told),
                *(float(line.share), line.packages, float(line.usd)),
                *(round(float(n * line.usd), 2) for n in (line.share, line.packages)),
            )
            for line in self.lines
        ]
        return Section(
            columns=[
                *(Column(name, titles.get(name, "")) for name in told),
                *(Column("share", "share", ".0%"), Column("packages", "packs")),
                *(Column(name, title, ".2f") for name, title in money.items()),
            ],
            rows=rows,
            facts={"used_usd": self.used_usd, "total_usd": self.total_usd},
            sentence="{total_usd:,.2f} USD to buy, in whole packages; {used_usd:,.2f} USD where a "
            "package counts by the share that is used",
        )


#: The quantities of a bill: what they are to people, and their unit.
_AMOUNTS = {
    "robots": ("robots", ""),
    "voxels": ("voxels", ""),
    "active": ("pink voxels (active)", ""),
    "passive": ("blue or yellow voxels (passive)", ""),
    "slices": ("slices", ""),
    "joints": ("joints of Sil-Poxy (bonds, tubes)", ""),
    "holes": ("holes to punch", ""),
    "groups": ("actuator groups, a tube each", ""),
    "mould_fillings": ("mould fillings", ""),
    "silicone_ml": ("silicone, in the voxels", "ml"),
    "tube_1_32_in_cm": ("tube 1/32 in", "cm"),
    "tube_1_16_in_cm": ("tube 1/16 in", "cm"),
    "connectors": ("connectors", ""),
    "cure_hours": ("curing in the mould", "h"),
}


def bill(
    plans: Sequence[Plan],
    copies: int = 1,
    *,
    mould_voxels: int = MOULD_VOXELS,
    incubator: bool = True,
) -> Bill:
    """Return what robots take, and cost: the paper's table of parts, scaled.

    The table is of fifty robots whose eight voxels are all active. Of each part a batch takes as
    much as it has of what drives it (the column scales_with of data/kit/parts.csv): silicone, cups,
    sticks and gloves go by voxels; Sil-Poxy and what spreads it by joints; tubes and connectors by
    actuator groups; tape by slices. Tools, mould and machine are bought once.

    Parameters
    ----------
    plans : sequence of Plan
        Of robots that can be built.
    copies : int
        How many are built of each.
    mould_voxels : int
        How many one filling of the mould makes.
    incubator : bool
        Whether layers cure at 60 C after 25 min, or at room temperature.

    Notes
    -----
    The silicone is that of the voxels' mass; what stays in cups is not in it, nor in the hours the
    cures of bottom layers and of the bonds between slices, and all that hands do.

    Raises
    ------
    ValueError
        For a robot that can't be built, or copies or mould_voxels below 1.

    Examples
    --------
    >>> full = bill([plan(Design(6560))], copies=50)
    >>> full.total_usd, full.quantities["mould_fillings"], full.quantities["cure_hours"]
    (622.0, 3, 4.5)
    """
    for name, value in (("copies", copies), ("mould_voxels", mould_voxels)):
        if value < 1:
            raise ValueError(f"{name} must be a whole number from 1, got {value}")
    for one in plans:
        if one.problems:
            raise ValueError(f"design {one.design.digits} can't be built: {one.problems[0]}")
    needed = _counted(plans, copies)
    table = _counted([plan(Design(TABLE_DESIGN))], TABLE_ROBOTS)
    fillings = ceil(Fraction(needed["voxels"], mould_voxels))
    minutes = CURE_MINUTES if incubator else CURE_MINUTES_ROOM
    pneumatics = {
        name: amount * needed["groups"] / table["groups"] for name, amount in _PNEUMATICS.items()
    }
    quantities: dict[str, float] = {
        **needed,
        "mould_fillings": fillings,
        "silicone_ml": needed["voxels"] * VOXEL_G / SILICONE_G_PER_ML,
        **pneumatics,
        "cure_hours": fillings * LAYERS * minutes / 60,
    }
    lines = [
        Line(
            int(row["no"]),
            row["part"],
            row["section"],
            row["use"],
            Fraction(row["usd"]),
            driver := row["scales_with"],
            Fraction(1) if driver == "once" else Fraction(needed[driver], table[driver]),
        )
        for row in _parts()
    ]
    return Bill(quantities, tuple(lines))


def _counted(plans: Sequence[Plan], copies: int) -> dict[str, int]:
    """Return what is counted in robots, of which there are so many each."""
    designs = [one.design for one in plans]
    active, voxels = (sum(getattr(d, n) for d in designs) for n in ("n_active", "n_voxels"))
    counts = {
        "robots": len(plans),
        "voxels": voxels,
        "active": active,
        "passive": voxels - active,
        "slices": sum(int((d.array != ABSENT).any(axis=(0, 1)).sum()) for d in designs),
        "joints": sum(len(one.bonds) + len(one.groups) for one in plans),
        "holes": sum(len(one.holes) for one in plans),
        "groups": sum(len(one.groups) for one in plans),
    }
    return {name: count * copies for name, count in counts.items()}


@lru_cache(maxsize=1)
def _parts() -> list[dict[str, str]]:
    """Return the paper's table of parts, and what drives each."""
    path = files("softvox_gym.data") / "kit" / "parts.csv"
    return list(csv.DictReader(path.read_text(encoding="utf-8").splitlines()))
