"""softvox landscape: simulate all designs into a table."""

from __future__ import annotations

import json
import sys
import time
import zipfile
from argparse import Namespace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.cli.parser import add_physics, add_threads, physics_of, whole_number
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.files import archive_of, check_folder, write_folder
from softvox_gym.landscapes.analysis import analyse
from softvox_gym.landscapes.analysis.phased import analyse_phased
from softvox_gym.landscapes.cache import cache_path
from softvox_gym.landscapes.section import Column, Section
from softvox_gym.landscapes.table import (
    AXES,
    COMPUTED,
    MOST_PHASES,
    N_DESIGNS,
    PHASED_DIGESTS,
    Table,
    compute,
    phased,
    phased_lattice,
)
from softvox_gym.manifest import digest, provenance
from softvox_gym.physics import Physics
from softvox_gym.progress import Progress
from softvox_gym.realities import Reality

TABLE, MANIFEST = FILES = ("landscape.csv", "manifest.json")
ANALYSIS, DOCUMENT, *TABLES = ANALYSIS_FILES = (
    "analysis.json", "analysis.md", "local_optima.csv", "classes.csv", "neighbours.csv"
)  # fmt: skip

#: Written instead of the table if that has millions of rows.
PACKED = "landscape.npz"

#: Numbers of designs by number of phases.
N_PHASED = {phases: phased_lattice(phases).n_designs for phases in range(2, MOST_PHASES + 1)}

#: Time of the published run (Kriegman et al., RoboSoft 2020).
PAPER_CPU_HOURS = 58

DESCRIPTION = f"""\
Simulate all {N_DESIGNS} designs of the 2x2x2 lattice, print the ten best, and write
into a folder
  {TABLE}  a row per design: dx, dy, dz, displacement of the centre of
                 mass in voxel widths (cm for the 1 cm voxel); fitness =
                 sqrt(dx^2 + dy^2); diverged (if True, all these are nan);
                 steps; and step_error, the change of the fitness at half the
                 time step (nan without --check-step)
  {MANIFEST}  physics, version, commit, machine, seconds, digest of the bits
With --analyse, also analyse the landscape exactly (kinds of designs, symmetry,
local optima and climbs, ruggedness, neutrality, robustness to one error; a
design that diverged counts as 0), print the results, and write
  {ANALYSIS}  for programs, with the digest of the landscape's bits
  {DOCUMENT}    for people, with the meaning of every number
  {", ".join(TABLES)}
                 a row per local optimum, symmetry class and design

With --phases 2, 3 or 4, active voxels differ in when they are pumped: digit
2 + p is active, p / P cycles ahead. There are {N_PHASED[2]:,}, {N_PHASED[3]:,} or {N_PHASED[4]:,}
designs; with 4 phases they take half an hour on one core. Results are kept in
the user's cache folder, and an interrupted command continues from there. Above
2 phases the table is {PACKED}, with the same columns, for numpy.load. The
analysis is shorter, and includes which designs the kit can build.
"""

BEST = 10

#: Larger landscapes are not written as CSV.
MOST_ROWS = 10**5


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "landscape",
        help="simulate all 6561 designs and write a table",
        description=DESCRIPTION,
        usage="softvox landscape [--out DIR] [--analyse] [--phases P] [options]",
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
    parser.add_argument("--analyse", action="store_true", help="also print and write an analysis")
    parser.add_argument(
        "--check-step",
        action="store_true",
        help="also simulate at half the time step, and report the change",
    )
    parser.add_argument(
        "--phases",
        type=whole_number,
        default=1,
        metavar="P",
        help="number of phases of active voxels, 1 to 4 (default: 1)",
    )
    add_threads(parser)
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check that the result can be written, then compute, write and summarise it."""
    physics = physics_of(args)
    if args.phases > 1:
        return _run_phased(args, physics)
    names = [*FILES, *ANALYSIS_FILES] if args.analyse else FILES
    with bad_input("--out"):
        check_folder(args.out, names, force=args.force)
    with bad_input(), Progress(sys.stderr, quiet=args.quiet) as progress:
        origin = provenance(threads=args.threads)
        wall, cpu = time.perf_counter(), time.process_time()
        table = compute(
            physics, check_step=args.check_step, threads=args.threads, progress=progress
        )
    seconds = {"seconds": time.perf_counter() - wall, "cpu_seconds": time.process_time() - cpu}
    manifest = {**origin, "arguments": args.arguments, **facts(table), **seconds}
    texts = {TABLE: table.section().csv(), MANIFEST: as_json(manifest)}
    shown = [summary(table, manifest)]
    if args.check_step:
        shown.append(step_section(table["step_error"]))
    if args.analyse:
        analysis = analyse(table["fitness"])
        # A later landscape written here with --force leaves these files; the digest then shows
        # that they belong to another one.
        data = {name: manifest[name] for name in ("version", "commit", "digest")}
        texts |= {ANALYSIS: as_json({**data, **analysis.to_dict()}), DOCUMENT: analysis.markdown()}
        texts |= analysis.tables()
        shown.append(analysis.text())
    with bad_input("--out"):
        write_folder(args.out, texts, force=args.force)
    print("\n\n".join([*shown, f"wrote into {args.out}: {', '.join(names)}"]))
    return 0


def _run_phased(args: Namespace, physics: Physics) -> int:
    """Do the same with several phases, using a landscape that ships or is in the cache."""
    if args.check_step:
        raise BadInputError(
            "--check-step works with one phase only; leave out --check-step or --phases"
        )
    try:
        lattice = phased_lattice(args.phases)
    except ValueError as error:
        raise BadInputError(f"--{error}") from error
    packed = lattice.n_designs > MOST_ROWS
    names = [PACKED if packed else TABLE, MANIFEST, *([ANALYSIS, DOCUMENT] * args.analyse)]
    with bad_input("--out"):
        check_folder(args.out, names, force=args.force)
    with bad_input(), Progress(sys.stderr, quiet=args.quiet) as progress:
        origin = provenance(threads=args.threads)
        table = phased(Reality.of(physics), lattice, threads=args.threads, progress=progress)
    found = {"phases": lattice.phases, **facts(table)}
    shown = [best_section(table).text(), f"{len(table)} designs, digest {found['digest']}"]
    expected = json.loads((COMPUTED / PHASED_DIGESTS).read_text("utf-8")).get(str(lattice.phases))
    if expected and physics == Physics.published():
        if expected != found["digest"]:
            raise BadInputError(
                f"the landscape differs from the published one, whose digest is {expected}; if "
                f"{cache_path(physics, lattice)} exists, delete it and try again"
            )
        shown[-1] += ", which is the published one"
    table_file = _packed(table) if packed else table.section().csv()
    contents: dict[str, bytes | str] = {names[0]: table_file}
    contents[MANIFEST] = as_json({**origin, "arguments": args.arguments, **found})
    if args.analyse:
        analysis = analyse_phased(table["fitness"], lattice)
        data = {name: {**origin, **found}[name] for name in ("version", "commit", "digest")}
        contents[ANALYSIS] = as_json({**data, **analysis.to_dict()})
        contents[DOCUMENT] = analysis.markdown()
        shown.append(analysis.text())
    with bad_input("--out"):
        write_folder(args.out, contents, force=args.force)
    print("\n\n".join([*shown, f"wrote into {args.out}: {', '.join(names)}"]))
    return 0


def _packed(table: Table) -> bytes:
    """Return a table's columns, except the digits, as an archive."""
    columns = {name: table[name] for name in table.dtype.names or () if name != "digits"}
    return archive_of(columns, zipfile.ZIP_DEFLATED)


def facts(table: Table) -> dict[str, Any]:
    """Return the manifest's facts about the table itself."""
    names = ["design", "digits", "fitness"]
    best = [dict(zip(names, row, strict=True)) for row in ranking(table)[:1][names].tolist()]
    assert table.physics is not None
    return {
        "physics": table.physics.to_dict(),
        "n_designs": len(table),
        "n_diverged": int(table["diverged"].sum()),
        "best": best[0] if best else None,
        "digest": digest(np.stack([table[name] for name in AXES], axis=1)),
    }


def ranking(table: Table) -> Table:
    """Return the designs that did not diverge, best first; ties by number."""
    order = np.argsort(-table["fitness"], kind="stable")
    return Table.of(table[order[~table["diverged"][order]]], table.physics)


def step_section(error: NDArray[np.float64]) -> str:
    """Return a sentence about the changes of fitness at half the time step."""
    known = error[~np.isnan(error)]
    counts = " and ".join(
        f"{int((known > least).sum())} by more than {least:g}" for least in (0.1, 1)
    )
    median = float(np.median(known)) if len(known) else float("nan")
    return (
        f"at half the time step the fitness of designs changes: of {counts} voxel widths, the "
        f"median {median:.3f}"
    )


def as_json(values: dict[str, Any]) -> str:
    """Return values as JSON, in the format of a landscape's files."""
    return json.dumps(values, indent=2, allow_nan=False) + "\n"


def best_section(table: Table) -> Section:
    """Return the table of the ten best designs."""
    names = ("design", "digits", "fitness", "dx", "dy")
    best = enumerate(ranking(table)[:BEST][list(names)].tolist(), start=1)
    columns = [Column(name, name) for name in ("rank", *names[:2])]
    columns += [Column(name, name, ".4f") for name in names[2:]]
    return Section(columns=columns, rows=[(rank, *row) for rank, row in best])


def summary(table: Table, manifest: dict[str, Any]) -> str:
    """Return the ten best designs, and the time compared with the paper's."""
    times = PAPER_CPU_HOURS * 3600 / manifest["cpu_seconds"]
    diverged = manifest["n_diverged"]
    lost = f", of which {diverged} diverged" if diverged else ""
    effort = "{cpu_seconds:.1f} CPU-seconds, {instruction_set}, {threads} threads".format(
        **manifest
    )
    return f"""\
{best_section(table).text()}

{len(table)} designs in {manifest["seconds"]:.1f} s{lost} ({effort})
the paper's {PAPER_CPU_HOURS} CPU-hours are {float(f"{times:.2g}"):,.10g} times that"""
