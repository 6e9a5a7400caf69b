"""Trials: a database of runs of robots that grows, held against what was simulated."""

from softvox_gym.trials.comparison import Comparison, compare
from softvox_gym.trials.trial import Trial, TrialError

__all__ = ["Comparison", "Trial", "TrialError", "compare"]
