"""An argument parser with errors of one line, and the options that commands share."""

from __future__ import annotations

import argparse
import difflib
import re
import shutil
import sys
from collections.abc import Iterable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from softvox_gym.cli.terminal import BadInputError, bad_input, complain
from softvox_gym.physics import ACTUATIONS, PRESETS, SPECS, ParameterSpec, Physics
from softvox_gym.realities import Reality, reality

#: Negative numbers that argparse mistakes for options.
ODD_NEGATIVE = re.compile(r"-((\d+\.?\d*|\.\d+)(e[-+]?\d+)|\d+\.|inf|nan)", re.IGNORECASE)


class Parser(argparse.ArgumentParser):
    """An argument parser that reports an error in one line and exits with status 2."""

    def __init__(self, **options: Any) -> None:
        width = min(shutil.get_terminal_size().columns - 2, 88)
        layout = partial(argparse.RawDescriptionHelpFormatter, max_help_position=26, width=width)
        super().__init__(allow_abbrev=False, formatter_class=layout, **options)

    def error(self, message: str) -> NoReturn:
        """Report what is wrong and how to get help."""
        complain("error", f"{message} (see {self.prog} --help)")
        sys.exit(2)

    def refuse(self, unknown: Sequence[str]) -> NoReturn:
        """Report an unknown argument, and what may have been meant."""
        option = next((word for word in unknown if word.startswith("-")), None)
        if option is None:
            self.error(f"unexpected argument {unknown[0]!r}")
        name = option.partition("=")[0]
        close = difflib.get_close_matches(name, re.findall(r"--[a-z-]+", self.format_help()), n=1)
        self.error(f"no option {name}" + (f"; did you mean {close[0]}?" if close else ""))


def readable(arguments: Iterable[str]) -> list[str]:
    """Return arguments in a form that argparse understands.

    A blank before -1e7, -inf and the like makes argparse read them as values. --shape 3x3x3 becomes
    --shape 3 3 3.
    """
    words = [f" {word}" if ODD_NEGATIVE.fullmatch(word) else word for word in arguments]
    made: list[str] = []
    for word in words:
        option, equals, value = word.rpartition("=")
        is_shape = option == "--shape" or (not equals and made[-1:] == ["--shape"])
        sides = value.split("x") if is_shape and re.fullmatch(r"\d+x\d+x\d+", value) else []
        made += (["--shape", *sides] if equals else sides) if sides else [word]
    return made


def number(text: str) -> float:
    """Read a number; `Physics` checks whether it is finite and within bounds."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"must be a number, got {text!r}") from None


def whole_number(text: str) -> int:
    """Read a positive whole number of at most nine digits."""
    if not re.fullmatch(r"0*[1-9][0-9]{0,8}", text):
        raise argparse.ArgumentTypeError(
            f"must be a whole number above 0 and at most {10**9 - 1}, got {text}"
        )
    return int(text)


def add_several(parser: Any, option: str, metavar: str, what: str, *, kind: Any = Path) -> None:
    """Add an option that may be given several times: a list, which is empty without it."""
    told: dict[str, Any] = {"metavar": metavar, "help": f"{what}; may be given several times"}
    parser.add_argument(option, type=kind, action="append", default=[], **told)


def add_shape(parser: argparse.ArgumentParser) -> None:
    """Add --shape and --phases."""
    parser.add_argument(
        "--shape",
        type=whole_number,
        nargs=3,
        default=(2, 2, 2),
        metavar=("NX", "NY", "NZ"),
        help="shape of the lattice, as 3 3 3 or 3x3x3 (default: 2x2x2)",
    )
    parser.add_argument(
        "--phases",
        type=whole_number,
        default=1,
        metavar="P",
        help="number of phases, 1 to 8: digit 2 + p is active, p / P cycles ahead (default: 1)",
    )


def add_threads(parser: argparse.ArgumentParser) -> None:
    """Add --threads."""
    parser.add_argument(
        "--threads", type=whole_number, metavar="N", help="use at most N threads (default: all)"
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
        help="the preset: the paper's values as rounded in the published run, or exact (default: "
        "published)",
    )
    for spec in SPECS:
        option = "--" + spec.name.replace("_", "-")
        published, exact = _shown(spec.published), _shown(spec.default)
        default = published if published == exact else f"{published}, exact {exact}"
        unit = f"; {spec.unit}" if spec.unit else ""
        text = f"{spec.about}{unit} (default: {default})"
        group.add_argument(option, help=text, **_kind(spec))
    text = "T*, shear strength of a voxel's face over the voxel's weight; not with --shear-strength"
    group.add_argument("--shear-ratio", type=number, metavar="X", help=text)


def _kind(spec: ParameterSpec) -> dict[str, Any]:
    if isinstance(spec.default, bool):
        return {"action": argparse.BooleanOptionalAction}
    if isinstance(spec.default, str):
        return {"choices": ACTUATIONS}
    if spec.name == "gravity":
        return {"type": number, "nargs": "+", "metavar": "G"}
    return {"type": number, "metavar": "X"}


def _shown(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    is_short = isinstance(value, float) and float(f"{value:g}") == value
    return f"{value:g}" if is_short else str(value)


def physics_of(args: argparse.Namespace) -> Physics:
    """Return the physics of the options; BadInputError for a value out of its bounds."""
    changes = {spec.name: value for spec in SPECS if (value := vars(args)[spec.name]) is not None}
    gravity = changes.get("gravity", ())
    if len(gravity) not in (0, 1, 3):
        raise BadInputError(
            f"--gravity takes one number or three, got {len(gravity)}; put other arguments "
            "before it"
        )
    if len(gravity) == 1:
        changes["gravity"] = gravity[0]
    if args.shear_ratio is not None:
        changes["shear_ratio"] = args.shear_ratio
    with bad_input():
        return Physics.of({"preset": args.physics, **changes})


def named(physics: Physics, preset: str) -> str:
    """Return the changes of a physics to a preset, as in `world_of`, or the preset's name."""
    own, usual = physics.to_dict(), Physics.preset(preset).to_dict()
    changes = [
        f"{key}={value:g}" if isinstance(value, float) else f"{key}={value}".replace(" ", "")
        for key, value in own.items()
        if value != usual[key] and key != "duration"
    ]
    return ",".join(changes) or preset


def world_of(text: str, physics: Physics) -> tuple[str, Reality]:
    """Return a world and its name, for the text reality=NAME or changes to a physics.

    Raises
    ------
    ValueError
        If the text is neither, or a value is out of its bounds.
    """
    kinds = {spec.name: type(spec.default) for spec in SPECS} | {"shear_ratio": float}
    changes: dict[str, Any] = {}
    for part in text.split(","):
        key, equals, value = (word.strip() for word in part.partition("="))
        key = key.replace("-", "_")
        if key == "reality" and equals and part == text:
            return value, reality(value)
        if key not in kinds or not equals:
            close = difflib.get_close_matches(key, ["reality", *kinds], n=1)
            hint = f"; did you mean {close[0]}=...?" if close else ""
            raise ValueError(
                f"{text!r} is neither reality=NAME nor parameters such as gravity=-1.62{hint}"
            )
        changes[key] = _value(key, value, kinds[key])
    if "shear_ratio" in changes:
        own = {key: value for key, value in physics.to_dict().items() if key != "shear_strength"}
    else:
        own = physics.to_dict()
    return text, Reality.of(Physics.of({**own, **changes}))


def _value(key: str, text: str, kind: type) -> Any:
    """Return a parameter's value for its text; ValueError if the text is invalid."""
    if kind is str:
        return text
    if kind is bool:
        if text not in ("yes", "no"):
            raise ValueError(f"{key} must be yes or no, got {text!r}")
        return text == "yes"
    try:
        return float(text)
    except ValueError:
        raise ValueError(f"{key} must be a number, got {text!r}") from None
