"""Robots that grow: an episode builds one voxel by voxel and tries it at the end."""

from __future__ import annotations

from itertools import compress
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from softvox_gym.design import ABSENT, ACTIVE, checked_digits
from softvox_gym.envs.episodes import Columns, Episodes, Generators, Rows, Started, Stepped
from softvox_gym.envs.evaluator import Action, Evaluator
from softvox_gym.envs.single import SingleEnv
from softvox_gym.envs.vector import NativeVectorEnv
from softvox_gym.lattice import Lattice
from softvox_gym.motion import rest_pose
from softvox_gym.rendering import fitting_distance, render
from softvox_gym.simulation import check_count, check_flag

Bools = NDArray[np.bool_]

#: Frames that a film shows after each voxel: a fifth of a second.
PICTURES_PER_VOXEL = 5


def masks(
    rows: NDArray[np.uint8], following: NDArray[np.intp], lattice: Lattice, *, connected: bool
) -> Bools:
    """Return which digits the next sites may get.

    If only connected robots are wanted, these are the digits after which the open sites can still
    join the voxels into one piece. That holds if all voxels lie within one connected component of
    the voxels and the open sites: filling all open sites of that component would make one piece. An
    empty robot is not one piece, so the last site can't be absent if there are no voxels.

    Parameters
    ----------
    rows : ndarray of uint8, shape (n, sites)
        The digits so far; 0 for sites still open.
    following : ndarray of int, shape (n,)
        The next site of each. All sites before it are built; it and all after it are open.
    lattice : Lattice
    connected : bool
        Whether to allow only digits that can lead to one piece, or all.

    Returns
    -------
    ndarray of bool, shape (n, 3)
        All true if no digit can lead to one piece any more, as after the last site.
    """
    if not connected:
        return np.ones((len(rows), ACTIVE + 1), dtype=np.bool_)
    sites, stands = np.arange(lattice.sites), rows != ABSENT
    here, later = sites == following[:, np.newaxis], sites > following[:, np.newaxis]
    absent = _can_join(stands, later, lattice)
    present = _can_join(stands | here, later, lattice)
    allowed = np.stack([absent, present, present], axis=1)
    return np.asarray(allowed | ~allowed.any(axis=1, keepdims=True))


def _can_join(stands: Bools, is_open: Bools, lattice: Lattice) -> Bools:
    """Return whether the open sites can join the voxels into one piece, shape (n,)."""
    free = stands | is_open
    first = np.where(stands.any(axis=1), stands.argmax(axis=1), free.argmax(axis=1))
    start = np.arange(lattice.sites) == first[:, np.newaxis]
    reached = lattice.to_rows(_reached(lattice.to_stack(start & free), lattice.to_stack(free)))
    return np.asarray(free.any(axis=1) & (reached | ~stands).all(axis=1))


def _reached(start: Bools, free: Bools) -> Bools:
    """Return which free sites connect to the start through faces, (n, nx, ny, nz)."""
    reached = start
    while True:
        grown = reached.copy()
        for axis in (1, 2, 3):
            new, old = np.moveaxis(grown, axis, 0), np.moveaxis(reached, axis, 0)
            new[1:] |= old[:-1]
            new[:-1] |= old[1:]
        grown &= free
        if np.array_equal(grown, reached):
            return reached
        reached = grown


class Unfinished(NamedTuple):
    """A robot with sites that are still open."""

    digits: NDArray[np.uint8]  #: (nx, ny, nz)

    def pictures(self) -> list[NDArray[np.uint8]]:
        """Draw it for several frames."""
        return [self.last()] * PICTURES_PER_VOXEL

    def last(self) -> NDArray[np.uint8]:
        """Draw it, with a camera that sees the whole lattice."""
        distance = fitting_distance(rest_pose(np.ones_like(self.digits)))
        middle = [side / 2 for side in self.digits.shape]
        return render(rest_pose(self.digits), look_at=middle, distance=distance)


class Growth(Episodes):
    """Plays episodes of `SoftVoxGrowEnv`."""

    def __init__(self, num_envs: int, render_mode: str | None, connected: bool, **trial: Any):
        super().__init__(render_mode)
        check_flag("connected", connected)
        self.evaluator = Evaluator(render_mode=render_mode, **trial)
        self.physics, self.reward_space = self.evaluator.physics, self.evaluator.reward_space
        self.lattice, self.connected = self.evaluator.lattice, connected
        if self.lattice.phases > 1:
            raise ValueError(
                f"phases must be 1, as robots that grow have one, got {self.lattice.phases}; "
                "SoftVox-v0 takes several"
            )
        self.single_action_space = spaces.Discrete(ACTIVE + 1)
        sites = self.lattice.sites
        self.single_observation_space = spaces.Box(0, 1, (4 * sites,), np.float32)
        self._rows = np.zeros((num_envs, sites), np.uint8)
        self._next = np.full(num_envs, sites)

    def action_masks(self, which: Rows | slice = slice(None)) -> Bools:
        """Return which digits the next sites of some episodes may get, shape (k, 3)."""
        rows, following = self._rows[which], self._next[which]
        return masks(rows, following, self.lattice, connected=self.connected)

    def start(self, which: Rows, generators: Generators) -> Started:
        """Show an empty lattice."""
        self._rows[which], self._next[which] = ABSENT, 0
        return Started(*self._shown(which))

    def step(self, which: Rows, actions: NDArray[np.int64], generators: Generators) -> Stepped:
        """Set the next digit of each, and try the robots that are finished."""
        actions = Action.of(actions)
        if actions.dtype.kind not in "iu" or actions.shape != which.shape:
            raise ValueError(
                "an action must be a whole number 0, 1 or 2, the digit of the next site; "
                f"got {actions.dtype} values of shape {actions.shape[1:]}"
            )
        digits = checked_digits(np.asarray(actions), what="an action")
        following = self._next[which]
        if (following == self._rows.shape[1]).any():
            raise ResetNeeded("no site is open: reset() before a robot is built, and after it")
        self._rows[which, following] = digits
        self._next[which] += 1
        over = self._next[which] == self._rows.shape[1]
        observations, infos, films = self._shown(which)
        reward = () if self.reward_space is None else self.reward_space.shape
        rewards = np.zeros((len(which), *reward))
        finals: Columns = {}
        if over.any():
            last = which[over]
            designs = np.empty_like(actions, np.int64, shape=(len(last), self._rows.shape[1]))
            designs[:] = self._rows[last]  # still an Action, with the wrappers' requests
            tried = self.evaluator.step(last, designs, lambda: list(compress(generators(), over)))
            rewards[over], finals = tried.rewards, tried.infos
            for i, film in zip(np.flatnonzero(over), tried.films, strict=True):
                films[i] = film
        ends = over, np.zeros_like(over)
        return Stepped(observations, rewards, *ends, infos, films, finals)

    def _shown(self, which: Rows) -> tuple[NDArray[np.float32], dict[str, Any], list[Any]]:
        """Return observations, infos and films of the robots so far."""
        rows, sites = self._rows[which], np.arange(self._rows.shape[1])
        is_next = (sites == self._next[which, np.newaxis])[..., np.newaxis]
        is_built = (sites < self._next[which, np.newaxis])[..., np.newaxis]
        is_digit = rows[..., np.newaxis] == np.arange(ACTIVE + 1)
        observed = np.concatenate([is_digit & is_built, is_next], axis=2).astype(np.float32)
        films: list[Any] = [None] * len(rows)
        if self.render_mode:
            films = [Unfinished(stack) for stack in self.lattice.to_stack(rows)]
        told = {"action_mask": self.action_masks(which).astype(np.int8)}
        return observed.reshape(len(rows), -1), told, films


class SoftVoxGrowEnv(SingleEnv):
    """Grow a soft robot voxel by voxel; at the end the reward is how far it travels.

    An episode sets the digit of one site after another, in the order of the sites, i = x + nx (y +
    ny z), so the digits read d_0 d_1 d_2 ... like a design's.

    Action space
    ------------
    ``Discrete(3)``: the digit of the next site: 0 absent, 1 passive, 2 active.

    Observation space
    -----------------
    ``Box(0, 1, (4 * sites,), float32)``: the voxels so far, and which site is next.

    ======= ====================
    entry   1 where site i is
    ======= ====================
    4 i     absent
    4 i + 1 passive
    4 i + 2 active
    4 i + 3 the next
    ======= ====================

    All four are 0 for an open site that is not the next; after the last site none is next.

    Reward
    ------
    0 until the last site; then that of `SoftVoxEnv`: the fitness or the ``objectives``.

    End of an episode
    -----------------
    The step of the last site terminates; no step truncates.

    Info
    ----
    =========== ========== ================================================================
    key         type
    =========== ========== ================================================================
    action_mask int8, (3,) 1 for each digit that the next site may get, for
                           ``action_space.sample(mask=...)``; `action_masks` returns the same as
                           bools, for sb3-contrib
    =========== ========== ================================================================

    Returned by reset and by every step; the last step adds the info of `SoftVoxEnv`.

    Parameters
    ----------
    connected : bool
        Whether the mask has only digits after which the robot can still end in one piece. Agents
        that follow such a mask always build one piece, and can build every one. Otherwise the mask
        allows all digits. A digit outside the mask is accepted too; once no digit can lead to one
        piece any more, the mask allows all.
    shape, physics, reality, task, heading, objectives, render_mode, from_table
        As in `SoftVoxEnv`. Pictures show the voxels so far; those of the last step show the walk.

    Raises
    ------
    TypeError, ValueError
        As `SoftVoxEnv` does, or if there are several phases; by `step` if the action is not in the
        space.
    gymnasium.error.ResetNeeded
        By `step` if the robot is finished.

    Examples
    --------
    >>> import gymnasium as gym
    >>> import softvox_gym
    >>> env = gym.make("SoftVoxGrow2x2x2-v0", connected=True)
    >>> observation, info = env.reset(seed=0)
    >>> for digit in [0, 0, 0, 2, 1, 2, 2, 2]:
    ...     assert info["action_mask"][digit]
    ...     observation, reward, terminated, truncated, info = env.step(digit)
    >>> print(round(reward, 2), terminated, info["design"])
    4.66 True 6453

    Versions
    --------
    v0: the first.
    """

    def __init__(
        self, *, connected: bool = False, render_mode: str | None = None, **options: Any
    ) -> None:
        self.growth = Growth(1, render_mode, connected, **options)
        self.evaluator = self.growth.evaluator
        super().__init__(self.growth)

    def action_masks(self) -> Bools:
        """Return which digits the next site may get, shape (3,)."""
        only: Bools = self.growth.action_masks()[0]
        return only


class SoftVoxGrowVectorEnv(NativeVectorEnv):
    """`SoftVoxGrowEnv` for a batch of robots; robots finished in one step are tried together.

    Parameters
    ----------
    num_envs, autoreset_mode, threads
        As in `SoftVoxVectorEnv`.
    connected, shape, physics, reality, task, heading, objectives, render_mode, from_table
        As in `SoftVoxGrowEnv`; one for the whole batch.

    Raises
    ------
    TypeError, ValueError
        As both do.

    Examples
    --------
    >>> import gymnasium as gym
    >>> import softvox_gym
    >>> envs = gym.make_vec("SoftVoxGrow2x2x2-v0", num_envs=2, autoreset_mode="SameStep")
    >>> _ = envs.reset(seed=0)
    >>> for digits in zip([0, 0, 0, 2, 1, 2, 2, 2], [2] * 8):
    ...     _, rewards, _, _, infos = envs.step(digits)
    >>> print(rewards.round(2), infos["final_info"]["design"], envs.action_masks().shape)
    [4.66 0.01] [6453 6560] (2, 3)
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        connected: bool = False,
        render_mode: str | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        **options: Any,
    ) -> None:
        check_count("num_envs", num_envs, least=1)
        self.growth = Growth(num_envs, render_mode, connected, **options)
        self.evaluator = self.growth.evaluator
        super().__init__(self.growth, num_envs, autoreset_mode)

    def action_masks(self) -> Bools:
        """Return which digits the next sites may get, shape (num_envs, 3)."""
        return self.growth.action_masks()
