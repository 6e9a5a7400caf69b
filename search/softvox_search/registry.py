"""The registry: this package's searchers by name, and your own by import path."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Mapping
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
    #: A sentence, if it is not the first of the class's docstring.
    about: str = ""
    #: Options that the name implies; they can't be given with it.
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
    "cppn": Entry("cppn:Cppn"),
    "nsga2": Entry("nsga2:Nsga2"),
    "map_elites": Entry("map_elites:MapElites"),
    "tpe": Entry("tpe:Tpe"),
    "nevergrad": Entry("nevergrad_search:Nevergrad"),
    "catcma": Entry("catcma:CatCma"),
}


class Registry(NamedTuple):
    """The package's classes by name, and your own by import path."""

    kind: str  #: "searcher"
    package: str  #: The package of the places.
    entries: Mapping[str, Entry]
    takes: int  #: Number of arguments to make a class with.
    protocol: str  #: The protocol that it must follow.
    base: str  #: A class that lacks only ask.

    @property
    def names(self) -> str:
        """The known names, in words."""
        return (
            f"the {self.kind}s are: {', '.join(self.entries)}; one's own class or function is "
            "given as 'package.module:name'"
        )

    def found(self, name: str) -> Any:
        """Return the class or function for a name.

        Raises
        ------
        TypeError, ValueError
            If the name leads to none.
        ImportError
            If a library that its module needs is not installed.
        """
        if not isinstance(name, str):
            raise TypeError(f"{self.kind} must be a name, got {name!r}; {self.names}")
        if is_ours := name in self.entries:
            name = f"{self.package}.{self.entries[name].place}"
        elif ":" not in name:
            near = get_close_matches(name, self.entries, n=1)
            hint = f"; did you mean {near[0]!r}?" if near else ";"
            raise ValueError(f"there is no {self.kind} {name!r}{hint} {self.names}")
        module, _, attribute = name.partition(":")
        try:
            kind = getattr(import_module(module), attribute, None)
        except ModuleNotFoundError as error:
            if is_ours or not error.name or not f"{module}.".startswith(f"{error.name}."):
                raise
            raise ValueError(
                f"there is no module {error.name!r}; is its folder on PYTHONPATH?"
            ) from None
        except (TypeError, ValueError):
            raise ValueError(
                f"{self.kind} {name!r} must be 'package.module:name'; {self.names}"
            ) from None
        if not callable(kind):
            raise ValueError(f"module {module} has no class or function {attribute!r}")
        return kind

    def options_of(self, name: str) -> dict[str, Any] | None:
        """Return its options with their defaults; None if it takes any.

        Without the options that the name implies; `inspect.Parameter.empty` if an option has no
        default.

        Raises
        ------
        TypeError, ValueError, ImportError
            As `found` does.
        """
        fixed = self.entries[name].fixed if name in self.entries else {}
        return _options(self.found(name), self.takes, fixed)

    def check_options(self, name: str, options: Iterable[str]) -> None:
        """Raise ValueError if it doesn't take an option."""
        takes = self.options_of(name)
        for option in options:
            if takes is not None and option not in takes:
                known = ", ".join(takes) or "none"
                raise ValueError(
                    f"{self.kind} {name} has no option {option!r}; its options are: {known}"
                )

    def made(
        self, name: str, what: Any, of_function: Callable[..., Any], /, *given: Any, **options: Any
    ) -> Any:
        """Return what a class of a name, or another callable, makes; or a function, as that.

        Raises
        ------
        TypeError, ValueError
            For a class that lacks a method, or what it refuses.
        """
        if is_function(what, self.takes + 1):
            return of_function(what, *given, **options)
        # Attributes that a class provides by __getattr__ are visible only on an instance.
        if inspect.isclass(what) and not hasattr(what, "__getattr__"):
            self.require_methods(name, what)
        fixed = self.entries[name].fixed if name in self.entries else {}
        made = what(*given, **fixed, **options)
        self.require_methods(name, made)
        return made

    def require_methods(self, name: str, made: Any) -> None:
        """Raise TypeError for a class, or what was made of it, that lacks one of the methods."""
        methods = ("ask", "tell", "recommend")
        lacks = [what for what in methods if not callable(getattr(made, what, None))]
        if lacks:
            raise TypeError(
                f"{self.kind} {name} lacks {', '.join(lacks)}; see {self.protocol}, or derive the "
                f"class from {self.base}, which lacks only ask"
            )


REGISTRY = Registry(
    kind="searcher",
    package=f"{__package__}.searchers",
    entries=SEARCHERS,
    takes=2,
    protocol="softvox_search.Searcher",
    base="softvox_search.SearcherBase",
)

found, options_of = REGISTRY.found, REGISTRY.options_of


def make(
    name: str, rng: np.random.Generator, *, space: Lattice | None = None, **options: Any
) -> Searcher:
    """Make a searcher.

    Parameters
    ----------
    name : str
        One of `SEARCHERS`, or "package.module:name" for your own: a class, which is called as
        ``Class(space, rng, **options)``, or a function ``f(evaluate, space, rng, **options)``; see
        `softvox_search.FunctionSearcher`.
    rng : numpy.random.Generator
        The generator of the run.
    space : Lattice, optional
        The lattice whose designs it searches; by default 2x2x2.
    **options
        Options of the class or function; its docstring describes them.

    Raises
    ------
    TypeError, ValueError
        If the name leads to no searcher, or an option is unknown or has a value that the searcher
        rejects.
    ImportError
        If a library that the searcher needs is not installed.
    """
    kind = found(name)
    REGISTRY.check_options(name, options)
    made: Searcher = REGISTRY.made(name, kind, FunctionSearcher, space or Lattice(), rng, **options)
    return made


def _options(kind: Any, takes: int, fixed: Mapping[str, Any]) -> dict[str, Any] | None:
    try:
        parameters = list(inspect.signature(kind).parameters.values())
    except ValueError:  # a type of an extension module may have no signature
        return None
    if any(parameter.kind is parameter.VAR_KEYWORD for parameter in parameters):
        return None
    return {
        parameter.name: parameter.default
        for parameter in parameters[takes + 1 if is_function(kind, takes + 1) else takes :]
        if parameter.kind in (parameter.KEYWORD_ONLY, parameter.POSITIONAL_OR_KEYWORD)
        and parameter.name not in fixed
    }
