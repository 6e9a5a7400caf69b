"""Experiments with transfer methods: the keys of their file, and how a run is done."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import msgspec
import numpy as np
from msgspec import Meta, structs

from softvox_gym import Task
from softvox_gym.landscapes.table import N_DESIGNS
from softvox_gym.realities import SETS, realities, reality
from softvox_gym.tasks import HEADINGS
from softvox_search.experiment.schema import (
    Count,
    File,
    Level,
    Name,
    Row,
    check_different,
    sha256,
    tried,
)
from softvox_search.log import Columns, digest
from softvox_search.transfer.registry import make
from softvox_search.transfer.run import TransferRun, prepared
from softvox_search.transfer.simulator import Simulator

#: Among `realities`: all that have a name.
NAMED = "named"

Names = Annotated[list[Name], Meta(min_length=1)]


class MethodChoice(Row, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table [[methods]]; write an option whose value is a list as a list of one list.

    Tests and realities, if given, replace the experiment's as well; tables for different realities
    may share a label.
    """

    tests: Count | None = None
    realities: Names | None = None


class TransferExperiment(File, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The file of a comparison of transfer methods."""

    tests: Count = 20
    measurement_noise: Level = 0.0
    realities: Names = msgspec.field(default_factory=lambda: [NAMED])
    tasks: Names = msgspec.field(default_factory=lambda: ["directed"])
    methods: Annotated[list[MethodChoice], Meta(min_length=1)]

    #: Libraries that draw random numbers or compute for methods.
    libraries: ClassVar[tuple[str, ...]] = (
        *("botorch", "deap", "gpytorch", "numpy", "sbi", "scikit-learn", "scipy", "torch"),
    )

    def named(self) -> list[str]:
        """Return the names in the file that may refer to the user's own code."""
        return [row.name for row in self.methods]

    def method_choices(self) -> list[MethodChoice]:
        """Return the methods, one for every combination of options that are lists."""
        return [
            structs.replace(
                one,
                seeds=one.seeds or self.seeds,
                tests=one.tests or self.tests,
                realities=one.realities or self.realities,
            )
            for row in self.methods
            for one in row.combinations()
        ]

    def runs(self) -> list[TransferTask]:
        """Return all runs: method x reality x task x seed, the seed changing fastest."""
        return [
            TransferTask(
                method=method,
                reality=name,
                task=task,
                seed=seed,
                entropy=self.entropy,
                measurement_noise=self.measurement_noise,
            )
            for method in self.method_choices()
            for name in members(method.realities or ())
            for task in self.tasks
            for seed in range(method.seeds or 1)
        ]


KEYS: Mapping[str, tuple[str, ...]] = {
    "": TransferExperiment.__struct_fields__,
    "methods": MethodChoice.__struct_fields__,
}


@dataclass(frozen=True, kw_only=True)
class TransferTask:
    """A method in a reality with a task; a task with headings has all of `HEADINGS` in turn."""

    method: MethodChoice
    reality: str
    task: str = "directed"
    seed: int = 0
    entropy: int = 0
    measurement_noise: float = 0.0

    is_repeatable: ClassVar[bool] = True

    #: The columns of its result: means over the headings, at the end.
    summary: ClassVar[tuple[str, ...]] = (
        *("status", "tests", "regret", "class_regret", "srcc_before", "srcc_after"),
        *("kendall_before", "kendall_after", "heading_error_before", "heading_error"),
        *("distance", "is_specified", "simulations", "digest"),
    )

    @property
    def kind(self) -> str:
        """The method's name, without label and options."""
        return self.method.name

    @property
    def headings(self) -> tuple[float | None, ...]:
        """The headings of the task, degrees."""
        return HEADINGS if self.task == "directed" else (None,)

    def names(self) -> dict[str, Any]:
        """Return the names that identify the run in reports and key its random streams."""
        return {
            "method": self.method.label,
            "reality": self.reality,
            "task": self.task,
            "seed": self.seed,
        }

    def to_dict(self) -> dict[str, Any]:
        """Return all of the experiment that the run's result depends on, ready for JSON."""
        where = reality(self.reality)
        return {
            "names": self.names(),
            "entropy": self.entropy,
            "method": {"name": self.method.name, "options": self.method.options},
            "tests": self.method.tests,
            "measurement_noise": self.measurement_noise,
            "reality": {**where.to_dict(), "nominal": where.nominal.to_dict()},
        }

    def __str__(self) -> str:
        return ", ".join(f"{key} {value}" for key, value in self.names().items())


def members(names: list[str] | tuple[str, ...]) -> list[str]:
    """Return the realities meant by names: single realities, all named ones, or sets."""
    made = []
    for name in names:
        if name == NAMED:
            made += list(realities())
        elif name in SETS:
            made += [f"{name}-{i}" for i in range(len(SETS[name]))]
        else:
            made.append(reality(name).name)
    return made


def check_values(experiment: TransferExperiment) -> None:
    """Raise ValueError for faults beyond the keys' types; `check` tries the methods.

    Raises
    ------
    ValueError
    """
    for row in experiment.methods:
        if (row.tests or experiment.tests) > N_DESIGNS:
            raise ValueError(f"tests must be at most {N_DESIGNS}, the designs there are")
    for task in experiment.tasks:
        Task(task)
    check_different("tasks", "name", list(experiment.tasks))
    experiment.check_rows(
        "methods",
        experiment.methods,
        "methods, realities and tasks",
        lambda row: len(members(row.realities or experiment.realities)) * len(experiment.tasks),
    )
    for names in (experiment.realities, *(row.realities for row in experiment.methods)):
        check_different("realities", "name", members(names or ()))
    cells = [
        f"{one.label} in {name}"
        for one in experiment.method_choices()
        for name in members(one.realities or ())
    ]
    check_different("[[methods]]", "label", cells)


def check(experiment: TransferExperiment, place: str, progress: Callable[[int, int], None]) -> None:
    """Make every reality's landscape and every method once, before the work.

    A method's models have landscapes too, which are simulated now and kept.

    Raises
    ------
    UsageError
        If a method can't be made as the file says; the message begins with the place.
    """
    choices = experiment.method_choices()
    where = dict.fromkeys(name for one in choices for name in members(one.realities or ()))
    pairs = dict.fromkeys(
        (number, reality(name).nominal)
        for number, one in enumerate(choices)
        for name in members(one.realities or ())
    )
    total = len(where) + len(pairs)
    progress(0, total)
    for done, name in enumerate(where, start=1):
        reality(name).landscape()
        progress(done, total)
    for done, (number, nominal) in enumerate(pairs, start=len(where) + 1):
        one = choices[number]
        for task in experiment.tasks:
            rng, asked = np.random.default_rng(0), Task(task)
            tried(
                f"{place}: [[methods]] {one.label}",
                lambda: make(one.name, Simulator(nominal), asked, rng, **one.options),  # noqa: B023
            )
        progress(done, total)


def cross(run: TransferTask) -> tuple[dict[str, Any], Columns]:
    """Do a run; pass on any error of the method.

    Returns
    -------
    summary : dict
        A row of `Results.runs` without the column run.
    columns : dict of ndarray
        Test by test, heading by heading: heading in degrees (NaN for tasks without one), test
        from 1, design, reward in voxel widths, recommended, regret, class_regret. If a method ended
        early it has fewer designs than recommendations; the rest are -1 and NaN.
    """
    made = [_crossed(run, heading) for heading in run.headings]
    tests = run.method.tests or 1
    columns = {
        "heading": np.repeat(np.array(run.headings, dtype=np.float64), tests),
        "test": np.tile(np.arange(1, tests + 1, dtype="<i4"), len(made)),
        "design": np.concatenate([_padded(one.tested, tests, -1) for one in made]),
        "reward": np.concatenate([_padded(one.rewards, tests, np.nan) for one in made]),
        "recommended": np.concatenate([one.recommended for one in made]),
        "regret": np.concatenate([one.regret for one in made]),
        "class_regret": np.concatenate([one.class_regret for one in made]),
    }
    means = {
        name: _mean([getattr(one, name) for one in made])
        for name in run.summary
        if name not in ("status", "tests", "regret", "class_regret", "is_specified", "digest")
    }
    summary = {
        **run.names(),
        "status": "ok",
        "tests": tests,
        "regret": _mean([one.regret[-1] for one in made]),
        "class_regret": _mean([one.class_regret[-1] for one in made]),
        **means,
        "is_specified": made[0].is_specified,
        "digest": digest(columns, {name: column.dtype.str for name, column in columns.items()}),
    }
    return summary, columns


def _crossed(run: TransferTask, heading: float | None) -> TransferRun:
    """Do one of a run's headings, with its own stream, keyed by names."""
    words = sha256({"entropy": run.entropy, **run.names(), "heading": heading})
    return prepared(
        run.method.name,
        run.method.options,  # a dict, as an option may have the name of an argument of `transfer`
        reality=run.reality,
        task=run.task,
        heading=heading,
        tests=run.method.tests or 1,
        seed=int.from_bytes(words[:8], "little"),
        measurement_noise=run.measurement_noise,
    )()


def _padded(values: Any, n: int, with_: float) -> Any:
    return np.concatenate([values, np.full(n - len(values), with_, dtype=values.dtype)])


def _mean(values: list[float]) -> float | None:
    """Return the mean; None if there is none, as JSON has no NaN."""
    mean = float(np.mean(values))
    return None if np.isnan(mean) else mean
