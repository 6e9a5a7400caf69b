"""Episodes of one step: the action is a design, and the step evaluates it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple, Self

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from softvox_gym.design import BodyFacts, checked_digits
from softvox_gym.engine import step_count
from softvox_gym.envs.episodes import (
    WALK_FPS,
    WALK_SPEED,
    Episodes,
    Generators,
    Rows,
    Started,
    Stepped,
)
from softvox_gym.evaluation import SAMPLES_PER_CYCLE, Evaluation, evaluate
from softvox_gym.landscapes.table import LATTICE, has_table, looked_up, no_table
from softvox_gym.lattice import Lattice
from softvox_gym.motion import Motion
from softvox_gym.noise import Perturbation
from softvox_gym.objectives import objectives_of
from softvox_gym.physics import Physics
from softvox_gym.realities import PhysicsLike, Reality, reality_of
from softvox_gym.rendering import Pose, Stage, Walk
from softvox_gym.simulation import Result, check_flag, check_threads, sample_count, spaced
from softvox_gym.tasks import Task

#: Objectives that need only the ends of a track.
TOLD_BY_ENDS = ("displacement", "voxels", "actuators", "heading")

#: Points of the path in a picture; the robot is shown at the last of them.
POSES_PER_RUN = 128


class Action(NDArray[np.int64]):
    """An action, or a batch of them, with the requests of the wrappers around the environment.

    Wrappers pass it inwards through whatever lies between them and the environment.

    Attributes
    ----------
    perturbations : tuple of Perturbation
        Applied to every trial.
    trials : int or None
        Trials per design; None if no wrapper asks for several, so that infos need not list each.
    heard : list of True
        The environment appends to it when it receives the requests; None without requests.
    """

    perturbations: tuple[Perturbation, ...] = ()
    trials: int | None = None
    heard: list[bool] | None = None

    @classmethod
    def of(cls, action: ArrayLike) -> Self:
        """Return an action as an `Action`, with the requests it already has."""
        array = np.asanyarray(action)
        return array if isinstance(array, cls) else array.view(cls)

    def __array_finalize__(self, other: Any) -> None:
        """Keep the requests when an action is copied, transformed or indexed."""
        self.perturbations = getattr(other, "perturbations", ())
        self.trials = getattr(other, "trials", None)
        self.heard = getattr(other, "heard", None)

    def asking(self, *perturbations: Perturbation, trials: int | None = None) -> Self:
        """Return the action with added requests for perturbations or trials."""
        asked = self.view()
        asked.perturbations = (*self.perturbations, *perturbations)
        asked.trials = self.trials if trials is None else trials
        asked.heard = [] if self.heard is None else self.heard
        return asked


class Evaluator(Episodes):
    """Evaluates the designs that actions stand for; takes the arguments of an environment."""

    def __init__(
        self,
        shape: Sequence[int] = (2, 2, 2),
        physics: PhysicsLike = "published",
        render_mode: str | None = None,
        *,
        reality: str | Reality | None = None,
        task: str | Task = "displacement",
        heading: float | None = None,
        from_table: bool = False,
        phases: int | None = None,
        objectives: Sequence[str] | None = None,
        threads: int | None = None,
    ) -> None:
        super().__init__(render_mode)
        check_threads(threads)
        check_flag("from_table", from_table)
        self.lattice = Lattice.of(shape, phases=phases)
        self.reality = reality_of(physics, reality)
        self.physics = self.reality.physics
        self.task = Task.of(task, heading)
        asked = () if objectives is None else objectives_of(objectives)
        self.asked = tuple(one.name for one in asked)
        self.from_table = from_table
        self.threads = threads
        if from_table:
            _check_table(self.reality, self.lattice, self.asked)
        if asked:
            low, high = np.array([(one.low, one.high) for one in asked]).T
            self.reward_space = spaces.Box(low, high, dtype=np.float64)
        if not self.reality.is_plain:
            self.reality.trials(np.zeros(self.lattice, np.uint8))  # phases must fit the lattice
        samples = sample_count(self.physics, SAMPLES_PER_CYCLE)
        if from_table and self.lattice.phases > 1:
            samples = 2  # the table has no tracks
        self.single_action_space = spaces.MultiDiscrete([self.lattice.states] * self.lattice.sites)
        self.single_observation_space = spaces.Box(
            -np.inf, np.inf, shape=(samples, 3), dtype=np.float64
        )

    def start(self, which: Rows, generators: Generators) -> Started:
        """Show the empty floor."""
        shape = self.single_observation_space.shape or ()
        return Started(np.zeros((len(which), *shape)), {}, [None] * len(which))

    def step(self, which: Rows, actions: NDArray[np.int64], generators: Generators) -> Stepped:
        """Evaluate a batch of designs; films show the first trial of each."""
        actions = Action.of(actions)
        if actions.heard is not None:
            actions.heard.append(True)
        sites = self.lattice.sites
        *first, last = map(str, range(self.lattice.states))
        if actions.dtype.kind not in "iu" or actions.ndim != 2 or actions.shape[1] != sites:
            numbers = ", ".join(first)
            raise ValueError(
                f"an action must be {sites} whole numbers {numbers} or {last}, one per site; "
                f"got {actions.dtype} values of shape {actions.shape[1:]}"
            )
        rows = checked_digits(np.asarray(actions), self.lattice, what="an action")
        stack = self.lattice.to_stack(rows)
        trials = actions.trials or 1
        films: Sequence[Filmed | None] = [None] * len(rows)
        if self.render_mode or not self.from_table:
            evaluation = evaluate(
                stack,
                self.reality,
                shape=self.lattice,
                task=self.task,
                perturbations=actions.perturbations,
                trials=trials,
                objectives=self.asked or None,
                seed=generators() if actions.perturbations else None,
                frames=self._frames(actions),
                threads=self.threads,
            )
            if self.render_mode:
                films = _filmed(evaluation.result, len(rows), self)
        if self.from_table:
            looked = looked_up(stack, self.task, self.lattice)
            evaluation = replace(looked, asked=self.asked).repeated(trials)
        tracks = np.where(np.isnan(evaluation.track), 0.0, evaluation.track)
        return Stepped(
            tracks[:, 0].copy() if tracks.shape[1] == 1 else tracks.mean(axis=1),
            evaluation.objectives if self.asked else evaluation.value,
            terminated=np.ones(len(rows), dtype=np.bool_),
            truncated=np.zeros(len(rows), dtype=np.bool_),
            infos=_infos(evaluation, rows, is_repeated=actions.trials is not None),
            films=films,
        )

    def _frames(self, actions: Action) -> int:
        """Return the steps between frames of a run."""
        if self.render_mode is None:
            return 0
        physics = self.reality.of_parts(self.physics)
        step, duration = float(physics.time_step), float(physics.duration)
        if self.render_mode == "rgb_array_list":
            return max(1, round(WALK_SPEED / WALK_FPS / step))
        # Perturbations may end a run earlier.
        return spaced(step_count(step, duration), POSES_PER_RUN)


def _check_table(reality: Reality, lattice: Lattice, asked: Sequence[str]) -> None:
    """Check that a table has all that is requested; otherwise ValueError."""
    if reality.plain_physics != Physics.published() or lattice[:] != LATTICE:
        raise ValueError(
            "from_table needs shape (2, 2, 2), physics 'published' and no reality; without "
            "from_table, as in SoftVox2x2x2-v0, anything can be simulated"
        )
    if "energy" in asked:
        raise ValueError(
            "objectives has energy, which the table lacks; without from_table, as in "
            "SoftVox2x2x2-v0, it is simulated"
        )
    if lattice.phases > 1 and not {*asked} <= {*TOLD_BY_ENDS}:
        raise ValueError(
            f"objectives may be {', '.join(TOLD_BY_ENDS)} from the table of several phases, which "
            "has no tracks; without from_table all are simulated"
        )
    if not has_table(lattice):
        raise ValueError(no_table(lattice))


class Filmed(NamedTuple):
    """The walk of a robot from the moment the pump began."""

    walk: Walk
    poses: list[Pose]  # at every moment; for single pictures only the first and the last

    def pictures(self) -> list[NDArray[np.uint8]]:
        """Draw every moment."""
        stage = Stage([self.walk])
        return [stage.picture([pose], [k]) for k, pose in enumerate(self.poses)]

    def last(self) -> NDArray[np.uint8]:
        """Draw the last moment."""
        return Stage([self.walk]).picture(self.poses[-1:])


def _infos(evaluation: Evaluation, rows: NDArray[np.uint8], *, is_repeated: bool) -> dict[str, Any]:
    """Return the infos of an evaluation: for each key an array of shape (n, ...)."""
    lattice = evaluation.lattice
    bodies = BodyFacts.of(rows, lattice)
    lost = evaluation.diverged.all(axis=1)
    identity = {"design": lattice.numbers(rows)} if lattice.has_int64_numbers else {"digits": rows}
    infos: dict[str, Any] = {
        **identity,
        "fitness": np.where(lost, np.nan, evaluation.value),
        "displacement": evaluation.mean_displacement,
        "diverged": lost,
        "n_voxels": bodies.n_voxels,
        "is_connected": bodies.is_connected,
        "steps": evaluation.steps.sum(axis=1),
    }
    if is_repeated:
        infos |= {"values": evaluation.fitness, "displacements": evaluation.displacement}
    if is_repeated and evaluation.asked:
        infos["objectives"] = evaluation.objectives_of_trials
    return infos


def _filmed(result: Result | None, n: int, evaluator: Evaluator) -> list[Filmed | None]:
    """Return films of the first trial of each of n designs, in voxel widths.

    A design that diverged is shown as built; one without voxels has no film.
    """
    if result is None or not n:
        return []
    edge, is_film = evaluator.physics.edge, evaluator.render_mode == "rgb_array_list"
    firsts = range(0, len(result), len(result) // n)
    return [_walked(result, i, edge, is_film=is_film) for i in firsts]


def _walked(result: Result, i: int, edge: float, *, is_film: bool) -> Filmed | None:
    motion = Motion.of(result, i, edge)
    if not len(motion.built.active):
        return None
    first, last = (0, 0) if result.diverged[i] else (motion.begin, motion.last)
    poses = [motion.pose(k) for k in (range(first, last + 1) if is_film else (first, last))]
    walk = Walk(poses[0], motion.centre[:1]) if result.diverged[i] else motion.walk
    return Filmed(walk, poses)
