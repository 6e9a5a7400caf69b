"""softvox compare: an experiment from its file into a folder of results."""

from __future__ import annotations

import argparse
import re
import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING, Any

from softvox_gym.cli.parser import whole_number
from softvox_gym.cli.terminal import BadInputError, complain
from softvox_gym.engine import default_threads
from softvox_gym.progress import Progress
from softvox_search.cli.own_code import look_in, prints_aside
from softvox_search.cli.results import check_report, make_folder, needs, report, warn, writing

if TYPE_CHECKING:
    from softvox_search.experiment.compare import DoAll, Outcome, Part

RESULTS = Path("results")

#: As many failed runs are named; all are in failed.csv.
MOST_NAMED = 5

DESCRIPTION = """\
Run an experiment, a comparison of searchers or of transfer methods, and write
into a folder, results/NAME for NAME.toml unless --out says otherwise: a file
per run (runs/), a summary of each (runs.csv), and the report (report.md).

Only runs that are missing there are done: killed at any moment, the same
command goes on where it was, and searchers, seeds or physics added to
FILE.toml are added to the results. Before that some finished runs, one of
every searcher or method at least, are done again, and must give the same bits.
A run that raises an error is named, the others go on, and the exit status is 1;
the same command tries it again.

Searchers, methods and wrappers of your own, package.module:Class, are looked
for among what is installed, on PYTHONPATH, in the current folder and in that
of FILE.toml. What they print goes to standard error.
"""

KEYS = """\
  seeds          runs per searcher, problem and policy
  entropy        a whole number; all random streams derive from it (0)
  title          of the report (the name of the file)
  [budget]       of each run: unique (different designs; under noise every
                 evaluation counts), evaluations (all; 20 times unique), steps
                 (simulated), cpu_seconds (of the searcher and the engine; such
                 runs are not repeatable); the first that is used up ends it
  physics        a preset's name, a table of parameters, with a label if you
                 like, or a list of such ("published")
  shape          of the lattice, or a list of such ([2, 2, 2])
  phases         of active voxels (1): digit 2 + p is active, p / phases cycles
                 ahead; the regret is known where the landscape is on this
                 machine: that of 2 ships, "softvox landscape --phases P" makes
                 others, and from those, too, the table answers
  table          whether the exact table answers where nothing disturbs the
                 simulation, with the same bits (true)
  levels         of JakobiNoise, which is put around the bare environment, or is
                 where [[wrappers]] names it; left out, there is no such noise
  [[wrappers]]   name (FitnessNoise, JakobiNoise, Resample, or your own as
                 package.module:Class) and the wrapper's arguments; from the
                 environment outward
  [[policies]]   name, and switches against luck under noise: running_mean,
                 reevaluate_parents, final_stage (false), finalists (10),
                 resamples (8)
  [[searchers]]  name (from softvox search --list, or your own as
                 package.module:Class); label (the name); options = {}, where a
                 list makes a searcher of each of its values; seeds and budget
                 where they differ from the others'
"""

#: Of the other kind of file.
METHOD_KEYS = """\
  seeds, entropy, title
                 as above
  tests          in reality, of each run (20)
  measurement_noise
                 of dx and dy in a test, voxel widths (0)
  realities      a list of names, softvox reality --list has them; named stands
                 for all of these, public and test for the sets (["named"])
  tasks          of displacement, directed (["directed"]); all four headings of
                 the latter are in one run
  [[methods]]    name (from softvox transfer --list, or your own as
                 package.module:Class); label (the name); options = {}, where a
                 list makes a method of each of its values; seeds, tests and
                 realities where they differ from the others'
"""

#: A small experiment.
EXAMPLE = """\
seeds = 10
[budget]
unique = 500
[[searchers]]
name = "random"
[[searchers]]
name = "ga"
options = { population = [20, 50] }
"""

EPILOG = f"""\
FILE.toml, with what holds where a key is left out in brackets:
{KEYS}
for example:
{indent(EXAMPLE, "  ")}
A file with [[methods]] compares transfer methods (softvox_search.transfer):
{METHOD_KEYS}
On many machines at once, each a part of the runs, then put together:
  softvox compare FILE.toml --part 3/16 --out parts/3
  softvox merge parts/* --out results/all
or by the workers of a Dask cluster (docs/cluster.md):
  softvox compare FILE.toml --scheduler tcp://10.0.0.1:8786
  softvox compare FILE.toml --scheduler slurm --jobs 16
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "compare",
        help="run an experiment: searchers against each other",
        description=DESCRIPTION,
        epilog=EPILOG,
        usage="softvox compare FILE.toml [--out DIR] [--workers N] [options]",
    )
    parser.add_argument("file", type=Path, metavar="FILE.toml", help="the experiment")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help=f"folder of results (default: {RESULTS}/NAME for NAME.toml)",
    )
    parser.add_argument(
        "--workers", type=whole_number, metavar="N", help="processes (default: all cores)"
    )
    parser.add_argument(
        "--scheduler",
        type=scheduler,
        metavar="WHERE",
        help="let a Dask cluster do the runs: tcp://HOST:PORT, where its scheduler is; local, "
        "started here with so many workers; slurm, started in jobs",
    )
    parser.add_argument(
        "--jobs",
        type=whole_number,
        metavar="N",
        help="of --scheduler slurm, each as dask-jobqueue is configured (default: 1)",
    )
    parser.add_argument(
        "--part", type=part, metavar="K/N", help="only the K-th of N parts of the runs, no report"
    )
    parser.add_argument(
        "--force", action="store_true", help="throw earlier results in that folder away"
    )
    only = parser.add_mutually_exclusive_group()
    only.add_argument("--no-report", action="store_true", help="write no report")
    only.add_argument(
        "--report-only", action="store_true", help="make the report anew from what is there"
    )
    only.add_argument("--check", action="store_true", help="only do some finished runs again")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    parser.set_defaults(run=run, parser=parser)


def part(text: str) -> tuple[int, int]:
    """Read a part of the runs, "3/16"."""
    found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text)
    if not found or not 1 <= int(found[1]) <= int(found[2]):
        raise argparse.ArgumentTypeError(f"must be K/N with K from 1 to N, as 3/16, got {text!r}")
    return int(found[1]), int(found[2])


def scheduler(text: str) -> str:
    """Read where a Dask scheduler is."""
    if text not in ("local", "slurm") and not re.fullmatch(r"\w+://.+:\d+/?", text):
        raise argparse.ArgumentTypeError(
            f"must be local, slurm or an address as tcp://10.0.0.1:8786, got {text!r}"
        )
    return text


def run(args: Namespace) -> int:
    """Check everything, run what is left to run, and sum it up; 1 where a run failed."""
    if args.workers and args.scheduler not in (None, "local"):
        raise BadInputError(
            f"--workers is of processes on this machine; those of {args.scheduler} have theirs"
        )
    if args.jobs and args.scheduler != "slurm":
        raise BadInputError("--jobs goes with --scheduler slurm")
    look_in(Path.cwd(), args.file.parent)
    with needs("compare"):
        from softvox_search.experiment.compare import compare
        from softvox_search.experiment.environments import check
        from softvox_search.experiment.schema import read
    experiment = read(args.file)
    folder: Path = args.out or RESULTS / args.file.stem
    has_report = not (args.no_report or args.check or args.part)
    if has_report:
        check_report()
    if args.report_only:
        with writing(folder):
            print(f"wrote into {folder}: {', '.join(report(folder))}")
        return 0
    with prints_aside(), Progress(sys.stderr, quiet=args.quiet, unit="preparations") as progress:
        check(experiment, str(args.file), progress)
    if not args.check:
        make_folder(folder)
    elif not folder.is_dir():
        raise BadInputError(f"{folder} is not there, and has no finished runs to do again")
    options = {"part": args.part, "check": args.check}
    workers = args.workers or default_threads()
    with writing(folder):
        with (
            prints_aside(),
            _cluster(args, experiment, workers) as cluster,
            Progress(sys.stderr, quiet=args.quiet, unit="runs") as progress,
        ):
            outcome = compare(
                experiment,
                folder,
                command=_command(args.file),
                workers=workers,
                cluster=cluster,
                force=args.force,
                progress=progress,
                say=warn,
                **options,
            )
        if has_report and outcome.is_whole:
            outcome.files += report(folder)
    print(summary(experiment.title, folder, outcome, **options))
    for failed, failure in outcome.failed[:MOST_NAMED]:
        complain("failed", f"run {failure.run[:16]} ({failed}): {failure.error}")
    return 1 if outcome.failed else 0


@contextmanager
def _cluster(args: Namespace, experiment: Any, workers: int) -> Iterator[DoAll | None]:
    """Yield what does runs on the cluster asked for; None where there is none."""
    if args.scheduler is None:
        yield None
        return
    from softvox_search.experiment.cluster import connected, do_all

    try:
        import distributed  # noqa: F401

        if args.scheduler == "slurm":
            import dask_jobqueue  # noqa: F401
    except ModuleNotFoundError as error:
        raise BadInputError(
            f"--scheduler {args.scheduler} needs {(error.name or '').replace('_', '-')}: "
            "pip install 'softvox-gym[cluster]'"
        ) from error
    folders = [str(folder.resolve()) for folder in (Path.cwd(), args.file.parent)]
    with connected(args.scheduler, workers=workers, jobs=args.jobs or 1) as client:
        yield partial(do_all, client=client, experiment=experiment, folders=folders, say=warn)


def summary(
    title: str, folder: Path, outcome: Outcome, *, part: Part | None = None, check: bool = False
) -> str:
    """Return what was done, in a few lines."""
    again = f"{outcome.repeated} finished runs done again gave the same bits"
    if outcome.unrepeatable:
        again += f"; {outcome.unrepeatable} can't be repeated, as their budget is in CPU seconds"
    if check:
        return f"{title}: {again}, in {folder}"
    of_part = " of part {}/{}".format(*part) if part else ""
    if outcome.before == outcome.total:
        lines = [f"{title}: all {outcome.total} runs{of_part} were done already, in {folder}"]
    else:
        done = outcome.total - outcome.missing
        before = f" ({outcome.before} of them before)" if outcome.before else ""
        lines = [
            f"{title}: {done} of {outcome.total} runs{of_part} done{before}, "
            f"{outcome.seconds:.1f} s"
        ]
    if outcome.repeated or outcome.unrepeatable:
        lines.append(again)
    if outcome.failed:
        table = next(name for name in outcome.files if name.startswith("failed"))
        lines.append(
            f"{len(outcome.failed)} failed, see {folder / table}; the same command tries them again"
        )
    if part:
        lines.append("no report on a part; softvox merge puts parts together and makes it")
    if outcome.files:
        lines.append(f"wrote into {folder}: {', '.join(outcome.files)}")
    return "\n".join(lines)


def _command(file: Path) -> str:
    """Return what to type to make the results again, however the path was spelt."""
    path, here = file.resolve(), Path.cwd()
    shown = path.relative_to(here).as_posix() if path.is_relative_to(here) else path.name
    return f"softvox compare {shown}"
