"""Trials of robots that were never built: they are simulated in a pseudo-reality, and say so."""

from softvox_gym import reality
from softvox_gym.calibration import tracks_of
from softvox_gym.trials import Trial

#: Nine, with those that turn round in the reality "reversal".
NINE = (6453, 6013, 2117, 6489, 6481, 1385, 6330, 4690, 573)


def trials_in(world, designs, *, turn=0.0, **facts):
    """Return a trial per design, as the world moves it; `turn` is added to its y, cm per cycle."""
    made = []
    for track in tracks_of(reality(world), list(designs)):
        position = track.position * 1.5  # of voxels as wide as the kit's
        position[:, 1] += turn * track.cycle
        told = {"surface": "acrylic", "who": "softvox-gym", "license": "CC0-1.0", **facts}
        told |= {"source": "simulated", "reality": world}
        made.append(Trial(design=track.design, cycle=track.cycle, position=position, **told))
    return made
