"""Agreement of this build with the published table and the authors' own engine."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym import engine
from softvox_gym.data import Records, designs, document, flags, numbers, records
from softvox_gym.design import Design
from softvox_gym.landscapes.table import AXES, N_DESIGNS
from softvox_gym.manifest import digest
from softvox_gym.physics import Physics
from softvox_gym.realities import reality
from softvox_gym.simulation import Result, simulate
from softvox_gym.verify.agreement import (
    EXCEPTED,
    FAILED,
    UNJUDGED,
    Row,
    count,
    differences,
    judge,
)
from softvox_gym.verify.trajectories import trajectories

#: Digest of the published landscape's displacements, on every machine and instruction set.
GOLDEN = "7bc2ffe3d2e87be874a7775c930c5937eea9c88522328be62a850620578a05b0"

#: Difference of the authors' engine from itself, compiled with other flags; voxel widths.
TOLERANCE = 1e-7

#: Difference if voxels also contract, where the authors' engine deviates more; voxel widths.
VARIANT_TOLERANCES = {"both_phases": 2e-7}

#: Changes of fitness at half the time step up to this count as small; voxel widths.
STEP_ERROR = 0.1

#: Difference if no voxels touch, where the authors' engine took a tenth of the time step; voxel
#: widths.
LINKLESS_TOLERANCE = 2e-3

_FALLS = "rounding decides its fall"

#: Designs that miss the tolerance, by row of the table: the accepted difference and the reason.
#: These two are mirror symmetric, and the last bit decides to which side they fall. The limits are
#: the spread over 200 runs whose voxels start displaced by a random 2e-16 of an edge.
EXCEPTIONS = {"clamp": {5455: (0.9, _FALLS), 6453: (0.15, _FALLS)}}

FAMILIES = {
    "hires": "high resolution",
    "lat234": "2x3x4 lattice",
    "lat333": "3x3x3 lattice",
    "lat444": "4x4x4 lattice",
    "phase222": "phase offsets",
}


def checks(*, threads: int | None = None) -> Iterator[Row]:
    """Yield the rows of the agreement table as they are computed; threads as in `simulate`."""
    landscape = simulate(np.arange(N_DESIGNS), threads=threads)
    yield published_top100(landscape.fitness, records("published_top100.csv"))
    yield golden(landscape.displacement)
    yield half_step(landscape.fitness)
    yield from instruction_sets(landscape.displacement, threads=threads)
    tenth = records("landscape_sample.csv")
    yield from sample(landscape.displacement, tenth, threads=threads)
    sensitive = {int(row["design"]) for row in tenth if row["sensitive"] == "1"}
    yield from trajectories(sensitive, TOLERANCE, threads=threads)
    yield from lattices(document("lattices.json"), threads=threads)
    yield from variants(document("variants.json"), records("variants.csv"), threads=threads)


def published_top100(fitness: NDArray[np.float64], published: Records) -> Row:
    """Compare fitness, shape (6561,), with the paper's table at the two decimals printed there."""
    found = fitness[designs(published)]
    agree = [f"{value:.2f}" == row["fitness"] for value, row in zip(found, published, strict=True)]
    largest = float(np.max(np.abs(found - numbers(published, "fitness")[:, 0])))
    return count("published top 100", agree, largest=largest, note="at two decimals")


def golden(displacement: NDArray[np.float64]) -> Row:
    """Compare the bits of the published landscape with those that every build must give."""
    same = np.full(N_DESIGNS, digest(displacement) == GOLDEN)
    return count("digest", same, note="all displacements, to the bit")


def half_step(fitness: NDArray[np.float64]) -> Row:
    """Count the designs whose fitness, shape (6561,), hardly changes at half the time step.

    Uses the table of the reality half_step that ships with the package.
    """
    change = np.abs(reality("half_step").landscape()["fitness"] - fitness)
    note = f"the step's own error; {int((change > 1).sum())} change by more than 1"
    return judge("half the time step", change, STEP_ERROR, verdicts=UNJUDGED, note=note)


def instruction_sets(displacement: NDArray[np.float64], *, threads: int | None) -> Iterator[Row]:
    """Compare a part of the landscape, shape (6561, 3), bit by bit on every instruction set."""
    some = np.arange(0, N_DESIGNS, 40)
    wanted = displacement[some].view(np.uint64)
    for isa in engine.isa_names():
        found = simulate(some, threads=threads, isa=isa).displacement.view(np.uint64)
        yield count(isa, (found == wanted).all(axis=1), note="to the bit")


def sample(
    displacement: NDArray[np.float64], tenth: Records, *, threads: int | None = None
) -> Iterator[Row]:
    """Compare the published landscape, shape (6561, 3), with a tenth of the authors' one."""
    chosen, wanted = np.array(designs(tenth)), numbers(tenth, *AXES)
    linkless, sensitive = flags(tenth, "linkless"), flags(tenth, "sensitive")
    difference = differences(displacement[chosen], wanted)

    plain = ~linkless & ~sensitive
    yield judge("landscape sample", difference[plain], TOLERANCE)
    note = "the authors took dt/10"
    yield judge("linkless", difference[linkless], LINKLESS_TOLERANCE, note=note)
    published = Physics.published()
    short = replace(published, time_step_fraction=published.time_step_fraction / 10)
    found = simulate(chosen[linkless], short, threads=threads).displacement
    yield judge("linkless at dt/10", differences(found, wanted[linkless]), TOLERANCE)
    note = "theirs varies too"
    yield judge("sensitive", difference[sensitive], TOLERANCE, verdicts=UNJUDGED, note=note)


def variants(
    changes: Mapping[str, Mapping[str, Any]], measured: Records, *, threads: int | None = None
) -> Iterator[Row]:
    """Compare runs with changed parameters: displacement, number of steps, time step."""
    for name, change in changes.items():
        rows = [row for row in measured if row["variant"] == name]
        physics = replace(Physics.published(), **change)
        result = simulate(designs(rows), physics, threads=threads)
        difference, known = compare_runs(result, rows), EXCEPTIONS.get(name, {})
        plain = [design not in known for design in designs(rows)]
        yield judge(name, difference[plain], VARIANT_TOLERANCES.get(name, TOLERANCE))
        for design, (limit, reason) in known.items():
            own = difference[[other == design for other in designs(rows)]]
            yield judge(f"  design {design}", own, limit, verdicts=(EXCEPTED, FAILED), note=reason)


def lattices(cases: Sequence[Mapping[str, Any]], *, threads: int | None = None) -> Iterator[Row]:
    """Compare other lattices, phase offsets, and the paper's high-resolution model."""
    families = defaultdict(list)
    for case in cases:
        families[case["name"].partition("_")[0]].append(case)
    for family, rows in families.items():
        shape, edge = rows[0]["shape"], rows[0]["edge"]
        physics = replace(Physics.published(), edge=edge, strain=numbers(rows, "strain")[:, 0])
        phases = [row["phase"] or np.zeros(np.prod(shape)) for row in rows]
        result = simulate(
            [Design(row["digits"], shape=shape) for row in rows],
            physics,
            phase=np.stack([np.reshape(phase, shape, order="F") for phase in phases]),
            threads=threads,
        )
        yield judge(FAMILIES.get(family, family), compare_runs(result, rows), TOLERANCE)


def compare_runs(result: Result, rows: Sequence[Mapping[str, Any]]) -> NDArray[np.float64]:
    """Return the differences in displacement; NaN if the numbers of steps differ."""
    difference = differences(result.displacement, numbers(rows, *AXES))
    steps, time_step = numbers(rows, "steps", "time_step").T
    same = (result.steps == steps) & np.isclose(result.physics.time_step, time_step, 1e-14, 0)
    return np.where(same, difference, np.nan)
