"""The searchers by name, and one's own by where they are."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from difflib import get_close_matches
from importlib import import_module
from typing import Any

import numpy as np

from softvox_search.protocol import Searcher, SearcherBase

_HERE = "softvox_search.searchers"

#: Where the class of each name is: "module:Class", imported when it is made.
SEARCHERS: Mapping[str, str] = {
    "exhaustive": f"{_HERE}.exhaustive:Exhaustive",
    "exhaustive_shuffled": f"{_HERE}.exhaustive:Exhaustive",
    "random": f"{_HERE}.random_search:RandomSearch",
    "random_with_replacement": f"{_HERE}.random_search:RandomSearch",
    "hill_climber": f"{_HERE}.hill_climber:HillClimber",
    "ga": f"{_HERE}.genetic:GeneticAlgorithm",
    "mu_plus_lambda": f"{_HERE}.mu_plus_lambda:MuPlusLambda",
    "afpo": f"{_HERE}.afpo:Afpo",
    "nsga2": f"{_HERE}.nsga2:Nsga2",
    "map_elites": f"{_HERE}.map_elites:MapElites",
    "tpe": f"{_HERE}.tpe:Tpe",
    "nevergrad": f"{_HERE}.nevergrad_search:Nevergrad",
    "catcma": f"{_HERE}.catcma:CatCma",
}

#: Options that a name stands for; they can't be given with it.
FIXED: Mapping[str, Mapping[str, Any]] = {
    "exhaustive": {"shuffled": False},
    "exhaustive_shuffled": {"shuffled": True},
    "random": {"replacement": False},
    "random_with_replacement": {"replacement": True},
}

#: What a name does, where several stand for one class and its docstring can't say.
ABOUT: Mapping[str, str] = {
    "exhaustive": "Asks for every design once, by number, and then for nothing more.",
    "exhaustive_shuffled": "Asks for every design once, in random order, and then for nothing "
    "more.",
    "random": "Asks for designs drawn uniformly of those not known yet: random search without "
    "replacement.",
    "random_with_replacement": "Asks for designs drawn uniformly of all, known ones as well: "
    "random search with replacement.",
}

#: Of `Searcher`.
METHODS = ("ask", "tell", "recommend", "state_dict", "load_state_dict")


def make(name: str, rng: np.random.Generator, **options: Any) -> Searcher:
    """Make a searcher.

    Parameters
    ----------
    name : str
        One of `SEARCHERS`, or "package.module:Class" for one's own class, which is called as
        ``Class(rng, **options)``.
    rng : numpy.random.Generator
        The run's own.
    **options
        Of the class; its docstring describes them.

    Raises
    ------
    TypeError, ValueError
        For a name that leads to no searcher, an option that the class doesn't take, or a value that
        it refuses.
    ImportError
        Where a library that the searcher needs is not installed.
    """
    kind = class_of(name)
    if inspect.isclass(kind) and not hasattr(kind, "__getattr__"):
        _require_methods(name, kind)
    takes = options_of(name)
    fixed = FIXED.get(name, {})
    for option in options:
        if takes is not None and option not in takes:
            raise ValueError(
                f"searcher {name} has no option {option!r}; its options are: "
                f"{', '.join(takes) or 'none'}"
            )
    searcher: Searcher = kind(rng, **fixed, **options)
    _require_methods(name, searcher)
    return searcher


def _require_methods(name: str, searcher: Any) -> None:
    """Refuse a class, or what was made of it, without the five methods."""
    lacks = [method for method in METHODS if not _has(searcher, method)]
    if lacks == ["ask"]:
        raise TypeError(f"searcher {name} lacks ask; see softvox_search.protocol.Searcher")
    if lacks:
        raise TypeError(
            f"searcher {name} lacks {', '.join(lacks)}; see softvox_search.protocol.Searcher, or "
            "derive the class from softvox_search.protocol.SearcherBase"
        )


def _has(searcher: Any, method: str) -> bool:
    """Return whether there is a method; the base's `ask` is only a place for one."""
    found = getattr(searcher, method, None)
    return callable(found) and getattr(found, "__func__", found) is not SearcherBase.ask


def class_of(name: str) -> Any:
    """Return the class of a name, as `make` takes it.

    Raises
    ------
    TypeError, ValueError
        For a name that leads to no class.
    ImportError
        Where a library that the class's module needs is not installed.
    """
    if not isinstance(name, str):
        raise TypeError(f"searcher must be a name, got {name!r}; {_names()}")
    if name not in SEARCHERS and ":" not in name:
        near = get_close_matches(name, SEARCHERS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ";"
        raise ValueError(f"there is no searcher {name!r}{hint} {_names()}")
    module, _, attribute = SEARCHERS.get(name, name).partition(":")
    found = getattr(_module(module, name), attribute, None)
    if not callable(found):
        raise ValueError(f"module {module} has no class {attribute!r}")
    return found


def options_of(name: str) -> dict[str, Any] | None:
    """Return the options that a searcher takes, with their defaults.

    Returns
    -------
    dict or None
        Without those that the name stands for; `inspect.Parameter.empty` for a default that is
        none. None where the class takes any option.

    Raises
    ------
    TypeError, ValueError, ImportError
        As `class_of` does.
    """
    parameters = list(inspect.signature(class_of(name)).parameters.values())[1:]
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters):
        return None
    return {
        parameter.name: parameter.default
        for parameter in parameters
        if parameter.kind in (parameter.KEYWORD_ONLY, parameter.POSITIONAL_OR_KEYWORD)
        and parameter.name not in FIXED.get(name, {})
    }


def _module(module: str, name: str) -> Any:
    """Import a module; ValueError where there is none of that name."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if not error.name or not f"{module}.".startswith(f"{error.name}."):
            raise
        raise ValueError(
            f"there is no module {error.name!r}; is its folder on PYTHONPATH?"
        ) from None
    except (TypeError, ValueError):
        raise ValueError(f"searcher {name!r} must be 'package.module:Class'; {_names()}") from None


def _names() -> str:
    return (
        f"the searchers are: {', '.join(SEARCHERS)}; one's own is given as 'package.module:Class'"
    )
