"""softvox search: one run of one searcher."""

from __future__ import annotations

import json
import sys
from argparse import Namespace
from math import inf
from pathlib import Path
from typing import Any

from softvox_gym.cli.parser import add_physics, number, physics_of, whole_number
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.design import Design
from softvox_gym.files import write_file
from softvox_gym.landscapes.noisy import LEVELS
from softvox_gym.lattice import Lattice
from softvox_gym.progress import Progress
from softvox_search.cli.options import (
    check_output,
    name_in_files,
    not_negative,
    options_given,
    print_list,
)
from softvox_search.cli.own_code import look_in, prints_aside, tell_raised
from softvox_search.registry import REGISTRY

KNOWN = ", ".join(f"{level:g}" for level in LEVELS)

DESCRIPTION = """\
Run a searcher that looks for the fittest robot, and compare the design that it
recommends with all 6561: its fitness, its regret (the difference to the best),
its rank, and when it was found. On another lattice (--shape) the best is not
known, and regret and rank are left out. With --phases 2 it is known, with more
phases once you have run "softvox landscape --phases P".

With --noise every evaluation is a new draw, and "believed" is the fitness that
the searcher expects of its recommendation. --running-mean, --reevaluate-parents
and --final-stage are remedies against lucky draws.

A picture of the robot after its run is written to search-NAME-SEED.png, or
search-NAME-SEED-noise-LEVEL.png with --noise, and replaces an earlier one;
--picture names another file.

A searcher of your own, --searcher package.module:name, is a class with ask or a
function f(evaluate, space, rng). It may be an installed package, or a module on
PYTHONPATH or in the current folder. What it prints goes to standard error.
"""

SWITCHES = ("running_mean", "reevaluate_parents", "final_stage")

HELP = {
    "option": "an option of the searcher, with a TOML value; may be given several times",
    "shape": "shape of the lattice, as 3 3 3 or 3x3x3 (default: 2x2x2)",
    "phases": "number of phases, 1 to 8: digit 2 + p is active, p / P cycles ahead (default: 1)",
    "seed": "seed of all random numbers (default: 0)",
    "budget": "number of different designs; with noise, of evaluations (default: %(default)s)",
    "evaluations": "maximum number of evaluations, including repeated ones (default: 20 times the "
    "budget)",
    "noise": "level of JakobiNoise; 1 is the assumed reality. The true values under noise are "
    f"known for {KNOWN}",
    "running_mean": "with noise: report the mean of all draws of a design to the searcher",
    "reevaluate_parents": "with noise: evaluate parents again in every generation",
    "final_stage": "with noise: spend the end of the budget on the ten best",
    "json": "print JSON",
    "out": "also save every evaluation, as .csv or .parquet",
    "picture": "file of the picture; an existing one is replaced only with --force",
    "no_picture": "draw no picture",
    "force": "replace existing files named by --out or --picture",
    "quiet": "no progress bar",
}


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "search",
        help="run one searcher, and report the best robot that it finds",
        description=DESCRIPTION,
        usage="softvox search --searcher NAME [--seed N] [--budget N] [options]",
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument(
        "--searcher", metavar="NAME", help="one of --list, or your own as package.module:name"
    )
    what.add_argument("--list", action="store_true", help="list the searchers with their options")
    whole = {"type": whole_number, "metavar": "N"}
    options: dict[str, dict[str, Any]] = {
        "option": {"action": "append", "default": [], "metavar": "KEY=VALUE"},
        "shape": {**whole, "nargs": 3, "default": (2, 2, 2), "metavar": ("NX", "NY", "NZ")},
        "phases": {**whole, "default": 1, "metavar": "P"},
        "seed": {"type": not_negative, "default": 0, "metavar": "N"},
        "budget": {**whole, "default": 500},
        "evaluations": whole,
        "noise": {"type": number, "metavar": "LEVEL"},
        "out": {"type": Path, "metavar": "FILE"},
        "picture": {"type": Path, "metavar": "FILE.png"},
    }
    for name, text in HELP.items():
        kind = options.get(name, {"action": "store_true"})
        parser.add_argument("--" + name.replace("_", "-"), help=text, **kind)
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check everything, search, save, then print."""
    if args.list:
        print_list(REGISTRY, as_json=args.json)
        return 0
    from softvox_search import SearcherError
    from softvox_search.single import RaisedError

    look_in(Path.cwd())
    try:
        return _search(args)
    except (SearcherError, ImportError) as error:
        raise BadInputError(str(error)) from error
    except RaisedError as error:
        return tell_raised(error)


def _search(args: Namespace) -> int:
    from softvox_search import single
    from softvox_search.oracle import Budget
    from softvox_search.policies import Policy

    for switch in SWITCHES:
        if args.noise is None and getattr(args, switch):
            option = "--" + switch.replace("_", "-")
            raise BadInputError(f"{option} works with noise only; give --noise LEVEL as well")
    if args.noise is not None and not 0 <= args.noise < inf:
        raise BadInputError(f"--noise must be a number that is not negative, got {args.noise:g}")
    name = name_in_files(args.searcher)
    noise = "" if args.noise is None else f"-noise-{args.noise:g}"
    picture = args.picture or Path(f"search-{name}-{args.seed}{noise}.png")
    if args.out:
        check_output("--out", args.out, (".csv", ".parquet"), force=args.force)
    if not args.no_picture:
        check_output("--picture", picture, (".png",), force=args.force or not args.picture)
    try:
        space = Lattice.of(args.shape, phases=args.phases)
    except ValueError as error:
        raise BadInputError(f"--{error}") from error
    physics = physics_of(args).to_dict()
    with prints_aside(), Progress(sys.stderr, quiet=args.quiet, unit="evaluations") as progress:
        facts, columns = single.search(
            args.searcher,
            options=options_given(args.option),
            seed=args.seed,
            space=space,
            budget=Budget(unique=args.budget, evaluations=args.evaluations),
            level=args.noise,
            policy=Policy(**{switch: getattr(args, switch) for switch in SWITCHES}),
            physics=physics,
            progress=progress,
        )
    if args.out:
        with bad_input("--out"):
            write_file(args.out, single.table(columns, args.out.suffix), force=args.force)
    facts["picture"] = None if args.no_picture else str(picture)
    if not args.no_picture:
        with bad_input("--picture"):
            image = single.picture(Design(facts["digits"], shape=space), physics)
            write_file(picture, image, force=args.force or not args.picture)
    print(json.dumps(facts, indent=2, allow_nan=False) if args.json else _text(facts, args.budget))
    return 0


def _text(facts: dict[str, Any], budget: int) -> str:
    """Return what `single.search` found as text."""
    space = Lattice.of(facts["shape"], phases=facts["phases"])
    level, under = facts["level"], facts["under_noise"]
    is_known, fitness = "rank" in facts, f"{facts['fitness']:.4f} voxel widths"
    said = {"design": facts["design"], "digits": facts["digits"]}
    if is_known:
        said["fitness"] = f"{fitness}, of the best {facts['best']:.4f}"
        said["regret"] = f"{facts['regret']:.4f}"
        said["rank"] = f"{facts['rank']} of {space.n_designs}"
    else:
        said["fitness"] = f"{fitness}; the best of {space} is not known"
    if level is not None:
        believed = "nothing" if facts["believed"] is None else f"{facts['believed']:.4f}"
        said["believed"] = f"{believed}, at level {level:g}"
        at = f"at level {level:g}"
        if level in LEVELS:
            at = "for this physics" if space == Lattice() else f"on {space}"
        said["under noise"] = f"not known {at}; known at {KNOWN} of the physics published, on 2x2x2"
    if under:
        said["under noise"] = (
            f"mean {under['fitness']:.4f}, of the best {under['best']:.4f}: "
            f"regret {under['regret']:.4f}, rank {under['rank']}"
        )
    unique, evaluations = facts["unique"], facts["evaluations"]
    when = f"at evaluation {facts['found_at']}" if facts["found_at"] else "never evaluated"
    said["found"] = f"{when} of {evaluations} ({unique} counted as unique)"
    if facts["ended_by"] == "searcher":
        said["ended"] = f"by the searcher, which proposed no more: {unique} of {budget}"
    if facts["ended_by"] == "evaluations" and level is None:
        said["ended"] = f"by {evaluations} evaluations: only {unique} of {budget} designs were new"
    if facts["picture"]:
        said["picture"] = facts["picture"]
    return "\n".join(f"{name:14}{text}" for name, text in said.items())
