"""Where results come from, the program, the machine and the moment; and a digest of them."""

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

#: Designs of which the engine's bits are looked at, nominally and disturbed.
PROBED = np.arange(40, 3**8, 410)


def provenance(*, threads: int | None = None) -> dict[str, Any]:
    """Return what results depend on, or might be asked about later; ready for JSON.

    Take it before the work: it says when that started, and from which commit. The threads are those
    handed to `simulate`. Raises ValueError as `softvox_gym.engine.isa_name` does.
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
    """Return a digest of what the loaded engine, and the noise, make of some designs.

    Results that were made with another may differ in their bits. Computed once per process, in a
    tenth of a second.
    """
    nominal, disturbed = (
        evaluate(PROBED, perturbations=perturbations, seed=0).displacement
        for perturbations in ([], [Jakobi(2.0)])
    )
    return digest(np.concatenate([nominal, disturbed]))


def commit() -> str | None:
    """Return the commit that this package runs from, "-dirty" where changed; None if installed."""
    # An installed copy may lie inside some other repository, which does not track it.
    if _output("git", "ls-files", "--error-unmatch", SOURCE.name) is None:
        return None
    head = _output("git", "rev-parse", "HEAD")
    changes = _output("git", "--no-optional-locks", "status", "--porcelain", "-uno")
    return f"{head}-dirty" if head and changes else head


def cpu_model() -> str:
    """Return the processor's name, as well as the system knows it."""
    with contextlib.suppress(OSError):
        linux = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        if match := re.search(r"^model name\s*:\s*(.*\S)", linux, re.MULTILINE):
            return match[1]
    apple = _output("sysctl", "-n", "machdep.cpu.brand_string")
    return apple or platform.processor() or platform.machine()


def _output(*command: str) -> str | None:
    """Return what a command prints, run in the source folder; None where it fails or is absent."""
    try:
        done = subprocess.run(
            command, cwd=SOURCE.parent, capture_output=True, text=True, timeout=10, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()
