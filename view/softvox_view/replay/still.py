"""Still pictures of replays."""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from softvox_gym.rendering import Pose, fitting_distance, png, render
from softvox_gym.simulation import Result
from softvox_view.replay.data import checked_places, frames_of, pose

#: Counts between the colours of a picture in a page, which takes two fifths of its bytes away.
COARSE = 4

PANEL = (400, 300)  # pixels, at most
WIDTH = 900  # pixels of all panels beside each other, at most


def still(
    result: Result,
    *designs: int,
    frame: int | None = None,
    panel: tuple[int, int] | None = None,
) -> NDArray[np.uint8]:
    """Draw some designs of a batch side by side at one moment.

    Parameters
    ----------
    result, *designs
        As of `recording`.
    frame : int, optional
        From 0; the last where None.
    panel : (int, int), optional
        Width and height of each robot's picture, pixels; smaller for many robots where None.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
    """
    places = checked_places(result, designs)
    shown = len(frames_of(result).step) - 1 if frame is None else frame
    if panel is None:
        width = min(PANEL[0], WIDTH // columns(len(places)))
        panel = (width, width * PANEL[1] // PANEL[0])
    # From where the first frame is seen, so that the breathing of a robot does not zoom.
    first = [pose(result, i, 0) for i in places]
    return beside([pose(result, i, shown) for i in places], panel=panel, seen_as=first)


def beside(
    poses: Sequence[Pose], *, panel: tuple[int, int], seen_as: Sequence[Pose] | None = None
) -> NDArray[np.uint8]:
    """Draw robots in rows of panels, as `columns` says; what is left of the last row is empty.

    Each is seen from as far as it needs itself, or as some others do.
    """
    width, height = panel
    across = columns(len(poses))
    rows = math.ceil(len(poses) / across)
    picture = np.full((rows * height, across * width, 3), 255, np.uint8)
    for k, (robot, whole) in enumerate(zip(poses, seen_as or poses, strict=True)):
        top, left = k // across * height, k % across * width
        drawn = render(robot, width=width, height=height, distance=fitting_distance(whole))
        picture[top : top + height, left : left + width] = drawn
    return picture


def columns(count: int) -> int:
    """Return how many panels stand in a row: up to three robots in one, then a square."""
    return max(count, 1) if count <= 3 else math.ceil(math.sqrt(count))


def data_url(picture: NDArray[np.uint8]) -> str:
    """Return a picture as a URL that holds it, in fewer colours."""
    coarse = np.minimum(np.rint(picture / COARSE) * COARSE, 255).astype(np.uint8)
    return "data:image/png;base64," + base64.b64encode(png(coarse)).decode("ascii")
