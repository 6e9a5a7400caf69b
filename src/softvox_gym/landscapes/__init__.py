"""Landscapes of the 2x2x2 lattice: tables, exact and under noise, and their analysis."""

from softvox_gym.landscapes.noisy import noisy_landscape
from softvox_gym.landscapes.table import Table, landscape

__all__ = ["Table", "landscape", "noisy_landscape"]
