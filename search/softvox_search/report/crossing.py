"""The figure of a few runs across the reality gap: their regret, and where the robots go."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from softvox_search.report import style
from softvox_search.report.style import line, scaled
from softvox_search.transfer.run import TransferRun

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = NDArray[np.float64]

#: One per heading, in order; black is the mean.
COLOURS = tuple(colour for colour in style.COLOURS if colour != "#000000")


def picture(runs: Sequence[TransferRun], simulated: Array, real: Array) -> Figure:
    """Draw runs of one method in one reality that differ in their heading.

    Parameters
    ----------
    runs : sequence of TransferRun
    simulated, real : ndarray, shape (6561, 3)
        Displacement of every design in the nominal simulator and in reality, voxel widths; NaN
        for designs that were not measured.
    """
    made = style.figure(9.5, 4.6)
    losses, plane = made.subplots(1, 2)
    _losses(losses, runs)
    _plane(plane, runs, simulated, real)
    many = len(runs) > 1
    black: dict[str, Any] = {"color": style.INK}
    handles = [
        line(_name(run), color=colour, lw=scaled(1.8))
        for run, colour in zip(runs, cycle(COLOURS), strict=False)
    ]
    if many:
        handles.append(line("mean", lw=scaled(2.4), **black))
    handles.append(line(f"{'mean ' * many}class regret", lw=scaled(1.3), ls=":", **black))
    handles.append(line("in the simulator", marker="o", mfc="none", lw=scaled(1), ls="--", **black))
    handles.append(line("in reality", marker="o", lw=scaled(1.8), **black))
    best = "the best of those tried" if np.isnan(real).any() else "the best in reality"
    handles.append(line(best, marker="*", lw=0, ms=scaled(10), **black))
    style.legend(made, f"{runs[0].method} in {runs[0].reality}", handles)
    return made


def _losses(axis: Axes, runs: Sequence[TransferRun]) -> None:
    """Draw the regret after every test, for each run and on average."""
    at = np.arange(1, 1 + len(runs[0].regret))
    steps: dict[str, Any] = {"ds": "steps-post", "marker": "o" if len(at) == 1 else ""}
    for run, colour in zip(runs, cycle(COLOURS), strict=False):
        axis.plot(at, run.regret, color=colour, lw=scaled(1.4), **steps)
    if len(runs) > 1:
        mean = np.mean([run.regret for run in runs], axis=0)
        axis.plot(at, mean, color=style.INK, lw=scaled(2.4), **steps)
    mean = np.mean([run.class_regret for run in runs], axis=0)
    axis.plot(at, mean, color=style.INK, lw=scaled(1.3), ls=":", **steps)
    # The regret of a design that was not measured is NaN, and draws no line.
    lost = np.concatenate([run.regret for run in runs])
    if np.isnan(lost).any():
        words = f"{'unknown' if np.isnan(lost).all() else 'no line'}: nobody measured the design"
        axis.text(0.5, 0.95, words, transform=axis.transAxes, ha="center", va="top")
    axis.set_ylim(0, max(1.0, 1.05 * float(np.nanmax([0.0, *lost]))))
    axis.set_xlim(1, max(2, len(at)))
    axis.locator_params(axis="x", integer=True)
    axis.set_xlabel("tests in reality")
    axis.set_ylabel("regret, share of the best")
    axis.set_title("What is lost by building the design recommended")


def _plane(axis: Axes, runs: Sequence[TransferRun], simulated: Array, real: Array) -> None:
    """Draw where the designs recommended last go, in both worlds."""
    ends = []
    for run, colour in zip(runs, cycle(COLOURS), strict=False):
        design = int(run.recommended[-1])
        dashed: dict[str, Any] = {"ls": "--", "lw": scaled(1.0), "mfc": "none"}
        for world, look in ((simulated, dashed), (real, {"ls": "-", "lw": scaled(1.8)})):
            x, y = world[design, :2]
            # Only the end has a marker.
            axis.plot([0, x], [0, y], color=colour, marker="o", markevery=[1], **look)
            ends.append((x, y))
        best = int(np.nanargmax(run.task.reward(real)))
        axis.plot(*real[best, :2], color=colour, marker="*", ms=scaled(10), lw=0)
        ends.append(tuple(real[best, :2]))
        axis.annotate(
            str(design),
            ends[-2] if np.isfinite(ends[-2]).all() else ends[-3],
            xytext=(4, 4),
            textcoords="offset points",
            color=colour,
            fontsize=scaled(8),
        )
    reach = 1.15 * max(float(np.nanmax(np.abs(ends))), 0.5)
    for run, colour in zip(runs, cycle(COLOURS), strict=False):
        if run.task.heading is not None:
            x, y = run.task.direction
            axis.annotate(
                "",
                (x * reach, y * reach),
                (x * reach * 0.9, y * reach * 0.9),
                arrowprops={"arrowstyle": "-|>", "color": colour, "lw": scaled(1.2)},
                annotation_clip=False,
            )
    axis.set(xlim=(-reach, reach), ylim=(-reach, reach), aspect="equal")
    axis.set_xlabel("dx, voxel widths")
    axis.set_ylabel("dy, voxel widths")
    axis.set_title("Where it goes: the design recommended last")


def _name(run: TransferRun) -> str:
    return "any direction" if run.task.heading is None else f"heading {run.task.heading:g}°"
