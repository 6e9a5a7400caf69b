"""Recompute the landscapes under noise that ship with the package, data/computed/noise.npz.

Run by `make noise`, after a change of the engine or the noise; takes about ten minutes.
"""

import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from softvox_gym import landscape
from softvox_gym.engine import Progress as Report
from softvox_gym.evaluation import evaluate
from softvox_gym.files import archive_of, write_file
from softvox_gym.landscapes.noisy import LEVELS, ROW, STATISTICS, name_of
from softvox_gym.landscapes.table import COMPUTED, N_DESIGNS
from softvox_gym.noise import Jakobi
from softvox_gym.progress import Progress

#: Draws of every design; and for each larger number of draws, how many designs with the best means
#: get at least so many.
DRAWS = 64
REDRAWN = {256: 100, 4096: 20}

#: Simulations in one call into C.
BATCH = 4096

#: How many of the fittest designs without noise are drawn anew.
N_NOMINAL = 200


def main() -> None:
    """Measure every level and write the archive."""
    levels = {}
    for level in LEVELS[1:]:
        wall, cpu = time.perf_counter(), time.process_time()
        with Progress(sys.stderr) as progress:
            levels[name_of(level)] = measure(level, progress)
        seconds, cpu_seconds = time.perf_counter() - wall, time.process_time() - cpu
        print(f"level {level:g}: {seconds:.0f} s, {cpu_seconds:.0f} CPU-seconds")
    write_file(Path(str(COMPUTED)) / STATISTICS, archive_of(levels), force=True)


def measure(level: float, progress: Progress) -> NDArray[np.void]:
    """Make the table of one level; see `softvox_gym.noisy_landscape`.

    At every level, design i is drawn with the seed i, then with 6561 + i, then with 2 * 6561 + i.
    """
    everything = np.arange(N_DESIGNS)
    rows = sample(everything, level, draws=DRAWS, seeds=everything, progress=progress)
    fittest = np.argsort(-landscape()["fitness"], kind="stable")[:N_NOMINAL]
    stage: tuple[int, int, NDArray[np.int64]] | None = (1, min(REDRAWN), fittest)
    while stage is not None:
        number, draws, more = stage
        seeds = number * N_DESIGNS + more
        rows[more] = sample(more, level, draws=draws, seeds=seeds, progress=progress)
        stage = next_stage(rows)
    return rows


def sample(
    designs: NDArray[np.int64],
    level: float,
    *,
    draws: int,
    seeds: NDArray[np.int64],
    progress: Report | None = None,
) -> NDArray[np.void]:
    """Evaluate designs under noise, each with its own seed, and return their statistics.

    Parameters
    ----------
    designs, seeds : ndarray of int, shape (n,)
        Numbers, and the seed of each design's random generator.
    level : float
        Level of the noise.
    draws : int
        Draws per design.
    progress : callable (done, total), optional
        Called with the number of simulations.

    Returns
    -------
    structured ndarray, shape (n,)
        Rows as in `noisy_landscape`.
    """
    batch = max(1, BATCH // draws)
    rows = np.zeros(len(designs), dtype=ROW)
    rows["design"] = designs
    rows["draws"] = draws
    for begin in range(0, len(designs), batch):
        some = slice(begin, begin + batch)
        generators = [np.random.default_rng(int(seed)) for seed in seeds[some]]
        found = evaluate(
            designs[some], perturbations=[Jakobi(level)], trials=draws, seed=generators
        )
        part = rows[some]
        part["mean"] = found.fitness.mean(axis=1)
        part["std"] = found.fitness.std(axis=1, ddof=1)
        part["q10"] = np.quantile(found.fitness, 0.1, axis=1)
        part["min"] = found.fitness.min(axis=1)
        part["p_diverged"] = found.diverged.mean(axis=1)
        part["dx"], part["dy"] = found.mean_displacement[:, :2].T
        if progress is not None:
            progress(draws * (begin + len(part)), draws * len(designs))
    return rows


def next_stage(rows: NDArray[np.void]) -> tuple[int, int, NDArray[np.int64]] | None:
    """Return the designs among the best that have too few draws, and how many they need."""
    order = np.argsort(-rows["mean"], kind="stable")
    for number, (draws, count) in enumerate(REDRAWN.items(), start=1):
        more = order[:count][rows["draws"][order[:count]] < draws]
        if len(more):
            return number, draws, more
    return None


if __name__ == "__main__":
    main()
