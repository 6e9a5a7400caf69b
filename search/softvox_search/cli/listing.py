"""The list of searchers."""

from __future__ import annotations

import json
from textwrap import wrap
from typing import Any

from softvox_search.registry import SEARCHERS, found, options_of

WIDTH = 80


def entries() -> list[dict[str, Any]]:
    """Return name, about, options with their defaults, and needs of every searcher.

    Where a library is missing that its module imports, `needs` is its name, and nothing else is
    known of it.
    """
    listed = []
    for name, entry in SEARCHERS.items():
        about, options, needs = entry.about, None, None
        try:
            options = options_of(name)
            about = about or (found(name).__doc__ or "").partition("\n")[0]
        except ImportError as error:
            needs = error.name
        listed.append({"name": name, "about": about, "options": options, "needs": needs})
    return listed


def as_text(listed: list[dict[str, Any]]) -> str:
    """Return the list for people, wrapped to 80 columns."""
    indent = 2 + max(len(entry["name"]) for entry in listed)
    lines = []
    for entry in listed:
        options = [f"{key}={json.dumps(value)}" for key, value in (entry["options"] or {}).items()]
        text = f"options: {', '.join(options) or 'none'}"
        if entry["needs"]:
            text = f"needs {entry['needs']}: pip install {entry['needs']}"
        said = wrap(entry["about"], WIDTH - indent) + wrap(text, WIDTH - indent)
        heads = [entry["name"], *[""] * (len(said) - 1)]
        lines += [f"{head:{indent}}{line}" for head, line in zip(heads, said, strict=True)]
    return "\n".join(lines)


def as_json(listed: list[dict[str, Any]]) -> str:
    """Return the list for programs."""
    return json.dumps(listed, indent=2, allow_nan=False)
