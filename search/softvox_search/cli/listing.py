"""The list of searchers, made without importing any.

Their libraries would take seconds, or be missing; so what they say and take is read from
their source.
"""

from __future__ import annotations

import ast
import json
from dataclasses import asdict, dataclass
from importlib.util import find_spec
from pathlib import Path
from textwrap import wrap
from typing import Any

from softvox_search.registry import ABOUT, FIXED, SEARCHERS

WIDTH = 80


@dataclass(frozen=True)
class Entry:
    """A searcher as the list has it.

    Parameters
    ----------
    name : str
        In the registry.
    about : str
        One sentence.
    options : dict
        With their defaults; None for one without.
    """

    name: str
    about: str
    options: dict[str, Any]


def entries() -> list[Entry]:
    """Return all searchers of the registry."""
    return [_entry(name, place) for name, place in SEARCHERS.items()]


def as_text(listed: list[Entry]) -> str:
    """Return the list for people, wrapped to 80 columns."""
    indent = 2 + max(len(entry.name) for entry in listed)
    lines = []
    for entry in listed:
        options = [f"{key}={json.dumps(value)}" for key, value in entry.options.items()]
        said = wrap(entry.about, WIDTH - indent)
        said += wrap(f"options: {', '.join(options) or 'none'}", WIDTH - indent)
        heads = [entry.name, *[""] * (len(said) - 1)]
        lines += [f"{head:{indent}}{line}" for head, line in zip(heads, said, strict=True)]
    return "\n".join(lines)


def as_json(listed: list[Entry]) -> str:
    """Return the list for programs."""
    return json.dumps([asdict(entry) for entry in listed], indent=2, allow_nan=False)


def _entry(name: str, place: str) -> Entry:
    node = _class(place)
    about = ABOUT.get(name) or (ast.get_docstring(node) or "").partition("\n")[0]
    fixed = FIXED.get(name, {})
    options = {key: value for key, value in _options(node).items() if key not in fixed}
    return Entry(name, about, options)


def _class(place: str) -> ast.ClassDef:
    module, _, name = place.partition(":")
    spec = find_spec(module)
    assert spec is not None
    assert spec.origin is not None
    for node in ast.parse(Path(spec.origin).read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef) and node.name == name:
            return node
    raise AssertionError(f"{module} has no class {name}")


def _options(node: ast.ClassDef) -> dict[str, Any]:
    """Return the keyword-only arguments of a class with their defaults."""
    for inner in node.body:
        if isinstance(inner, ast.FunctionDef) and inner.name == "__init__":
            pairs = zip(inner.args.kwonlyargs, inner.args.kw_defaults, strict=True)
            return {argument.arg: default and _constant(default) for argument, default in pairs}
    return {}


def _constant(node: ast.expr) -> Any:
    """Return the value of a default: a constant, or a fraction of two."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
        return ast.literal_eval(node.left) / ast.literal_eval(node.right)
    return ast.literal_eval(node)
