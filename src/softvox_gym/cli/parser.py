"""An argument parser with errors of one line, and the options that commands share."""

from __future__ import annotations

import argparse
import difflib
import re
import shutil
import sys
from collections.abc import Sequence
from dataclasses import Field, fields
from typing import Any, NoReturn

from softvox_gym.cli.terminal import bad_input, complain
from softvox_gym.physics import ACTUATIONS, PRESETS, Physics


class _Formatter(argparse.RawDescriptionHelpFormatter):
    def __init__(self, prog: str) -> None:
        width = min(shutil.get_terminal_size().columns - 2, 88)
        super().__init__(prog, max_help_position=26, width=width)
        self._action_max_length = 14  # the list of commands forgets its own indent


class Parser(argparse.ArgumentParser):
    """An argument parser that says one line and exits with 2 where it can't go on."""

    def __init__(self, **options: Any) -> None:
        super().__init__(allow_abbrev=False, formatter_class=_Formatter, **options)
        # The usual pattern takes -1e7 and -inf for options.
        self._negative_number_matcher = re.compile(r"-(\d|\.\d|inf|nan)", re.IGNORECASE)

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and where the help is."""
        complain("error", f"{message} (see {self.prog} --help)")
        sys.exit(2)

    def refuse(self, unknown: Sequence[str]) -> NoReturn:
        """Say which argument is one too many, and what may have been meant."""
        option = next((word for word in unknown if word.startswith("-")), None)
        if option is None:
            self.error(f"unexpected argument {unknown[0]!r}")
        name = option.partition("=")[0]
        close = difflib.get_close_matches(name, self._option_string_actions, n=1)
        self.error(f"no option {name}" + (f"; did you mean {close[0]}?" if close else ""))


#: Whole numbers on the command line have at most nine digits.
MOST = 10**9 - 1


def number(text: str) -> float:
    """Read a number; whether it is finite and in bounds is for `Physics` to say."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a number, got {text!r}") from None


def whole_number(text: str) -> int:
    """Read a positive whole number."""
    if re.fullmatch(r"[0-9]*[1-9][0-9]{9,}", text):
        raise argparse.ArgumentTypeError(
            f"must be a whole number above 0 and at most {MOST}, got {text}"
        )
    if not re.fullmatch(r"[0-9]{1,9}", text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"must be a whole number above 0, got {text!r}")
    return int(text)


class OneOrThree(argparse.Action):
    """Takes one number or three."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Store a number or a tuple."""
        if len(values) not in (1, 3):
            parser.error(
                f"argument {option_string}: takes one number or three, got {len(values)}; "
                "anything else goes before it"
            )
        setattr(namespace, self.dest, values[0] if len(values) == 1 else tuple(values))


def add_threads(parser: argparse.ArgumentParser) -> None:
    """Add --threads."""
    parser.add_argument(
        "--threads", type=whole_number, metavar="N", help="at most this many (default: all)"
    )


def add_physics(parser: argparse.ArgumentParser) -> None:
    """Add --physics and an option for every parameter."""
    group = parser.add_argument_group(
        "physics", "SI units; each option changes one parameter of the preset."
    )
    group.add_argument(
        "--physics",
        choices=PRESETS,
        default="published",
        help="the preset: the values that the published run rounded to, or the paper's exact ones "
        "(default: published)",
    )
    for parameter in fields(Physics):
        _add_parameter(group, parameter)


def _add_parameter(group: argparse._ArgumentGroup, parameter: Field[Any]) -> None:
    option = "--" + parameter.name.replace("_", "-")
    unit = f", {parameter.metadata['unit']}" if parameter.metadata["unit"] else ""
    text = f"{parameter.metadata['meaning']}{unit} (default: {_defaults(parameter.name)})"
    text = text.replace("%", "%%")
    if parameter.metadata["bounds"] == "actuation":
        group.add_argument(option, choices=ACTUATIONS, help=text)
    elif parameter.metadata["bounds"] == "flag":
        group.add_argument(option, action=argparse.BooleanOptionalAction, help=text)
    elif parameter.name == "gravity":
        group.add_argument(
            option, action=OneOrThree, nargs="+", type=number, metavar="G", help=text
        )
    else:
        group.add_argument(option, type=number, metavar="X", help=text)


def _defaults(name: str) -> str:
    published, exact = (_shown(getattr(Physics.preset(preset), name)) for preset in PRESETS)
    return published if published == exact else f"{published}, exact {exact}"


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    short = f"{value:g}" if isinstance(value, float) else str(value)
    return short if isinstance(value, str) or float(short) == value else str(value)


def physics_of(args: argparse.Namespace) -> Physics:
    """Return the physics that the options ask for.

    Raises
    ------
    BadInputError
        For a value out of its bounds.
    """
    given = {f.name: getattr(args, f.name) for f in fields(Physics)}
    changes = {name: value for name, value in given.items() if value is not None}
    with bad_input():
        return Physics.of({"preset": args.physics, **changes})
