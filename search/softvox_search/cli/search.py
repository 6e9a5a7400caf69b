"""softvox search: one run of one searcher."""

from __future__ import annotations

import json
import re
import sys
import tomllib
import traceback
from argparse import ArgumentTypeError, Namespace
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softvox_gym.cli.parser import add_physics, number, physics_of, whole_number
from softvox_gym.cli.terminal import BadInputError, bad_input, complain
from softvox_gym.files import check_file, write_file
from softvox_gym.landscapes.noisy import LEVELS
from softvox_gym.lattice import Lattice
from softvox_gym.progress import Progress
from softvox_search.cli import listing
from softvox_search.cli.own_code import look_in, prints_aside

if TYPE_CHECKING:
    from softvox_search.single import SearchResult

BUDGET = 500

KNOWN = ", ".join(f"{level:g}" for level in LEVELS)

DESCRIPTION = """\
Let a searcher look for the fittest robot, and hold what it recommends against
all 6561: its fitness, its regret (what it lacks to the best), its rank, when
it was found, and a picture of it after its run. On another lattice, --shape,
the best is not known, and regret and rank are left out.

With --noise every evaluation is a fresh draw; "believed" is then what the
searcher thinks that its recommendation is worth. The switches against luck
are --running-mean, --reevaluate-parents and --final-stage.

The picture goes to search-NAME-SEED.png, under noise to
search-NAME-SEED-noise-LEVEL.png, in place of an earlier one, unless --picture
names another file.

A searcher of your own, --searcher package.module:name, is a class with ask or a
function f(evaluate, space, rng). It is looked for among what is installed, on
PYTHONPATH and in the current folder. What it prints goes to standard error.
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "search",
        help="one run of one searcher: the best robot that it finds",
        description=DESCRIPTION,
        usage="softvox search --searcher NAME [--seed N] [--budget N] [options]",
    )
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument(
        "--searcher", metavar="NAME", help="from --list, or your own as package.module:name"
    )
    what.add_argument("--list", action="store_true", help="list the searchers with their options")
    parser.add_argument(
        "--option",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="of the searcher, as in TOML; may be given several times",
    )
    parser.add_argument(
        "--shape",
        type=whole_number,
        nargs=3,
        default=(2, 2, 2),
        metavar=("NX", "NY", "NZ"),
        help="the lattice (default: 2 2 2)",
    )
    parser.add_argument(
        "--seed", type=_seed, default=0, metavar="N", help="of all random numbers (default: 0)"
    )
    parser.add_argument(
        "--budget",
        type=whole_number,
        default=BUDGET,
        metavar="N",
        help="different designs; with noise, evaluations (default: %(default)s)",
    )
    parser.add_argument(
        "--evaluations",
        type=whole_number,
        metavar="N",
        help="at most so many evaluations, repeated ones included (default: 20 times the budget)",
    )
    _add_noise(parser)
    _add_output(parser)
    add_physics(parser)
    parser.set_defaults(run=run, parser=parser)


def _add_noise(parser: Any) -> None:
    parser.add_argument(
        "--noise",
        type=number,
        metavar="LEVEL",
        help="of JakobiNoise; 1 is the assumed reality. What the designs are worth under noise is "
        f"known at {KNOWN}",
    )
    for switch, text in (
        ("--running-mean", "tell the mean of all draws of a design"),
        ("--reevaluate-parents", "evaluate parents anew in every generation"),
        ("--final-stage", "spend the end of the budget on the ten best"),
    ):
        parser.add_argument(switch, action="store_true", help=f"with noise: {text}")


def _add_output(parser: Any) -> None:
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="also save every evaluation, .csv or .parquet"
    )
    parser.add_argument(
        "--picture",
        type=Path,
        metavar="FILE.png",
        help="where the picture goes; one that exists is only replaced with --force",
    )
    parser.add_argument("--no-picture", action="store_true", help="draw none")
    parser.add_argument("--force", action="store_true", help="replace files named here that exist")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")


def run(args: Namespace) -> int:
    """Check everything, search, save, then print."""
    if args.list:
        listed = listing.entries()
        print(listing.as_json(listed) if args.json else listing.as_text(listed))
        return 0
    from softvox_search import SearcherError, single

    look_in(Path.cwd())
    try:
        return _search(args)
    except (single.SearchError, SearcherError, ImportError) as error:
        raise BadInputError(str(error)) from error
    except single.RaisedError as error:
        if sys.stderr is not None:
            traceback.print_exception(error.__cause__)
        complain("error", str(error))
        return 1


def _search(args: Namespace) -> int:
    from softvox_search import single

    picture = None if args.no_picture else args.picture or _default_picture(args)
    _check_files(args, picture)
    options = _search_options(args)
    with prints_aside(), Progress(sys.stderr, quiet=args.quiet, unit="evaluations") as progress:
        result = single.search(args.searcher, **options, progress=progress)
    if args.out:
        with bad_input("--out"):
            write_file(args.out, single.table(result.columns, args.out.suffix), force=args.force)
    if picture:
        with bad_input("--picture"):
            image = single.picture(result.design, options["physics"])
            write_file(picture, image, force=args.force or not args.picture)
    print(as_json(result, picture) if args.json else as_text(result, picture))
    return 0


def _search_options(args: Namespace) -> dict[str, Any]:
    """Return the search as `single.search` takes it."""
    from softvox_search.oracle import Budget
    from softvox_search.policies import Policy

    switches = ("running_mean", "reevaluate_parents", "final_stage")
    for switch in switches:
        if args.noise is None and getattr(args, switch):
            option = "--" + switch.replace("_", "-")
            raise BadInputError(f"{option} is against noise, and there is none; give --noise LEVEL")
    if args.noise is not None and not 0 <= args.noise < inf:
        raise BadInputError(f"--noise must be a number that is not negative, got {args.noise:g}")
    try:
        space = Lattice.of(args.shape)
    except ValueError as error:
        raise BadInputError(f"--{error}") from error
    return {
        "options": _options(args.option),
        "seed": args.seed,
        "space": space,
        "budget": Budget(unique=args.budget, evaluations=args.evaluations),
        "level": args.noise,
        "policy": Policy(**{switch: getattr(args, switch) for switch in switches}),
        "physics": physics_of(args).to_dict(),
    }


def _options(pairs: list[str]) -> dict[str, Any]:
    options = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals or not key:
            raise BadInputError(f"--option must be KEY=VALUE, got {pair!r}")
        try:
            options[key] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:  # a text need not be in quotes
            options[key] = value
    return options


def _check_files(args: Namespace, picture: Path | None) -> None:
    if args.out:
        if args.out.suffix not in (".csv", ".parquet"):
            raise BadInputError(f"--out must end in .csv or .parquet, got {args.out}")
        with bad_input("--out"):
            check_file(args.out, force=args.force)
    if picture:
        if picture.suffix != ".png":
            raise BadInputError(f"--picture must end in .png, got {picture}")
        with bad_input("--picture"):
            check_file(picture, force=args.force or not args.picture)


def _default_picture(args: Namespace) -> Path:
    name = re.sub(r"[^A-Za-z0-9_]+", "-", args.searcher.rpartition(":")[2]).strip("-")
    noise = "" if args.noise is None else f"-noise-{args.noise:g}"
    return Path(f"search-{name or 'own'}-{args.seed}{noise}.png")


def _seed(text: str) -> int:
    if re.fullmatch(r"[0-9]{19,}", text):
        raise ArgumentTypeError(f"must be a whole number of at most 18 digits, got {text}")
    if not re.fullmatch(r"[0-9]{1,18}", text):
        raise ArgumentTypeError(f"must be a whole number that is not negative, got {text!r}")
    return int(text)


def as_text(result: SearchResult, picture: Path | None) -> str:
    """Return what was found for people."""
    design, truth, space = result.design, result.truth, result.design.lattice
    if truth:
        fitness = f"{truth.fitness:.4f} voxel widths, of the best {truth.best:.4f}"
    else:
        fitness = f"{result.fitness:.4f} voxel widths; the best of {space} is not known"
    lines = [f"design        {design.index}", f"digits        {design.digits}"]
    lines.append(f"fitness       {fitness}")
    if truth:
        lines.append(f"regret        {truth.regret:.4f}")
        lines.append(f"rank          {truth.rank} of {space.n_designs}")
    if result.level is not None:
        believed = "nothing" if result.believed is None else f"{result.believed:.4f}"
        lines.append(f"believed      {believed}, at level {result.level:g}")
    if result.noisy is not None:
        lines.append(
            f"under noise   mean {result.noisy.fitness:.4f}, of the best {result.noisy.best:.4f}: "
            f"regret {result.noisy.regret:.4f}, rank {result.noisy.rank}"
        )
    elif result.level is not None:
        at = f"at level {result.level:g}"
        if result.level in LEVELS:
            at = "for this physics" if truth else f"on {space}"
        lines.append(
            f"under noise   not known {at}; known at {KNOWN} of the physics published, on 2x2x2"
        )
    when = "never evaluated" if result.sequence is None else f"at evaluation {result.sequence}"
    used = f"{result.oracle.evaluations} ({result.oracle.unique} counted as unique)"
    lines.append(f"found         {when} of {used}")
    if reason := _ended(result):
        lines.append(f"ended         {reason}")
    if picture:
        lines.append(f"picture       {picture}")
    return "\n".join(lines)


def _ended(result: SearchResult) -> str | None:
    """Return why a search ended before its budget of designs, or None."""
    unique = f"{result.oracle.unique} of {result.oracle.budget.unique}"
    if result.ended_by == "searcher":
        return f"by the searcher, which proposed no more: {unique}"
    if result.ended_by == "evaluations" and result.level is None:
        return f"by {result.oracle.evaluations} evaluations: only {unique} designs were new"
    return None


def as_json(result: SearchResult, picture: Path | None) -> str:
    """Return what was found for programs."""
    data = {**result.to_dict(), "picture": str(picture) if picture else None}
    return json.dumps(data, indent=2, allow_nan=False)
