"""Every soft robot of a 2x2x2 lattice, simulated bit for bit: a benchmark with a known optimum."""

from gymnasium.envs.registration import register, registry

from softvox_gym.design import Design
from softvox_gym.physics import Physics
from softvox_gym.simulation import Frames, Result, simulate

__all__ = ["Design", "Frames", "Physics", "Result", "simulate"]

__version__ = "0.1.0"

ENV_ID = "SoftVox2x2x2-v0"

if ENV_ID not in registry:  # the module may be imported anew
    register(
        ENV_ID,
        entry_point="softvox_gym.env:SoftVoxEnv",
        vector_entry_point="softvox_gym.vector_env:SoftVoxVectorEnv",
    )
