"""Experiments: how they are read from TOML files, and their runs."""

from __future__ import annotations

import difflib
import hashlib
import json
import re
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import product
from math import prod
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, TypeVar, cast

import msgspec
from msgspec import Meta, Struct, structs
from msgspec.structs import asdict

from softvox_gym import Lattice, Physics
from softvox_gym.cli.terminal import BadInputError
from softvox_gym.lattice import MOST_PHASES
from softvox_search.oracle import Budget
from softvox_search.policies import Policy

NOISE = "JakobiNoise"

#: The most runs of an experiment.
MOST_RUNS = 10**6

#: Libraries that draw random numbers or compute for searchers; a version may change the bits.
LIBRARIES = ("cmaes", "deap", "gymnasium", "nevergrad", "numpy", "optuna", "ribs", "scipy")

Count = Annotated[int, Meta(ge=1, le=2**31 - 1)]
Level = Annotated[float, Meta(ge=0)]
Name = Annotated[str, Meta(min_length=1)]
Plain = bool | int | float | str | list[Any]


T = TypeVar("T")


class UsageError(BadInputError):
    """Unusable input: one line that names it and the remedy."""


class BudgetKeys(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The table [budget], and the budget of a searcher; see `softvox_search.oracle.Budget`."""

    unique: Count | None = None
    evaluations: Count | None = None
    steps: Count | None = None
    cpu_seconds: Annotated[float, Meta(gt=0)] | None = None

    def within(self, common: BudgetKeys) -> BudgetKeys:
        """Return this with the keys that it lacks taken from the common budget."""
        own = {key: n for key, n in asdict(self).items() if n is not None}
        return structs.replace(common, **own)

    def checked(self) -> Budget:
        """Return the budget itself; ValueError if it might never end a search."""
        return Budget(**asdict(self))


class PolicyChoice(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table [[policies]]: a name, and the arguments of `softvox_search.policies.Policy`."""

    name: Name
    running_mean: bool = False
    reevaluate_parents: bool = False
    final_stage: bool = False
    finalists: Count = 10
    resamples: Count = 8

    @property
    def policy(self) -> Policy:
        """The policy itself."""
        return Policy(**{key: value for key, value in asdict(self).items() if key != "name"})


class Row(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The keys common to [[searchers]] and [[methods]]; seeds replace the experiment's.

    An option that is a list makes a row for each of its values.
    """

    name: Name
    label: Name | None = None
    options: dict[str, Plain] = {}
    seeds: Count | None = None

    @property
    def swept(self) -> dict[str, list[Any]]:
        """The options that are lists."""
        return {name: value for name, value in self.options.items() if isinstance(value, list)}

    @property
    def n_combinations(self) -> int:
        """The number of `combinations`."""
        return prod(map(len, self.swept.values()))

    def combinations(self) -> list[Self]:
        """Return a row, with a label, for every combination of values of options that are lists."""
        made = []
        for values in product(*self.swept.values()):
            options = dict(zip(self.swept, values, strict=True))
            label = (self.label or self.name) + (f"({shown(options)})" if options else "")
            made.append(structs.replace(self, label=label, options={**self.options, **options}))
        return made


class Searcher(Row, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table [[searchers]]."""

    budget: BudgetKeys = BudgetKeys()


class File(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The keys common to the files of all experiments; `softvox compare --help` explains them."""

    seeds: Count
    entropy: Annotated[int, Meta(ge=0)] = 0
    title: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return the experiment ready for JSON; `of_dict` reads it back."""
        return cast(dict[str, Any], msgspec.to_builtins(self))

    def check_rows(
        self, table: str, rows: Sequence[Row], axes: str, each: Callable[[Any], int]
    ) -> None:
        """Raise ValueError for values that a file can't have, or more runs than `MOST_RUNS`.

        Each returns how many runs a row has per combination and seed.
        """
        for row in rows:
            if [] in row.options.values():
                raise ValueError(f"[[{table}]] {row.name} options must not be empty lists")
        try:
            json.dumps(self.to_dict(), allow_nan=False)
        except (TypeError, ValueError) as error:
            raise ValueError(
                f"values must be texts, finite numbers, true or false: {error}"
            ) from None
        number = sum(row.n_combinations * (row.seeds or self.seeds) * each(row) for row in rows)
        if number > MOST_RUNS:
            raise ValueError(
                f"seeds, {axes} make {number} runs, and at most {MOST_RUNS} are taken; give fewer"
            )


class Experiment(File, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The file of a comparison of searchers."""

    budget: BudgetKeys
    physics: str | dict[str, Any] | Annotated[list[str | dict[str, Any]], Meta(min_length=1)] = (
        "published"
    )
    shape: Annotated[list[Count | list[Count]], Meta(min_length=1)] = msgspec.field(
        default_factory=lambda: [2, 2, 2]
    )
    phases: Annotated[int, Meta(ge=1, le=MOST_PHASES)] | msgspec.UnsetType = msgspec.UNSET
    table: bool = True
    levels: Annotated[list[Level], Meta(min_length=1)] | None = None
    wrappers: list[dict[str, Any]] = []
    policies: list[PolicyChoice] = []
    searchers: Annotated[list[Searcher], Meta(min_length=1)]

    libraries: ClassVar[tuple[str, ...]] = LIBRARIES

    def problems(self) -> list[Problem]:
        """Return physics x shape x level, the level changing fastest."""
        return [
            Problem(
                physics=_label(physics),
                values=_values(physics),
                shape=shape,
                level=level,
                wrappers=tuple(self.wrappers),
                table=self.table,
            )
            for physics, shape, level in product(
                self.physics_given(), self.shapes(), self.levels or (None,)
            )
        ]

    def physics_given(self) -> list[str | dict[str, Any]]:
        """Return the physics, as they are written in the file."""
        return self.physics if isinstance(self.physics, list) else [self.physics]

    def shapes(self) -> list[Lattice]:
        """Return the lattices."""
        given: list[Any] = self.shape
        phases = self.phases or 1
        shapes = given if isinstance(given[0], list) else [given]
        return [Lattice.of(one, phases=phases) for one in shapes]

    def searcher_choices(self) -> list[Searcher]:
        """Return the searchers, one for every combination of options that are lists."""
        return [
            structs.replace(
                one, seeds=one.seeds or self.seeds, budget=one.budget.within(self.budget)
            )
            for row in self.searchers
            for one in row.combinations()
        ]

    def named(self) -> list[str]:
        """Return the names in the file that may refer to the user's own code."""
        wrappers = [str(one["name"]) for one in self.wrappers]
        return [*wrappers, *(row.name for row in self.searchers)]

    def runs(self) -> list[Run]:
        """Return all runs: searcher x problem x policy x seed, the seed changing fastest."""
        problems = self.problems()
        policies: Sequence[PolicyChoice | None] = self.policies or [None]
        return [
            Run(searcher=searcher, problem=problem, policy=policy, seed=seed, entropy=self.entropy)
            for searcher in self.searcher_choices()
            for problem in problems
            for policy in policies
            for seed in range(searcher.seeds or 1)
        ]


@dataclass(frozen=True, kw_only=True)
class Problem:
    """The task of a searcher: a lattice, a physics with a label, noise and wrappers."""

    physics: str = "published"
    values: str | dict[str, Any] = "published"  #: As `Physics.of` accepts it.
    shape: Lattice = Lattice()  # noqa: RUF009, immutable
    level: float | None = None  #: Level of `JakobiNoise`; None if the experiment has no levels.
    wrappers: tuple[dict[str, Any], ...] = ()  #: Innermost first; "name", and further arguments.
    table: bool = True

    @cached_property
    def changes(self) -> dict[str, Any]:
        """The differences from the published physics, ready for JSON."""
        base, values = Physics.published().to_dict(), Physics.of(self.values).to_dict()
        return {name: value for name, value in values.items() if value != base[name]}

    def to_dict(self) -> dict[str, Any]:
        """Return what results depend on, ready for JSON.

        The physics is given by its differences only, so that a parameter added to the package later
        does not change the identity of runs.
        """
        return {
            "physics": self.changes,
            "shape": list(self.shape),
            **({"phases": self.shape.phases} if self.shape.phases > 1 else {}),
            "level": self.level,
            "wrappers": list(self.wrappers),
        }

    def stack(self) -> list[dict[str, Any]]:
        """Return the wrappers, innermost first, including the noise of the level."""
        if self.level is None:
            return list(self.wrappers)
        level = {"name": NOISE, "level": self.level}
        if not any(wrapper["name"] == NOISE for wrapper in self.wrappers):
            return [level, *self.wrappers]
        return [{**w, **level} if w["name"] == NOISE else w for w in self.wrappers]


@dataclass(frozen=True, kw_only=True)
class Run:
    """A searcher on a problem under a policy, with the index of a seed and the file's entropy."""

    searcher: Searcher
    problem: Problem = field(default_factory=Problem)
    policy: PolicyChoice | None = None
    seed: int = 0
    entropy: int = 0

    #: The columns of its result.
    summary: ClassVar[tuple[str, ...]] = (
        *("status", "unique", "evaluations", "steps", "recommended", "believed", "digest"),
    )

    @property
    def kind(self) -> str:
        """The searcher's name, without label and options."""
        return self.searcher.name

    @property
    def is_repeatable(self) -> bool:
        """Whether it gives the same bits each time: not if its budget is in CPU seconds."""
        return self.searcher.budget.cpu_seconds is None

    def names(self) -> dict[str, Any]:
        """Return the names that identify the run in reports and key its random streams."""
        return {
            "searcher": self.searcher.label,
            "physics": self.problem.physics,
            "shape": str(self.problem.shape),
            "level": self.problem.level,
            "policy": self.policy.name if self.policy else "",
            "seed": self.seed,
        }

    def to_dict(self) -> dict[str, Any]:
        """Return all of the experiment that the run's result depends on, ready for JSON."""
        budget = vars(self.searcher.budget.checked())
        return {
            "names": self.names(),
            "entropy": self.entropy,
            "searcher": {"name": self.searcher.name, "options": self.searcher.options},
            "budget": {name: value for name, value in budget.items() if value},
            "problem": self.problem.to_dict(),
            "policy": vars(self.policy.policy) if self.policy else None,
        }

    def __str__(self) -> str:
        known = {key: value for key, value in self.names().items() if value not in (None, "")}
        return ", ".join(f"{key} {value}" for key, value in known.items())


def read(path: Path) -> Any:
    """Read an experiment from a TOML file; `of_dict` describes the kinds.

    Raises
    ------
    UsageError
        If the file can't be read, or is not an experiment.
    """
    try:
        data = tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None
    except ValueError as error:  # no UTF-8, no TOML, or numbers with more digits than Python reads
        raise UsageError(f"{path}: is not valid TOML: {error}") from None
    return of_dict({"title": path.stem, **data}, str(path))


def of_dict(data: dict[str, Any], place: str) -> Any:
    """Return an experiment from what `tomllib` reads from its file, or its `to_dict` returns.

    If it has the key methods, it is a `softvox_search.experiment.transfer.TransferExperiment`;
    otherwise it is an `Experiment`.

    Raises
    ------
    UsageError
        If it is not an experiment; the message begins with the place.
    """
    kind, keys, check = _kind(data)
    try:
        experiment = msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        raise UsageError(f"{place}: {_explained(str(error), data, keys)}") from None
    try:
        check(experiment)
    except (TypeError, ValueError) as error:
        raise UsageError(f"{place}: {error}") from None
    return experiment


def _kind(data: dict[str, Any]) -> tuple[Any, Mapping[str, tuple[str, ...]], Callable[[Any], None]]:
    if "methods" in data:
        from softvox_search.experiment import transfer

        return transfer.TransferExperiment, transfer.KEYS, transfer.check_values
    return Experiment, KEYS, _check


def meant(given: str, valid: Iterable[str]) -> str:
    """Return a guess at the intended name, to append to an error, or an empty text."""
    close = difflib.get_close_matches(given, list(valid), n=1)
    return f"; did you mean {close[0]}?" if close else ""


#: The keys of every table of the file.
KEYS: dict[str, tuple[str, ...]] = {
    "": Experiment.__struct_fields__,
    "budget": BudgetKeys.__struct_fields__,
    "policies": PolicyChoice.__struct_fields__,
    "searchers": Searcher.__struct_fields__,
}


def _explained(message: str, data: dict[str, Any], all_keys: Mapping[str, tuple[str, ...]]) -> str:
    """Return msgspec's message about a file's content in the words of TOML, with the value."""
    said, _, path = message.partition(" - at `$")
    value: Any = data
    place, keys = "", all_keys[""]
    for part in re.findall(r"[^.\[\]`]+", path):
        keys = all_keys.get(part, keys)
        if part.isdecimal():
            value = value[int(part)]
            name = value.get("label", value.get("name")) if isinstance(value, dict) else None
            place += f"no. {int(part) + 1} " + (f"({name}) " if isinstance(name, str) else "")
        else:
            value = value[part]
            place += f"{part} "
    if unknown := re.search(r"unknown field `(.*)`", said):
        hint = meant({"noise": "levels"}.get(unknown[1], unknown[1]), keys)
        return f"{place}has no key {unknown[1]}{hint}; its keys are {', '.join(keys)}"
    if missing := re.search(r"missing required field `(.*)`", said):
        return f"{place}lacks the key {missing[1]}"
    words = {"Expected": "must be", ", got": ", not", "object": "table", "array": "list", "`": ""}
    for theirs, ours in words.items():
        said = said.replace(theirs, ours)
    shown = repr(value)
    return f"{place}{said}, got {shown if len(shown) < 80 else f'{shown[:60]}...'}"


def _check(experiment: Experiment) -> None:
    """Raise ValueError for faults beyond the keys' types; `environments.check` tries the rest."""
    if not all(isinstance(wrapper.get("name"), str) for wrapper in experiment.wrappers):
        raise ValueError("[[wrappers]] lacks the key name, a text")
    axes = (experiment.physics_given(), experiment.shapes(), experiment.levels, experiment.policies)
    each = prod(len(axis or (None,)) for axis in axes)
    words = "searchers, physics, shapes, levels and policies"
    experiment.check_rows("searchers", experiment.searchers, words, lambda row: each)
    choices, problems = experiment.searcher_choices(), experiment.problems()
    for choice in choices:
        choice.budget.checked()
    for problem in problems:
        try:
            Physics.of(problem.values)
        except (TypeError, ValueError) as error:
            raise ValueError(f"physics {problem.physics}: {error}") from None
    check_different("[[searchers]]", "label", [str(choice.label) for choice in choices])
    check_different("[[policies]]", "name", [one.name for one in experiment.policies])
    # Reports tell levels apart by six figures, and -0.0 from 0 not at all.
    figures = [f"{abs(level):g}" for level in experiment.levels or ()]
    check_different("levels", "value, different in six figures", figures)
    check_different("shape", "value", [str(shape) for shape in experiment.shapes()])
    check_different("physics", "label", [_label(one) for one in experiment.physics_given()])
    if experiment.levels and any(
        wrapper["name"] == NOISE and "level" in wrapper for wrapper in experiment.wrappers
    ):
        raise ValueError(f"[[wrappers]] {NOISE} has its own level beside levels; drop one of them")


def tried(place: str, what: Callable[[], T]) -> T:
    """Return what a call returns; any error of the user's own code becomes one line."""
    try:
        return what()
    except (ImportError, TypeError, ValueError) as error:
        raise UsageError(f"{place}: {error}") from error
    except (Exception, SystemExit) as error:
        raise UsageError(f"{place}: fails with {type(error).__name__}: {error}") from error


def check_different(kind: str, key: str, names: list[str]) -> None:
    """Raise ValueError for a name that appears twice."""
    name, times = max(Counter(names).items(), key=lambda item: item[1], default=("", 0))
    if times > 1:
        raise ValueError(f"{kind} {name} is there twice; give one of them another {key}")


def _label(physics: str | dict[str, Any]) -> str:
    if isinstance(physics, str):
        return physics
    return str(physics.get("label") or shown(physics) or "exact")


def _values(physics: str | dict[str, Any]) -> str | dict[str, Any]:
    if isinstance(physics, str):
        return physics
    return {key: value for key, value in physics.items() if key != "label"}


def shown(values: dict[str, Any]) -> str:
    """Return named values as a label shows them."""
    texts = {key: v if isinstance(v, str) else json.dumps(v) for key, v in values.items()}
    return ", ".join(f"{key}={text}" for key, text in texts.items())


def sha256(value: dict[str, Any]) -> bytes:
    """Return the SHA-256 of a value's canonical JSON."""
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).digest()
