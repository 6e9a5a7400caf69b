"""The transfer methods by name, and one's own by where they are."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from softvox_gym import Task
from softvox_search.function import is_function
from softvox_search.registry import Entry, Registry, require_methods
from softvox_search.transfer.function import FunctionMethod
from softvox_search.transfer.guard import Guarded
from softvox_search.transfer.protocol import TransferMethod
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

REGISTRY = Registry("method", f"{__package__}.methods", METHODS, takes=3)

#: Arguments of a function: test, simulator, task, rng.
ARGUMENTS = 4


def make(
    method: str | Callable[..., Any],
    simulator: Simulator,
    task: Task,
    rng: np.random.Generator,
    /,
    **options: Any,
) -> Guarded:
    """Make a transfer method, which may then be driven by hand: ask, test, tell, recommend.

    Parameters
    ----------
    method : str, class or function
        One of `METHODS`, or "package.module:name" for one's own: a class, which is called as
        ``Class(simulator, task, rng, **options)``, or a function; see `FunctionMethod`. Or the
        class or the function itself.
    simulator : Simulator
    task : softvox_gym.Task
    rng : numpy.random.Generator
        Its own.
    **options
        Of the class or function; its docstring describes them.

    Returns
    -------
    Guarded
        The method, held to the order of its calls.

    Raises
    ------
    TypeError, ValueError
        For what leads to no method, an option that it doesn't take, or a value that it refuses.
    ImportError
        Where a library that the method needs is not installed.
    """
    name = name_of(method)
    if callable(method):
        kind: Any = method
    else:
        kind = REGISTRY.found(method)
        REGISTRY.check_options(method, options)
    if is_function(kind, ARGUMENTS):
        return Guarded(FunctionMethod(kind, simulator, task, rng, **options), name)
    if inspect.isclass(kind) and not hasattr(kind, "__getattr__"):
        require_methods(name, kind, kind=REGISTRY.kind)
    made: TransferMethod = kind(simulator, task, rng, **options)
    require_methods(name, made, kind=REGISTRY.kind)
    return Guarded(made, name)


def name_of(method: Any) -> str:
    """Return what to call a method: its name, or that of its class or function."""
    return method if isinstance(method, str) else getattr(method, "__name__", repr(method))
