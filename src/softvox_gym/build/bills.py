"""The bill of materials of a batch of robots."""

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

#: g, mass of a voxel of the kit, with its tube and without connectors.
VOXEL_G = 1.2

#: g per ml of Dragon Skin 10, at any cure speed. Source: Smooth-On, Dragon Skin Series, technical
#: bulletin.
SILICONE_G_PER_ML = 1.07

#: Minutes to cure each of the two layers: at room temperature and then at 60 C; or only at room
#: temperature.
LAYERS, CURE_MINUTES, CURE_MINUTES_ROOM = 2, 25 + 20, 75

#: Voxels in one filling of the mould. An assumption: the paper says 26 interlocking strips, and 13
#: across 13 have 12 x 12 cells between them.
MOULD_VOXELS = 144

#: The robots that the paper's table of parts is for.
TABLE_ROBOTS, TABLE_DESIGN = 50, 6560


@dataclass(frozen=True)
class Line:
    """A line of the bill: a row of the paper's table (data/kit/parts.csv), and the amount.

    The share is relative to the amount for the paper's robots, and 1 for what is bought once.
    """

    row: Mapping[str, str]
    share: Fraction

    @property
    def usd(self) -> Fraction:
        """The cost of a package."""
        return Fraction(self.row["usd"])

    @property
    def packages(self) -> int:
        """The number of packages to buy."""
        return ceil(self.share)


@dataclass(frozen=True)
class Bill:
    """The materials and costs of a batch of robots.

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
        """The cost if each package counts by the share that is used."""
        return float(sum(line.share * line.usd for line in self.lines))

    @property
    def total_usd(self) -> float:
        """The cost of all packages to buy."""
        return float(sum(line.packages * line.usd for line in self.lines))

    def amounts(self) -> Section:
        """Return the amounts for the batch as text."""
        columns = [Column("what", "it takes"), Column("amount", "amount", ",.7g")]
        rows = [(_AMOUNTS[key], round(value, 1)) for key, value in self.quantities.items()]
        return Section(columns=columns, rows=rows)

    def materials(self) -> Section:
        """Return the bill of materials as a `Section`."""
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


#: Descriptions of the quantities of a bill.
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
    """Return the materials and costs of robots: the paper's table of parts, scaled.

    The table is for fifty robots whose eight voxels are all active. Each part scales with the
    quantity that drives it (the column scales_with of data/kit/parts.csv): silicone, cups, sticks
    and gloves with voxels; Sil-Poxy and its applicators with joints; tubes and connectors with
    actuator groups; tape with slices. Tools, mould and machine are bought once.

    Parameters
    ----------
    plans : sequence of Plan
        Plans of robots that can be built.
    copies : int
        The number of robots built from each plan.
    mould_voxels : int
        Voxels that one filling of the mould makes.

    Notes
    -----
    The silicone is that of the voxels' mass, without the remains in cups. The hours leave out the
    curing of bottom layers and of the bonds between slices, and all manual work.

    Raises
    ------
    ValueError
        If a robot can't be built, or copies or mould_voxels is not a whole number from 1.
    TypeError
        If plans are not `Plan` objects.

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
    """Return the quantities of robots, with this many copies of each."""
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
