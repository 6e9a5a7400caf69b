"""Tasks: what a robot should do, and the reward for its displacement."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from math import isfinite, pi

import numpy as np
from numpy.typing import NDArray

from softvox_gym.portable import cos_sin
from softvox_gym.simulation import check_number

Array = NDArray[np.float64]

TASKS = ("displacement", "directed")

#: Headings of the directed task, degrees; reported numbers are means over these.
HEADINGS = (0.0, 90.0, 180.0, 270.0)

#: Unit vectors of the quarter turns, for which a series would be off in the last bit.
_QUARTERS = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))


@dataclass(frozen=True)
class Task:
    """A task: its name, and for the directed one the heading.

    Parameters
    ----------
    name : {"displacement", "directed"}
        To travel as far as possible in any direction, the task of Kriegman et al. 2020; or along a
        heading, where travel in the opposite direction is negative.
    heading : float, optional
        Degrees from x towards y; 0 by default in the directed task.

    Raises
    ------
    TypeError, ValueError
        If the task is unknown, has no heading but one is given, or the heading is not finite.
    """

    name: str = "displacement"
    heading: float | None = None

    def __post_init__(self) -> None:
        if self.name not in TASKS:
            close = difflib.get_close_matches(str(self.name), TASKS, n=1)
            hint = f"; did you mean {close[0]}?" if close else ""
            raise ValueError(f"no task {self.name!r}{hint}; there are {', '.join(TASKS)}")
        if self.name == "displacement":
            if self.heading is not None:
                raise ValueError("the task displacement has no heading; only directed has one")
            return
        heading = check_number("heading", 0.0 if self.heading is None else self.heading)
        if not isfinite(heading):
            raise ValueError(f"heading must be finite, got {heading}")
        object.__setattr__(self, "heading", heading % 360.0 % 360.0)  # -1e-20 % 360 is 360

    @classmethod
    def of(cls, task: str | Task, heading: float | None = None) -> Task:
        """Return a task by its name, with a heading if given; a Task is returned unchanged.

        Raises
        ------
        TypeError, ValueError
            As the class does, or if a heading is given with a Task.
        """
        if not isinstance(task, Task):
            return cls(task, heading)
        if heading is not None:
            raise ValueError("heading needs the name of a task; the Task given has its own")
        return task

    @property
    def direction(self) -> tuple[float, float]:
        """The unit vector (x, y) of the heading; ValueError if the task has none."""
        if self.heading is None:
            raise ValueError(f"the task {self.name} has no heading")
        if self.heading in HEADINGS:
            return _QUARTERS[HEADINGS.index(self.heading)]
        cosine, sine = cos_sin(np.array(self.heading * (pi / 180)))
        return float(cosine), float(sine)

    def reward(self, displacement: Array) -> Array:
        """Return the rewards, shape (...), of displacements, shape (..., 3), in their unit."""
        x, y = displacement[..., 0], displacement[..., 1]
        if self.heading is None:
            return np.asarray(np.sqrt(x * x + y * y))
        along, across = self.direction
        return np.asarray(x * along + y * across)

    def __str__(self) -> str:
        return self.name if self.heading is None else f"{self.name} {self.heading:g} degrees"
