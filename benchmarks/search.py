"""How many evaluations a second the environments, the oracle and the searchers do, on one core.

    python benchmarks/search.py [--evaluations 2000]

prints evaluations per second of processor time: of the table's and the engine's vector environment
and of the oracle on them, by batch; of the engine under noise; and of every searcher's own ask and
tell, the oracle's answers left out. Nothing passes or fails.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from typing import Any

import gymnasium as gym
import numpy as np

import softvox_gym
from softvox_gym import Lattice
from softvox_gym.wrappers.vector import JakobiNoise
from softvox_search.oracle import Budget, Oracle
from softvox_search.registry import SEARCHERS, make

TABLE, ENGINE = softvox_gym.TABLE_ENV_ID, softvox_gym.ENV_ID
BATCHES = (1, 16, 50, 256, 4096)

MakeEnv = Callable[[int], Any]


def bare(name: str) -> MakeEnv:
    """Return what makes vector environments of one thread."""
    options = {} if name == TABLE else {"threads": 1}
    return lambda n: gym.make_vec(name, num_envs=n, **options)


def noisy(n: int) -> Any:
    """Return a vector environment at the assumed real variability."""
    return JakobiNoise(bare(ENGINE)(n))


def per_second(work: Callable[[], object], evaluations: int) -> float:
    """Return evaluations per second of processor time."""
    begin = time.process_time()
    work()
    return evaluations / (time.process_time() - begin)


def environment(make_env: MakeEnv, batch: int, evaluations: int) -> float:
    """Return the evaluations per second of a vector environment itself."""
    env = make_env(batch)
    actions = (
        Lattice()
        .digits(
            np.random.default_rng(0)
            .integers(0, 3**8, (evaluations // batch + 1, batch))
            .reshape(-1)
        )
        .reshape(-1, batch, 8)
    )
    env.reset(seed=0)
    env.step(actions[0])

    def work() -> None:
        for rows in actions:
            env.reset()
            env.step(rows)

    return per_second(work, len(actions) * batch)


def oracle(make_env: MakeEnv, batch: int, evaluations: int) -> float:
    """Return the evaluations per second of the oracle, none of them from its cache."""
    rng = np.random.default_rng(0)
    asked = Oracle(make_env, Budget(evaluations=evaluations), rng=rng)
    designs = Lattice().digits(np.random.default_rng(0).permutation(3**8)[:evaluations])
    asked.evaluate(designs[:0])

    def work() -> None:
        for begin in range(0, len(designs), batch):
            asked.evaluate(designs[begin : begin + batch])

    return per_second(work, len(designs))


def searcher(name: str, evaluations: int) -> tuple[int, float]:
    """Return how often a searcher's own work is done, and how many times a second."""
    made = make(name, np.random.default_rng(0))
    asked = Oracle(bare(TABLE), Budget(evaluations=evaluations))
    own = 0.0
    while not asked.is_exhausted:
        begin = time.process_time()
        designs = made.ask()
        own += time.process_time() - begin
        answer = asked.evaluate(designs)
        if len(answer.designs) == 0:
            break
        begin = time.process_time()
        made.tell(*answer)
        own += time.process_time() - begin
    return asked.evaluations, asked.evaluations / own


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, add_help=True, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--evaluations", type=int, default=2000, help="per measurement")
    count = parser.parse_args().evaluations
    print(f"{'evaluations/s':24}" + "".join(f"{f'batch {batch}':>12}" for batch in BATCHES))
    for name, measure, make_env in (
        ("environment, table", environment, bare(TABLE)),
        ("environment, engine", environment, bare(ENGINE)),
        ("environment, noise", environment, noisy),
        ("oracle, table", oracle, bare(TABLE)),
        ("oracle, engine", oracle, bare(ENGINE)),
        ("oracle, noise", oracle, noisy),
    ):
        rates = [measure(make_env, batch, count) for batch in BATCHES]
        print(f"{name:24}" + "".join(f"{rate:12,.0f}" for rate in rates), flush=True)
    print(f"\n{'ask and tell alone':24}{'evaluations':>12}{'a second':>12}")
    for name in SEARCHERS:
        searcher(name, 50)  # imports its libraries
        done, rate = searcher(name, count)
        print(f"{name:24}{done:12}{rate:12,.0f}", flush=True)


if __name__ == "__main__":
    main()
