"""Trials: a growing database of runs of robots, compared with simulations."""

from softvox_gym.trials.comparison import Comparison, compare
from softvox_gym.trials.database import read
from softvox_gym.trials.measured import from_trials
from softvox_gym.trials.transfers import Transfer, transfers
from softvox_gym.trials.trial import Trial, TrialError

__all__ = [
    "Comparison",
    "Transfer",
    "Trial",
    "TrialError",
    "compare",
    "from_trials",
    "read",
    "transfers",
]
