"""softvox figures: the paper's figures from this package's own data."""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from softvox_gym.cli.parser import add_several
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.files import check_folder
from softvox_gym.progress import Progress
from softvox_gym.realities import reality
from softvox_view.cli.options import add_results, import_figures, read_results, write_figures
from softvox_view.figures import (
    FIGURES,
    OF_REALITIES,
    OF_RESULTS,
    Inputs,
    figure_of,
    files_of,
    make,
)

if TYPE_CHECKING:
    from softvox_gym.real_tracks import RealTrack
    from softvox_search.experiment.results import Results

#: The libraries needed for figures of results.
LIBRARIES = ("matplotlib", "msgspec", "pandas", "pyarrow", "scipy")

#: The same as `softvox_view.figures.style.FORMATS`, which loads matplotlib.
FORMATS = ("png", "pdf")

#: The scales of the heatmap.
SCALES = ("rank", "fitness")

_NAMES = "\n".join(f"  {name:13} {shown}" for name, shown in FIGURES.items())

DESCRIPTION = f"""\
Draw the figures of the paper, and further ones, into a folder:
{_NAMES}
Without a NAME, all are drawn; search and transfer only if --results gives a
folder of their kind.

--reality selects the worlds in the figures whose names begin with gap;
softvox reality --list names them. By default gap and gap_headings show all
named realities, and gap_tracks and gap_map show area_friction, where most of
the best robots turn round.

--tracks draws tracks of real robots over the simulated ones and compares them:
angle between the displacements, end-point error, RMS error. The file is CSV,
  design,trial,cycle,x_cm,y_cm
  6453,1,0,0.0,0.0
  6453,1,0.5,-0.1,-0.2
with one line per moment; cycle starts at 0 in every trial. The figure tracks
writes such a file, tracks_simulated.csv.

The same data give the same bytes.
"""


def add_parser(commands: Any) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "figures",
        help="draw the paper's figures from our own data",
        description=DESCRIPTION,
        usage="softvox figures [NAME ...] [--out DIR] [--format FORMAT ...] [options]",
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="figures (default: all)")
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("figures"),
        metavar="DIR",
        help="folder to write (default: figures)",
    )
    parser.add_argument(
        "--format",
        nargs="+",
        choices=FORMATS,
        default=FORMATS,
        metavar="FORMAT",
        help=f"{' or '.join(FORMATS)}, or both (default: both)",
    )
    add_several(parser, "--tracks", "FILE.csv", "tracks of real robots, for the figure tracks")
    add_results(parser, "for search or transfer")
    add_several(parser, "--reality", "NAME", "a reality, for the figures named gap...", kind=str)
    scale = "what the heatmap's colours show (default: rank)"
    parser.add_argument("--scale", choices=SCALES, help=scale)
    one = "in the gallery, only one robot per symmetry class"
    parser.add_argument("--one-per-class", action="store_true", help=one)
    parser.add_argument("--force", action="store_true", help="replace earlier figures in DIR")
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    parser.set_defaults(run=run, parser=parser)


def run(args: Namespace) -> int:
    """Check everything, draw, write all files at once, then print what was written."""
    formats = list(dict.fromkeys(args.format))
    names = _names(args)
    with bad_input("--reality"):
        chosen = tuple(reality(name) for name in dict.fromkeys(args.reality))
    if args.results:
        import_figures("search", what="figures", libraries=LIBRARIES)
    else:
        import_figures(what="figures")
    results = read_results(args.results, of_transfer=None)
    names = _drawable(names, results)
    scale = args.scale or SCALES[0]
    inputs = Inputs(_tracks(args.tracks), results, chosen, scale, args.one_per_class)
    with bad_input("--out"):
        expected = [f"{name}.{form}" for name in names for form in formats]
        check_folder(args.out, expected, force=args.force)
    files: dict[str, bytes] = {}
    lines: list[str] = []
    with Progress(sys.stderr, quiet=args.quiet, unit="figures") as progress:
        for done, name in enumerate(names):
            progress(done, len(names))
            with bad_input():
                drawing = make(name, inputs)
            files |= files_of(drawing, formats)
            lines += drawing.lines
    write_figures(args.out, files, force=args.force)
    print("\n".join([*lines, f"wrote {len(files)} files into {args.out}: {', '.join(names)}"]))
    return 0


def _tracks(files: list[Path]) -> tuple[RealTrack, ...]:
    """Return the tracks of real robots."""
    if not files:
        return ()
    from softvox_gym.real_tracks import read_tracks
    from softvox_view.figures.tracks import CYCLES, designs_of

    with bad_input("--tracks"):
        tracks = read_tracks(files, most_cycles=CYCLES)
        designs_of(tracks)
    return tracks


def _names(args: Namespace) -> list[str]:
    """Return the figures that are named; check that every option is for one of them."""
    names = list(dict.fromkeys(args.names))
    for name in names:
        if name not in FIGURES:
            raise BadInputError(f"no figure {name!r}; there are {', '.join(FIGURES)}")
    uses = {"results": OF_RESULTS, "tracks": ("tracks",), "reality": OF_REALITIES}
    uses |= {"scale": ("heatmap",), "one-per-class": ("gallery",)}
    for option, figures in uses.items():
        if names and getattr(args, option.replace("-", "_")) and not {*names} & {*figures}:
            which = (
                f"one of {', '.join(figures)}" if len(figures) > 1 else f"the figure {figures[0]}"
            )
            raise BadInputError(f"--{option} is for {which}; name that as well")
    return names


def _drawable(names: list[str], results: Mapping[str, Results]) -> list[str]:
    """Return the figures to draw, all if none is named; check that their results are given."""
    given = {figure_of(one): one for one in results.values()}
    if not names:
        return [name for name in FIGURES if name not in OF_RESULTS or name in given]
    for figure, one in given.items():
        if figure not in names:
            raise BadInputError(
                f"--results {one.folder} is for the figure {figure}; name that as well"
            )
    for name, kind in zip(OF_RESULTS, ("searchers", "transfer methods"), strict=True):
        if name in names and name not in given:
            raise BadInputError(
                f"the figure {name} is made from results of {kind}; give --results DIR, a folder "
                "that softvox compare has written"
            )
    return names
