"""The provenance of results: program, machine and time; and a digest of results."""

from __future__ import annotations

import contextlib
import hashlib
import platform
import re
import subprocess
from datetime import UTC, datetime
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import engine
from softvox_gym.evaluation import evaluate
from softvox_gym.noise import Jakobi

SOURCE = Path(__file__).resolve()

#: Designs whose bits `engine_probe` computes, without and with noise.
PROBED = np.arange(40, 3**8, 410)


def provenance(*, threads: int | None = None) -> dict[str, Any]:
    """Return what results depend on, and facts that may matter later; ready for JSON.

    Call it before the work: it records the time and the commit at the start. `threads` is as passed
    to `simulate`. Raises ValueError as `softvox_gym.engine.isa_name` does.
    """
    return {
        "version": metadata.version("softvox-gym"),
        "commit": commit(),
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "cpu": cpu_model(),
        "instruction_set": engine.isa_name(),
        "compiler": engine.compiler(),
        "threads": engine.default_threads() if threads is None else threads,
        "platform": platform.platform(),
        "python": platform.python_version(),
        "numpy": np.__version__,
    }


def digest(displacement: NDArray[np.float64]) -> str:
    """Return the SHA-256 of the bits: little-endian float64, design by design, dx, dy, dz."""
    return hashlib.sha256(np.ascontiguousarray(displacement, dtype="<f8").tobytes()).hexdigest()


@lru_cache(maxsize=1)
def engine_probe() -> str:
    """Return a digest of the results of some designs, with the loaded engine and its noise.

    Results with another digest may differ in their bits. Computed once per process, in a tenth of a
    second.
    """
    nominal, disturbed = (
        evaluate(PROBED, perturbations=perturbations, seed=0).displacement
        for perturbations in ([], [Jakobi(2.0)])
    )
    return digest(np.concatenate([nominal, disturbed]))


def commit() -> str | None:
    """Return the commit that this package runs from, "-dirty" if changed; None if installed."""
    # An installed copy may be inside another repository, which does not track it.
    if _output("git", "ls-files", "--error-unmatch", SOURCE.name) is None:
        return None
    head = _output("git", "rev-parse", "HEAD")
    changes = _output("git", "--no-optional-locks", "status", "--porcelain", "-uno")
    return f"{head}-dirty" if head and changes else head


def cpu_model() -> str:
    """Return the processor's name, as far as the system knows it."""
    with contextlib.suppress(OSError):
        linux = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        if match := re.search(r"^model name\s*:\s*(.*\S)", linux, re.MULTILINE):
            return match[1]
    apple = _output("sysctl", "-n", "machdep.cpu.brand_string")
    return apple or platform.processor() or platform.machine()


def _output(*command: str) -> str | None:
    """Return the output of a command in the source folder; None if it fails or is missing."""
    try:
        done = subprocess.run(
            command, cwd=SOURCE.parent, capture_output=True, text=True, timeout=10, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
