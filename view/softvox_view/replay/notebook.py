"""What a result looks like in a notebook: facts, and the robots, moving where it has frames."""

from __future__ import annotations

import html
import math
from typing import Any

import numpy as np

from softvox_gym.design import Design
from softvox_gym.rendering import fitting_distance
from softvox_view.replay.data import bytes_per_frame, clock_of, label, recording, rest_pose
from softvox_view.replay.page import page
from softvox_view.replay.recorded import Recorded
from softvox_view.replay.still import beside, data_url, still

ROBOTS = 3  # shown, the fittest first
ROWS = 8  # of the table
MOST_FRAMES = 400  # of a recording
MOST_BYTES = 300_000  # of a recording: they stay in the notebook
PANEL = (240, 180)  # pixels


def notebook(result: Recorded) -> str:
    """Return a result as HTML: a picture of the fittest designs, and a table of facts.

    The designs are shown as built; where the result has frames, a player shows them moving.
    """
    order = fittest(result)
    shown = order[:ROBOTS]
    parts = []
    if shown:
        parts.append(_built(result, shown) if result.frames is None else _player(result, shown))
    parts.append(_table(result, order))
    return "\n".join(parts)


def fittest(result: Recorded) -> list[int]:
    """Return the places of a batch's designs, the fittest first, those that diverged last."""
    worth = np.where(np.isfinite(result.fitness), result.fitness, -1.0)
    order: list[int] = np.argsort(-worth, kind="stable").tolist()
    return order


def _built(result: Recorded, shown: list[int]) -> str:
    poses = [rest_pose(result.designs[i]) for i in shown]
    distances = [fitting_distance(pose) for pose in poses]
    picture = beside(poses, panel=PANEL, distances=distances)
    names = html.escape("; ".join(label(result, i) for i in shown))
    return f'<img alt="{names}" src="{data_url(picture)}">'


def _player(result: Recorded, shown: list[int]) -> str:
    assert result.frames is not None
    # One clock runs for all that are shown: that of the fittest.
    shown = [i for i in shown if clock_of(result, i) == clock_of(result, shown[0])]
    size = bytes_per_frame(Design(result.designs[i]) for i in shown)
    most = max(2, min(MOST_FRAMES, MOST_BYTES // size))
    stride = math.ceil(len(result.frames.step) / most)
    content = page(recording(result, *shown, stride=stride), still(result, *shown, panel=PANEL))
    return (
        '<iframe sandbox="allow-scripts" style="border: 0; width: 100%; height: 420px" '
        f'title="replay" srcdoc="{html.escape(content)}"></iframe>'
    )


def _table(result: Recorded, order: list[int]) -> str:
    rows = [_row(result, i) for i in order[:ROWS]]
    names = ("#", "design", "digits", "voxels", "active", "fitness", "dx", "dy")
    head = "".join(f"<th>{name}</th>" for name in names)
    more = len(order) - len(rows)
    caption = f"{len(order)} designs" + (f", the fittest {len(rows)}" if more else "")
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return (
        f"<table><caption>{caption}; lengths in voxel widths</caption>"
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


def _row(result: Recorded, i: int) -> list[Any]:
    design = Design(result.designs[i])
    sites = len(design.digits)
    facts = [i, design.index if sites <= 27 else "", design.digits[:64]]
    travel = [result.fitness[i], *result.displacement[i, :2]]
    if not np.isfinite(travel).all():
        return [*facts, design.n_voxels, design.n_active, "diverged", "", ""]
    return [*facts, design.n_voxels, design.n_active, *(f"{value:.3f}" for value in travel)]
