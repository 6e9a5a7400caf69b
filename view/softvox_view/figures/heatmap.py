"""The fitness of every design as a map (Fig. 4)."""

from __future__ import annotations

from matplotlib.figure import Figure

import softvox_gym
from softvox_view.figures import Inputs, maps, style


def draw(_: Inputs) -> Figure:
    """Draw the map: lighter is fitter."""
    fitness = softvox_gym.landscape()["fitness"]
    best = int(fitness.argmax())
    made = style.figure(0.8 * style.WIDTH, 0.68 * style.WIDTH)
    axis = made.subplots()
    image = maps.show(axis, fitness, cmap=style.SEQUENTIAL, vmin=0)
    made.colorbar(image, ax=axis, label="fitness, voxel widths", pad=0.02)
    maps.mark(axis, best, f"{best}: {fitness[best]:.2f}")
    return made
