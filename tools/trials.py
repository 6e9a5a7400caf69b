"""Recompute the simulated trials that ship with the package, src/softvox_gym/data/trials.

Run by `make trials`, after a change of the engine's bits, of a reality or of the format; takes some
seconds. Measured trials there are not changed.
"""

from softvox_gym import Reality, realities
from softvox_gym.calibration import tracks_of
from softvox_gym.trials import Trial
from softvox_gym.trials.database import add, shipped

#: The three e-types and three f-types of the paper's text, and three more: docs/calibrate.md.
DESIGNS = (6453, 6013, 2117, 6489, 6481, 1385, 6330, 4690, 573)

#: Every tenth point of `tracks_of` is kept: five per cycle.
EVERY = 10

WHO = "softvox-gym"

PUBLISHED = Reality("published", about="the simulator of the paper, as published")


def main() -> None:
    """Write the trials of all realities, and delete the earlier ones."""
    made = [trial for one in (PUBLISHED, *realities().values()) for trial in trials_of(one)]
    for path in shipped().glob("*.json"):
        if {f'"who": "{WHO}",', '"source": "simulated",'} <= {*path.read_text("utf-8").split("\n")}:
            path.unlink()
    add(shipped(), made)


def trials_of(reality: Reality, designs: tuple[int, ...] = DESIGNS) -> list[Trial]:
    """Return the tracks of designs in a reality, as trials."""
    physics = reality.physics
    return [
        Trial(
            design=track.design,
            cycle=track.cycle[::EVERY],
            position=track.position[::EVERY],
            surface=reality.about,
            who=WHO,
            license="CC0-1.0",
            source="simulated",
            reality=reality.name,
            frequency_hz=float(physics.frequency_hz),
            voxel_cm=round(100 * float(physics.edge), 9),
        )
        for track in tracks_of(reality, designs)
    ]


if __name__ == "__main__":
    main()
