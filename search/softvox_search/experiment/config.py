"""What an experiment is, and how it is read from its file."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import MISSING, asdict, dataclass, field, fields
from pathlib import Path
from typing import Any, NamedTuple

from softvox_gym import ENV_ID, Physics
from softvox_search.experiment.toml_table import REQUIRED, ConfigError, Table, load, meant
from softvox_search.oracle import Budget
from softvox_search.policies import Policy
from softvox_search.registry import SEARCHERS

NOISE = "JakobiNoise"

#: Wrappers that an experiment may name; another is named as "package.module:Class".
WRAPPERS = ("FitnessNoise", NOISE, "Resample")

#: Runs of an experiment.
MOST_RUNS = 10**6

#: Seeds of numpy's own making have 128 bits.
MOST_ENTROPY = 2**128 - 1

_BUDGETS = tuple(f.name for f in fields(Budget))


@dataclass(frozen=True, kw_only=True)
class WrapperChoice:
    """A wrapper around the environment, and its arguments."""

    name: str
    options: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class PolicyChoice:
    """A policy against luck, under the name by which reports call it."""

    name: str
    policy: Policy


@dataclass(frozen=True, kw_only=True)
class SearcherChoice:
    """A searcher of the comparison.

    Parameters
    ----------
    name : str
        In the registry, or "package.module:Class".
    label : str
        What reports call it.
    options : dict
        What it is made with.
    seeds : int
        Runs per cell.
    budget : Budget
        Of each run.
    reason : str
        Why seeds or budget are not those of the others; "" where they are.
    """

    name: str
    label: str
    options: dict[str, Any] = field(default_factory=dict)
    seeds: int
    budget: Budget
    reason: str = ""


class Cell(NamedTuple):
    """A searcher at a level of noise with a policy; None where the experiment has no such axis."""

    number: int
    searcher: SearcherChoice
    level: float | None
    policy: PolicyChoice | None


class Run(NamedTuple):
    """A cell and the index of a seed."""

    number: int
    cell: Cell
    seed: int


@dataclass(frozen=True, kw_only=True)
class Experiment:
    """Everything that the results depend on; `read` explains the file.

    Parameters
    ----------
    name : str
        Of the file, without its ending.
    entropy : int
        All random streams derive from it.
    seeds : int
        Runs per cell, where a searcher doesn't say otherwise.
    budget : Budget
        Of each run, likewise.
    env_id : str
    physics : str or dict
        As the environment takes it.
    table : bool
        Whether the exact table answers where nothing disturbs the simulation.
    levels : tuple of float, optional
        Of `JakobiNoise`.
    wrappers : tuple of WrapperChoice
        From the environment outward.
    policies : tuple of PolicyChoice
    searchers : tuple of SearcherChoice
    """

    name: str
    entropy: int
    seeds: int
    budget: Budget
    env_id: str = ENV_ID
    physics: str | dict[str, Any] = "published"
    table: bool = True
    levels: tuple[float, ...] | None = None
    wrappers: tuple[WrapperChoice, ...] = ()
    policies: tuple[PolicyChoice, ...] = ()
    searchers: tuple[SearcherChoice, ...]

    def cells(self) -> Iterator[Cell]:
        """Yield searcher x level x policy, the policy changing fastest."""
        number = 0
        for searcher in self.searchers:
            for level in self.levels or (None,):
                for policy in self.policies or (None,):
                    yield Cell(number, searcher, level, policy)
                    number += 1

    def runs(self) -> list[Run]:
        """Return all runs, cell by cell."""
        pairs = [(cell, seed) for cell in self.cells() for seed in range(cell.searcher.seeds)]
        return [Run(number, cell, seed) for number, (cell, seed) in enumerate(pairs)]

    @property
    def is_published(self) -> bool:
        """Whether the physics is that of the published run, of which the optimum is known."""
        return Physics.of(self.physics) == Physics.published()

    def to_dict(self) -> dict[str, Any]:
        """Return it ready for JSON; what the results don't depend on is left out."""
        data = asdict(self)
        del data["name"]
        return data


def read(path: Path) -> Experiment:
    """Read an experiment from a TOML file.

    `softvox_search.experiment.keys` has the table of its keys and an example, which ``softvox
    compare --help`` shows.

    Raises
    ------
    ConfigError
        For a file that can't be read, an unknown key, one that is missing or a wrong value.
    """
    top = load(path)
    seeds = top.whole("seeds")
    entropy = top.whole("entropy", 0, least=0, most=MOST_ENTROPY)
    budget = _budget_keys(top.table("budget"))
    env = top.table("env", {})
    physics, table = _physics(env), env.flag("table", True)
    env_id = env.text("id", ENV_ID, choices=(ENV_ID,))
    env.close()
    experiment = Experiment(
        name=path.stem,
        entropy=entropy,
        seeds=seeds,
        budget=_budget(top, budget),
        env_id=env_id,
        physics=physics,
        table=table,
        levels=top.levels("levels"),
        wrappers=tuple(map(_wrapper, top.tables("wrappers", []))),
        policies=_named(top, "policies", map(_policy, top.tables("policies", []))),
        searchers=_named(
            top, "searchers", (_searcher(row, seeds, budget) for row in top.tables("searchers"))
        ),
    )
    top.close()
    if not experiment.searchers:
        raise top.error("searchers must be one table [[searchers]] or more, got none")
    _check_levels(top, experiment)
    _check_number(top, experiment)
    return experiment


def _physics(env: Table) -> str | dict[str, Any]:
    physics = env.take("physics", "published")
    if not isinstance(physics, (str, dict)):
        raise env.error(f"physics must be a preset's name or a table, got {physics!r}")
    try:
        Physics.of(physics)
    except (TypeError, ValueError) as error:
        raise env.error(f"physics: {error}") from None
    return physics


def _budget_keys(table: Table) -> dict[str, int]:
    given = {name: table.whole(name, None) for name in _BUDGETS}
    table.close()
    return {name: value for name, value in given.items() if value is not None}


def _budget(table: Table, keys: dict[str, int]) -> Budget:
    try:
        return Budget(**keys)
    except ValueError as error:
        raise table.error(str(error)) from None


def _wrapper(row: Table) -> WrapperChoice:
    name = row.text("name")
    if ":" not in name and name not in WRAPPERS:
        raise row.error(
            f"name must be one of {', '.join(WRAPPERS)} or package.module:Class, got {name!r}"
            + meant(name, WRAPPERS)
        )
    return WrapperChoice(name=name, options=_plain(row, row.rest()))


def _policy(row: Table) -> PolicyChoice:
    name = row.text("name")
    options = {}
    for switch in fields(Policy):
        assert switch.default is not MISSING
        take = row.flag if isinstance(switch.default, bool) else row.whole
        options[switch.name] = take(switch.name, switch.default)
    row.close()
    return PolicyChoice(name=name, policy=Policy(**options))


def _searcher(row: Table, seeds: int, budget: dict[str, int]) -> SearcherChoice:
    name = row.text("name")
    if ":" not in name and name not in SEARCHERS:
        raise row.error(
            f"name must be one of {', '.join(SEARCHERS)} or package.module:Class, got {name!r}"
            + meant(name, SEARCHERS)
        )
    differs = "seeds" in row or "budget" in row
    own = _budget_keys(row.table("budget", {}))
    options = _plain(row, row.table("options", {}).rest())
    label, own_seeds = row.text("label", name), row.whole("seeds", seeds)
    reason = row.text("reason", REQUIRED if differs else "")
    row.close()
    return SearcherChoice(
        name=name,
        label=label,
        options=options,
        seeds=own_seeds,
        budget=_budget(row, {**budget, **own}),
        reason=reason,
    )


def _plain(row: Table, options: dict[str, Any]) -> dict[str, Any]:
    """Return options that can be kept beside the results."""
    for key, value in options.items():
        try:
            json.dumps(value, allow_nan=False)
        except (TypeError, ValueError):
            raise row.error(
                f"{key} must be finite numbers, texts, true or false, got {value!r}"
            ) from None
    return options


def _named(top: Table, key: str, choices: Any) -> tuple[Any, ...]:
    """Return the choices, whose names must differ."""
    seen: dict[str, Any] = {}
    for choice in choices:
        name = getattr(choice, "label", None) or choice.name
        if name in seen:
            kind = "label" if key == "searchers" else "name"
            raise top.error(f"[[{key}]] {name} is there twice; give one of them another {kind}")
        seen[name] = choice
    return tuple(seen.values())


def _check_number(top: Table, experiment: Experiment) -> None:
    """Refuse more runs than can be kept, before anything counts them one by one."""
    number = sum(cell.searcher.seeds for cell in experiment.cells())
    if number > MOST_RUNS:
        raise top.error(
            f"seeds, searchers, levels and policies make {number} runs, and at most {MOST_RUNS} "
            "are taken; give fewer seeds"
        )


def _check_levels(top: Table, experiment: Experiment) -> None:
    named = [wrapper for wrapper in experiment.wrappers if wrapper.name == NOISE]
    if experiment.levels is None:
        return
    if len(named) > 1:
        raise top.error(f"levels stands for the level of {NOISE}, and [[wrappers]] names several")
    if named and "level" in named[0].options:
        raise top.error(f"[[wrappers]] {NOISE} has a level of its own beside levels; drop one")


__all__ = [
    "Cell",
    "ConfigError",
    "Experiment",
    "PolicyChoice",
    "Run",
    "SearcherChoice",
    "WrapperChoice",
    "read",
]
