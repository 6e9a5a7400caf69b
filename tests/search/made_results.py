"""Results of runs that were made up, to see what the report makes of them."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pandas as pd

import softvox_gym
from softvox_gym import Lattice

FITNESS = softvox_gym.landscape()["fitness"]
OPTIMUM = FITNESS.max()

#: What `Physics.of` takes, by label; half a second is soon simulated.
VALUES = {"brief": {"preset": "published", "settle_time": 0.05, "duration": 0.25}}


@dataclass(frozen=True, eq=False)
class Results:
    """As `softvox_search.experiment.results.Results`, from memory."""

    title: str
    command: str
    runs: pd.DataFrame
    logs: dict
    budgets: dict
    problems: list
    is_of_transfer: bool = False

    def evaluations(self, run):
        return self.logs[run]


def run(
    number,
    searcher,
    designs,
    *,
    physics="published",
    shape=(2, 2, 2),
    level=np.nan,
    policy="",
    status="ok",
    believed=0.0,
    fitness=None,
    unique=None,
):
    """A run that evaluates these designs in turn and recommends the best.

    They are different ones unless unique evaluations are given; their fitness is that of the
    published landscape unless it is given.
    """
    designs = np.asarray(designs)
    sequence = np.arange(1, len(designs) + 1)
    fitness = FITNESS[designs] if fitness is None else np.asarray(fitness, dtype=float)
    log = {
        "sequence": sequence,
        "unique_sequence": sequence if unique is None else np.asarray(unique),
        "design": designs,
        "fitness": fitness,
    }
    row = {
        "run": f"{number:064x}",
        "searcher": searcher,
        "physics": physics,
        "shape": "x".join(map(str, shape)),
        "level": level,
        "policy": policy,
        "seed": number,
        "status": status,
        "unique": int(log["unique_sequence"].max(initial=0)),
        "evaluations": len(designs),
        "steps": 1000 * len(designs),
        "recommended": designs[fitness.argmax()],
        "believed": believed,
        "digest": "",
        "file": "",
    }
    return row, log


def results(*runs, budgets=None, title="Made up", command="make it up"):
    rows = [row for row, _ in runs]
    most = {"unique": max(row["unique"] for row in rows)}
    problems = dict.fromkeys((row["physics"], row["shape"], row["level"]) for row in rows)
    return Results(
        title=title,
        command=command,
        runs=pd.DataFrame(rows),
        logs={row["run"]: log for row, log in runs},
        budgets={row["searcher"]: most for row in rows} | (budgets or {}),
        problems=[
            SimpleNamespace(
                physics=physics,
                values=VALUES.get(physics, "published"),
                shape=Lattice.named(shape),
                level=level,
                wrappers=(),
            )
            for physics, shape, level in problems
        ],
    )


def random_runs(
    searchers,
    seeds,
    length,
    *,
    physics=("published",),
    shapes=((2, 2, 2),),
    levels=(np.nan,),
    policies=("",),
):
    """Runs that evaluate designs in random order; what they believe is a little off."""
    rng = np.random.default_rng(0)
    cells = [
        (kind, shape, level, policy, name)
        for kind in physics
        for shape in shapes
        for level in levels
        for policy in policies
        for name in searchers
    ]
    return [
        run(
            seeds * i + seed,
            searcher,
            rng.permutation(6561)[:length],
            physics=kind,
            shape=shape,
            level=level,
            policy=policy,
            believed=rng.normal(3, 0.1),
        )
        for i, (kind, shape, level, policy, searcher) in enumerate(cells)
        for seed in range(seeds)
    ]
