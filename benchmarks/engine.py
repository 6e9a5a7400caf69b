"""How fast the engine is, in yardsticks: processor time of fixed scalar work on the same machine.

    python benchmarks/engine.py [--repeat 5] [--append]

measures, each beside the yardstick in one run: the whole landscape on one thread with every
instruction set of this machine, how much two threads save, what a batch of 256 random designs
costs per design, and what a step of the vector environment costs beside `simulate`. --append adds
a row per instruction set to benchmarks/engine.csv. It is never a test: nothing passes or fails.
"""

from __future__ import annotations

import argparse
import csv
import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from statistics import median
from typing import Any

import gymnasium as gym
import numpy as np

import softvox_gym
from softvox_gym import Physics, engine, simulate
from softvox_gym.manifest import commit, cpu_model

HERE = Path(__file__).parent
TABLE = HERE / "engine.csv"
YARDSTICK_FLAGS = ("-O2", "-ffp-contract=off", "-fno-math-errno")
BATCH = 256
PUBLISHED = Physics.published()
ALL = np.arange(3**8)


def build_yardstick(folder: str) -> Path:
    """Compile the yardstick and return the program's path."""
    program = Path(folder) / "yardstick"
    compiler = os.environ.get("CC", "cc")
    source = HERE / "yardstick.c"
    subprocess.run([compiler, *YARDSTICK_FLAGS, source, "-lm", "-o", program], check=True)
    return program


def yardstick(program: Path) -> float:
    """Return the processor seconds of one yardstick."""
    run = subprocess.run([program], check=True, capture_output=True, text=True)
    return float(run.stdout)


def seconds(work: Callable[[], object]) -> tuple[float, float]:
    """Return the seconds that some work takes: of the processor over all threads, of the wall."""
    cpu, wall = time.process_time(), time.perf_counter()
    work()
    return time.process_time() - cpu, time.perf_counter() - wall


def landscape(threads: int = 1) -> Any:
    """Simulate all designs under published physics."""
    return simulate(ALL, PUBLISHED, threads=threads)


def voxel_steps() -> int:
    """Return the voxel-steps of one landscape."""
    result = landscape(threads=engine.default_threads())
    return int((np.count_nonzero(result.designs, axis=(1, 2, 3)) * result.steps).sum())


def measure(isa: str, program: Path, repeat: int, total_steps: int) -> dict[str, Any]:
    """Return one row of the table: medians over the repetitions, ratios within one."""
    os.environ[engine.ISA_VARIABLE] = isa
    designs = np.random.default_rng(0).integers(0, 3, (BATCH, 8))
    env = gym.make_vec(softvox_gym.ENV_ID, num_envs=BATCH, threads=1, autoreset_mode="Disabled")
    rows = []
    for _ in range(repeat):
        unit = yardstick(program)
        whole, one = seconds(landscape)
        _, two = seconds(lambda: landscape(threads=2))
        batch, _ = seconds(lambda: simulate(designs, PUBLISHED, threads=1, track=1))
        env.reset()
        step, _ = seconds(lambda: env.step(designs))
        rows.append(
            {
                "yardstick_s": unit,
                "landscape_cpu_s": whole,
                "yardsticks": whole / unit,
                "voxel_steps_per_s": total_steps / whole,
                "two_threads_wall_ratio": two / one,
                "random_256_cost_ratio": (batch / BATCH) / (whole / len(ALL)),
                "vector_env_cost_ratio": step / batch,
            }
        )
    env.close()
    return rounded({key: median(row[key] for row in rows) for key in rows[0]})


def provenance(isa: str) -> dict[str, str]:
    """Return what a row was measured on."""
    return {
        "date": datetime.now(UTC).strftime("%Y-%m-%d"),
        "commit": commit() or "",
        "cpu": cpu_model(),
        "isa": isa,
        "compiler": engine.compiler(),
        "flags": engine.compiler_flags(),
    }


def rounded(row: dict[str, Any]) -> dict[str, Any]:
    """Return a row with its numbers to four digits."""
    return {k: float(f"{v:.4g}") if isinstance(v, float) else v for k, v in row.items()}


def append(table: Path, row: dict[str, Any]) -> None:
    """Add a row to a table, with its header where there is none yet."""
    is_new = not table.exists()
    with table.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, fieldnames=list(row), lineterminator="\n")
        if is_new:
            writer.writeheader()
        writer.writerow(row)


def main() -> None:
    """Measure, print, and append where asked."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeat", type=int, default=5, help="repetitions, of which the median")
    parser.add_argument("--append", action="store_true", help=f"add the rows to {TABLE.name}")
    options = parser.parse_args()
    isas, total_steps = engine.isa_names(), voxel_steps()
    with tempfile.TemporaryDirectory() as folder:
        program = build_yardstick(folder)
        for isa in isas:
            row = {**provenance(isa), **measure(isa, program, options.repeat, total_steps)}
            print("\n".join(f"{key:>24} {value}" for key, value in row.items()), end="\n\n")
            if options.append:
                append(TABLE, row)


if __name__ == "__main__":
    main()
