"""Maps of labels: the kind of robot, and its class of robots turned or mirrored."""

from __future__ import annotations

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

import softvox_gym
from softvox_gym.landscapes.analysis import symmetry_classes
from softvox_view.figures import Inputs, maps, style

#: Kinds of robot, from dark to light, so that they stay apart without colour.
KINDS = ("no voxels", "in pieces, none active", "in pieces", "one piece, none active", "one piece")
COLOURS = ("#000000", "#5B2A6E", "#C0563B", "#6FA8DC", "#F7E7A9")


def kinds() -> NDArray[np.int64]:
    """Return the kind of every design, an index into `KINDS`, shape (6561,)."""
    table = softvox_gym.landscape()
    is_active = table["n_active"] > 0
    kind = np.where(table["is_connected"], 3, 1) + is_active
    return np.where(table["n_voxels"] == 0, 0, kind)


def class_ranks() -> NDArray[np.int64]:
    """Return for every design the rank of its symmetry class, shape (6561,).

    The 1035 classes are ranked from 1 by their fittest design, ties by their smallest.
    """
    smallest, member_of = np.unique(symmetry_classes(), return_inverse=True)
    best = np.full(len(smallest), -np.inf)
    np.maximum.at(best, member_of, softvox_gym.landscape()["fitness"])
    rank = np.empty(len(smallest), dtype=np.int64)
    rank[np.lexsort((smallest, -best))] = 1 + np.arange(len(smallest))
    return rank[member_of]


def draw(_: Inputs) -> Figure:
    """Draw both maps side by side."""
    made = style.figure(style.WIDTH, 0.62 * style.WIDTH)
    (left, right), (key, bar) = made.subplots(2, 2, height_ratios=(24, 1))
    colours = ListedColormap(COLOURS)
    edges = BoundaryNorm(np.arange(len(KINDS) + 1) - 0.5, len(KINDS))
    maps.show(left, kinds(), cmap=colours, norm=edges)
    left.set_title("a  kind of robot", loc="left")
    counts = np.bincount(kinds(), minlength=len(KINDS))
    handles = [
        Patch(fc=colour, ec=style.INK, lw=0.4, label=f"{kind} ({count})")
        for kind, colour, count in zip(KINDS, COLOURS, counts, strict=True)
    ]
    key.set_axis_off()
    key.legend(handles=handles, loc="center", ncols=2)
    ranks = class_ranks()
    image = maps.show(right, ranks, cmap=f"{style.SEQUENTIAL}_r")
    right.set_title("b  symmetry class", loc="left")
    scale = made.colorbar(image, cax=bar, orientation="horizontal")
    scale.set_label("rank of the class by its fittest design")
    scale.set_ticks([ranks.max(), 800, 600, 400, 200, 1])
    bar.invert_xaxis()  # the lightest to the right, as on the other maps
    return made
