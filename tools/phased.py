"""Recompute the shipped parts of landscapes of several phases, data/computed/phased.*.

Run by `make phased`, after a change of the engine's bits. It takes about half an hour of one core.
The landscape of four phases is kept in the user's cache folder, and continued from there.
"""

import json
import sys
from pathlib import Path

import numpy as np

from softvox_gym import Physics
from softvox_gym.files import archive_of, write_file
from softvox_gym.landscapes.table import (
    AXES,
    COMPUTED,
    PHASED,
    PHASED_DIGESTS,
    STEPS,
    phased,
    phased_lattice,
    simulated,
)
from softvox_gym.manifest import digest
from softvox_gym.progress import Progress
from softvox_gym.realities import Reality

#: How many of the fittest designs of four phases ship.
FITTEST = 1000


def main() -> None:
    """Simulate both landscapes, four phases only if not in the cache; write the shipped files."""
    reality = Reality.of(Physics.published())
    with Progress(sys.stderr, unit="designs of 2 phases") as progress:
        two = simulated(reality, phased_lattice(2), progress=progress)  # not the shipped one
    with Progress(sys.stderr, unit="designs of 4 phases") as progress:
        four = phased(reality, phased_lattice(4), progress=progress)
    displacement = np.stack([four[axis] for axis in AXES], axis=-1)
    best = np.argsort(-four["fitness"], kind="stable")[:FITTEST]
    arrays = {
        "two": two.displacement,
        f"two{STEPS}": two.steps,
        "four_best": best,
        "four_best_displacement": displacement[best],
    }
    digests = {"2": digest(two.displacement), "4": digest(displacement)}
    folder = Path(str(COMPUTED))
    write_file(folder / PHASED, archive_of(arrays), force=True)
    write_file(folder / PHASED_DIGESTS, (json.dumps(digests, indent=2) + "\n").encode(), force=True)


if __name__ == "__main__":
    main()
