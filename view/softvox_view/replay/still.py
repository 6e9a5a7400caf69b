"""Still pictures of replays."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from softvox_gym.motion import Motion, frames_of
from softvox_gym.rendering import Stage, lanes, png
from softvox_gym.simulation import Result
from softvox_view.replay.data import checked_places

#: Step between the colours of a picture in a page, which saves two fifths of its bytes.
COARSE = 4

PANEL = (400, 300)  # pixels, at most
WIDTH = 900  # pixels of all panels beside each other, at most


class Panels:
    """Robots in panels side by side, to be drawn frame after frame.

    Parameters
    ----------
    scenes : sequence of sequences of (Result, int)
        The robots of each panel, as results with frames and indices in their batch.
    panel : (int, int)
        Width and height of each, pixels.
    boxes : bool
        As in `softvox_gym.rendering.render`.
    """

    def __init__(
        self,
        scenes: Sequence[Sequence[tuple[Result, int]]],
        *,
        panel: tuple[int, int],
        boxes: bool = False,
    ) -> None:
        self.stages: list[Stage] = []
        self._scenes: list[list[tuple[Result, Motion, NDArray[np.float64]]]] = []
        for scene in scenes:
            motions = [Motion.of(result, i) for result, i in scene]
            walks = [motion.walk for motion in motions]
            shifts = lanes(walks)
            moved = [one.moved(shift) for one, shift in zip(walks, shifts, strict=True)]
            self.stages.append(Stage(moved, width=panel[0], height=panel[1], boxes=boxes))
            results = [result for result, _ in scene]
            self._scenes.append(list(zip(results, motions, shifts, strict=True)))

    def picture(self, frame_of: Callable[[Result], int]) -> NDArray[np.uint8]:
        """Draw the given frame of each result; after a robot's last frame, the last."""
        drawn = []
        for stage, robots in zip(self.stages, self._scenes, strict=True):
            poses, moments = [], []
            for result, motion, shift in robots:
                frame = min(frame_of(result), motion.last)
                pose = motion.pose(frame)
                poses.append(replace(pose, position=pose.position + shift))
                moments.append(max(0, frame - motion.begin))
            drawn.append(stage.picture(poses, moments))
        return beside(drawn)


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
        As in `recording`.
    frame : int, optional
        From 0; by default the last.
    panel : (int, int), optional
        Width and height of each robot's picture, pixels; by default smaller for many robots.

    Returns
    -------
    ndarray of uint8, shape (height, width, 3)
    """
    places = checked_places(result, designs)
    shown = len(frames_of(result).step) - 1 if frame is None else frame
    scenes = [[(result, i)] for i in places]
    return Panels(scenes, panel=panel or panel_for(len(places))).picture(lambda _: shown)


def panel_for(count: int) -> tuple[int, int]:
    """Return a panel's width and height, pixels: smaller for many robots."""
    width = min(PANEL[0], WIDTH // columns(count))
    return width, width * PANEL[1] // PANEL[0]


def beside(pictures: Sequence[NDArray[np.uint8]]) -> NDArray[np.uint8]:
    """Put pictures in rows of `columns`; the rest of the last row is empty."""
    height, width, _ = pictures[0].shape if pictures else (*PANEL[::-1], 3)
    across = columns(len(pictures))
    rows = max(1, math.ceil(len(pictures) / across))
    picture = np.full((rows * height, across * width, 3), 255, np.uint8)
    for k, drawn in enumerate(pictures):
        top, left = k // across * height, k % across * width
        picture[top : top + height, left : left + width] = drawn
    return picture


def columns(count: int) -> int:
    """Return the number of panels in a row: up to three robots in one row, then a square."""
    return max(count, 1) if count <= 3 else math.ceil(math.sqrt(count))


def data_url(picture: NDArray[np.uint8]) -> str:
    """Return a picture as a data URL, in fewer colours."""
    coarse = np.minimum(np.rint(picture / COARSE) * COARSE, 255).astype(np.uint8)
    return "data:image/png;base64," + base64.b64encode(png(coarse)).decode("ascii")
