"""softvox explore: the landscape as an interactive map in the browser."""

from __future__ import annotations

import sys
import webbrowser
from argparse import Namespace
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from softvox_gym.cli.parser import add_several
from softvox_gym.cli.terminal import bad_input, complain
from softvox_gym.cli.trials import add_shipped
from softvox_gym.files import check_file, write_file
from softvox_gym.trials import Trial
from softvox_gym.trials.database import read, shipped
from softvox_view.cli.options import add_results, read_results
from softvox_view.explore.trials import on_the_map

DESCRIPTION = """\
Show the landscape as a map in a browser. Hover over a cell to see the robot;
click it to simulate the robot and replay it in 3-D. If you move the sliders of
the physics, all 6561 designs are simulated again. The page is one file that
contains the engine and makes no network requests: open it from disk, send it,
or put it on any host.

The page's address records the view: the part after # can be given as --state.
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "explore",
        help="show the landscape as an interactive map in a browser",
        description=DESCRIPTION,
    )
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="write the page to FILE, and open no browser (default: a temporary file, opened in a "
        "browser)",
    )
    parser.add_argument("--force", action="store_true", help="replace FILE where it exists")
    parser.add_argument(
        "--state",
        default="",
        metavar="STATE",
        help="the initial view, as 'design=6453&gravity=-1.62'",
    )
    add_results(parser, "to show its searchers' paths over the map")
    add_several(
        parser,
        "--trials",
        "DIR",
        "a folder of trials, whose tracks are drawn beside the simulated ones",
    )
    add_shipped(parser)
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Write the page, open it, and print its address."""
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
    """Return the trials that the options select, without those of lattices that the map lacks."""
    folders = [*args.trials, *([shipped()] if args.shipped else [])]
    with bad_input("--trials"):
        trials = read(*folders)
        shown = on_the_map(trials)
        if folders and not shown:
            raise ValueError(f"{folders[0]} has no trial of a 2x2x2 robot; name another folder")
    if others := len(trials) - len(shown):
        complain("warning", f"{others} of {len(trials)} trials are of other lattices, and left out")
    return shown
