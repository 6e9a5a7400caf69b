"""softvox build: how to build designs with the paper's kit, the materials, and sheets."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from softvox_gym.build.bills import MOULD_VOXELS, Bill, bill
from softvox_gym.build.plans import TOWARDS, Plan, digits_of, places, plan
from softvox_gym.cli.landscape import ranking
from softvox_gym.cli.parser import add_shape, whole_number
from softvox_gym.cli.simulate import design_of
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.design import Design, buildable
from softvox_gym.files import check_file, write_file
from softvox_gym.landscapes.analysis import symmetry_classes
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.landscapes.table import landscape
from softvox_gym.lattice import Lattice
from softvox_gym.progress import Progress
from softvox_view.cli.options import import_figures

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from softvox_view.figures.sheets import Facts

DESCRIPTION = f"""\
Plan how to build designs with the paper's kit. For each design, print the
actuator groups (active voxels of a slice that share their air), the inlet of
each with the reason for its place, and warnings; or why it can't be built. For
all that can be built, print amounts (voxels by colour, silicone, tube, hours)
and the bill of materials, scaled from the paper's table for fifty robots.

--out draws sheets: a page per robot with its slices, the order of assembly, and
the expected measurements. The file's ending sets the format:
  .pdf   all robots, and a page for the batch: the bill, and how to measure
  .html  the same, for a browser
  .svg   the same, with the pages below one another

Mould fillings and hours assume that the mould makes {MOULD_VOXELS} voxels at once. The
hours are for curing its two layers: each takes 25 min and then 20 min at 60 C,
or 75 min without an incubator.

If a DESIGN can't be built, the exit status is 1; the others are still planned.
"""

USAGE = """\
softvox build DESIGN ... [--copies N] [--out FILE] [options]
       softvox build --top N [--one-per-class] [--out FILE] [options]"""

#: Suffixes of a file of sheets.
FORMS = (".pdf", ".svg", ".html")


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "build",
        help="plan how to build designs in silicone: sheets, and the bill",
        description=DESCRIPTION,
        usage=USAGE,
    )
    parser.add_argument("designs", metavar="DESIGN", nargs="*", help="a number, digits or a file")
    number: dict[str, Any] = {"type": whole_number, "metavar": "N"}
    parser.add_argument(
        "--top",
        **number,
        help="plan the fittest N of the published landscape that can be built",
    )
    parser.add_argument(
        "--one-per-class",
        action="store_true",
        help="with --top, only the best of each symmetry class (turned or mirrored)",
    )
    add_shape(parser)
    parser.add_argument(
        "--copies", **number, default=1, help="number of robots per design (default: 1)"
    )
    parser.add_argument("--out", type=Path, metavar="FILE", help="draw sheets into FILE")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="write the bill into FILE, as CSV")
    words = f"number of voxels per filling of the mould (default: {MOULD_VOXELS})"
    parser.add_argument("--mould-voxels", **number, default=MOULD_VOXELS, help=words)
    parser.add_argument("--force", action="store_true", help="replace FILE where it exists")
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check everything, plan, draw, write, then print."""
    if bool(args.designs) == bool(args.top):
        raise BadInputError("give either designs or --top N")
    designs, shown = _best(args) if args.top else (_given(args), "")
    for option, path in (("--out", args.out), ("--csv", args.csv)):
        if path:
            with bad_input(option):
                check_file(path, force=args.force)
    if args.out:
        check_form(args.out)
        if args.csv and args.csv.resolve() == args.out.resolve():
            raise BadInputError(f"--csv {args.csv} is where --out draws the sheets; choose another")
    plans = [plan(design) for design in designs]
    sound = [one for one in plans if not one.problems]
    batch = bill(sound, args.copies, mould_voxels=args.mould_voxels) if sound else None
    parts = [shown or "\n".join(line for one in plans for line in _as_text(one))]
    if len(sound) < len(plans):
        parts.append(f"the bill, of the {len(sound)} that can be built:" if sound else "no bill")
    parts += [batch.amounts().text(), batch.materials().text()] if batch else []
    files = [("--out", args.out, sheets_of(args.out, plans, batch))] if args.out else []
    files += [("--csv", args.csv, batch.materials().csv().encode())] if args.csv and batch else []
    for option, path, content in files:
        with bad_input(option):
            write_file(path, content, force=args.force)
        parts.append(f"wrote {path}")
    print("\n\n".join(parts))
    return 0 if len(sound) == len(plans) else 1


def _given(args: Namespace) -> list[Design]:
    """Return the designs named in the options."""
    if args.one_per_class:
        raise BadInputError("--one-per-class needs --top N; give that instead of designs")
    return [design_of(text, tuple(args.shape), args.phases) for text in args.designs]


def _best(args: Namespace) -> tuple[list[Design], str]:
    """Return the fittest designs that can be built, and a description of them."""
    if tuple(args.shape) != Lattice() or args.phases > 1:
        raise BadInputError("--shape and --phases are not for --top, whose landscape is 2x2x2")
    table = ranking(landscape())
    can_be = buildable(Lattice().digits(table["design"]), Lattice())
    ranks = np.flatnonzero(can_be)[: args.top]
    if args.top > len(ranks):
        raise BadInputError(
            f"--top must be at most {len(ranks)}, the designs that can be built, got {args.top}"
        )
    left_out = ranks[-1] + 1 - len(ranks)
    if args.one_per_class:
        classes = symmetry_classes()[table["design"][ranks]]
        ranks = ranks[np.sort(np.unique(classes, return_index=True)[1])]
    designs = [Design(number) for number in table["design"][ranks].tolist()]
    titles = ("rank", "design", "digits", "fitness", "pink", "blue")
    rows = [
        (rank + 1, d.index, d.digits, fitness, d.n_active, d.n_voxels - d.n_active)
        for rank, fitness, d in zip(ranks, table["fitness"][ranks], designs, strict=True)
    ]
    columns = [Column(name, name, ".2f" * (name == "fitness")) for name in titles]
    shown = Section(columns=columns, rows=rows).text()
    if left_out:
        shown += f"\nleft out: {left_out} in several pieces, which can't be built"
    return designs, shown


def check_form(out: Path) -> None:
    """Check that sheets can be drawn into a file of that name."""
    form = out.suffix.lower()
    if form not in FORMS:
        raise BadInputError(f"--out must end in {', '.join(FORMS)}, got {str(out)!r}")
    import_figures("sheets")


def sheets_of(out: Path, plans: Sequence[Plan], batch: Bill | None) -> bytes:
    """Return a file with a sheet for every robot, and one for all that can be built."""
    from softvox_view.figures.sheets import draw_batch, draw_sheet, facts_of, write

    form = out.suffix.lower().removeprefix(".")
    facts: dict[Design, Facts] = {}
    for lattice in dict.fromkeys(one.design.lattice for one in plans):
        own = [one.design for one in plans if one.design.lattice == lattice]
        facts |= zip(own, facts_of(own), strict=True)

    def pages() -> Iterator[Figure]:
        with Progress(sys.stderr, unit="sheets") as progress:
            for done, one in enumerate(plans, start=1):
                yield from draw_sheet(one, facts[one.design])
                progress(done, len(plans))
        if batch:
            yield from draw_batch([one for one in plans if not one.problems], batch)

    with bad_input("--out"):
        return write(pages(), form)


def _as_text(one: Plan) -> Iterator[str]:
    """Yield the lines about a robot."""
    design = one.design
    name = f"{design.index}  " if design.lattice == Lattice() else ""
    yield (
        f"{name}{digits_of(design)}  {design.n_active} pink (active), "
        f"{design.n_voxels - design.n_active} blue or yellow (passive); groups {len(one.groups)}, "
        f"holes {len(one.holes)}"
    )
    for group in one.groups:
        yield f"  group {group.name}: {places(design, group.sites)}"
        if inlet := group.inlet:
            at = f"{places(design, [inlet.site])} towards {TOWARDS[inlet.face]}"
            yield f"    inlet in {at}: {inlet.why}"
    yield from (f"  can't be built: {problem}" for problem in one.problems)
    yield from (f"  take care: {warning}" for warning in one.warnings)
