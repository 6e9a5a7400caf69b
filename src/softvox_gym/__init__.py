"""Every soft robot of a 2x2x2 lattice, simulated bit for bit: a benchmark with a known optimum."""

from softvox_gym.design import Design
from softvox_gym.physics import Physics
from softvox_gym.simulation import Frames, Result, simulate

__all__ = ["Design", "Frames", "Physics", "Result", "simulate"]

__version__ = "0.1.0"
