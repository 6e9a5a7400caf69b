"""Crossing the reality gap: methods that may try a few designs in reality, and what they lose.

A method has the nominal simulator, a task and so many tests in a reality that it does not know; it
names one design after every test. `transfer` lets one try and says what its recommendations are
worth there, exactly; `check` puts a method through what the suite relies on; `proposals` asks one
what to build and test next.
"""

from softvox_search.transfer.conformance import check
from softvox_search.transfer.next import Proposal, proposals
from softvox_search.transfer.protocol import Method, Test, TransferMethod
from softvox_search.transfer.registry import METHODS, make
from softvox_search.transfer.run import TransferRun, transfer
from softvox_search.transfer.simulator import SimulationBudgetError, Simulator

__all__ = [
    "METHODS",
    "Method",
    "Proposal",
    "SimulationBudgetError",
    "Simulator",
    "Test",
    "TransferMethod",
    "TransferRun",
    "check",
    "make",
    "proposals",
    "transfer",
]
