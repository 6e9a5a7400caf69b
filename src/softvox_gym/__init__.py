"""Every soft robot of a 2x2x2 lattice, simulated bit for bit: a benchmark with a known optimum.

Importing the package registers its Gymnasium environments. Without Gymnasium, `evaluate` returns
the fitness of designs, and `simulate` every detail of their walks.
"""

from typing import Any

from gymnasium.envs.registration import register, registry

from softvox_gym.calibration import Calibration, calibrate
from softvox_gym.design import Design
from softvox_gym.evaluation import Evaluation, evaluate
from softvox_gym.landscapes.noisy import noisy_landscape
from softvox_gym.landscapes.table import landscape
from softvox_gym.lattice import Lattice
from softvox_gym.paused import Simulation, State
from softvox_gym.physics import Physics
from softvox_gym.realities import Reality, realities, reality
from softvox_gym.simulation import Frames, Result, simulate
from softvox_gym.step import step_error
from softvox_gym.tasks import Task
from softvox_gym.trials.measured import MeasuredReality

__all__ = [
    "Calibration",
    "Design",
    "Evaluation",
    "Frames",
    "Lattice",
    "MeasuredReality",
    "Physics",
    "Reality",
    "Result",
    "Simulation",
    "State",
    "Task",
    "calibrate",
    "evaluate",
    "landscape",
    "noisy_landscape",
    "realities",
    "reality",
    "simulate",
    "step_error",
]

__version__ = "0.1.0"

ENV_ID = "SoftVox2x2x2-v0"
TABLE_ENV_ID = "SoftVoxTable2x2x2-v0"


def _register(
    name: str,
    single: str = "single:SoftVoxEnv",
    vector: str = "vector:SoftVoxVectorEnv",
    **options: Any,
) -> None:
    if name not in registry:  # the module may be imported again
        register(
            name,
            entry_point=f"softvox_gym.envs.{single}",
            vector_entry_point=f"softvox_gym.envs.{vector}",
            kwargs=options,
        )


_register("SoftVox-v0")
_register(ENV_ID, shape=[2, 2, 2])  # lists, as a spec has them that is read from JSON
_register("SoftVox3x3x3-v0", shape=[3, 3, 3])
_register("SoftVox4x4x4-v0", shape=[4, 4, 4])
_register("SoftVoxPhased2x2x2-v0", shape=[2, 2, 2], phases=4)
_register(TABLE_ENV_ID, from_table=True)
_register("SoftVoxControl-v0", "control:SoftVoxControlEnv", "control:SoftVoxControlVectorEnv")

_GROWTH = ("growth:SoftVoxGrowEnv", "growth:SoftVoxGrowVectorEnv")
_register("SoftVoxGrow-v0", *_GROWTH)
_register("SoftVoxGrow2x2x2-v0", *_GROWTH, shape=[2, 2, 2])
_register("SoftVoxGrow3x3x3-v0", *_GROWTH, shape=[3, 3, 3])
_register("SoftVoxGrow4x4x4-v0", *_GROWTH, shape=[4, 4, 4])
