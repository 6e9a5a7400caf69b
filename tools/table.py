"""Recompute the table that ships with the package, src/softvox_gym/data/computed/landscape.*.

Run by `make table`, after a change of the engine's bits.
"""

import json
from pathlib import Path

import numpy as np

from softvox_gym import simulate
from softvox_gym.files import archive_of, write_file
from softvox_gym.landscapes.table import COMPUTED, N_DESIGNS, TRACKS
from softvox_gym.manifest import digest, provenance

#: File with the origin of the tracks: version, commit and digest of the engine's bits.
ORIGIN = "landscape.json"
FACTS = ("version", "commit", "compiler", "instruction_set")


def main() -> None:
    """Simulate all designs, and write their tracks and the origin of these."""
    origin = provenance()
    result = simulate(np.arange(N_DESIGNS), track=1)
    assert result.track is not None
    assert np.array_equal(result.track[:, -1], result.displacement)
    assert not result.diverged.any()
    content = archive_of({"track": result.track, "steps": result.steps})
    facts = {
        "engine_digest": digest(result.displacement),
        "physics": "published",
        **{name: origin[name] for name in FACTS},
    }
    folder = Path(str(COMPUTED))
    write_file(folder / TRACKS, content, force=True)
    write_file(folder / ORIGIN, (json.dumps(facts, indent=2) + "\n").encode(), force=True)


if __name__ == "__main__":
    main()
