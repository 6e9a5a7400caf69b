"""The page that plays a recording: one file, which asks the network for nothing."""

from __future__ import annotations

import html
import json
import re
from importlib.resources import files
from typing import Any

from numpy.typing import NDArray

from softvox_view.replay.still import data_url

SPEED = 0.5

#: Of the player, each importing those before it.
MODULES = [f"{name}.js" for name in ("shaders", "camera", "scene", "input", "player")]


def page(
    recording: dict[str, Any],
    picture: NDArray[Any],
    *,
    title: str | None = None,
    speed: float = SPEED,
    autoplay: bool = True,
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
    """
    name = title or "; ".join(robot["label"] for robot in recording["robots"])
    parts = {
        "title": html.escape(name),
        "rows": "Row by row: " if len(recording["robots"]) > 1 else "",
        "style": style(),
        "still": data_url(picture),
        "recording": _in_script(recording),
        "script": script(),
        "options": _in_script({"autoplay": autoplay, "speed": speed}),
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda match: parts[match[1]], _asset("page.html"))


def script() -> str:
    """Return the player as one ES module that exports `SoftvoxPlayer` and imports nothing."""
    parts = [re.sub(r"^import .*\n", "", _asset(name), flags=re.MULTILINE) for name in MODULES]
    # The last is the player; what the others export it finds beside it.
    inner = [re.sub(r"^export ", "", part, flags=re.MULTILINE) for part in parts[:-1]]
    return "\n".join([*inner, parts[-1]])


def style() -> str:
    """Return the player's style sheet."""
    return _asset("player.css")


def _in_script(value: Any) -> str:
    """Return JSON that may stand inside a script element of a page."""
    return json.dumps(value, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")


def _asset(name: str) -> str:
    return files("softvox_view.replay").joinpath("assets", name).read_text(encoding="utf-8")
