"""Make the landscapes under noise that ship with the package, data/computed/noise.npz, anew.

Run by `make noise`, after a change of the engine or of the noise; takes about ten minutes.
"""

import io
import sys
import time
from pathlib import Path

import numpy as np

import softvox_gym
from softvox_gym.files import write_file
from softvox_gym.landscapes.noisy import LEVELS, STATISTICS, measure, name_of
from softvox_gym.progress import Progress

FOLDER = Path(softvox_gym.__file__).parent / "data" / "computed"


def main() -> None:
    """Measure every level and write the archive."""
    levels = {}
    for level in LEVELS[1:]:
        wall, cpu = time.perf_counter(), time.process_time()
        with Progress(sys.stderr) as progress:
            levels[name_of(level)] = measure(level, progress=progress)
        seconds, cpu_seconds = time.perf_counter() - wall, time.process_time() - cpu
        print(f"level {level:g}: {seconds:.0f} s, {cpu_seconds:.0f} CPU-seconds")
    archive = io.BytesIO()
    np.savez_compressed(archive, **levels)
    write_file(FOLDER / STATISTICS, archive.getvalue(), force=True)


if __name__ == "__main__":
    main()
