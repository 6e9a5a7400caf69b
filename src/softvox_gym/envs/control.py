"""Control environments: the action sets how far each actuator grows in the next interval."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from math import atan2, ceil, degrees, hypot, pi
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from softvox_gym.design import ACTIVE, Design, DesignLike, actuators, written
from softvox_gym.envs.episodes import (
    WALK_FPS,
    WALK_SPEED,
    Episodes,
    Generators,
    Rows,
    Started,
    Stepped,
)
from softvox_gym.envs.single import SingleEnv
from softvox_gym.envs.vector import NativeVectorEnv
from softvox_gym.lattice import Lattice
from softvox_gym.motion import rest_pose
from softvox_gym.paused import Simulation, State, sealed, unsealed
from softvox_gym.portable import cos_sin
from softvox_gym.realities import PhysicsLike, Reality, reality_of
from softvox_gym.rendering import AIM, AZIMUTH, NOWHERE, Pose, Walk, fitting_distance, render
from softvox_gym.simulation import check_count, check_flag, check_number, check_threads
from softvox_gym.tasks import Task

Array = NDArray[np.float64]

#: How a saved episode begins; another format has another number.
MAGIC = b"softvox control 1\n"

#: Cycles by which the last interval of an episode may fall short and still count as whole.
SLACK = 1e-3

#: Share of the strain: an action this close to an end of the range counts as that end, because a
#: wrapper that rescales actions may have rounded.
ROUNDED = 1e-6

#: Voxel widths per second: 99 of 100 velocities are below 6, however the pumps are switched.
FASTEST = 20.0

#: Camera distance over the one that fits the robot alone, so that its path is seen too.
BACK = 1.4


@dataclass(eq=False)
class _Group:
    """Episodes after equally many steps, which can share a simulation."""

    rows: Rows
    sim: Simulation
    step: int  # intervals so far
    value: Array  # the task's value so far, shape (k,)

    def take(self, mask: NDArray[np.bool_]) -> _Group:
        """Return a group of some of the episodes, with its own simulation."""
        sim = self.sim.take(np.flatnonzero(mask))
        return _Group(self.rows[mask], sim, self.step, self.value[mask])


class _Seen(NamedTuple):
    """A moving robot, as its pictures show it."""

    stand: Pose  # when the pump began
    path: list[Array]  # of its centre of mass, from then on
    poses: list[Pose]  # at the last moments of the path
    azimuth: float  # of the camera, degrees

    def pictures(self) -> list[NDArray[np.uint8]]:
        """Draw the last moments."""
        first = len(self.path) - len(self.poses) + 1
        return [self._picture(pose, first + k) for k, pose in enumerate(self.poses)]

    def last(self) -> NDArray[np.uint8]:
        """Draw the last of them."""
        return self._picture(self.poses[-1], len(self.path))

    def _picture(self, pose: Pose, until: int) -> NDArray[np.uint8]:
        # The camera doesn't turn or zoom, as it is unknown where the robot will go.
        (x, y, _), distance = self.path[until - 1], BACK * fitting_distance(self.stand)
        walk, look_at = Walk(self.stand, np.array(self.path[:until])), (x, y, AIM * distance)
        return render(pose, walk, look_at=look_at, distance=distance, azimuth=self.azimuth)


class Control(Episodes):
    """Plays robots of one design; made with the arguments of an environment."""

    def __init__(
        self,
        *,
        design: DesignLike = 6453,
        shape: Sequence[int] | None = None,
        physics: PhysicsLike = "published",
        reality: str | Reality | None = None,
        task: str | Task = "displacement",
        heading: float | None = None,
        interval: float = 1.0,
        groups: bool = False,
        render_mode: str | None = None,
        threads: int | None = None,
    ) -> None:
        super().__init__(render_mode)
        if isinstance(design, str):
            self.design = written(design, Lattice() if shape is None else Lattice.of(shape))
        else:
            self.design = Design(design, shape=shape)
        self.lattice = self.design.lattice
        world = reality_of(physics, reality)
        if world.resolution > 1:
            raise ValueError(
                f"reality {world.name} divides voxels into smaller ones, which control can't use"
            )
        self.physics = world.physics
        self.task = Task.of(task, heading)
        self.actuators = _actuators(self.design, are_grouped=groups)
        self.interval = _interval(
            interval, float(self.physics.time_step * self.physics.frequency_hz)
        )
        self.steps = max(1, ceil((float(self.physics.cycles) - SLACK) / self.interval))
        check_threads(threads)
        self._threads = threads

        if not float(self.physics.strain) > 0:
            raise ValueError(
                "strain of the physics must be positive, as the largest amplitude of an action; "
                f"got {self.physics.strain}"
            )
        trial = world.trials(self.design.kinds)
        self._strain, self._phase = trial.strain[:, 0], trial.phase  # each (1, nx, ny, nz)
        self._most = np.float32(self.physics.strain)
        self.single_action_space = spaces.Box(
            np.float32(0), self._most, (len(self.actuators),), np.float32
        )
        self._stand = rest_pose(self.design.kinds)  # replaced after settling
        assert self._stand.site is not None
        self._at = (slice(None), *self._stand.site.T)  # its voxels in the arrays of a State
        self._low, self._high = self._bounds()
        self.single_observation_space = spaces.Box(self._low, self._high, dtype=np.float32)
        self._groups: list[_Group] = []
        self._settled: Simulation | None = None
        self._azimuth = AZIMUTH
        self._paths: dict[int, list[Array]] = {}  # of the centre of mass, if there are pictures

    @property
    def metadata(self) -> dict[str, Any]:
        """The environments' metadata; at its frame rate a picture per step plays in real time."""
        told = super().metadata
        if self.render_mode != "rgb_array_list":
            told["render_fps"] = max(1, round(float(self.physics.frequency_hz) / self.interval))
        return told

    def start(self, which: Rows, generators: Generators) -> Started:
        """Start robots in the settled state, which is simulated once and then copied."""
        return self._begin(which, self._settle(), 0)

    def step(self, which: Rows, actions: NDArray[Any], generators: Generators) -> Stepped:
        """Advance some robots by an interval."""
        amplitudes = self._amplitudes(actions)
        k, size = len(which), len(self._low)
        observations, rewards = np.zeros((k, size), np.float32), np.zeros(k)
        values, displacements = np.zeros(k), np.zeros((k, 3))
        lost, is_last = np.zeros((2, k), dtype=np.bool_)
        films: list[_Seen | None] = [None] * k
        for group in self._playing(which):
            at = np.searchsorted(which, group.rows)
            states = self._advance(group, amplitudes[at])
            moved = displacements[at] = group.sim.displacement
            values[at] = np.where(_is_lost(moved), 0.0, self.task.reward(moved))
            lost[at], rewards[at] = _is_lost(moved), values[at] - group.value
            group.step, group.value = group.step + 1, values[at]
            is_last[at] = group.step == self.steps
            observations[at] = self._observed(group, states[-1], moved)
            if self.render_mode:
                for j, film in zip(at, self._filmed(group, states, lost[at]), strict=True):
                    films[j] = film
        if (is_over := lost | is_last).any():
            self._groups = self._without(which[is_over])
        return Stepped(
            observations,
            rewards,
            terminated=lost,
            truncated=is_last & ~lost,
            infos={
                "fitness": np.where(lost, np.nan, values),
                "displacement": displacements,
                "diverged": lost.copy(),
            },
            films=films,
        )

    def save(self, number: int) -> bytes:
        """Return everything needed to continue an episode."""
        for group in self._groups:
            for place in np.flatnonzero(group.rows == number):
                about = {"of": self._identity, "step": group.step}
                saved = group.sim.take([int(place)]).save()
                return sealed(MAGIC, json.dumps(about).encode() + b"\n" + saved)
        raise ResetNeeded("there is no episode to save: it is over or has not begun; reset() first")

    def restore(self, saved: bytes, which: Rows) -> Started:
        """Continue a saved episode in some rows."""
        about, _, simulation = unsealed(
            MAGIC, saved, "episode", "save of SoftVoxControlEnv"
        ).partition(b"\n")
        told = json.loads(about)
        if told["of"] != self._identity:
            raise ValueError(
                "this episode was saved by an environment of another design, physics or interval"
            )
        self._settle()
        sim = Simulation.restore(simulation, threads=self._threads)
        return self._begin(which, sim, told["step"])

    @property
    def _identity(self) -> str:
        """The digest that environments share if they can continue each other's episodes."""
        phases = [] if self.lattice.phases == 1 else [self.lattice.phases]
        body = [*self.lattice, self.design.digits, *phases]
        facts = json.dumps([body, self.physics.to_dict(), self.interval])
        actuation = self._strain.tobytes() + self._phase.tobytes()
        return hashlib.sha256(facts.encode() + actuation).hexdigest()

    def _settle(self) -> Simulation:
        """Return the robot at the end of settling."""
        if self._settled is None:
            self._settled = Simulation(
                self.design,
                self.physics,
                strain=self._strain,
                phase=self._phase,
                threads=self._threads,
            )
            self._settled.advance(until=float(self.physics.settle_time))
            if self.render_mode and not _is_lost(self._settled.displacement)[0]:
                self._stand = self._pose(self._settled.state, 0)
                self._azimuth = self._across(self._settled.take([0]))
        return self._settled

    def _across(self, sim: Simulation) -> float:
        """Return the azimuth that looks across the heading, or the fully pumped robot's path."""
        if self.task.heading is not None:
            return self.task.heading - 90
        sim.advance(until=np.inf)
        x, y, _ = sim.displacement[0].tolist()
        return degrees(atan2(y, x)) - 90 if hypot(x, y) > NOWHERE else AZIMUTH

    def _begin(self, which: Rows, sim: Simulation, step: int) -> Started:
        """Start robots as copies of a simulation's one robot, after some number of intervals."""
        copies = sim.take([0] * len(which))
        state, moved = copies.state, copies.displacement
        group = _Group(which, copies, step, np.nan_to_num(self.task.reward(moved)))
        self._groups = [*self._without(which), group]
        films: Sequence[_Seen | None] = [None] * len(which)
        if self.render_mode:
            start = np.nan_to_num(state.centre / self.physics.edge - moved)
            self._paths |= {int(i): [at] for i, at in zip(which, start, strict=True)}
            films = self._filmed(group, [state], _is_lost(moved))
        return Started(self._observed(group, state, moved), {}, films)

    def _without(self, which: Rows) -> list[_Group]:
        """Return the groups without some episodes."""
        left = []
        for group in self._groups:
            stays = ~np.isin(group.rows, which)
            if stays.any():
                left.append(group if stays.all() else group.take(stays))
        return left

    def _playing(self, which: Rows) -> list[_Group]:
        """Return the groups of these episodes alone; ResetNeeded if one is not playing."""
        if len(self._groups) == 1 and np.array_equal(self._groups[0].rows, which):
            return self._groups
        known = [row for group in self._groups for row in group.rows]
        if not np.isin(which, known).all():
            raise ResetNeeded("the episode is over, or has not begun: reset() first")
        playing, waiting = [], []
        for group in self._groups:
            plays = np.isin(group.rows, which)
            if plays.all():
                playing.append(group)
            elif plays.any():
                playing.append(group.take(plays))
                waiting.append(group.take(~plays))
            else:
                waiting.append(group)
        self._groups = playing + waiting
        return playing

    def _advance(self, group: _Group, amplitudes: Array) -> list[State]:
        """Advance by an interval; return the states to show, the last being its end."""
        frequency, settle = float(self.physics.frequency_hz), float(self.physics.settle_time)
        begin, end = (settle + (group.step + k) * self.interval / frequency for k in range(2))
        pictures = 1
        if self.render_mode == "rgb_array_list":
            pictures = max(1, round((end - begin) * WALK_FPS / WALK_SPEED))
        until = np.linspace(begin, end, pictures + 1)[1:]
        if group.step + 1 == self.steps:  # to the end of the run, which may be within the interval
            until = np.append(until[until < float(self.physics.duration)][: pictures - 1], np.inf)
        states = []
        for moment in until:
            group.sim.advance(until=float(moment), strain=amplitudes)
            states.append(group.sim.state)
        return states

    def _amplitudes(self, actions: NDArray[Any]) -> Array:
        """Return the strain of every voxel, (k, nx, ny, nz), for actions, (k, actuators)."""
        given, shape = np.asarray(actions), (len(self.actuators),)
        if given.dtype.kind not in "iuf" or given.shape[1:] != shape:
            raise ValueError(
                f"an action must be {shape[0]} numbers from 0 to {self._most}, one per actuator; "
                f"got {given.dtype} values of shape {given.shape[1:]}"
            )
        share = given.astype(np.float64) / float(self._most)
        is_within = (share >= -ROUNDED) & (share <= 1 + ROUNDED)
        if not is_within.all():
            bad = given[~is_within].flat[0]
            raise ValueError(f"an action must be numbers from 0 to {self._most}, got {bad}")
        # The whole share is the strain itself, whose last bits float32 lacks.
        share = np.where(share >= 1 - ROUNDED, 1.0, np.maximum(share, 0.0))
        rows = np.zeros((len(given), self.lattice.sites))
        for slot, sites in enumerate(self.actuators):
            rows[:, list(sites)] = share[:, [slot]]
        return np.asarray(self.lattice.to_stack(rows) * self._strain)

    def _bounds(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the bounds of every slot of an observation; see `SoftVoxControlEnv`."""
        far, near = max(1.0, ceil(float(self.physics.cycles))), 2.0 * max(self.lattice)
        whole = [far] * 3 + [FASTEST] * 3 + [1.0, 1.0, 1.0]
        voxel = [near] * 3 + [FASTEST] * 3 + [1.0, 1.0 + float(np.max(self._strain))]
        m = self.design.n_voxels
        low = np.negative(whole + voxel * m)
        low[8] = 0.0
        low[9:].reshape(m, 8)[:, 6:] = 0.0
        return low.astype(np.float32), np.array(whole + voxel * m, np.float32)

    def _observed(self, group: _Group, state: State, moved: Array) -> NDArray[np.float32]:
        """Return observations, shape (k, 9 + 8 voxels), of robots with these displacements."""
        at, edge, k = self._at, float(self.physics.edge), len(group.rows)
        velocity = state.velocity[at]
        mean = velocity.mean(axis=1)
        turns = float(self.physics.frequency_hz) * state.time[0]  # the same for all of a group
        cosine, sine = cos_sin(2 * pi * (turns - np.floor(turns)))
        clock = np.tile([cosine, sine, group.step / self.steps], (k, 1))
        whole = [moved, mean / edge, clock]
        voxels = [
            state.relative_position[at] / edge,
            (velocity - mean[:, np.newaxis]) / edge,
            state.on_floor[at][..., np.newaxis],
            state.edge[at][..., np.newaxis] / edge,
        ]
        flat = np.concatenate([*whole, np.concatenate(voxels, axis=2).reshape(k, -1)], axis=1)
        flat[_is_lost(moved)] = 0.0
        return np.asarray(np.clip(flat, self._low, self._high), np.float32)

    def _filmed(
        self, group: _Group, states: Sequence[State], lost: NDArray[np.bool_]
    ) -> list[_Seen]:
        """Return a film of every robot of a group; a diverged one stands at its start."""
        films = []
        for j, row in enumerate(group.rows.tolist()):
            path, poses = self._paths[row], [self._stand]
            if lost[j]:
                del path[1:]
            else:
                poses = [self._pose(state, j) for state in states]
                path += [pose.position.mean(axis=0) for pose in poses]
            films.append(_Seen(self._stand, list(path), poses, self._azimuth))
        return films

    def _pose(self, state: State, j: int) -> Pose:
        """Return a robot as it is drawn."""
        edge, own = float(self.physics.edge), self._stand
        position, turn, edges = (
            values[self._at][j] for values in (state.position, state.orientation, state.edge)
        )
        return Pose(position / edge, turn, edges / edge, own.active, own.site)


def _is_lost(displacement: Array) -> NDArray[np.bool_]:
    """Return which robots have diverged, shape (k,)."""
    return np.isnan(displacement[:, 0])


def _actuators(design: Design, *, are_grouped: bool) -> tuple[tuple[int, ...], ...]:
    """Return the sites that each entry of an action drives."""
    check_flag("groups", are_grouped)
    if not design.n_active:
        raise ValueError(
            f"design {design.digits} has no active voxel, so there is nothing to control; active "
            "ones have the digit 2"
        )
    if not are_grouped:
        return tuple((site,) for site, digit in enumerate(design.digits) if int(digit) >= ACTIVE)
    return actuators(design)


def _interval(interval: float, shortest: float) -> float:
    """Check and return an interval, in cycles: finite and at least a time step."""
    cycles = check_number("interval", interval)
    if not shortest <= cycles < np.inf:
        raise ValueError(
            f"interval must be finite and at least a time step ({shortest:.2g} cycles), got "
            f"{interval}"
        )
    return cycles


class SoftVoxControlEnv(SingleEnv):
    """Control a voxel-based soft robot: set how far each actuator grows in the next interval.

    The robot's design is fixed; the pump's sine runs as in the other environments, and the action
    is its amplitude. An episode that always plays the largest amplitude is the published pump: it
    gives the displacement of `softvox_gym.simulate`, to the bit.

    Action space
    ------------
    ``Box(0, strain, (actuators,), float32)``: the amplitude of every actuator until the next step,
    in order of their sites; `actuators` lists the sites of each. The high end, or a value within a
    millionth of it, is the strain of the physics in every digit of a double. In a reality whose
    strain varies from voxel to voxel, each voxel gets that share of its own strain.

    Observation space
    -----------------
    ``Box(low, high, (9 + 8 voxels,), float32)``; values beyond the bounds are clipped. Lengths are
    in voxel widths; L is the longest side of the lattice. All zeros if the robot diverged.

    ============== ================================================== ==========================
    slot           value                                              bounds
    ============== ================================================== ==========================
    0, 1, 2        displacement x, y, z so far                        +- cycles of the episode
    3, 4, 5        velocity of the centre of mass, per second         +- 20
    6, 7           cosine and sine of the pump's phase                +- 1
    8              progress: the share of intervals completed         0, 1
    9 + 8 v + 0-2  voxel v: position from the centre of mass          +- 2 L
    9 + 8 v + 3-5  velocity less that of the centre, per second       +- 20
    9 + 8 v + 6    whether it touches the floor                       0, 1
    9 + 8 v + 7    edge                                               0, 1 + strain
    ============== ================================================== ==========================

    Voxels are in the order of their sites. If intervals are whole cycles, slots 6 and 7 never
    change.

    Reward
    ------
    The gain in the task's value over the interval, in voxel widths: in the horizontal distance from
    where the robot stood at the end of settling, or in its component along the heading. So the
    rewards of an episode add up to its fitness, apart from rounding: walking in circles earns
    nothing. A robot that diverges loses what it had earned: the sum is 0.

    End of an episode
    -----------------
    Truncated at the physics' duration: after ``ceil(cycles / interval)`` steps, the last of which
    may be shorter; 15 by default. Terminated if the robot diverges.

    Info
    ----
    Empty after reset. After a step:

    ============ ======== =================================================================
    key          type
    ============ ======== =================================================================
    fitness      float    the task's value so far, voxel widths; NaN where it diverged
    displacement (3,)     from the end of settling, voxel widths; NaN where it diverged
    diverged     bool
    ============ ======== =================================================================

    Parameters
    ----------
    design : int, str, sequence of int, array or Design
        The robot, as a number or the digits of all sites, or an (nx, ny, nz) array. It may be in
        several pieces; the centre of mass is that of all of them. A Design may have several phases.
        A number, text or list survives ``spec.to_json()``.
    shape : (int, int, int), optional
        The lattice of a number or a row of digits; by default 2x2x2.
    physics, reality, task, heading
        As in `SoftVoxEnv`; a reality must not divide voxels into parts.
    interval : float
        Time between actions, in cycles of the pump.
    groups : bool
        Whether neighbouring active voxels of a slice z share one actuator, as they share the air in
        robots built from the paper's kit.
    render_mode : {"rgb_array", "rgb_array_list"}, optional
        A picture of the robot as it is now, with its start and its path; or all pictures since the
        last call of `render`, which show the whole walk, 25 per second at half speed.

    Attributes
    ----------
    design : Design
    actuators : tuple of tuple of int
        The sites that each entry of an action drives.

    Raises
    ------
    TypeError, ValueError
        If the design is invalid or has no active voxel, the interval is not a positive number or is
        shorter than a time step, the strain is not positive, the reality divides voxels, or
        `SoftVoxEnv` would raise; by `step` if the action is not in the space.

    Examples
    --------
    >>> import gymnasium as gym
    >>> import softvox_gym
    >>> env = gym.make("SoftVoxControl-v0", design=6453)
    >>> observation, info = env.reset(seed=0)
    >>> over = False
    >>> while not over:
    ...     observation, reward, terminated, over, info = env.step(env.action_space.high)
    >>> print(observation.shape, round(info["fitness"], 2))
    (49,) 4.66

    Planning one interval ahead: take the best of sixteen actions.

    >>> observation, info = env.reset()
    >>> start, found = env.unwrapped.save(), {}
    >>> env.action_space.seed(0)
    0
    >>> for action in [env.action_space.sample() for _ in range(16)]:
    ...     found[tuple(action)] = env.step(action)[1]
    ...     observation = env.unwrapped.restore(start)
    >>> print(round(env.step(max(found, key=found.get))[1], 2))
    0.21

    Versions
    --------
    v0: the first.
    """

    episodes: Control

    def __init__(
        self,
        *,
        design: DesignLike = 6453,
        shape: Sequence[int] | None = None,
        physics: PhysicsLike = "published",
        reality: str | Reality | None = None,
        task: str | Task = "displacement",
        heading: float | None = None,
        interval: float = 1.0,
        groups: bool = False,
        render_mode: str | None = None,
    ) -> None:
        control = Control(
            design=design,
            shape=shape,
            physics=physics,
            reality=reality,
            task=task,
            heading=heading,
            interval=interval,
            groups=groups,
            render_mode=render_mode,
        )
        super().__init__(control)
        self.design, self.actuators = control.design, control.actuators

    def save(self) -> bytes:
        """Return the current state of the episode, without any state of wrappers.

        Raises
        ------
        ResetNeeded
            If the episode is over or has not begun.
        """
        return self.episodes.save(0)

    def restore(self, saved: bytes) -> NDArray[np.float32]:
        """Continue a saved episode, to the bit; return its observation.

        Raises
        ------
        TypeError, ValueError
            If `save` did not make the bytes, if they are damaged, or if they belong to another
            design, physics, interval or engine.
        """
        observations, _, films = self.episodes.restore(saved, np.zeros(1, np.intp))
        self._seen = list(films)
        return np.asarray(observations[0])


class SoftVoxControlVectorEnv(NativeVectorEnv):
    """`SoftVoxControlEnv` for robots of one design side by side, advanced by one call into C.

    Parameters
    ----------
    num_envs : int
    design, shape, physics, reality, task, heading, interval, groups, render_mode
        As in `SoftVoxControlEnv`; one for the whole batch.
    autoreset_mode, threads
        As in `SoftVoxVectorEnv`.

    Raises
    ------
    TypeError, ValueError
        As both do.

    Examples
    --------
    Planning again: `restore` copies one episode into all environments, and each tries an action.

    >>> import gymnasium as gym
    >>> import softvox_gym
    >>> env = gym.make("SoftVoxControl-v0", design=6453)
    >>> observation, info = env.reset(seed=0)
    >>> envs = gym.make_vec("SoftVoxControl-v0", num_envs=16, design=6453)
    >>> observations = envs.unwrapped.restore(env.unwrapped.save())
    >>> envs.action_space.seed(0)
    0
    >>> actions = envs.action_space.sample()
    >>> rewards = envs.step(actions)[1]
    >>> bool(env.step(actions[rewards.argmax()])[1] == rewards.max())
    True
    """

    episodes: Control

    def __init__(
        self,
        num_envs: int = 1,
        *,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        **options: Any,
    ) -> None:
        control = Control(**options)
        super().__init__(control, num_envs, autoreset_mode)
        self.design, self.actuators = control.design, control.actuators

    def save(self, number: int = 0) -> bytes:
        """Return the episode state of one environment, as `SoftVoxControlEnv.save` does."""
        check_count("number", number, least=0, most=self.num_envs - 1)
        return self.episodes.save(number)

    def restore(self, saved: bytes) -> NDArray[np.float32]:
        """Continue one saved episode in all environments; return their observations."""
        every = np.ones(self.num_envs, dtype=np.bool_)
        self._start_anew(every, lambda which: self.episodes.restore(saved, which))
        self._has_reset |= every
        return self._observations.copy()
