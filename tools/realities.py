"""Recompute the tables of the named realities, src/softvox_gym/data/computed/realities.npz.

Run by `make realities`, after a change of the engine's bits or of a reality. It takes about 40
minutes of one core, nearly all for the high resolution. With names as arguments only these are
recomputed.
"""

import sys
import zipfile
from pathlib import Path

import numpy as np

from softvox_gym.files import archive_of, write_file
from softvox_gym.landscapes.table import AXES, COMPUTED, REALITIES, STEPS, compute, shipped
from softvox_gym.progress import Progress


def main(names: list[str]) -> None:
    """Simulate all designs in the named realities, or in all."""
    path = Path(str(COMPUTED)) / REALITIES
    arrays = dict(np.load(path)) if names and path.exists() else {}
    known = shipped()
    for name in names or known:
        with Progress(sys.stderr, unit=f"designs in {name}") as progress:
            table = compute(known[name], progress=progress)
        arrays[name] = np.stack([table[axis] for axis in AXES], axis=-1)
        arrays[name + STEPS] = table["steps"].astype(np.int32)
    ordered = {name: arrays[name] for name in sorted(arrays)}
    write_file(path, archive_of(ordered, zipfile.ZIP_DEFLATED), force=True)


if __name__ == "__main__":
    main(sys.argv[1:])
