"""Every soft robot of a 2x2x2 lattice, simulated bit for bit: a benchmark with a known optimum."""

from gymnasium.envs.registration import register, registry

from softvox_gym.design import Design
from softvox_gym.landscapes.noisy import noisy_landscape
from softvox_gym.landscapes.table import landscape
from softvox_gym.physics import Physics
from softvox_gym.simulation import Frames, Result, simulate

__all__ = ["Design", "Frames", "Physics", "Result", "landscape", "noisy_landscape", "simulate"]

__version__ = "0.1.0"

ENV_ID = "SoftVox2x2x2-v0"
TABLE_ENV_ID = "SoftVoxTable2x2x2-v0"

for _id, _kind in ((ENV_ID, "SoftVox"), (TABLE_ENV_ID, "SoftVoxTable")):
    if _id not in registry:  # the module may be imported anew
        register(
            _id,
            entry_point=f"softvox_gym.envs.single:{_kind}Env",
            vector_entry_point=f"softvox_gym.envs.vector:{_kind}VectorEnv",
        )
