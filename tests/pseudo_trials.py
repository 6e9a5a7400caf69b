"""Trials of robots that were never built: they are simulated in a pseudo-reality, and say so."""

from softvox_gym import reality
from softvox_gym.calibration import tracks_of
from softvox_gym.trials import Trial

#: Nine, with those that turn round in the reality "reversal".
NINE = (6453, 6013, 2117, 6489, 6481, 1385, 6330, 4690, 573)


def trials_in(world, designs, **facts):
    """Return a trial per design, as the world moves it."""
    made = []
    for track in tracks_of(reality(world), list(designs)):
        told = {"surface": "acrylic", "who": "softvox-gym", "license": "CC0-1.0", **facts}
        told |= {"source": "simulated", "reality": world, "voxel_cm": 1.0}
        made.append(Trial(design=track.design, cycle=track.cycle, position=track.position, **told))
    return made
