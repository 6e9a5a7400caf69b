"""The page that plays a recording: one file, which asks the network for nothing."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Iterable, Mapping
from importlib.resources import files
from typing import Any

from numpy.typing import NDArray

from softvox_view.replay.still import data_url

SPEED = 0.5

#: Of the player, each importing those before it.
MODULES = [
    f"{name}.js"
    for name in (
        *("shaders", "bodies", "camera", "scene"),
        *("strips", "filters", "export", "input", "player"),
    )
]


def page(
    recording: dict[str, Any],
    picture: NDArray[Any],
    *,
    title: str | None = None,
    speed: float = SPEED,
    autoplay: bool = True,
    boxes: bool = False,
    gallery: bool = False,
) -> str:
    """Return a page of HTML that plays a recording.

    Parameters
    ----------
    recording : dict
        As `softvox_view.replay.recording` returns it.
    picture : ndarray of uint8, shape (height, width, 3)
        Shown where the browser can't draw the robots: `softvox_view.replay.still`.
    title : str, optional
        The robots' labels where None.
    speed : float
        At which it begins; 1 is real time.
    autoplay : bool
        Whether it begins to play at once, unless the reader asked for reduced motion.
    boxes : bool
        Whether voxels begin as the cubes that they are in the model, rather than as one skin.
    gallery : bool
        Whether robots are many, and are chosen from by voxels and fitness.
    """
    name = title or "; ".join(robot["label"] for robot in recording["robots"])
    own = {
        "title": html.escape(name),
        "rows": "Row by row: " if len(recording["robots"]) > 1 else "",
        "still": data_url(picture),
        "recording": in_script(recording),
    }
    options = {"boxes": boxes, "gallery": gallery}
    chosen = {name: value for name, value in options.items() if value}
    return filled(template(speed=speed, autoplay=autoplay, **chosen), own)


def template(**options: Any) -> str:
    """Return the page without what is shown: title, rows, still and recording are left open."""
    parts = {"style": style(), "script": script(), "options": in_script(options)}
    return filled(_asset("page.html"), parts)


def filled(text: str, parts: Mapping[str, str]) -> str:
    """Return a text with each {{name}} that is among the parts replaced by that."""
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts.get(match[1], match[0]), text)


def script() -> str:
    """Return the player as one ES module that exports `SoftvoxPlayer` and imports nothing."""
    return joined(map(_asset, MODULES)) + "\nexport { SoftvoxPlayer };\n"


def joined(modules: Iterable[str]) -> str:
    """Return modules, each of which imports those before it, as one that exports nothing."""
    whole = re.sub(r"^import .*\n", "", "\n".join(modules), flags=re.MULTILINE)
    return re.sub(r"^export ", "", whole, flags=re.MULTILINE)


def style() -> str:
    """Return the player's style sheet."""
    return _asset("player.css")


def in_script(value: Any) -> str:
    """Return JSON that may stand inside a script element of a page."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _asset(name: str) -> str:
    return files("softvox_view.replay").joinpath("assets", name).read_text(encoding="utf-8")
