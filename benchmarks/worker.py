"""One engine behind a pipe: answers what benchmarks/bodies.py asks of it, until the pipe ends.

Runs with whatever `softvox_gym` Python finds, so it uses only what the old one has as well.
"""

from __future__ import annotations

import os
import pickle
import re
import sys
import time
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

import softvox_gym
from softvox_gym import Physics, engine, simulate

#: Does the work once; returns the bits of what came of it, and the steps taken.
Work = Callable[[], tuple[bytes, Any]]


def simulating(designs: Any, physics: dict[str, float], phase: Any = None) -> Work:
    """Return the work of simulating designs on one thread; physics is changes to `published`."""
    changed = Physics.of({"preset": "published", **physics})

    def work() -> tuple[bytes, Any]:
        result = simulate(designs, changed, phase=phase, threads=1)
        return result.displacement.tobytes(), result.steps

    return work


def making() -> Work:
    """Return the work of making an environment."""
    gym.make(softvox_gym.ENV_ID)  # imports

    def work() -> tuple[bytes, Any]:
        gym.make(softvox_gym.ENV_ID)
        return b"", 0

    return work


def stepping(action: list[int]) -> Work:
    """Return the work of making an environment and stepping it."""
    making()
    digits = np.array(action)

    def work() -> tuple[bytes, Any]:
        env = gym.make(softvox_gym.ENV_ID)
        env.reset()
        track, *_, info = env.step(digits)
        return np.concatenate([info["displacement"], *track]).tobytes(), info["steps"]

    return work


def timed(work: Work, times: int) -> dict[str, Any]:
    """Return the processor seconds of doing some work once, and what came of it."""
    begin = time.process_time()
    for _ in range(times):
        bits, steps = work()
    return {"cpu": (time.process_time() - begin) / times, "bits": bits, "steps": steps}


def most_resident() -> int:
    """Return the most memory that this process has held so far, bytes."""
    status = Path("/proc/self/status")
    found = re.search(r"VmHWM:\s+(\d+) kB", status.read_text()) if status.exists() else None
    return int(found[1]) * 1024 if found else 0


def remembered(work: Work) -> dict[str, Any]:
    """Return the bytes that some work asks for, and those it used; these 0 where not on Linux."""
    sizes, allocate = [], engine._memory

    def counted(size: int) -> Any:
        sizes.append(size)
        return allocate(size)

    engine._memory = counted  # the engine's workspace, which is not traced
    before = most_resident()
    tracemalloc.start()
    work()
    asked = sum(sizes) + tracemalloc.get_traced_memory()[1]
    return {"asked": asked, "used": most_resident() - before}


def main() -> None:
    """Say where the engine is from, then do what is asked for."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what else is printed stays out of the pipe
    answer: Any = softvox_gym.__file__
    while True:
        pickle.dump(answer, answers)
        answers.flush()
        try:
            how, what, of, more = pickle.load(sys.stdin.buffer)
        except EOFError:
            return
        try:
            answer = globals()[how](globals()[what](**of), **more)
        except Exception as error:
            answer = error


if __name__ == "__main__":
    main()
