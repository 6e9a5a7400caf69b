"""What noise leaves of every design's fitness, as maps."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

import softvox_gym
from softvox_view.figures import Inputs, Made, maps, style
from softvox_view.headings import LITTLE

LEVEL = 1.0

#: Shares at the ends of the scale; what lies beyond has the colour of the end.
LOW, HIGH = 0.5, 2.0
TICKS = (0.5, 0.7, 1.0, 1.4, 2.0)


def retained() -> NDArray[np.float64]:
    """Return the mean fitness under noise as a share of the fitness without, shape (6561,).

    NaN where a design travels less than `LITTLE` without noise.
    """
    fitness = softvox_gym.landscape()["fitness"]
    mean = softvox_gym.noisy_landscape(LEVEL)["mean"]
    share = np.full(len(fitness), np.nan)
    np.divide(mean, fitness, out=share, where=fitness >= LITTLE)
    return share


def draw(_: Inputs) -> Made:
    """Draw the mean under noise, and the share of the fitness that it is."""
    mean = softvox_gym.noisy_landscape(LEVEL)["mean"]
    made = style.figure(style.WIDTH, 0.61 * style.WIDTH)
    left, right = made.subplots(1, 2)
    image = maps.show(left, mean, cmap=style.SEQUENTIAL, vmin=0)
    left.set_title(f"a  mean fitness at noise level {LEVEL:g}", loc="left")
    bar: dict[str, Any] = {"location": "bottom", "shrink": 0.9, "pad": 0.02}
    made.colorbar(image, ax=left, label="voxel widths", **bar)
    maps.mark(left, int(mean.argmax()), f"{mean.argmax()}: {mean.max():.2f}")
    right.set_facecolor("white")
    image = maps.show(right, retained(), cmap=style.SEQUENTIAL, norm=LogNorm(LOW, HIGH))
    right.set_title("b  the same as a share of the fitness without noise", loc="left")
    scale = made.colorbar(image, ax=right, extend="both", **bar)
    scale.set_label(f"share; white: fitness below {LITTLE:g} voxel widths")
    scale.ax.xaxis.set_minor_locator(NullLocator())
    scale.set_ticks(TICKS, labels=[f"{tick:g}" for tick in TICKS])
    return Made({"robustness": made})
