"""Trials: a database of runs of robots that grows, held against what was simulated."""

from softvox_gym.trials.transfers import Transfer, transfers
from softvox_gym.trials.trial import Trial, TrialError

__all__ = ["Transfer", "Trial", "TrialError", "transfers"]
