"""softvox transfer: a method in a reality that it knows from tests alone."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from softvox_gym import MeasuredReality, Reality, reality
from softvox_gym.cli.parser import number, whole_number
from softvox_gym.cli.reality import plain
from softvox_gym.cli.terminal import BadInputError, bad_input, complain
from softvox_gym.cli.trials import add_trials, measured_of
from softvox_gym.files import write_file
from softvox_gym.missing import missing
from softvox_gym.noise import not_negative as finite
from softvox_gym.progress import Progress
from softvox_gym.tasks import HEADINGS, Task
from softvox_search.cli.options import (
    add_method_options,
    check_output,
    name_in_files,
    not_negative,
    options_given,
    print_list,
)
from softvox_search.cli.own_code import look_in, prints_aside, tell_raised

if TYPE_CHECKING:
    from softvox_search.transfer import TransferRun

DESCRIPTION = """\
Run a transfer method, which looks for a design for a reality that it knows from
tests alone. It has the nominal simulator, tests one design after another in
reality, and recommends a design after every test. The output has the regret of
this recommendation: what is lost by building it, as a share of what the best
design in reality is worth, above 1 if it goes the wrong way. The class regret
is the same if the robot may be turned or mirrored before it starts.

The directed task is run for four headings, 0, 90, 180 and 270 degrees, and
averaged, unless --heading gives one. softvox reality --list has the realities.

The picture is written to transfer-METHOD-REALITY-SEED.png, and replaces an
earlier one; --out names another file.

A method of your own, --method package.module:name, is a class with ask, or a
function f(test, simulator, task, rng); docs/transfer.md shows both. It may be
an installed package, or a module on PYTHONPATH or in the current folder. What
it prints goes to standard error.

With --trials DIR, the reality is that of the trials in a folder (softvox
trials), or of some of them, as --surface acrylic selects. Designs that were not
measured can't be tested; if one is recommended, its regret is unknown. Headings
to which no robot goes are left out. All robots, real and simulated, are
compared after as many cycles as the shortest run has; --cycles 90:23 compares
real ones after 90 with simulated ones after 23.
"""

#: The reality if none is named.
DEFAULT = "reversal"

#: The table has a row after so many tests, and after the last.
TOLD = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)

#: Numbers of a run that are also given as means.
MEASURES = (
    *("srcc_before", "srcc_after", "kendall_before", "kendall_after"),
    *("heading_error_before", "heading_error", "distance"),
)


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "transfer",
        help="run a method that finds a design by a few tests in a reality",
        description=DESCRIPTION,
        usage="softvox transfer [--method NAME] [--reality NAME | --trials DIR]\n"
        "                        [--tests N] [options]",
    )
    options: dict[str, dict[str, Any]] = {
        "method": {
            "default": "ite",
            "metavar": "NAME",
            "help": "one of --list, or your own as package.module:name (default: %(default)s)",
        },
        "list": {"action": "store_true", "help": "list the methods with their options"},
        "reality": {
            "metavar": "NAME",
            "help": f"a named reality, or one of a set, as public-0 (default: {DEFAULT})",
        },
        "tests": {
            "type": whole_number,
            "metavar": "N",
            "help": "tests in reality, per heading (default: 20, or as many as were measured)",
        },
        "noise": {
            "type": number,
            "default": 0.0,
            "metavar": "X",
            "help": "standard deviation of measured dx and dy, voxel widths (default: 0)",
        },
        "simulations": {
            "type": not_negative,
            "metavar": "N",
            "help": "maximum number of simulated designs, per heading (default: no limit)",
        },
        "json": {"action": "store_true", "help": "print JSON"},
        "out": {
            "type": Path,
            "metavar": "FILE.png",
            "help": "file of the picture; an existing one is replaced only with --force",
        },
        "no-picture": {"action": "store_true", "help": "draw no picture"},
        "force": {"action": "store_true", "help": "replace FILE.png where it exists"},
        "quiet": {"action": "store_true", "help": "no progress bar"},
    }
    for name, settings in options.items():
        parser.add_argument(f"--{name}", **settings)
    add_method_options(parser, task="directed", heading="the four")
    add_trials(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check everything, run the method, draw, then print."""
    if args.list:
        from softvox_search.transfer.registry import REGISTRY

        print_list(REGISTRY, as_json=args.json)
        return 0
    from softvox_search.single import RaisedError

    where, tasks = _asked(args)
    out = args.out or Path(f"transfer-{name_in_files(args.method)}-{where.name}-{args.seed}.png")
    force = args.force or not args.out
    if not args.no_picture:
        check_output("--out", out, (".png",), force=force)
        draw = _picture()
    look_in(Path.cwd())
    try:
        runs = _runs(args, where, tasks)
    except RaisedError as error:
        return tell_raised(error)
    if not args.no_picture:
        with bad_input("--out"):
            write_file(out, draw(runs, where), force=force)
    facts = _facts(args, where, runs)
    facts["picture"] = None if args.no_picture else str(out)
    print(json.dumps(facts, indent=2, allow_nan=False) if args.json else _text(facts))
    return 0


def _asked(args: Namespace) -> tuple[Reality, list[Task]]:
    """Return the reality and the tasks, and set the tests; BadInputError for invalid options."""
    from softvox_search.transfer.run import number_of_tests

    where = _where(args)
    with bad_input("--task:"):
        task = Task(args.task)
    tasks = [task]
    if args.heading is not None:
        with bad_input("--heading:"):
            tasks = [Task(args.task, args.heading)]
    elif task.heading is not None:
        tasks = [Task(args.task, heading) for heading in HEADINGS]
    with bad_input():
        args.tests = number_of_tests(where, args.tests, name="--tests")
        finite("--noise", args.noise)
    if isinstance(where, MeasuredReality):
        tasks = _answerable(where, tasks)
    return where, tasks


def _where(args: Namespace) -> Reality:
    """Return the reality that the options name."""
    if args.reality is not None and args.trials:
        raise BadInputError("give either --reality or --trials, not both")
    if (made := measured_of(args)) is not None:
        return made
    with bad_input("--reality:"):
        return reality(DEFAULT if args.reality is None else args.reality)


def _answerable(where: MeasuredReality, tasks: Sequence[Task]) -> list[Task]:
    """Return the tasks in which a measured robot got anywhere: in others all regret is unknown."""
    made = [task for task in tasks if np.nanmax(task.reward(where.displacement)) > 0]
    lost = [task.heading for task in tasks if task not in made]
    way = "anywhere" if None in lost else f"towards {', '.join(f'{one:g}' for one in lost)} degrees"
    words = f"no robot of --trials goes {way}"
    if not made:
        raise BadInputError(
            f"{words}, so the regret is unknown; give other trials, or another --heading"
        )
    if lost:
        complain("warning", f"{words}; left out")
    return made


def _runs(args: Namespace, where: Reality, tasks: Sequence[Task]) -> list[TransferRun]:
    """Run the method once per task."""
    from softvox_search import SearcherError
    from softvox_search.single import RaisedError
    from softvox_search.transfer import SimulationBudgetError
    from softvox_search.transfer.run import prepared

    options, runs = options_given(args.option), []
    try:
        with prints_aside(), Progress(sys.stderr, quiet=args.quiet, unit="runs") as progress:
            for done, task in enumerate(tasks):
                progress(done, len(tasks))
                try:
                    ready = prepared(
                        args.method,
                        options,
                        reality=where,
                        task=task,
                        tests=args.tests,
                        seed=args.seed,
                        measurement_noise=args.noise,
                        simulations=args.simulations,
                    )
                except (TypeError, ValueError) as error:
                    raise BadInputError(f"--method {args.method}: {error}") from error
                runs.append(ready())
    except ImportError as error:
        raise BadInputError(missing(f"method {args.method}", error)) from error
    except (SearcherError, SimulationBudgetError) as error:
        raise BadInputError(str(error)) from error
    except (BadInputError, MemoryError):
        raise
    except (Exception, SystemExit) as error:
        raise RaisedError(f"method {args.method} raised {type(error).__name__}: {error}") from error
    return runs


def _picture() -> Callable[[Sequence[TransferRun], Reality], bytes]:
    """Return a function that draws, as PNG; BadInputError if a library is missing."""
    try:
        from softvox_search.report import style
        from softvox_search.report.crossing import picture
    except ImportError as error:
        needs = missing("the picture", error)
        raise BadInputError(f"{needs}; or give --no-picture") from error
    from softvox_search.transfer.run import truth

    def draw(runs: Sequence[TransferRun], where: Reality) -> bytes:
        simulated, real = truth(Reality.of(where.nominal)), truth(where)
        with style.style():
            return style.encoded(picture(runs, simulated, real))

    return draw


def _facts(args: Namespace, where: Reality, runs: Sequence[TransferRun]) -> dict[str, Any]:
    """Return the results, ready for JSON."""
    rows = [
        {
            "heading": run.task.heading,
            **{
                name: [plain(value) for value in getattr(run, name).tolist()]
                for name in ("tested", "rewards", "recommended", "regret", "class_regret")
            },
            **{name: plain(getattr(run, name)) for name in MEASURES},
            "is_specified": run.is_specified,
            "simulations": run.simulations,
        }
        for run in runs
    ]
    known = {name: [row[name] for row in rows if row[name] is not None] for name in MEASURES}
    return {
        "method": args.method,
        "options": options_given(args.option),
        "reality": where.name,
        "task": runs[0].task.name,
        "tests": args.tests,
        "seed": args.seed,
        "noise": args.noise,
        **_lost_or_tried(where),
        "runs": rows,
        "mean": {
            **{
                name: [
                    plain(value)
                    for value in np.mean([getattr(run, name) for run in runs], axis=0).tolist()
                ]
                for name in ("regret", "class_regret")
            },
            **{name: float(np.mean(kept)) if kept else None for name, kept in known.items()},
        },
    }


def _lost_or_tried(where: Reality) -> dict[str, Any]:
    """Return how many designs diverge in a reality, or what is known about one made of trials."""
    if not isinstance(where, MeasuredReality):
        return {"diverged": int(where.landscape()["diverged"].sum())}
    known = {
        "about": where.about,
        "source": where.measured[0].source,
        "designs": where.designs.tolist(),
        "cycles": where.cycles,
        "simulated_cycles": where.simulated_cycles,
    }
    return {"diverged": 0, "trials": known}


def _text(facts: dict[str, Any]) -> str:
    """Return the results as text."""
    rows, mean = facts["runs"], facts["mean"]
    headings = ", ".join(f"{row['heading']:g}" for row in rows if row["heading"] is not None)
    task = facts["task"] + (f" along {headings} degrees" if headings else "")
    average = f", the mean of {len(rows)}" if len(rows) > 1 else ""
    lines = [
        f"{facts['method']} in {facts['reality']}, {task}; seed {facts['seed']}",
        "",
        f"{'tests':>6}{'regret':>8}{'class regret':>14}   recommended{average and ', in turn'}",
    ]
    for tests in sorted({*(n for n in TOLD if n < facts["tests"]), facts["tests"]}):
        at = tests - 1
        designs = "".join(f"{row['recommended'][at]:>6}" for row in rows)
        regrets = f"{_told(mean['regret'][at]):>8}{_told(mean['class_regret'][at]):>14}"
        lines.append(f"{tests:>6}{regrets}  {designs}")
    said = {
        "regret": f"a share of what the best is worth{average}",
        "heading error": _both(mean["heading_error_before"], mean["heading_error"], ".0f", " deg"),
        "Kendall's tau": _both(mean["kendall_before"], mean["kendall_after"], ".2f"),
        "nearest model": "the method has none"
        if mean["distance"] is None
        else f"off by {mean['distance']:.2f} of the distance that designs travel",
        "specified": "yes, the models vary all parameters that differ"
        if all(row["is_specified"] for row in rows)
        else "no, the models don't vary everything that differs",
        "simulations": ", ".join(str(row["simulations"]) for row in rows),
    }
    if "trials" in facts:
        known = facts["trials"]
        said["trials"] = fill(" " * 15 + known["about"], 80, subsequent_indent=" " * 15).lstrip()
        said["cycles"] = (
            f"{known['cycles']:g} of the robots, {known['simulated_cycles']:g} simulated"
        )
        said["specified"] = "unknown, as it is not known what differs"
        if None in (*mean["regret"], *mean["class_regret"]):
            said["unknown"] = "regret of designs that were not measured"
        elif facts["tests"] == len(known["designs"]):
            said["unknown"] = "errors, as every measured design was tested"
    if facts["diverged"]:
        said["diverged"] = f"{facts['diverged']} designs in {facts['reality']}; their reward is 0"
    ended = [f"after {len(row['tested'])}" for row in rows if len(row["tested"]) < facts["tests"]]
    if ended:
        said["ended"] = f"by the method, {', '.join(ended)} of {facts['tests']} tests"
    if facts["picture"]:
        said["picture"] = facts["picture"]
    return "\n".join([*lines, "", *(f"{name:15}{text}" for name, text in said.items())])


def _told(regret: float | None) -> str:
    return "unknown" if regret is None else f"{regret:.2f}"


def _both(before: float | None, after: float | None, form: str, unit: str = "") -> str:
    """Return a number for the simulator's and for the method's expectations."""
    first, second = ("unknown" if one is None else f"{one:{form}}{unit}" for one in (before, after))
    return f"{first} for the simulator, {second} for the method at the end"
