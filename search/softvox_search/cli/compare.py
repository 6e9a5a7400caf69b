"""softvox compare: an experiment from its file into a folder of results."""

from __future__ import annotations

import os
import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from textwrap import indent
from typing import TYPE_CHECKING, Any

from softvox_gym.cli.parser import whole_number
from softvox_gym.cli.signals import Stopped
from softvox_gym.cli.terminal import BadInputError, bad_input, complain
from softvox_gym.engine import default_threads
from softvox_gym.files import OutputError, check_folder
from softvox_gym.progress import Progress
from softvox_search.cli.own_code import look_in, prints_aside
from softvox_search.experiment.keys import EXAMPLE, KEYS

if TYPE_CHECKING:
    from softvox_search.experiment.compare import Outcome, Plan
    from softvox_search.experiment.config import Experiment

RESULTS = Path("results")

#: As many failed runs are named; all are in failed.csv.
MOST_NAMED = 5

DESCRIPTION = """\
Run an experiment, a comparison of searchers, and write into a folder,
results/NAME for NAME.toml unless --out says otherwise,
  evaluations.parquet  every evaluation of every run
  runs.csv             a summary of each run
  improvements.csv     when each run came upon something better
  report.md            the report, with the folders tables and figures
  manifest.json        configuration, versions, commit, machine, times
  failed.csv           runs that raised an error, if any

Killed at any moment, the same command goes on where it was, and the results
are the same bits; all but manifest.json are so on every repetition. A run
that raises an error is named and left out, the others go on, and the exit
status is 1; the same command tries it again.

Searchers and wrappers of your own, package.module:Class, are looked for among
what is installed, on PYTHONPATH, in the current folder and in that of
FILE.toml. What they print goes to standard error.
"""

KEPT = "what is done is kept; the same command goes on"

EPILOG = f"""\
FILE.toml, with what holds where a key is left out in brackets:
{KEYS}
for example:
{indent(EXAMPLE, "  ")}"""


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
        "--force", action="store_true", help="throw earlier results in that folder away"
    )
    only = parser.add_mutually_exclusive_group()
    only.add_argument("--no-report", action="store_true", help="write no report")
    only.add_argument(
        "--report-only",
        action="store_true",
        help="make the report anew from results that are there",
    )
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check everything, run what is left to run, and sum it up; 1 where a run failed."""
    look_in(Path.cwd(), args.file.parent)
    with _one_line():
        from softvox_search.experiment.config import read

        experiment = read(args.file)
    folder: Path = args.out or RESULTS / experiment.name
    if args.report_only:
        return _report_only(experiment, folder, _command(args.file))
    with _one_line(), prints_aside():
        from softvox_search.experiment.checks import check

        check(experiment, args.file)
    _make(folder)
    return _compare(args, experiment, folder)


def _compare(args: Namespace, experiment: Experiment, folder: Path) -> int:
    from softvox_search.experiment.compare import Plan, compare

    plan = Plan(
        command=_command(args.file),
        arguments=args.arguments,
        workers=args.workers or default_threads(),
        force=args.force,
        report=not args.no_report,
    )
    try:
        with (
            _one_line(),
            _writing(folder),
            prints_aside(),
            Progress(sys.stderr, quiet=args.quiet, unit="runs") as progress,
        ):
            outcome = compare(
                experiment,
                folder,
                plan,
                progress=progress,
                say=lambda message: complain("warning", message),
            )
    except Stopped as stop:
        stop.add_note(KEPT)
        raise
    print(summary(experiment, folder, plan, outcome))
    for failure in outcome.failed[:MOST_NAMED]:
        complain("failed", f"{_named(experiment, failure.run)}: {failure.error}")
    return 1 if outcome.failed else 0


def summary(experiment: Experiment, folder: Path, plan: Plan, outcome: Outcome) -> str:
    """Return what was done, in a few lines."""
    lines = []
    if outcome.was_complete:
        lines.append(f"{experiment.name}: all {outcome.total} runs were done already, in {folder}")
    else:
        done = outcome.total - len(outcome.failed)
        before = f" ({outcome.before} of them before)" if outcome.before else ""
        lines.append(
            f"{experiment.name}: {done} of {outcome.total} runs done{before}, "
            f"{outcome.evaluations} evaluations, {outcome.seconds:.1f} s"
        )
    if outcome.failed:
        lines.append(
            f"{len(outcome.failed)} failed, see {folder / 'failed.csv'}; the same command tries "
            "them again"
        )
    if plan.report and not experiment.is_published:
        lines.append("no report: the optimum is known for the physics published only")
    shown = [name for name in outcome.files if "/" not in name]
    if shown:
        lines.append(f"wrote into {_shown(folder, experiment)}: {', '.join(shown)}")
    return "\n".join(lines)


def _shown(folder: Path, experiment: Experiment) -> str:
    """Return a folder, and the default where it isn't that: the report's command goes there."""
    default = RESULTS / experiment.name
    return str(folder) if folder == default else f"{folder} (without --out it is {default})"


def _report_only(experiment: Experiment, folder: Path, command: str) -> int:
    with _one_line(), _writing(folder), prints_aside():
        from softvox_search.experiment.compare import check_report
        from softvox_search.experiment.results import write_report

        check_report(experiment, folder)
        written = write_report(folder, experiment, command)
    shown = ", ".join(name for name in written if "/" not in name)
    print(f"wrote into {_shown(folder, experiment)}: {shown}")
    return 0


@contextmanager
def _one_line() -> Iterator[None]:
    """Turn the errors of an experiment into `BadInputError`."""
    try:
        from softvox_search.experiment.folder import FolderError
        from softvox_search.experiment.journal import JournalError
        from softvox_search.experiment.pool import PoolError
        from softvox_search.experiment.toml_table import ConfigError
    except ModuleNotFoundError as error:
        raise BadInputError(
            f"compare needs {error.name}: pip install 'softvox-gym[search]'"
        ) from error
    try:
        yield
    except (ConfigError, FolderError, JournalError, PoolError, OutputError) as error:
        raise BadInputError(str(error)) from error


@contextmanager
def _writing(folder: Path) -> Iterator[None]:
    """Say of what can't be written where that is, and that nothing done is lost."""
    try:
        yield
    except OutputError as error:
        raise BadInputError(f"{error}; {KEPT}") from error
    except OSError as error:
        why = error.strerror or error
        raise BadInputError(f"cannot write into {folder}: {why}; {KEPT}") from error


def _make(folder: Path) -> None:
    """Make the folder of results, and its parents, where they don't exist."""
    with bad_input("--out"):
        for parent in folder.parents:
            if os.path.lexists(parent) and not parent.is_dir():
                raise OutputError(f"{parent} is not a folder; choose another")
        folder.parent.mkdir(parents=True, exist_ok=True)
        check_folder(folder, (), force=True)
        folder.mkdir(exist_ok=True)


def _command(file: Path) -> str:
    """Return what to type to make the results again, however the path was spelt."""
    path, here = file.resolve(), Path.cwd()
    shown = path.relative_to(here).as_posix() if path.is_relative_to(here) else path.name
    return f"softvox compare {shown}"


def _named(experiment: Experiment, number: int) -> str:
    run = experiment.runs()[number]
    facts = [run.cell.searcher.label]
    if run.cell.level is not None:
        facts.append(f"level {run.cell.level:g}")
    if run.cell.policy:
        facts.append(f"policy {run.cell.policy.name}")
    return f"run {number} ({', '.join(facts)}, seed {run.seed})"
