"""What a Dask cluster costs, in processor seconds of all its processes beside those of one.

    python benchmarks/cluster.py [--repeat 3] [--workers 1 2] [--append]

measures, on one worker and on two of this machine: an evaluation of the whole landscape, one under
noise, a comparison of searchers, and chunks without work, which are the scheduler's own time; in
turn with the same in this process. --append adds the rows to benchmarks/cluster.csv. It is never a
test: nothing passes or fails. The processor times mean something on a machine that does other work
too; the efficiency, from the time on the wall, only on a quiet one.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from statistics import median
from typing import Any

import distributed
import numpy as np
from engine import HERE, append, rounded

from softvox_gym import cluster, evaluate
from softvox_gym.manifest import commit, cpu_model
from softvox_gym.noise import Jakobi
from softvox_search.experiment import cluster as clusters
from softvox_search.experiment.environments import Environments
from softvox_search.experiment.pool import done
from softvox_search.experiment.schema import of_dict

TABLE = HERE / "cluster.csv"
EMPTY = 1000

EXPERIMENT = of_dict(
    {
        "seeds": 12,
        "budget": {"unique": 250},
        "table": False,
        "searchers": [{"name": "random"}],
        "title": "benchmark",
    },
    "benchmark",
)
RUNS = [(str(number), run) for number, run in enumerate(EXPERIMENT.runs())]

#: Work on a cluster, or here where the client is None.
Work = Callable[[Any], object]


def landscape(client: Any) -> object:
    """Evaluate all designs."""
    return evaluate(np.arange(3**8), client=client, threads=1)


def noisy(client: Any) -> object:
    """Evaluate random designs under noise."""
    designs = np.random.default_rng(0).integers(0, 3**8, 50)
    return evaluate(
        designs, perturbations=[Jakobi(1.0)], trials=32, seed=0, client=client, threads=1
    )


def comparison(client: Any) -> object:
    """Do the runs of an experiment."""
    if client is None:
        environments = Environments()
        return [done(task, environments) for task in RUNS]
    return list(clusters.do_all(RUNS, client=client, experiment=EXPERIMENT, say=print))


def empty(client: Any) -> object:
    """Send chunks that hold nothing."""
    if client is None:
        return None
    return client.gather([client.submit(int, pure=False) for _ in range(EMPTY)])


CASES: dict[str, Work] = {
    "landscape": landscape,
    "noisy": noisy,
    "comparison": comparison,
    f"{EMPTY} empty chunks": empty,
}


def seconds(work: Work, client: Any) -> tuple[float, float]:
    """Return the seconds that some work takes: of all processes' processors, and of the wall."""
    before, wall = processor(client), time.perf_counter()
    work(client)
    wall = time.perf_counter() - wall
    return processor(client) - before, wall


def processor(client: Any) -> float:
    """Return the processor seconds so far of this process, the scheduler's too, and of workers."""
    theirs = client.run(time.process_time).values() if client else ()
    return time.process_time() + sum(theirs)


@contextmanager
def counted(client: Any) -> Iterator[list[int]]:
    """Count what is submitted."""
    count, submit = [0], client.submit

    def counting(*given: Any, **options: Any) -> Any:
        count[0] += 1
        return submit(*given, **options)

    client.submit = counting
    try:
        yield count
    finally:
        client.submit = submit


def warm() -> None:
    """Import and compute on a worker what every process does once."""
    cluster._probe(evaluate)
    clusters._facts(EXPERIMENT.libraries, ("softvox_gym", "softvox_search"), ())
    done(RUNS[0], Environments())


def measure(case: str, client: Any, workers: int, repeat: int) -> dict[str, Any]:
    """Return one row of the table: medians over the repetitions, ratios within one."""
    work, rows = CASES[case], []
    for _ in range(repeat):
        cpu, wall = seconds(work, None)
        with counted(client) as chunks:
            cluster_cpu, cluster_wall = seconds(work, client)
        rows.append(
            {
                "chunks": chunks[0],
                "cpu_s": cpu,
                "cluster_cpu_s": cluster_cpu,
                "overhead": cluster_cpu / cpu - 1 if work is not empty else 0.0,
                "ms_per_chunk": (cluster_cpu - cpu) / chunks[0] * 1e3,
                "wall_s": wall,
                "cluster_wall_s": cluster_wall,
                "efficiency": wall / cluster_wall / workers,
            }
        )
    return rounded({key: median(row[key] for row in rows) for key in rows[0]})


def main() -> None:
    """Measure, print, and append where asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeat", type=int, default=3, help="repetitions, of which the median")
    parser.add_argument("--append", action="store_true", help=f"add the rows to {TABLE.name}")
    parser.add_argument("--workers", type=int, nargs="+", default=[1, 2], help="how many in turn")
    options = parser.parse_args()
    for workers in options.workers:
        with clusters.connected("local", workers=workers) as client:
            warm()
            client.run(warm)
            for case in CASES:
                row = {
                    "date": time.strftime("%Y-%m-%d", time.gmtime()),
                    "commit": commit() or "",
                    "cpu": cpu_model(),
                    "dask": distributed.__version__,
                    "case": case,
                    "workers": workers,
                    "chunk_work": cluster.CHUNK_WORK,
                    **measure(case, client, workers, options.repeat),
                }
                print("\n".join(f"{key:>16} {value}" for key, value in row.items()), end="\n\n")
                if options.append:
                    append(TABLE, row)


if __name__ == "__main__":
    main()
