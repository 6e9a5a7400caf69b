"""The Gymnasium environment: the action is a design, one step simulates it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from softvox_gym.bench import SAMPLES_PER_CYCLE, Bench, TableBench
from softvox_gym.design import N_SITES
from softvox_gym.physics import Physics
from softvox_gym.rendering import Pose, render
from softvox_gym.simulation import sample_count

Observation = NDArray[np.float64]
PhysicsLike = str | Mapping[str, Any] | Physics

METADATA: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 1}


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
    steps        int      time steps simulated
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
        checked = single_physics(physics)
        self.render_mode = checked_render_mode(render_mode)
        self._set_up(Bench(checked, with_poses=render_mode is not None))

    def _set_up(self, bench: Bench) -> None:
        self.bench = bench
        self.physics = bench.physics
        self.action_space = action_space()
        self.observation_space: gym.Space[Observation] = observation_space(bench.physics)
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
        rows = checked_actions(np.asarray(action)[np.newaxis])
        outcome, poses = self.bench.run(rows, lambda: [self.np_random])
        self._pose = poses[0] if poses else None
        info = {key: _plain(column[0]) for key, column in outcome.infos().items()}
        return outcome.observations[0], float(outcome.rewards[0]), True, False, info

    def render(self) -> NDArray[np.uint8] | None:
        """Return the picture, uint8 of shape (height, width, 3); None without a render mode."""
        if self.render_mode is None:
            gym.logger.warn(
                "render() was called without a render mode; "
                'give one when the env is made: gym.make(..., render_mode="rgb_array")'
            )
            return None
        return render(self._pose)


class SoftVoxTableEnv(SoftVoxEnv):
    """`SoftVoxEnv` with physics "published", answering from the table that ships with the package.

    Observations, rewards and infos are the same bits; only faster. It can't be made noisy by
    wrappers that disturb the physics. Pictures are simulated.

    Parameters
    ----------
    render_mode : {"rgb_array"}, optional
        As in `SoftVoxEnv`.

    Raises
    ------
    ValueError
        For an unknown render mode; by `step` for an action that is not in the action space.

    Versions
    --------
    v0: the first.
    """

    def __init__(self, *, render_mode: str | None = None) -> None:
        self.render_mode = checked_render_mode(render_mode)
        self._set_up(TableBench(with_poses=render_mode is not None))


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


def _plain(value: Any) -> Any:
    """Return a numpy number as Python's; arrays and text as they are."""
    return value.item() if isinstance(value, np.generic) else value
