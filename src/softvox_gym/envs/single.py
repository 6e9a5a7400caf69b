"""Single environments: for any episodes, and for one step that simulates a design."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from softvox_gym.envs.episodes import METADATA, Columns, Episodes, Film, moving, pictured
from softvox_gym.envs.evaluator import Evaluator
from softvox_gym.realities import PhysicsLike, Reality
from softvox_gym.tasks import Task

Observation = NDArray[np.float64]

_ONLY = np.zeros(1, np.intp)  # the number of the one episode


class SingleEnv(gym.Env[Any, Any]):
    """An environment that plays one episode at a time."""

    metadata: dict[str, Any] = METADATA

    def __init__(self, episodes: Episodes) -> None:
        self.episodes = episodes
        self.metadata = episodes.metadata  # SyncVectorEnv writes into it before Gymnasium 1.3
        self.physics = episodes.physics
        self.render_mode = episodes.render_mode
        self.action_space = episodes.single_action_space
        self.observation_space = episodes.single_observation_space
        if episodes.reward_space is not None:
            self.reward_space = episodes.reward_space
        self._seen: list[Film | None] = []  # since the last pictures; None for the empty floor

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Start an episode; the class describes what is returned. There are no options."""
        super().reset(seed=seed)
        observations, infos, films = self.episodes.start(_ONLY, lambda: [self.np_random])
        self._seen = [films[0]]
        return observations[0], _first(infos)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Make a step; the class describes what is returned."""
        observations, rewards, terminated, truncated, infos, films, finals = self.episodes.step(
            _ONLY, np.asanyarray(action)[np.newaxis], lambda: [self.np_random]
        )
        if self.render_mode != "rgb_array_list":
            self._seen.clear()  # because earlier steps can't be requested
        self._seen.append(films[0])
        over = bool(terminated[0]), bool(truncated[0])
        return observations[0], plain(rewards[0]), *over, _first({**infos, **finals})

    def render(self) -> Any:
        """Return the picture, uint8 of shape (height, width, 3), or a list of pictures.

        None without a render mode.
        """
        if self.render_mode is None:
            gym.logger.warn(
                "render() was called without a render mode; "
                'give one when the env is made: gym.make(..., render_mode="rgb_array")'
            )
            return None
        if self.render_mode == "rgb_array":
            return pictured(self._seen[-1] if self._seen else None)
        seen, self._seen = self._seen, []
        return moving(seen)


def _first(columns: Columns) -> dict[str, Any]:
    """Return the info of the one episode."""
    return {key: plain(column[0]) for key, column in columns.items()}


def plain(value: Any) -> Any:
    """Return a numpy number as a Python number; arrays unchanged."""
    return value.item() if isinstance(value, np.generic) else value


class SoftVoxEnv(SingleEnv):
    """Design a voxel-based soft robot; the reward is how far it travels in simulation.

    An episode is one step: the action is the design, the reward its fitness. The 6561 designs of
    the 2x2x2 lattice are those of Kriegman et al., "Scalable sim-to-real transfer of soft robot
    designs", RoboSoft 2020.

    Action space
    ------------
    ``MultiDiscrete([3] * sites)``: the digit of each site of the lattice; ``[2 + P] * sites`` if
    active voxels have one of P phases.

    ===== ======= ================================================
    digit voxel
    ===== ======= ================================================
    0     absent
    1     passive
    2     active  its edge grows and shrinks with the actuation
    2 + p active  the same p / P cycles ahead, on a lattice of P phases
    ===== ======= ================================================

    Site i = x + nx (y + ny z), so the action's digits read d_0 d_1 d_2 ... like a design's.

    Observation space
    -----------------
    ``Box(-inf, inf, (cycles + 1, 3), float64)``: the track of the step just taken. It is the centre
    of mass (x, y, z) in voxel widths from where it was when actuation began, sampled once per
    actuation cycle, the start included; (16, 3) for the paper's 15 cycles. Zeros after reset and if
    the design diverged or is empty.

    Reward
    ------
    Fitness: the horizontal travel of the centre of mass in voxel widths, sqrt(dx^2 + dy^2); in the
    directed task its component along the heading. A design that diverges gets 0. With
    ``objectives`` the reward is an ndarray of shape (m,) with one number for each, within
    ``reward_space``.

    End of an episode
    -----------------
    Every step terminates; no step truncates.

    Info
    ----
    Empty after reset. After a step:

    ============ ======== =================================================================
    key          type
    ============ ======== =================================================================
    design       int      the design's number; on lattices with more designs than int64 counts (40
                          sites or more) there is ``digits`` in its place, uint8 of shape (sites,)
    fitness      float    voxel widths; NaN where it diverged
    displacement (3,)     dx, dy, dz in voxel widths; NaN where it diverged
    diverged     bool
    n_voxels     int
    is_connected bool     one piece
    steps        int      time steps simulated
    ============ ======== =================================================================

    Parameters
    ----------
    shape : (int, int, int)
        The lattice (nx, ny, nz).
    physics : str, dict or Physics
        A preset's name ("published" or "exact"), a dict of fields (changes to "exact", or to the
        preset that its key "preset" names), or a Physics. A name or dict survives
        ``spec.to_json()``.
    reality : str or Reality, optional
        Instead of a physics: a name of `softvox_gym.realities()`, or a Reality. A name survives
        ``spec.to_json()``.
    task : {"displacement", "directed"} or softvox_gym.Task
        Whether displacement counts in any direction, or along the heading.
    heading : float, optional
        Heading of the directed task, degrees from x towards y.
    objectives : sequence of str, optional
        Some of "displacement", "voxels", "actuators", "energy", "straightness", "stability" and
        "heading", for a vector reward in the style of MO-Gymnasium: see
        docs/environments/objectives.md.
    render_mode : {"rgb_array", "rgb_array_list"}, optional
        A picture of the robot after the last step, with its start, its path and a ruler; an empty
        floor after reset. Or all pictures since the last call of `render`, which for a step show
        the whole walk, 25 per second at half speed; `softvox_gym.wrappers.RecordWalk` makes films
        of them.
    phases : int, optional
        How many phases an active voxel can have, 1 to 8; by default the shape's, or 1.
    from_table : bool
        Whether to look results up in the table of the 2x2x2 lattice under "published" that ships
        with the package: the same bits, only faster; pictures are simulated. Wrappers that disturb
        the physics can't make it noisy. With several phases this needs a landscape that ships or
        was computed here before (`softvox_gym.landscape`); it has no tracks, so observations are
        the start and the end, (2, 3).

    Raises
    ------
    TypeError, ValueError
        If the shape is no lattice, the physics is none of these or holds arrays, the reality, task,
        objective or render mode is unknown, the phases are not from 1 to 8, a physics is given
        beside a reality, or a table is asked for anything else or is not on this machine; by `step`
        if the action is not in the space.

    Examples
    --------
    >>> import gymnasium as gym
    >>> import softvox_gym
    >>> env = gym.make("SoftVox2x2x2-v0")
    >>> track, info = env.reset(seed=0)
    >>> track, reward, terminated, truncated, info = env.step([0, 0, 0, 2, 1, 2, 2, 2])
    >>> print(round(reward, 2), terminated, info["design"], info["n_voxels"])
    4.66 True 6453 5

    Versions
    --------
    v0: the first.
    """

    def __init__(
        self,
        *,
        shape: Sequence[int] = (2, 2, 2),
        physics: PhysicsLike = "published",
        reality: str | Reality | None = None,
        task: str | Task = "displacement",
        heading: float | None = None,
        objectives: Sequence[str] | None = None,
        render_mode: str | None = None,
        from_table: bool = False,
        phases: int | None = None,
    ) -> None:
        self.evaluator = Evaluator(
            shape,
            physics,
            render_mode,
            reality=reality,
            task=task,
            heading=heading,
            objectives=objectives,
            from_table=from_table,
            phases=phases,
        )
        super().__init__(self.evaluator)
