"""The Gymnasium environment: the action is a design, one step simulates it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from softvox_gym.design import ACTIVE, N_SITES
from softvox_gym.engine import step_count
from softvox_gym.physics import Physics
from softvox_gym.rendering import Pose, render
from softvox_gym.simulation import Result, sample_count, simulate

Observation = NDArray[np.float64]
PhysicsLike = str | Mapping[str, Any] | Physics

METADATA: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 1}

SAMPLES_PER_CYCLE = 1


class SoftVoxEnv(gym.Env[Observation, NDArray[np.int64]]):
    """Design a soft robot of eight voxels; it is simulated, and rewarded for how far it travels.

    An episode is one step: the action is the design, the reward its fitness. The 6561 designs are
    those of Kriegman et al., "Scalable sim-to-real transfer of soft robot designs", RoboSoft 2020.

    Action space
    ------------
    ``MultiDiscrete([3] * 8)``: the digit of each site of the 2x2x2 lattice.

    ===== ======= ================================================
    digit voxel
    ===== ======= ================================================
    0     absent
    1     passive
    2     active  its edge grows and shrinks with the actuation
    ===== ======= ================================================

    Site i = x + 2 (y + 2 z), so that the action's digits read d_0 d_1 ... d_7 like a design's.

    Observation space
    -----------------
    ``Box(-inf, inf, (cycles + 1, 3), float64)``: the movement track of the step just taken: the
    centre of mass (x, y, z) in voxel widths from where it was when actuation began, sampled once
    per actuation cycle, the start included; (16, 3) for the paper's 15 cycles. Zeros after reset
    and where the design diverged or is empty.

    Reward
    ------
    Fitness: the horizontal travel of the centre of mass in voxel widths, sqrt(dx^2 + dy^2). A
    design that diverges gets 0.

    End of an episode
    -----------------
    Every step terminates; none truncates.

    Info
    ----
    Empty after reset. After a step:

    ============ ======== ===============================================
    key          type
    ============ ======== ===============================================
    design       int      the design's index, 0 ... 6560
    fitness      float    voxel widths; NaN where it diverged
    displacement (3,)     dx, dy, dz in voxel widths; NaN where it diverged
    status       str      "ok" or "diverged"
    n_voxels     int
    is_connected bool     one piece
    ============ ======== ===============================================

    Parameters
    ----------
    physics : str, dict or Physics
        A preset's name ("published" or "exact"), a dict of fields (changes to "exact", or to the
        preset that its key "preset" names), or a Physics. As name or dict it survives
        ``spec.to_json()``.
    render_mode : {"rgb_array"}, optional
        A picture of the robot as the last step left it; an empty floor after reset.

    Raises
    ------
    TypeError, ValueError
        For a physics that is none of these or holds arrays, or an unknown render mode; by `step`
        for an action that is not in the action space.

    Versions
    --------
    v0: the first.
    """

    metadata: dict[str, Any] = METADATA

    def __init__(
        self, *, physics: PhysicsLike = "published", render_mode: str | None = None
    ) -> None:
        self.physics = single_physics(physics)
        self.render_mode = checked_render_mode(render_mode)
        self.action_space = action_space()
        self.observation_space: gym.Space[Observation] = observation_space(self.physics)
        self._frames = last_step(self.physics) if render_mode else 0
        self._pose: Pose | None = None

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Start an episode: zeros, and an empty info."""
        super().reset(seed=seed)
        self._pose = None
        return np.zeros(self.observation_space.shape or ()), {}

    def step(
        self, action: NDArray[np.int64]
    ) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Simulate the design; see the class for what is returned."""
        designs = checked_actions(np.asarray(action)[np.newaxis])
        result = simulate(designs, self.physics, track=SAMPLES_PER_CYCLE, frames=self._frames)
        self._pose = final_pose(result, 0) if self.render_mode else None
        observation = observations(result)[0]
        return observation, float(rewards(result)[0]), True, False, infos(result)[0]

    def render(self) -> NDArray[np.uint8] | None:
        """Return the picture, uint8 of shape (height, width, 3); None without a render mode."""
        if self.render_mode is None:
            gym.logger.warn(
                "render() was called without a render mode; "
                'give one when the env is made: gym.make(..., render_mode="rgb_array")'
            )
            return None
        return render(self._pose)


def action_space() -> spaces.MultiDiscrete:
    """Return the space of designs."""
    return spaces.MultiDiscrete([3] * N_SITES)


def observation_space(physics: Physics) -> gym.Space[Observation]:
    """Return the space of movement tracks that runs under some physics have."""
    samples = sample_count(physics, SAMPLES_PER_CYCLE)
    space: Any = spaces.Box(-np.inf, np.inf, shape=(samples, 3), dtype=np.float64)
    return cast(gym.Space[Observation], space)


def single_physics(physics: PhysicsLike) -> Physics:
    """Return the physics that all designs share.

    Raises
    ------
    TypeError, ValueError
        As `Physics.of` does, or where a parameter is an array.
    """
    made = Physics.of(physics)
    if made.n_designs is not None:
        raise ValueError(
            "physics must hold single numbers in an environment, not an array per design"
        )
    return made


def checked_render_mode(render_mode: str | None) -> str | None:
    """Return the render mode.

    Raises
    ------
    ValueError
        Where it is neither None nor one of the modes.
    """
    if render_mode is not None and render_mode not in METADATA["render_modes"]:
        raise ValueError(f"render_mode must be None or 'rgb_array', got {render_mode!r}")
    return render_mode


def checked_actions(actions: NDArray[Any]) -> NDArray[Any]:
    """Return a batch of actions, an (n, 8) array of digits.

    Raises
    ------
    ValueError
        Where it is anything else.
    """
    if actions.dtype.kind not in "iu" or actions.ndim != 2 or actions.shape[1] != N_SITES:
        raise ValueError(
            f"an action must be {N_SITES} whole numbers 0, 1 or 2, one per site; "
            f"got {actions.dtype} values of shape {actions.shape[1:]}"
        )
    return actions


def rewards(result: Result) -> NDArray[np.float64]:
    """Return the rewards of a batch, shape (n,): fitness, 0 where diverged."""
    return np.where(np.isnan(result.fitness), 0.0, result.fitness)


def observations(result: Result) -> NDArray[np.float64]:
    """Return the observations of a batch, shape (n, samples, 3), NaN replaced by zero."""
    assert result.track is not None
    return np.nan_to_num(result.track, nan=0.0)


def infos(result: Result) -> list[dict[str, Any]]:
    """Return the info of each design of a batch."""
    designs = [result.design(i) for i in range(len(result))]
    return [
        {
            "design": design.index,
            "fitness": float(result.fitness[i]),
            "displacement": result.displacement[i].copy(),
            "status": str(result.status[i]),
            "n_voxels": design.n_voxels,
            "is_connected": design.is_connected,
        }
        for i, design in enumerate(designs)
    ]


def last_step(physics: Physics) -> int:
    """Return the step at which a run under the physics ends."""
    return step_count(float(physics.time_step), float(physics.duration))


def final_pose(result: Result, i: int) -> Pose | None:
    """Return how the i-th design's run left it, or None where it has no voxels.

    The result must hold a frame of the last step. A design that diverged is shown as built.
    """
    assert result.frames is not None
    frames, digits = result.frames, result.designs[i]
    present = digits > 0
    if not present.any():
        return None
    row = -1 if result.status[i] == "ok" else 0
    return Pose(
        position=frames.position[i, row][present] / result.physics.edge,
        quaternion=frames.quaternion[i, row][present],
        edge=frames.edge[i, row][present] / result.physics.edge,
        active=digits[present] == ACTIVE,
    )
