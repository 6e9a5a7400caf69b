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

#: The most failed runs to name; failed.csv has all.
MOST_NAMED = 5

DESCRIPTION = """\
Run an experiment that compares searchers or transfer methods, and write into a
folder, by default results/NAME for NAME.toml: a file per run (runs/), a summary
of all runs (runs.csv), and the report (report.md).

Only runs that are missing in the folder are done. So after any interruption the
same command continues, and searchers, seeds or physics that you add to
FILE.toml are added to the results. First, some finished runs, at least one of
every searcher or method, are repeated, and must give the same bits. If a run
raises an error, it is named, the others continue, and the exit status is 1; the
same command tries it again.

Your own searchers, methods and wrappers, package.module:Class, may be installed
packages, or modules on PYTHONPATH, in the current folder or in the folder of
FILE.toml. What they print goes to standard error.
"""

KEYS = """\
  seeds          runs per searcher, problem and policy
  entropy        a whole number from which all random streams derive (0)
  title          title of the report (the name of the file)
  [budget]       limits of each run, which ends at the first one reached: unique
                 (different designs; under noise every evaluation counts),
                 evaluations (including repeated ones; 20 times unique), steps
                 (of simulation), cpu_seconds (of the searcher and the engine;
                 such runs can't be repeated bit by bit)
  physics        the name of a preset, a table of parameters, which may have a
                 label, or a list of these ("published")
  shape          shape of the lattice, or a list of shapes ([2, 2, 2])
  phases         number of phases of active voxels (1): digit 2 + p is active,
                 p / phases cycles ahead. The optimum is known if the landscape
                 is on this machine; that of 2 phases ships, and
                 "softvox landscape --phases P" computes others
  table          whether to look results up in the exact landscape, if that is
                 known and nothing disturbs the simulation; the bits are the
                 same (true)
  levels         levels of JakobiNoise, which wraps the bare environment unless
                 [[wrappers]] names its place (no noise)
  [[wrappers]]   name (FitnessNoise, JakobiNoise, Resample, or your own as
                 package.module:Class) and the wrapper's arguments; in order
                 from the environment outward
  [[policies]]   name, and remedies against lucky draws under noise:
                 running_mean, reevaluate_parents, final_stage (false),
                 finalists (10), resamples (8)
  [[searchers]]  name (from softvox search --list, or your own as
                 package.module:Class); label (the name); options = {}, in
                 which a list makes one searcher per value; seeds and budget,
                 if they differ from those above
"""

#: The keys of files that compare transfer methods.
METHOD_KEYS = """\
  seeds, entropy, title
                 as above
  tests          tests in reality per run (20)
  measurement_noise
                 standard deviation of measured dx and dy, voxel widths (0)
  realities      a list of names from softvox reality --list, or of "named" for
                 all of these, "public" and "test" for the sets (["named"])
  tasks          a list of displacement and directed (["directed"]); a run of
                 the latter has all four headings
  [[methods]]    name (from softvox transfer --list, or your own as
                 package.module:Class); label (the name); options = {}, in
                 which a list makes one method per value; seeds, tests and
                 realities, if they differ from those above
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
Keys of FILE.toml, with defaults in parentheses:
{KEYS}
For example:
{indent(EXAMPLE, "  ")}
A file with [[methods]] compares transfer methods (softvox_search.transfer):
{METHOD_KEYS}
To use many machines, let each do a part of the runs, then merge the parts:
  softvox compare FILE.toml --part 3/16 --out parts/3
  softvox merge parts/* --out results/all
or use the workers of a Dask cluster (docs/cluster.md):
  softvox compare FILE.toml --scheduler tcp://10.0.0.1:8786
  softvox compare FILE.toml --scheduler slurm --jobs 16
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "compare",
        help="run an experiment that compares searchers or transfer methods",
        description=DESCRIPTION,
        epilog=EPILOG,
        usage="softvox compare FILE.toml [--out DIR] [--workers N] [options]",
    )
    parser.add_argument("file", type=Path, metavar="FILE.toml", help="describes the experiment")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="DIR",
        help=f"folder of results (default: {RESULTS}/NAME for NAME.toml)",
    )
    parser.add_argument(
        "--workers", type=whole_number, metavar="N", help="number of processes (default: all cores)"
    )
    parser.add_argument(
        "--scheduler",
        type=scheduler,
        metavar="WHERE",
        help="run on a Dask cluster: tcp://HOST:PORT, the address of its scheduler; local, started "
        "here with --workers workers; or slurm, started in --jobs jobs",
    )
    parser.add_argument(
        "--jobs",
        type=whole_number,
        metavar="N",
        help="jobs of --scheduler slurm, each as dask-jobqueue is configured (default: 1)",
    )
    parser.add_argument(
        "--part",
        type=part,
        metavar="K/N",
        help="do only the K-th of N parts of the runs, without a report",
    )
    parser.add_argument(
        "--force", action="store_true", help="delete earlier results in the folder first"
    )
    only = parser.add_mutually_exclusive_group()
    only.add_argument("--no-report", action="store_true", help="write no report")
    only.add_argument(
        "--report-only", action="store_true", help="only write the report, on the runs there are"
    )
    only.add_argument("--check", action="store_true", help="only repeat some finished runs")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    parser.set_defaults(run=run, parser=parser)


def part(text: str) -> tuple[int, int]:
    """Read a part of the runs, "3/16"."""
    found = re.fullmatch(r"(\d{1,6})/(\d{1,6})", text)
    if not found or not 1 <= int(found[1]) <= int(found[2]):
        raise argparse.ArgumentTypeError(f"must be K/N with K from 1 to N, as 3/16, got {text!r}")
    return int(found[1]), int(found[2])


def scheduler(text: str) -> str:
    """Check the address of a Dask scheduler, or "local" or "slurm"."""
    if text not in ("local", "slurm") and not re.fullmatch(r"\w+://.+:\d+/?", text):
        raise argparse.ArgumentTypeError(
            f"must be local, slurm or an address as tcp://10.0.0.1:8786, got {text!r}"
        )
    return text


def run(args: Namespace) -> int:
    """Check everything, do the missing runs, and write the summary; 1 if a run failed."""
    if args.workers and args.scheduler not in (None, "local"):
        raise BadInputError(
            "--workers is for processes on this machine; leave it out with --scheduler "
            f"{args.scheduler}"
        )
    if args.jobs and args.scheduler != "slurm":
        raise BadInputError("--jobs needs --scheduler slurm; give that as well")
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
        raise BadInputError(
            f"{folder} doesn't exist, so no runs can be repeated; leave out --check"
        )
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
    """Yield a function that does runs on the requested cluster; None if there is none."""
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
    again = f"{outcome.repeated} finished runs were repeated and gave the same bits"
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
    """Return the command that reproduces the results, however the path was spelt."""
    path, here = file.resolve(), Path.cwd()
    shown = path.relative_to(here).as_posix() if path.is_relative_to(here) else path.name
    return f"softvox compare {shown}"
