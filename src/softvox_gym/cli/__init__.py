"""The command line, `softvox`: one module per command.

A command is a module with `add_parser(commands)`, which adds its parser and sets `run` as the
parser's default, and `run(args)`, which does the work and returns the exit status. `COMMANDS` lists
those of this package. Other packages add commands by entry points of the group
`softvox_gym.commands`, each a module that is quick to import.

Exit status: 0 done, 1 the answer is no (`verify`) or the user's own searcher failed, 2 bad input,
128 + n stopped by signal n.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from argparse import Namespace
from collections.abc import Sequence
from importlib.metadata import entry_points

import softvox_gym
from softvox_gym.cli import landscape, reality, robustness, simulate, verify
from softvox_gym.cli.parser import Parser, readable
from softvox_gym.cli.signals import Stopped, stoppable
from softvox_gym.cli.terminal import BadInputError, complain, degrade_output, one_line_warnings

COMMANDS = (landscape, reality, robustness, simulate, verify)

#: Placeholder of a command in the usage; it also sets the width of the column of commands.
COMMAND = "COMMAND [options]"

#: Group of entry points that name further commands.
GROUP = "softvox_gym.commands"

DESCRIPTION = """\
Simulate soft robots made of voxels: all designs of a 2x2x2 lattice, with the
same bits on every machine. A design has a digit per site (0 absent, 1 passive,
2 active; site x + 2y + 4z) and a number, the sum of digit_i 3^i, 0 to 6560.
"""

EXAMPLES = """\
examples:
  softvox verify               check this build against the published table
  softvox landscape            all 6561 designs into the folder landscape
  softvox landscape --physics exact --gravity -1.62 --out moon
  softvox simulate 6453        the best design: fitness and track
  softvox simulate 00021222 --frames best.npz
  softvox reality              compare the landscape with those of other worlds
  softvox search --searcher hill_climber --seed 1 --budget 500
  softvox compare baselines/noise_free.toml

softvox COMMAND --help describes a command and all its options.
"""


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit status."""
    arguments = list(sys.argv[1:] if argv is None else argv)
    degrade_output()
    try:
        with stoppable(), one_line_warnings():
            status = _run(arguments)
            if sys.stdout is not None:
                sys.stdout.flush()
            return status
    except BadInputError as error:
        complain("error", str(error))
        return 2
    except MemoryError as error:
        complain("error", f"not enough memory for a run of this size: {error}")
        return 2
    except BrokenPipeError:  # the reader of a pipe, such as head, has stopped
        _drop_output()
        return 128 + getattr(signal, "SIGPIPE", 13)
    except OSError as error:
        _drop_output()
        complain("error", f"{error.filename or 'cannot write the output'}: {error.strerror}")
        return 2
    except Stopped as stop:
        notes = getattr(stop, "__notes__", ["no file was left half written"])
        complain("stopped", f"{signal.Signals(stop.number).name}, {'; '.join(notes)}")
        return 128 + stop.number


def _run(arguments: list[str]) -> int:
    parser = _parser(*arguments[:1])
    try:
        args, unknown = parser.parse_known_args(readable(arguments))
        if unknown:
            getattr(args, "parser", parser).refuse(unknown)
    except SystemExit as end:  # --help, --version, or an error that is already reported
        return int(end.code or 0)
    if args.run is None:
        parser.print_help()
        return 2
    status: int = args.run(Namespace(**vars(args), arguments=arguments))
    return status


def _parser(first: str = "") -> Parser:
    """Return the parser of all commands, or only of those that the first word may need.

    Commands of other packages are left out then, because they take time to load.
    """
    usage = f"softvox {COMMAND}"
    parser = Parser(prog="softvox", usage=usage, description=DESCRIPTION, epilog=EXAMPLES)
    parser.add_argument(
        "--version",
        action="version",
        help="show the version",
        version=f"softvox {softvox_gym.__version__}",
    )
    parser.set_defaults(run=None)
    commands = parser.add_subparsers(title="commands", metavar=COMMAND, prog="softvox")
    for command in COMMANDS:
        command.add_parser(commands)
    entries = sorted(entry_points(group=GROUP), key=lambda entry: entry.name)
    if first in {"--version", *commands.choices, *(entry.name for entry in entries)}:
        entries = [entry for entry in entries if entry.name == first]
    for entry in entries:
        try:
            entry.load().add_parser(commands)
        except Exception as error:  # a broken command must not break the others
            complain("warning", f"command {entry.name} can't be loaded: {error}")
    return parser


def _drop_output() -> None:
    """Discard the rest of the output, or the interpreter prints an error when it ends."""
    with contextlib.suppress(OSError, ValueError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
