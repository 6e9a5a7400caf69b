"""The display of a design or a result in a notebook: facts, and robots that move if recorded."""

from __future__ import annotations

import html
import math
from collections.abc import Sequence

import numpy as np

from softvox_gym.design import Design
from softvox_gym.motion import rest_pose
from softvox_gym.rendering import render
from softvox_gym.simulation import Result
from softvox_view.replay import data
from softvox_view.replay.page import page
from softvox_view.replay.still import beside, data_url, still

ROBOTS = 3  # shown, the fittest first
ROWS = 8  # of the table
MOST_FRAMES = 400  # of a recording
MOST_BYTES = 300_000  # of a recording: they stay in the notebook
PANEL = (240, 180)  # pixels


def notebook(value: Design | Result) -> str:
    """Return HTML: a picture of a design as built, or of a result's fittest, and a table of facts.

    If a result has frames, a player shows its designs moving.
    """
    if isinstance(value, Design):
        picture, table = _built([value]), _table(_FACTS, [_facts(value)], "1 design")
        return f"{picture}\n{table}"
    worth = np.where(value.diverged, -1.0, value.fitness)
    order: list[int] = np.argsort(-worth, kind="stable").tolist()
    shown = order[:ROBOTS]
    parts = []
    if shown and value.frames is not None:
        parts.append(_player(value, shown))
    elif shown:
        parts.append(_built([value.design(i) for i in shown]))
    caption = f"{len(order)} designs" + (f", the fittest {ROWS}" if len(order) > ROWS else "")
    rows = []
    for i in order[:ROWS]:
        travel = [value.fitness[i], *value.displacement[i, :2]]
        numbers = ["diverged", "", ""] if value.diverged[i] else [f"{far:.3f}" for far in travel]
        rows.append([i, *_facts(value.design(i)), *numbers])
    header = ("#", *_FACTS, "fitness", "dx", "dy")
    parts.append(_table(header, rows, f"{caption}; lengths in voxel widths"))
    return "\n".join(parts)


def _built(designs: Sequence[Design]) -> str:
    width, height = PANEL
    built = [rest_pose(design.array) for design in designs]
    picture = beside([render(pose, width=width, height=height) for pose in built])
    names = "; ".join(data.name_of(design) for design in designs)
    return f'<img alt="{html.escape(names)}" src="{data_url(picture)}">'


def _player(result: Result, shown: list[int]) -> str:
    # One clock for all shown designs: that of the fittest.
    shown = [i for i in shown if data.clock_of(result, i) == data.clock_of(result, shown[0])]
    size = data.bytes_per_frame(result.design(i) for i in shown)
    most = max(2, min(MOST_FRAMES, MOST_BYTES // size))
    picture = still(result, *shown, panel=PANEL)
    assert result.frames is not None
    stride = math.ceil(len(result.frames.step) / most)
    content = page(data.recording(result, *shown, stride=stride), picture)
    return (
        '<iframe sandbox="allow-scripts" style="border: 0; width: 100%; height: 420px" '
        f'title="replay" srcdoc="{html.escape(content)}"></iframe>'
    )


def _table(names: Sequence[str], rows: Sequence[Sequence[object]], caption: str) -> str:
    head = "".join(f"<th>{name}</th>" for name in names)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return (
        f"<table><caption>{caption}</caption>"
        f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )


_FACTS = ("design", "lattice", "digits", "voxels", "active", "in one piece")


def _facts(design: Design) -> list[object]:
    """Return a design's number, if it is not longer than its digits, and its body in numbers."""
    number = design.index if design.lattice.has_int64_numbers else ""
    is_connected = "yes" if design.is_connected else "no"
    digits = design.digits[:64]
    return [number, design.lattice, digits, design.n_voxels, design.n_active, is_connected]
