"""Make what ships of landscapes of several phases, src/softvox_gym/data/computed/phased.*, anew.

Run by `make phased`, after a change of the engine's bits. It takes about half an hour of one core;
that of four phases is kept in the user's cache folder, and taken up there.
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
    Table,
    phased,
    phased_lattice,
)
from softvox_gym.manifest import digest
from softvox_gym.progress import Progress
from softvox_gym.realities import Reality

#: So many of the fittest designs of four phases ship.
FITTEST = 1000


def main() -> None:
    """Simulate both landscapes, where they are not kept, and write what ships of them."""
    (COMPUTED / PHASED).unlink(missing_ok=True)
    two, four = map(landscape, (2, 4))
    best = np.argsort(-four["fitness"], kind="stable")[:FITTEST]
    arrays = {
        "two": displacement(two),
        f"two{STEPS}": two["steps"].astype(np.int32),
        "four_best": best,
        "four_best_displacement": displacement(four)[best],
    }
    digests = {"2": digest(displacement(two)), "4": digest(displacement(four))}
    folder = Path(str(COMPUTED))
    write_file(folder / PHASED, archive_of(arrays), force=True)
    write_file(folder / PHASED_DIGESTS, (json.dumps(digests, indent=2) + "\n").encode(), force=True)


def landscape(phases: int) -> Table:
    """Return the published landscape of so many phases."""
    with Progress(sys.stderr, unit=f"designs of {phases} phases") as progress:
        lattice = phased_lattice(phases)
        return phased(Reality.of(Physics.published()), lattice, progress=progress)


def displacement(table: Table) -> np.ndarray:
    """Return displacements, shape (n, 3)."""
    return np.stack([table[axis] for axis in AXES], axis=-1)


if __name__ == "__main__":
    main()
