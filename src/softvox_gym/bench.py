"""The bench on which environments try designs: nominally, under disturbances, repeatedly."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.conditions import Conditions, Disturbance
from softvox_gym.design import ACTIVE, checked_digits, indices_of
from softvox_gym.engine import step_count
from softvox_gym.landscapes import table
from softvox_gym.outcome import Outcome
from softvox_gym.physics import Physics
from softvox_gym.rendering import Pose
from softvox_gym.simulation import Result, sample_count, simulate

SAMPLES_PER_CYCLE = 1

#: Of a disturbed run: the picture shows the last of them, at most a 64th of the run before its end.
POSES_PER_RUN = 64

Generators = Callable[[], Sequence[np.random.Generator]]


class Bench:
    """Tries designs by simulating them.

    A wrapper changes what the next step does for the time of a `with`: `disturbed` and `repeated`.

    Parameters
    ----------
    physics : Physics
        Single numbers, the nominal conditions.
    with_poses : bool
        Whether poses are wanted for pictures.
    threads : int, optional
        At most this many; all processors of the process where None.

    Attributes
    ----------
    physics : Physics
    samples : int
        Of a track: one per nominal cycle of actuation, start and end included.
    repeats : int or None
        Trials per design that a wrapper asks for.
    """

    can_be_disturbed = True

    def __init__(self, physics: Physics, *, with_poses: bool, threads: int | None = None) -> None:
        self.physics = physics
        self.samples = sample_count(physics, SAMPLES_PER_CYCLE)
        self.threads = threads
        self.repeats: int | None = None
        self._disturbances: tuple[Disturbance, ...] = ()
        self._with_poses = with_poses

    @contextmanager
    def disturbed(self, disturbance: Disturbance) -> Iterator[None]:
        """Let a disturbance change the conditions of every trial; several act one after another."""
        before = self._disturbances
        self._disturbances = (*before, disturbance)
        try:
            yield
        finally:
            self._disturbances = before

    @contextmanager
    def repeated(self, n: int) -> Iterator[None]:
        """Try every design n times."""
        self.repeats = n
        try:
            yield
        finally:
            self.repeats = None

    def run(
        self, rows: NDArray[Any], generators: Generators
    ) -> tuple[Outcome, Sequence[Pose | None]]:
        """Try designs, all trials in one crossing into C.

        Parameters
        ----------
        rows : ndarray of int, shape (n, 8)
            Digits.
        generators : callable () -> sequence of Generator
            One per design, for the disturbances.

        Returns
        -------
        outcome : Outcome
        poses : sequence of Pose or None
            How the first trial of each design left it; empty where none are wanted.
        """
        trials = self.repeats or 1
        frames = self._last_step if self._with_poses else 0
        if self._disturbances:  # then runs may end earlier than the nominal last step
            frames = -(-frames // POSES_PER_RUN)
            result = self._under(self._conditions(generators(), trials), rows, trials, frames)
        else:  # trials that can't differ are simulated once
            result = self._simulated(rows, frames)
        outcome = Outcome.of(result, rows, self.samples, self.repeats)
        if not self._disturbances:
            outcome = _copied(outcome, trials)
        first = range(0, len(result), len(result) // max(len(rows), 1)) if len(rows) else ()
        return outcome, [final_pose(result, i) for i in first] if frames else []

    def _simulated(self, rows: NDArray[Any], frames: int) -> Result:
        return simulate(
            rows, self.physics, track=SAMPLES_PER_CYCLE, frames=frames, threads=self.threads
        )

    def _under(
        self, conditions: Conditions, rows: NDArray[Any], trials: int, frames: int
    ) -> Result:
        return simulate(
            np.repeat(rows, trials, axis=0),
            conditions.physics(self.physics),
            strain=conditions.strain,
            phase=conditions.phase,
            track=SAMPLES_PER_CYCLE,
            frames=frames,
            threads=self.threads,
        )

    def _conditions(self, generators: Sequence[np.random.Generator], trials: int) -> Conditions:
        nominal = Conditions.nominal(self.physics, trials)
        parts = []
        for generator in generators:
            part = nominal
            for disturbance in self._disturbances:
                part = disturbance(part, generator)
            parts.append(part)
        return Conditions.joined(parts or [nominal])

    @property
    def _last_step(self) -> int:
        """The step at which a nominal run ends."""
        return step_count(float(self.physics.time_step), float(self.physics.duration))


class TableBench(Bench):
    """Looks the designs up in the table that ships with the package."""

    can_be_disturbed = False

    def __init__(self, *, with_poses: bool, threads: int | None = None) -> None:
        super().__init__(Physics.published(), with_poses=with_poses, threads=threads)

    def run(
        self, rows: NDArray[Any], generators: Generators
    ) -> tuple[Outcome, Sequence[Pose | None]]:
        """Look designs up; poses, where wanted, are simulated."""
        design = indices_of(checked_digits(rows))
        track, steps = table.tracks()
        outcome = Outcome(
            design=design,
            track=track[design][:, np.newaxis],
            displacement=track[design, -1][:, np.newaxis],
            steps=steps[design].astype(np.int64)[:, np.newaxis],
            is_repeated=self.repeats is not None,
        )
        poses = super().run(rows, generators)[1] if self._with_poses else []
        return _copied(outcome, self.repeats or 1), poses


def _copied(outcome: Outcome, trials: int) -> Outcome:
    """Return the outcome of one trial each as that of several which can't differ.

    They count as if all had been simulated, so that a budget means the same with and without noise.
    """
    if trials == 1:
        return outcome
    return replace(
        outcome,
        track=np.repeat(outcome.track, trials, axis=1),
        displacement=np.repeat(outcome.displacement, trials, axis=1),
        steps=np.repeat(outcome.steps, trials, axis=1),
    )


def final_pose(result: Result, i: int) -> Pose | None:
    """Return how the i-th run left its design, or None where it has no voxels.

    The result must hold a frame of the last step of every run, or of a step shortly before where
    runs differ in length. A design that diverged is shown as built.
    """
    assert result.frames is not None
    frames, digits = result.frames, result.designs[i]
    present = digits > 0
    if not present.any():
        return None
    seen = ~np.isnan(frames.position[i][:, present]).any(axis=(1, 2))
    row = int(np.flatnonzero(seen)[-1]) if result.status[i] == "ok" else 0
    return Pose(
        position=frames.position[i, row][present] / result.physics.edge,
        quaternion=frames.quaternion[i, row][present],
        edge=frames.edge[i, row][present] / result.physics.edge,
        active=digits[present] == ACTIVE,
    )
