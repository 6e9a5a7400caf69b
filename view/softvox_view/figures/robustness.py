"""What noise leaves of every design's fitness, as maps."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

import softvox_gym
from softvox_view.figures import Inputs, maps, style

LEVEL = 1.0

#: Voxel widths: of slower robots a share says little, since many of them walk faster under noise.
FAST = 1.0


def kept() -> NDArray[np.float64]:
    """Return what share of its fitness a design keeps in nine draws out of ten, shape (6561,).

    The 10 % quantile under noise over the fitness without. NaN where that is less than `FAST`.
    """
    fitness = softvox_gym.landscape()["fitness"]
    share = np.full(len(fitness), np.nan)
    quantile = softvox_gym.noisy_landscape(LEVEL)["q10"]
    np.divide(quantile, fitness, out=share, where=fitness >= FAST)
    return share


def draw(_: Inputs) -> Figure:
    """Draw the mean under noise, and the share of the fitness that nine draws in ten keep."""
    mean = softvox_gym.noisy_landscape(LEVEL)["mean"]
    made = style.figure(style.WIDTH, 0.61 * style.WIDTH)
    left, right = made.subplots(1, 2)
    image = maps.show(left, mean, cmap=style.SEQUENTIAL, vmin=0)
    left.set_title(f"a  mean fitness at noise level {LEVEL:g}", loc="left")
    bar: dict[str, Any] = {"location": "bottom", "shrink": 0.9, "pad": 0.02}
    made.colorbar(image, ax=left, label="voxel widths", **bar)
    maps.mark(left, int(mean.argmax()), f"{mean.argmax()}: {mean.max():.2f}")
    right.set_facecolor("white")
    colours = style.on_white(style.SEQUENTIAL)
    image = maps.show(right, kept(), lines=style.PALE, cmap=colours, vmin=0, vmax=1)
    right.set_title("b  share of the fitness kept in nine draws of ten", loc="left")
    scale = made.colorbar(image, ax=right, extend="max", **bar)
    scale.set_label(f"10 % quantile / fitness; white: fitness below {FAST:g} voxel width")
    return made
