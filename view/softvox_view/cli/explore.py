"""softvox explore: the landscape as a living map, in a browser."""

from __future__ import annotations

import sys
import webbrowser
from argparse import Namespace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from softvox_gym.cli.terminal import bad_input, complain
from softvox_gym.files import check_file, write_file
from softvox_gym.trials import Trial
from softvox_gym.trials.database import read, shipped
from softvox_view.cli.options import add_results, read_results
from softvox_view.explore.trials import on_the_map

DESCRIPTION = """\
Show the landscape as a map in a browser: hover over a cell and see the robot,
click and it is simulated and replayed in 3-D; sliders change the physics, and
all 6561 designs are simulated anew. The page is one file that holds the engine
and asks the network for nothing: open it from disk, send it, or put it on any
host.

The page's address keeps what is seen: what follows its # is what --state takes.
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "explore",
        help="the landscape as a living map, in a browser",
        description=DESCRIPTION,
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write the page there, and open no browser (default: a temporary folder)",
    )
    parser.add_argument("--force", action="store_true", help="replace FILE where it exists")
    parser.add_argument(
        "--state",
        default="",
        metavar="STATE",
        help="to begin with, as 'design=6453&gravity=-1.62'",
    )
    add_results(parser, "whose searchers' paths can be laid over the map")
    parser.add_argument(
        "--trials",
        type=Path,
        action="append",
        default=[],
        metavar="DIR",
        help="a folder of trials, whose tracks are drawn beside the simulated ones; may be given "
        "several times",
    )
    parser.add_argument(
        "--shipped", action="store_true", help="also the trials that ship with the package"
    )
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Write the page, open it, and tell its address."""
    from softvox_view.explore.page import page

    if args.out:
        with bad_input("--out"):
            check_file(args.out, force=args.force)
    content = page(read_results(args.results), trials_of(args)).encode()
    path = args.out or Path(mkdtemp(prefix="softvox-")) / "landscape.html"
    with bad_input("--out"):
        write_file(path, content, force=args.force)
    state = args.state.rpartition("#")[2]
    address = path.resolve().as_uri() + (f"#{state}" if state else "")
    print(f"the landscape is at {address}")
    if not args.out and not webbrowser.open(address):
        print("softvox: no browser could be opened; open the page in one", file=sys.stderr)
    return 0


def trials_of(args: Namespace) -> tuple[Trial, ...]:
    """Return the trials that the options name; of other lattices the map has no cells."""
    folders = [*args.trials, *([shipped()] if args.shipped else [])]
    with bad_input("--trials"):
        trials = read(*folders)
        shown = on_the_map(trials)
        if folders and not shown:
            raise ValueError(f"{folders[0]} has no trial of a 2x2x2 robot; name another folder")
    if others := len(trials) - len(shown):
        complain("warning", f"{others} of {len(trials)} trials are of other lattices, and left out")
    return shown
