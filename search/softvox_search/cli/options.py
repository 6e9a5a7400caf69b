"""The options that commands with a single searcher or method share, and their --list."""

from __future__ import annotations

import json
import re
import tomllib
from argparse import ArgumentParser, ArgumentTypeError
from pathlib import Path
from textwrap import wrap
from typing import Any

from softvox_gym.cli.parser import add_several, number
from softvox_gym.cli.terminal import BadInputError, bad_input
from softvox_gym.files import check_file
from softvox_search.registry import Registry


def options_given(pairs: list[str]) -> dict[str, Any]:
    """Return the options of a searcher or a method, given as KEY=VALUE with values as in TOML."""
    options = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        if not equals or not key:
            raise BadInputError(f"--option must be KEY=VALUE, got {pair!r}")
        try:
            options[key] = tomllib.loads(f"value = {value}")["value"]
        except tomllib.TOMLDecodeError:  # a text needs no quotes
            options[key] = value
    return options


def not_negative(text: str) -> int:
    """Read a whole number that is not negative, such as a seed."""
    if not re.fullmatch(r"[0-9]{1,18}", text):
        raise ArgumentTypeError(
            f"must be a whole number of at most 18 digits that is not negative, got {text}"
        )
    return int(text)


def add_method_options(parser: ArgumentParser, *, task: str, heading: str) -> None:
    """Add --option, --task, --heading and --seed of a transfer method, with the usual defaults."""
    add_several(
        parser, "--option", "KEY=VALUE", "an option of the method, with a TOML value", kind=str
    )
    parser.add_argument(
        "--task",
        default=task,
        metavar="NAME",
        help="directed (travel along a heading) or displacement (in any direction) (default: "
        "%(default)s)",
    )
    parser.add_argument(
        "--heading",
        type=number,
        metavar="DEG",
        help=f"heading of the directed task, degrees from +x towards +y (default: {heading})",
    )
    parser.add_argument(
        "--seed",
        type=not_negative,
        default=0,
        metavar="N",
        help="seed of all random numbers (default: %(default)s)",
    )


def check_output(option: str, path: Path, endings: tuple[str, ...], *, force: bool) -> None:
    """Check, before the work, that a file has one of some endings and may be written."""
    if path.suffix not in endings:
        raise BadInputError(f"{option} must end in {' or '.join(endings)}, got {path}")
    with bad_input(option):
        check_file(path, force=force)


def name_in_files(name: str) -> str:
    """Return a name, such as "package.module:name", in a form for file names."""
    return re.sub(r"[^A-Za-z0-9_]+", "-", name.rpartition(":")[2]).strip("-") or "own"


def entries(registry: Registry) -> list[dict[str, Any]]:
    """Return name, description, options with defaults, and missing library of all entries."""
    listed = []
    for name, entry in registry.entries.items():
        about, options, needs = entry.about, None, None
        try:
            options = registry.options_of(name)
            about = about or (registry.found(name).__doc__ or "").partition("\n")[0]
        except ImportError as error:
            needs = error.name
        listed.append({"name": name, "about": about, "options": options, "needs": needs})
    return listed


def print_list(registry: Registry, *, as_json: bool) -> None:
    """Print all entries of a registry."""
    listed = entries(registry)
    print(json.dumps(listed, indent=2, allow_nan=False) if as_json else shown(listed))


def shown(listed: list[dict[str, Any]]) -> str:
    """Return `entries` as text, wrapped to 80 columns."""
    indent = 2 + max(len(entry["name"]) for entry in listed)
    lines = []
    for entry in listed:
        options = [f"{key}={json.dumps(value)}" for key, value in (entry["options"] or {}).items()]
        text = f"options: {', '.join(options) or 'none'}"
        if entry["needs"]:
            text = f"needs {entry['needs']}: pip install {entry['needs']}"
        said = wrap(entry["about"], 80 - indent) + wrap(text, 80 - indent)
        lines.append(f"{entry['name']:{indent}}" + f"\n{'':{indent}}".join(said))
    return "\n".join(lines)
