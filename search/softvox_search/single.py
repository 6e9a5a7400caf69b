"""One search, compared with the whole landscape if that is known."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from softvox_gym import ENV_ID, TABLE_ENV_ID, Design, Lattice, Physics, noisy_landscape
from softvox_gym import evaluate as evaluate_designs
from softvox_gym.cli.terminal import BadInputError
from softvox_gym.landscapes.noisy import LEVELS
from softvox_gym.landscapes.table import has_table
from softvox_gym.missing import missing
from softvox_gym.rendering import png
from softvox_gym.wrappers.vector import JakobiNoise
from softvox_search.global_random import library
from softvox_search.log import NO_SEED, Columns, identity
from softvox_search.oracle import Budget, Oracle, Progress
from softvox_search.policies import Policy, with_policy
from softvox_search.protocol import SearcherError
from softvox_search.registry import make
from softvox_search.report.truth import exact_fitness
from softvox_search.run import believed, run


class RaisedError(Exception):
    """The searcher's own code raised an error, the cause of this one; the message is one line."""


def search(
    searcher: str,
    *,
    budget: Budget,
    options: dict[str, Any] | None = None,
    seed: int = 0,
    space: Lattice | None = None,
    physics: str | dict[str, Any] = "published",
    level: float | None = None,
    policy: Policy | None = None,
    progress: Progress | None = None,
) -> tuple[dict[str, Any], Columns]:
    """Run one search, and compare its recommendation with all designs.

    Parameters
    ----------
    searcher : str
        Name in the registry, or "package.module:name" of a class or function.
    budget : Budget
    options : dict, optional
        Options of the searcher.
    seed : int
        Seed of all random numbers.
    space : Lattice, optional
        By default 2x2x2.
    physics : str or dict
    level : float, optional
        Level of `JakobiNoise`; by default no noise.
    policy : Policy, optional
        Policy against luck, under noise.
    progress : callable (done, total), optional
        As in `Oracle`.

    Returns
    -------
    facts : dict
        Ready for JSON: the recommended ``design`` (its number), its ``digits``, ``shape`` and
        ``phases``; ``fitness`` without noise and, if the landscape is known, ``best``, ``rank``
        (one more than the number of better designs) and ``regret``; the ``level``; the value that
        the searcher ``believed`` it to have, None if it can't say; the same four by mean fitness
        ``under_noise``, None if that was not measured; the evaluation ``found_at``, None if there
        was none; the amounts used, ``unique``, ``evaluations``, ``steps``; and ``ended_by``, a part
        of the budget or the "searcher". In voxel widths.
    columns : dict of ndarray
        The log.

    Raises
    ------
    BadInputError
        If the searcher, its options or the policy are invalid, or a library is missing.
    SearcherError
        If the searcher breaks the protocol.
    RaisedError
        If the searcher's own code raises anything else.
    """
    space = space or Lattice()
    is_published = Physics.of(physics) == Physics.published()
    is_known = is_published and has_table(space)

    def environment(n: int) -> Any:
        # The table has the engine's bits.
        if is_known and not level:
            return gym.make_vec(TABLE_ENV_ID, num_envs=n, phases=space.phases)
        env: Any = gym.make_vec(ENV_ID, num_envs=n, shape=space, physics=physics)
        return env if not level else JakobiNoise(env, level)

    own, noise = (np.random.default_rng(s) for s in np.random.SeedSequence(seed).spawn(2))
    # At level 0 a repeated evaluation costs the same as at other levels.
    oracle = Oracle(environment, budget, rng=noise, noisy=level is not None, progress=progress)
    try:
        try:
            made = make(searcher, own, space=space, **(options or {}))
            if level is not None:
                made = with_policy(made, policy or Policy(), space, budget)
        except ImportError as error:
            raise BadInputError(missing(f"searcher {searcher}", error)) from error
        except (TypeError, ValueError) as error:
            raise BadInputError(f"--searcher {searcher}: {error}") from error
        design = run(made, oracle, name=searcher)
    except (BadInputError, SearcherError, MemoryError):
        raise
    except (Exception, SystemExit) as error:
        raise RaisedError(f"searcher {searcher} raised {type(error).__name__}: {error}") from error
    finally:
        oracle.close()
    columns = oracle.log.columns()
    evaluated = columns["sequence"][columns["design"] == identity(design)].tolist()
    under_noise = None
    if (exact := exact_fitness(physics, space)) is not None:
        standing = _standing(design, exact["raw"])
        if space == Lattice() and level is not None and level in LEVELS and is_published:
            under_noise = _standing(design, noisy_landscape(level)["mean"])
    else:
        standing = {"fitness": float(evaluate_designs(design, physics).value[0])}
    return {
        "design": design.index,
        "digits": design.digits,
        "shape": list(design.shape),
        "phases": design.lattice.phases,
        **standing,
        "level": level,
        "believed": believed(made, design, columns),
        "under_noise": under_noise,
        "found_at": evaluated[0] if evaluated else None,
        "unique": oracle.unique,
        "evaluations": oracle.evaluations,
        "steps": oracle.steps,
        "ended_by": oracle.ended_by or "searcher",
    }, columns


def _standing(design: Design, values: NDArray[np.float64]) -> dict[str, float]:
    """Return the standing of a design among the values of all designs; NaN counts as 0."""
    values = np.nan_to_num(values, nan=0.0)
    own, best = float(values[design.index]), float(values.max())
    rank = 1 + int((values > own).sum())
    return {"fitness": own, "best": best, "rank": rank, "regret": best - own}


def table(columns: Columns, suffix: str) -> bytes:
    """Return a log as a file, ".csv" or ".parquet"; without noise the seeds are left empty."""
    frame = library("pandas").DataFrame(columns)
    frame["noise_seed"] = frame["noise_seed"].astype("Int64").mask(frame["noise_seed"] == NO_SEED)
    content: bytes = (
        frame.to_csv(index=False).encode() if suffix == ".csv" else frame.to_parquet(index=False)
    )
    return content


def picture(design: Design, physics: Any = "published") -> bytes:
    """Return a picture of a design after its run without noise, as PNG."""
    env = gym.make(ENV_ID, shape=design.lattice, physics=physics, render_mode="rgb_array")
    env.reset(seed=0)
    env.step(design.lattice.to_rows(design.array))
    image: Any = env.render()
    env.close()
    return png(image)
