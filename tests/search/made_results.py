"""Results of runs that were made up, to see what the report makes of them."""

import numpy as np
import pandas as pd

import softvox_gym
from softvox_search.report.improvements import improvements
from softvox_search.report.results import Results

FITNESS = softvox_gym.landscape()["fitness"]
OPTIMUM = FITNESS.max()


def run(number, searcher, designs, *, level=np.nan, policy="", status="ok", believed=0.0):
    """A run that evaluates these designs in turn, without duplicates, and recommends the best."""
    designs = np.asarray(designs)
    sequence = np.arange(1, len(designs) + 1)
    columns = {"sequence": sequence, "unique_sequence": sequence, "design": designs}
    row = {
        "run": number,
        "searcher": searcher,
        "level": level,
        "policy": policy,
        "seed": 0,
        "status": status,
        "unique": len(designs),
        "evaluations": len(designs),
        "steps": 1000 * len(designs),
        "recommended": designs[FITNESS[designs].argmax()],
        "believed": believed,
        "digest": "",
    }
    return row, pd.DataFrame({"run": number, **improvements(columns)})


def results(*runs, budget=None, title="Made up", command="make it up"):
    return Results(
        title=title,
        command=command,
        budget=budget or {"unique": max(row["unique"] for row, _ in runs)},
        runs=pd.DataFrame([row for row, _ in runs]),
        improvements=pd.concat([table for _, table in runs], ignore_index=True),
    )


def random_runs(searchers, seeds, length, *, levels=(np.nan,), policies=("",)):
    """Runs that evaluate designs in random order; what they believe is a little off."""
    rng = np.random.default_rng(0)
    cells = [(lev, pol, name) for lev in levels for pol in policies for name in searchers]
    return [
        run(
            seeds * i + seed,
            searcher,
            rng.permutation(6561)[:length],
            level=level,
            policy=policy,
            believed=rng.normal(3, 0.1),
        )
        for i, (level, policy, searcher) in enumerate(cells)
        for seed in range(seeds)
    ]
