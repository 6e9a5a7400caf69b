"""The searchers by name, and one's own by where they are."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from difflib import get_close_matches
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np

from softvox_gym import Lattice
from softvox_search.function import FunctionSearcher, is_function
from softvox_search.protocol import Searcher


class Entry(NamedTuple):
    """A searcher of this package."""

    #: "module:Class" within `softvox_search.searchers`, imported when it is made.
    place: str
    #: One sentence, where it is not the first of the class's docstring.
    about: str = ""
    #: Options that the name stands for; they can't be given with it.
    fixed: Mapping[str, Any] = {}


_RANDOM = "random_search:RandomSearch"

SEARCHERS: Mapping[str, Entry] = {
    "exhaustive": Entry("exhaustive:Exhaustive"),
    "exhaustive_shuffled": Entry(
        _RANDOM,
        "Asks for every design once, in random order, as random does.",
        {"replacement": False},
    ),
    "random": Entry(
        _RANDOM,
        "Random search without replacement: draws uniformly of the designs not drawn yet.",
        {"replacement": False},
    ),
    "random_with_replacement": Entry(
        _RANDOM,
        "Random search with replacement: draws uniformly of all designs.",
        {"replacement": True},
    ),
    "hill_climber": Entry("hill_climber:HillClimber"),
    "ga": Entry("genetic:GeneticAlgorithm"),
    "mu_plus_lambda": Entry("mu_plus_lambda:MuPlusLambda"),
    "afpo": Entry("afpo:Afpo"),
    "nsga2": Entry("nsga2:Nsga2"),
    "map_elites": Entry("map_elites:MapElites"),
    "tpe": Entry("tpe:Tpe"),
    "nevergrad": Entry("nevergrad_search:Nevergrad"),
    "catcma": Entry("catcma:CatCma"),
}

NAMES = (
    f"the searchers are: {', '.join(SEARCHERS)}; one's own class or function is given as "
    "'package.module:name'"
)


def make(
    name: str, rng: np.random.Generator, *, space: Lattice | None = None, **options: Any
) -> Searcher:
    """Make a searcher.

    Parameters
    ----------
    name : str
        One of `SEARCHERS`, or "package.module:name" for one's own: a class, which is called as
        ``Class(space, rng, **options)``, or a function ``f(evaluate, space, rng, **options)``; see
        `softvox_search.FunctionSearcher`.
    rng : numpy.random.Generator
        The run's own.
    space : Lattice, optional
        Whose designs it searches; 2x2x2 where None.
    **options
        Of the class or function; its docstring describes them.

    Raises
    ------
    TypeError, ValueError
        For a name that leads to no searcher, an option that it doesn't take, or a value that it
        refuses.
    ImportError
        Where a library that the searcher needs is not installed.
    """
    kind, space = found(name), space or Lattice()
    if inspect.isclass(kind) and not hasattr(kind, "__getattr__"):
        require_methods(name, kind)
    takes = options_of(name)
    for option in options:
        if takes is not None and option not in takes:
            known = ", ".join(takes) or "none"
            raise ValueError(f"searcher {name} has no option {option!r}; its options are: {known}")
    if is_function(kind):
        return FunctionSearcher(kind, space, rng, **options)
    fixed = SEARCHERS[name].fixed if name in SEARCHERS else {}
    searcher: Searcher = kind(space, rng, **fixed, **options)
    require_methods(name, searcher)
    return searcher


def found(name: str) -> Any:
    """Return the class or function of a name, as `make` takes it.

    Raises
    ------
    TypeError, ValueError
        For a name that leads to none.
    ImportError
        Where a library that its module needs is not installed.
    """
    if not isinstance(name, str):
        raise TypeError(f"searcher must be a name, got {name!r}; {NAMES}")
    if name in SEARCHERS:
        name = f"{__package__}.searchers.{SEARCHERS[name].place}"
    elif ":" not in name:
        near = get_close_matches(name, SEARCHERS, n=1)
        hint = f"; did you mean {near[0]!r}?" if near else ";"
        raise ValueError(f"there is no searcher {name!r}{hint} {NAMES}")
    module, _, attribute = name.partition(":")
    try:
        kind = getattr(import_module(module), attribute, None)
    except ModuleNotFoundError as error:
        if not error.name or not f"{module}.".startswith(f"{error.name}."):
            raise
        raise ValueError(
            f"there is no module {error.name!r}; is its folder on PYTHONPATH?"
        ) from None
    except (TypeError, ValueError):
        raise ValueError(f"searcher {name!r} must be 'package.module:name'; {NAMES}") from None
    if not callable(kind):
        raise ValueError(f"module {module} has no class or function {attribute!r}")
    return kind


def options_of(name: str) -> dict[str, Any] | None:
    """Return the options that a searcher takes, with their defaults; None where it takes any.

    Without those that the name stands for; `inspect.Parameter.empty` for a default that is none.

    Raises
    ------
    TypeError, ValueError, ImportError
        As `found` does.
    """
    kind = found(name)
    parameters = list(inspect.signature(kind).parameters.values())
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters):
        return None
    return {
        parameter.name: parameter.default
        for parameter in parameters[3 if is_function(kind) else 2 :]
        if parameter.kind in (parameter.KEYWORD_ONLY, parameter.POSITIONAL_OR_KEYWORD)
        and not (name in SEARCHERS and parameter.name in SEARCHERS[name].fixed)
    }


def require_methods(name: str, searcher: Any) -> None:
    """Raise TypeError for a class, or what was made of it, without the methods of `Searcher`."""
    methods = ("ask", "tell", "recommend")
    lacks = [method for method in methods if not callable(getattr(searcher, method, None))]
    if lacks:
        raise TypeError(
            f"searcher {name} lacks {', '.join(lacks)}; see softvox_search.Searcher, or derive the "
            "class from softvox_search.SearcherBase, which lacks only ask"
        )
