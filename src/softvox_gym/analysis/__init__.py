"""The landscape of all designs, analysed exactly: no sampling, no random number."""

from softvox_gym.analysis.graph import neighbours
from softvox_gym.analysis.summary import Analysis, analyse
from softvox_gym.analysis.symmetry import symmetry_classes

__all__ = ["Analysis", "analyse", "neighbours", "symmetry_classes"]
