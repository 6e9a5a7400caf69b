"""What to build and test next: a method chooses several designs before any is tested."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from softvox_gym import MeasuredReality, Task
from softvox_gym.design import buildable
from softvox_gym.engine import Progress
from softvox_gym.landscapes.analysis.symmetry import symmetry_classes
from softvox_gym.landscapes.table import LATTICE, N_DESIGNS, all_digits, bodies
from softvox_gym.realities import PhysicsLike, single_physics
from softvox_gym.simulation import check_count
from softvox_search.transfer.methods.ensemble import Eea
from softvox_search.transfer.methods.gaussian import Ite
from softvox_search.transfer.protocol import Test
from softvox_search.transfer.registry import make
from softvox_search.transfer.simulator import Simulator

Array = NDArray[np.float64]

#: Most proposals at once.
MOST = 100


@dataclass(frozen=True, eq=False)
class Proposal:
    """A design to build and test, with the expectations from all measurements.

    Parameters
    ----------
    design : int
    reward : float
        Its expected reward in the task, voxel widths.
    spread : float
        The uncertainty of the reward, voxel widths: the root mean square distance of the ensemble's
        models from their mean displacement (eea), or the standard deviation of the reward (ite).
    simulated : float
        Its reward in the nominal simulator, voxel widths.
    displacement : ndarray, shape (3,), or None
        Its expected displacement, voxel widths; None if the method expects only rewards.
    why : str
        The reason for the proposal, in words.
    """

    design: int
    reward: float
    spread: float
    simulated: float
    displacement: Array | None
    why: str


#: Expectations of a method: reward, spread and displacement, if any, each (6561, ...), and why.
Belief: TypeAlias = tuple[Array, Array, "Array | None", Callable[[int], str]]


def proposals(
    reality: MeasuredReality | None = None,
    *,
    method: str = "eea",
    budget: int = 5,
    task: str | Task = "displacement",
    heading: float | None = None,
    seed: int = 0,
    nominal: PhysicsLike = "published",
    buildable_only: bool = True,
    progress: Progress | None = None,
    **options: Any,
) -> tuple[Proposal, ...]:
    """Return the designs to build and test next, first choice first.

    The method is told all measurements. It is then asked for one design after another, and after
    each is told its own expectation instead of a result (the kriging believer), so that it chooses
    the next design as if that were known. The numbers of a proposal come from the measurements
    alone.

    No proposal is a measured design, the image of a measured or proposed one under turns or
    mirrors, or a design without active voxels.

    Parameters
    ----------
    reality : MeasuredReality, optional
        The measurements, and the simulator that they are compared with.
    method : {"eea", "ite"}
        Choose by the disagreement of the models that fit the measurements, or by the expected gain.
    budget : int
        The most designs to propose, up to 100.
    task : str or softvox_gym.Task
    heading : float, optional
        Heading of the directed task, degrees; 0 by default.
    seed : int
        Seed of the method's random numbers.
    nominal : str, dict or Physics
        The simulator if nothing was measured: then it chooses, or the method's own models do.
    buildable_only : bool
        Whether to leave out designs that the kit can't build; see `softvox_gym.design.buildable`.
    progress : callable (done, total), optional
        Called with the number of the method's models that are simulated.
    **options
        Options of the method.

    Returns
    -------
    tuple of Proposal
        Fewer than asked for if nothing is left, or the method ends.

    Raises
    ------
    TypeError, ValueError
        If an argument is none of these; the message names it.

    Notes
    -----
    Source: D. Ginsbourger, R. Le Riche, L. Carraro, "Kriging is well-suited to parallelize
    optimization", in Computational Intelligence in Expensive Optimization Problems, 2010.

    Examples
    --------
    >>> first, second = proposals(method="ite", budget=2)
    >>> first.design, round(first.reward, 2)
    (6453, 4.66)
    """
    check_count("budget", budget, least=1, most=MOST)
    check_count("seed", seed, least=0, most=2**64 - 1)
    if method not in BELIEFS:
        raise ValueError(f"method must be one of {', '.join(BELIEFS)}, got {method!r}")
    if not isinstance(reality, MeasuredReality | None):
        raise TypeError(
            f"reality must be one that Reality.from_trials makes, got {str(reality)[:40]!r}"
        )
    what = Task.of(task, heading)
    tests = []
    if reality is not None:
        moved = reality.displacement
        tests = [Test(n, float(what.reward(moved[n])), moved[n]) for n in reality.designs.tolist()]
    robots = _robots()
    is_free = bodies().n_active > 0
    if buildable_only:
        is_free &= buildable(all_digits(LATTICE), LATTICE)
    is_free &= ~np.isin(robots, robots[[test.design for test in tests]])
    if not is_free.any():
        return ()
    believed = single_physics(nominal) if reality is None else reality.nominal
    simulator = Simulator(believed, testable=is_free, progress=progress)
    rng = np.random.default_rng(seed)
    made: Any = make(method, simulator, what, rng, **options).method
    for test in tests:
        made.tell(test)
    rewards, spreads, displacement, why = BELIEFS[method](made)
    simulated = what.reward(simulator.landscape())
    chosen: list[Proposal] = []
    while len(chosen) < budget and made.untested().any() and (design := made.ask()) is not None:
        way = None if displacement is None else displacement[design]
        reward, spread, said = (float(all_of[design]) for all_of in (rewards, spreads, simulated))
        chosen.append(Proposal(design, reward, spread, said, way, why(design)))
        made.tell(Test(design, reward, np.zeros(3) if way is None else way))
        made.leave_out(robots == robots[design])
    return tuple(chosen)


def _robots() -> NDArray[np.int64]:
    """Return for every design the representative of the robot that is built, shape (6561,).

    Turned and mirrored designs are equal, and so are those that differ only in height.
    """
    numbers = np.arange(N_DESIGNS)
    upper = 3 ** (LATTICE.sites // 2)
    return symmetry_classes()[np.where(numbers % upper == 0, numbers // upper, numbers)]


def _of_models(made: Eea) -> Belief:
    """Return the expectations of the models that fit the measurements."""
    moved = made.models()[made.kept]
    rewards = made.task.reward(moved)
    models = "models that fit what was measured" if made.tests else "models of the prior"
    return (
        np.asarray(np.tensordot(made.weights, rewards, 1)),
        np.sqrt(moved[..., :2].var(axis=0).sum(axis=-1)),
        made.predict(),
        lambda n: f"{models} expect {rewards[:, n].min():.1f} to {rewards[:, n].max():.1f}",
    )


def _of_process(made: Ite) -> Belief:
    """Return the expectations of the Gaussian process."""
    reward = made.predict()
    best = max((test.reward for test in made.tests), default=None)

    def why(n: int) -> str:
        if best is None:
            return "the simulator's choice"
        gain = reward[n] - best
        return f"{abs(gain):.1f} {'more' if gain >= 0 else 'less'} than the best measured"

    return reward, made.deviation(), None, why


#: The methods that report an uncertainty, and their expectations.
BELIEFS: Mapping[str, Callable[[Any], Belief]] = {"eea": _of_models, "ite": _of_process}
