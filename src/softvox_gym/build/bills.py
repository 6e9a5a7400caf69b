"""What a batch of robots takes, and costs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import ceil
from numbers import Integral

from softvox_gym.build.plans import PER_GROUP, Plan, plan
from softvox_gym.data import records
from softvox_gym.design import ABSENT, Design
from softvox_gym.landscapes.section import Column, Section

#: g of a voxel of the kit, with its tube and without connectors.
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


@dataclass(frozen=True)
class Line:
    """A line of the bill: a row of the paper's table (data/kit/parts.csv), and how much of it.

    The share is of what the paper's robots took, and 1 of what is bought once.
    """

    row: Mapping[str, str]
    share: Fraction

    @property
    def usd(self) -> Fraction:
        """What a package costs."""
        return Fraction(self.row["usd"])

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
        `tube_1_32_in_cm`, `tube_1_16_in_cm`, `connectors`, `silicone_ml`, `mould_fillings`,
        `cure_hours` and, without an incubator, `cure_hours_room`.
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
        """Return what the batch takes, for people."""
        columns = [Column("what", "it takes"), Column("amount", "amount", ",.7g")]
        rows = [(_AMOUNTS[key], round(value, 1)) for key, value in self.quantities.items()]
        return Section(columns=columns, rows=rows)

    def materials(self) -> Section:
        """Return the bill of materials, for people and programs."""
        told = "no", "part", "section", "use", "scales_with"
        rows = [
            (
                *(line.row[name] for name in told),
                *(float(line.share), line.packages, float(line.usd)),
                *(round(float(n * line.usd), 2) for n in (line.share, line.packages)),
            )
            for line in self.lines
        ]
        return Section(
            columns=[
                *(Column("no"), Column("part", "part"), Column("section"), Column("use")),
                *(Column("scales_with", "goes by"), Column("share", "share", ".0%")),
                *(Column("packages", "packs"), Column("usd")),
                *(Column("used_usd", "USD used", ".2f"), Column("bought_usd", "to buy", ".2f")),
            ],
            rows=rows,
            facts={"used_usd": self.used_usd, "total_usd": self.total_usd},
            sentence="{total_usd:,.2f} USD to buy, in whole packages; {used_usd:,.2f} USD where a "
            "package counts by the share that is used",
        )


#: What the quantities of a bill are to people.
_AMOUNTS = {
    "robots": "robots",
    "voxels": "voxels",
    "active": "pink voxels (active)",
    "passive": "blue or yellow voxels (passive)",
    "slices": "slices",
    "joints": "joints of Sil-Poxy (bonds, tubes)",
    "holes": "holes to punch",
    "groups": "actuator groups, a tube each",
    "tube_1_32_in_cm": "tube 1/32 in, cm",
    "tube_1_16_in_cm": "tube 1/16 in, cm",
    "connectors": "connectors",
    "silicone_ml": "silicone in the voxels, ml",
    "mould_fillings": "mould fillings, of two layers",
    "cure_hours": "hours of cures in the mould, at 60 C",
    "cure_hours_room": "hours without an incubator",
}


def bill(plans: Sequence[Plan], copies: int = 1, *, mould_voxels: int = MOULD_VOXELS) -> Bill:
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

    Notes
    -----
    The silicone is that of the voxels' mass; what stays in cups is not in it, nor in the hours the
    cures of bottom layers and of the bonds between slices, and all that hands do.

    Raises
    ------
    ValueError
        For a robot that can't be built, or copies or mould_voxels that are no whole number from 1.
    TypeError
        For what are no plans.

    Examples
    --------
    >>> full = bill([plan(Design(6560))], copies=50)
    >>> full.total_usd, full.quantities["mould_fillings"], full.quantities["cure_hours"]
    (622.0, 3, 4.5)
    """
    for name, value in (("copies", copies), ("mould_voxels", mould_voxels)):
        if not isinstance(value, Integral) or value < 1:
            raise ValueError(f"{name} must be a whole number from 1, got {value}")
    for one in plans:
        if not isinstance(one, Plan):
            raise TypeError(f"plans must be what plan(design) returns, got a {type(one).__name__}")
        if one.problems:
            raise ValueError(f"design {one.design.digits} can't be built: {one.problems[0]}")
    needed = _counted(plans, copies)
    table = _counted([plan(Design(TABLE_DESIGN))], TABLE_ROBOTS)
    fillings = ceil(Fraction(needed["voxels"], mould_voxels))
    quantities = {
        **needed,
        **{name: amount * needed["groups"] for name, amount in PER_GROUP.items()},
        "silicone_ml": needed["voxels"] * VOXEL_G / SILICONE_G_PER_ML,
        "mould_fillings": fillings,
        "cure_hours": fillings * LAYERS * CURE_MINUTES / 60,
        "cure_hours_room": fillings * LAYERS * CURE_MINUTES_ROOM / 60,
    }
    lines = []
    for row in records("parts.csv", "kit"):
        driver = row["scales_with"]
        share = Fraction(1) if driver == "once" else Fraction(needed[driver], table[driver])
        lines.append(Line(row, share))
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
