"""Draw docs/picture.png: the fittest designs as their runs leave them. Needs the extra "plot"."""

from pathlib import Path

import numpy as np

from softvox_gym import Design, Physics, landscape, simulate
from softvox_gym.rendering import render
from softvox_search.report.style import encoded, figure, style
from softvox_view import replay

COLUMNS, ROWS = 4, 2


def best_designs(count: int) -> list[Design]:
    """Return the fittest designs, one of all that look the same when turned or mirrored."""
    best: dict[Design, Design] = {}
    for index in np.argsort(-landscape()["fitness"], kind="stable"):
        design = Design(index)
        best.setdefault(design.canonical(), design)
        if len(best) == count:
            break
    return list(best.values())


def main() -> None:
    """Draw the picture."""
    physics = Physics.published()
    last = int(physics.duration / physics.time_step)
    result = simulate(best_designs(COLUMNS * ROWS), physics, frames=last)
    with style(changes={"figure.dpi": 100}):
        made = figure(10, 4.4)
        for i, axis in enumerate(made.subplots(ROWS, COLUMNS).flat):
            pose = replay.pose(result, i, 1)
            centre = pose.position.mean(axis=0).tolist()
            axis.imshow(render(pose, width=640, height=480, look_at=centre, distance=6.5))
            axis.set_title(
                f"{result.design(i).digits}   {result.fitness[i]:.2f}", family="monospace"
            )
            axis.set_axis_off()
        Path(__file__).with_name("picture.png").write_bytes(encoded(made))


if __name__ == "__main__":
    main()
