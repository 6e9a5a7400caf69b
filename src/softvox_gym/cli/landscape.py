"""softvox landscape: all designs into a table."""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path
from typing import Any

from softvox_gym.cli.parser import add_physics, add_threads, physics_of
from softvox_gym.cli.terminal import bad_input
from softvox_gym.design import N_DESIGNS
from softvox_gym.files import check_folder, write_folder
from softvox_gym.landscapes import exhaustive
from softvox_gym.landscapes.analysis import Analysis, analyse, report, tables
from softvox_gym.progress import Progress

ANALYSIS, DOCUMENT = "analysis.json", "analysis.md"
OPTIMA, NEIGHBOURS, CLASSES = tables.NAMES

DESCRIPTION = f"""\
Simulate all {N_DESIGNS} designs of the 2x2x2 lattice and write, into a folder,
  {exhaustive.TABLE}  design, digits, dx, dy, dz, fitness, status: displacement of
                 the centre of mass in voxel widths (cm for the 1 cm voxel),
                 fitness = sqrt(dx^2 + dy^2), status ok or diverged (then nan)
  {exhaustive.MANIFEST}  physics, version, commit, machine, seconds, digest of the bits
and print the ten best. With --analyse, analyse the landscape exactly (kinds of
designs, symmetry, local optima and climbs, ruggedness, neutrality, robustness
to one error; a design that diverged counts as 0), print that too, and write
  {ANALYSIS}  for programs, with the digest of the bits it belongs to
  {DOCUMENT}    for people, every number with its meaning
  {OPTIMA}, {NEIGHBOURS}, {CLASSES}
                 a row per local optimum, design and symmetry class
"""

BEST = 10


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "landscape",
        help="simulate all 6561 designs into a table",
        description=DESCRIPTION,
        usage="softvox landscape [--out DIR] [--force] [--analyse] [options]",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("landscape"),
        metavar="DIR",
        help="folder to write, new or empty (default: landscape)",
    )
    parser.add_argument(
        "--force", action="store_true", help="replace an earlier landscape in that folder"
    )
    parser.add_argument(
        "--analyse", action="store_true", help="analyse the landscape, and print and write that"
    )
    add_threads(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check that the result can be written, then make it, write it and sum it up."""
    physics = physics_of(args)
    names = [exhaustive.TABLE, exhaustive.MANIFEST]
    if args.analyse:
        names += [ANALYSIS, DOCUMENT, *tables.NAMES]
    with bad_input("--out"):
        check_folder(args.out, names, force=args.force)
    with bad_input(), Progress(sys.stderr, quiet=args.quiet) as progress:
        made = exhaustive.run(physics, threads=args.threads, progress=progress)
    analysis = analyse(made.result.fitness) if args.analyse else None
    with bad_input("--out"):
        contents = made.contents(args.arguments)
        if analysis is not None:
            contents |= analysis_contents(made, analysis)
        write_folder(args.out, contents, force=args.force)
    print(summary(made))
    if analysis is not None:
        print(f"\n{report.text(analysis)}")
        print(f"\nwrote into {args.out}: {', '.join(names)}")
    else:
        print(f"\nwrote {args.out / exhaustive.TABLE} and {args.out / exhaustive.MANIFEST}")
    return 0


def analysis_contents(made: exhaustive.Landscape, analysis: Analysis) -> dict[str, bytes]:
    """Return the files of a landscape's analysis by name."""
    # A landscape forced over this one leaves these files: the digest tells that they are another's.
    manifest = made.manifest(())
    origin = {name: manifest[name] for name in ("version", "commit", "digest")}
    texts = {
        ANALYSIS: exhaustive.as_json({**origin, **analysis.to_dict()}),
        DOCUMENT: report.markdown(analysis),
        **tables.tables(analysis),
    }
    return {name: text.encode() for name, text in texts.items()}


def summary(made: exhaustive.Landscape) -> str:
    """Return the ten best, and the time beside the paper's."""
    result = made.result
    lines = [f"{'rank':>4}  {'design':>6}  {'digits':8}  {'fitness':>9}  {'dx':>9}  {'dy':>9}"]
    for rank, i in enumerate(exhaustive.ranking(result)[:BEST], start=1):
        dx, dy, _ = result.displacement[i]
        lines.append(
            f"{rank:4}  {i:6}  {result.design(int(i)).digits}  "
            f"{result.fitness[i]:9.4f}  {dx:9.4f}  {dy:9.4f}"
        )
    diverged = int((result.status != "ok").sum())
    times = exhaustive.PAPER_CPU_HOURS * 3600 / made.cpu_seconds
    lines += [
        "",
        f"{len(result)} designs in {made.seconds:.1f} s"
        + (f", of which {diverged} diverged" if diverged else "")
        + f" ({made.cpu_seconds:.1f} CPU-seconds, {made.origin['instruction_set']},"
        f" {made.origin['threads']} threads)",
        f"the paper's {exhaustive.PAPER_CPU_HOURS} CPU-hours are {_rounded(times)} times that",
    ]
    return "\n".join(lines)


def _rounded(times: float) -> str:
    """Return two digits of a ratio."""
    return f"{float(f'{times:.2g}'):,.10g}"
