"""Crossing the reality gap: methods that may test a few designs in reality, and their regret.

A transfer method has the nominal simulator, a task and a number of tests in a reality that it does
not know; it recommends one design after every test. `transfer` runs a method and evaluates its
recommendations exactly; `check` tests whether a method follows the protocol; `proposals` lets one
choose what to build and test next.
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
