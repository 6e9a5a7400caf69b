"""The landscape of all designs, analysed exactly: no sampling, no random number."""

from softvox_gym.landscapes.analysis.graph import neighbours
from softvox_gym.landscapes.analysis.summary import Analysis, analyse
from softvox_gym.landscapes.analysis.symmetry import symmetry_classes

__all__ = ["Analysis", "analyse", "neighbours", "symmetry_classes"]
