"""What to build and test next: a method is asked for several designs before any is tested."""

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

#: Most proposals at once: a day's work, not a library's.
MOST = 100


@dataclass(frozen=True, eq=False)
class Proposal:
    """A design to build and test, and what is expected of it by all that was measured.

    Parameters
    ----------
    design : int
    reward : float
        What it is expected to be worth in the task, voxel widths.
    spread : float
        How unsure that is, voxel widths: the root mean square distance of the ensemble's models
        from their mean displacement (eea), or the standard deviation of the reward (ite).
    simulated : float
        What the nominal simulator says that it is worth, voxel widths.
    displacement : ndarray, shape (3,), or None
        Expected, voxel widths; None where the method expects rewards alone.
    why : str
        Why this one, in words.
    """

    design: int
    reward: float
    spread: float
    simulated: float
    displacement: Array | None
    why: str


#: What a method expects: reward, spread and displacement, if any, each (6561, ...), and why.
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
    """Return which designs to build and test next, the first choice first.

    The method is told all that was measured. It is then asked for one design after another, and
    told of each, in the place of a result, what it expects of it (the kriging believer), so that
    it chooses the next one as if that were known. What a proposal tells is from what was measured
    alone.

    No design is proposed that was measured, nor one that looks like a measured or a proposed one
    when turned or mirrored, nor one without active voxels.

    Parameters
    ----------
    reality : MeasuredReality, optional
        What was measured, and the simulator that it is held against.
    method : {"eea", "ite"}
        By disagreement of the models that fit what was measured, or by the gain expected.
    budget : int
        At most so many designs, up to 100.
    task : str or softvox_gym.Task
    heading : float, optional
        Of the directed task, degrees; 0 where None.
    seed : int
        Of the method's random numbers.
    nominal : str, dict or Physics
        The simulator where nothing was measured: it chooses then, or the method's own models do.
    buildable_only : bool
        Whether to leave out what the kit can't build; see `softvox_gym.design.buildable`.
    progress : callable (done, total), optional
        Is told how many of the method's models are simulated.
    **options
        Of the method.

    Returns
    -------
    tuple of Proposal
        Fewer than asked for where nothing is left, or where the method ends.

    Raises
    ------
    TypeError, ValueError
        For what is none of these, naming it.

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
    """Return for every design the one that stands for what is built, shape (6561,).

    Turned and mirrored ones are the same, and what has no lower slice is what has it there.
    """
    numbers = np.arange(N_DESIGNS)
    upper = 3 ** (LATTICE.sites // 2)
    return symmetry_classes()[np.where(numbers % upper == 0, numbers // upper, numbers)]


def _of_models(made: Eea) -> Belief:
    """Return what the models expect that fit what was measured."""
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
    """Return what the Gaussian process expects."""
    reward = made.predict()
    best = max((test.reward for test in made.tests), default=None)

    def why(n: int) -> str:
        if best is None:
            return "the simulator's choice"
        gain = reward[n] - best
        return f"{abs(gain):.1f} {'more' if gain >= 0 else 'less'} than the best measured"

    return reward, made.deviation(), None, why


#: The methods that say how unsure they are, and how.
BELIEFS: Mapping[str, Callable[[Any], Belief]] = {"eea": _of_models, "ite": _of_process}
