"""The page that plays a recording: one file, which makes no network requests."""

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

#: The player's modules, each importing only earlier ones.
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
        From `softvox_view.replay.recording`.
    picture : ndarray of uint8, shape (height, width, 3)
        Shown if the browser can't draw the robots: `softvox_view.replay.still`.
    title : str, optional
        By default the robots' labels.
    speed : float
        Initial speed; 1 is real time.
    autoplay : bool
        Whether it plays at once, unless the reader prefers reduced motion.
    boxes : bool
        Whether voxels are shown at first as the cubes of the model, not as one skin.
    gallery : bool
        Whether there are many robots, with filters by voxels and fitness.
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
    """Return the page as a template in which title, rows, still and recording are open."""
    parts = {"style": style(), "script": script(), "options": in_script(options)}
    return filled(_asset("page.html"), parts)


def filled(text: str, parts: Mapping[str, str]) -> str:
    """Return a text with each {{name}} replaced by the part of that name, if there is one."""
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts.get(match[1], match[0]), text)


def script() -> str:
    """Return the player as one ES module that exports `SoftvoxPlayer` and imports nothing."""
    return joined(map(_asset, MODULES)) + "\nexport { SoftvoxPlayer };\n"


def joined(modules: Iterable[str]) -> str:
    """Return modules, each importing only earlier ones, joined into one without exports."""
    whole = re.sub(r"^import .*\n", "", "\n".join(modules), flags=re.MULTILINE)
    return re.sub(r"^export ", "", whole, flags=re.MULTILINE)


def style() -> str:
    """Return the player's style sheet."""
    return _asset("player.css")


def in_script(value: Any) -> str:
    """Return JSON that is safe inside a script element of a page."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _asset(name: str) -> str:
    return files("softvox_view.replay").joinpath("assets", name).read_text(encoding="utf-8")
