"""Draw docs/picture.png: the fittest designs as their runs leave them. Needs the extra "plot"."""

from pathlib import Path

import matplotlib as mpl
import numpy as np

mpl.use("Agg")
import matplotlib.pyplot as plt
from softvox_gym.bench import Bench

from softvox_gym import Design, Physics, landscape
from softvox_gym.rendering import render

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
    designs = best_designs(COLUMNS * ROWS)
    rows = np.array([[int(digit) for digit in design.digits] for design in designs])
    bench = Bench(Physics.published(), with_poses=True)
    outcome, poses = bench.run(rows, lambda: ())
    figure, axes = plt.subplots(ROWS, COLUMNS, figsize=(10, 4.4), layout="constrained")
    for i, axis in enumerate(axes.flat):
        pose = poses[i]
        assert pose is not None
        height = float(np.mean(pose.position[:, 2]))
        centre = (*pose.position[:, :2].mean(axis=0), height)
        axis.imshow(render(pose, width=640, height=480, look_at=centre, distance=6.5))
        axis.set_title(f"{designs[i].digits}   {outcome.values[i, 0]:.2f}", family="monospace")
        axis.set_axis_off()
    figure.savefig(Path(__file__).with_name("picture.png"), dpi=100)


if __name__ == "__main__":
    main()
