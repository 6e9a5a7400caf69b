"""The registry: this package's transfer methods by name, and your own by import path."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from softvox_gym import Task
from softvox_search.registry import Entry, Registry
from softvox_search.transfer.function import FunctionMethod
from softvox_search.transfer.guard import Guarded
from softvox_search.transfer.simulator import Simulator

METHODS: Mapping[str, Entry] = {
    "random": Entry("simple:Random"),
    "simulator_top": Entry("simple:SimulatorTop"),
    "gp_ucb": Entry("gaussian:GpUcb"),
    "ite": Entry("gaussian:Ite"),
    "transferability": Entry("transferability:Transferability"),
    "eea": Entry("ensemble:Eea"),
    "domain_randomisation": Entry("simple:DomainRandomisation"),
    "jakobi": Entry("simple:Jakobi"),
    "simopt": Entry("identification:SimOpt"),
    "npe": Entry("posterior:Npe"),
    "mfbo": Entry("multi_fidelity:Mfbo"),
    "oracle": Entry("simple:Oracle"),
}

REGISTRY = Registry(
    kind="method",
    package=f"{__package__}.methods",
    entries=METHODS,
    takes=3,
    protocol="softvox_search.transfer.TransferMethod",
    base="softvox_search.transfer.Method",
)


def make(
    method: str | Callable[..., Any],
    simulator: Simulator,
    task: Task,
    rng: np.random.Generator,
    /,
    **options: Any,
) -> Guarded:
    """Make a transfer method, which you can drive yourself: ask, test, tell, recommend.

    Parameters
    ----------
    method : str, class or function
        One of `METHODS`, or "package.module:name" for your own: a class, which is called as
        ``Class(simulator, task, rng, **options)``, or a function; see `FunctionMethod`. Or the
        class or the function itself.
    simulator : Simulator
    task : softvox_gym.Task
    rng : numpy.random.Generator
        Its own.
    **options
        Options of the class or function; its docstring describes them.

    Returns
    -------
    Guarded
        The method, with its order of calls enforced.

    Raises
    ------
    TypeError, ValueError
        If it leads to no method, or an option is unknown or has a value that the method rejects.
    ImportError
        If a library that the method needs is not installed.
    """
    name, what = name_of(method), method
    if not callable(method):
        what = REGISTRY.found(method)
        REGISTRY.check_options(method, options)
    return Guarded(REGISTRY.made(name, what, FunctionMethod, simulator, task, rng, **options), name)


def name_of(method: Any) -> str:
    """Return the name of a method, or of its class or function."""
    return method if isinstance(method, str) else getattr(method, "__name__", repr(method))
