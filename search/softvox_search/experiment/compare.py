"""Running an experiment into a folder: begun, gone on with, or found done."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from softvox_gym.manifest import provenance
from softvox_search.experiment import folder as files
from softvox_search.experiment.config import Experiment
from softvox_search.experiment.folder import FolderError, Written
from softvox_search.experiment.identity import difference, identity
from softvox_search.experiment.journal import Journal
from softvox_search.experiment.pool import Done, Failed, do_all
from softvox_search.experiment.results import write_report

#: What is thrown away to start anew; the manifest first, as it vouches for the others.
_OURS = (files.MANIFEST, files.JOURNAL, *files.DATA, files.FAILED, files.REPORT)


@dataclass(frozen=True, kw_only=True)
class Plan:
    """How to run an experiment.

    Parameters
    ----------
    command : str
        What makes the results again, for report and manifest.
    arguments : sequence of str
        Of the command line, for the manifest.
    workers : int
        Processes.
    force : bool
        Whether results in the folder are thrown away.
    report : bool
        Whether to write one.
    """

    command: str
    arguments: Sequence[str]
    workers: int
    force: bool = False
    report: bool = True


@dataclass
class Outcome:
    """What became of an experiment.

    Parameters
    ----------
    total : int
        Runs.
    before : int
        Those that were done already.
    failed : list of Failed
    was_complete : bool
        Whether all results were there already.
    evaluations : int
        Of all runs.
    seconds : float
        s, of the runs now.
    files : list of str
        Written, relative to the folder.
    """

    total: int
    before: int = 0
    failed: list[Failed] = field(default_factory=list)
    was_complete: bool = False
    evaluations: int = 0
    seconds: float = 0.0
    files: list[str] = field(default_factory=list)


def compare(
    experiment: Experiment,
    folder: Path,
    plan: Plan,
    *,
    progress: Callable[[int, int], None],
    say: Callable[[str], None],
) -> Outcome:
    """Run an experiment into a folder, going on where an earlier start ended.

    A run that raises an error is left out of the results and named in failed.csv; the next start
    tries it again. The journal is removed when all runs are done.

    Parameters
    ----------
    experiment : Experiment
    folder : Path
        An existing folder.
    plan : Plan
    progress : callable (done, total)
        Of the runs that are still to do.
    say : callable (str)
        Takes one line that the user should know.

    Raises
    ------
    FolderError
        For a folder with other results, or anything else.
    OutputError, OSError
        Where the results can't be written.
    """
    origin, made_from = provenance(threads=1), identity(experiment)
    with files.locked(folder):
        if plan.force:
            for name in _OURS:
                (folder / name).unlink(missing_ok=True)
        if is_complete(folder, made_from, force=plan.force):
            outcome = Outcome(len(experiment.runs()), len(experiment.runs()), was_complete=True)
            (folder / files.JOURNAL).unlink(missing_ok=True)
        else:
            with Journal(folder / files.JOURNAL, made_from) as journal:
                outcome, written = _filled(experiment, folder, journal, plan, progress, say)
                manifest = _manifest(experiment, plan, made_from, outcome, written)
            files.write_manifest(folder, {**origin, **manifest})
            outcome.files = [*files.DATA, *([files.FAILED] if outcome.failed else [])]
            outcome.files.append(files.MANIFEST)
            if not outcome.failed:
                (folder / files.JOURNAL).unlink()
        if plan.report and experiment.is_published:
            outcome.files += write_report(folder, experiment, plan.command)
    return outcome


def is_complete(folder: Path, made_from: dict[str, Any], *, force: bool = False) -> bool:
    """Return whether a folder holds all results of an experiment.

    Raises
    ------
    FolderError
        Where it holds something else, and force is not given.
    """
    manifest = files.read_manifest(folder)
    if manifest is None:
        _check_free(folder, force=force)
        return False
    _check_same(folder, manifest.get("made_from", {}), made_from)
    try:
        _check_files(folder, manifest, files.DATA)
    except FolderError:
        if (folder / files.JOURNAL).exists():
            return False
        raise
    return not manifest["failed"]


def check_report(experiment: Experiment, folder: Path) -> None:
    """Make sure that a folder holds results of an experiment on which there can be a report.

    Results made by other code or versions will do.

    Raises
    ------
    FolderError
        Where it doesn't.
    """
    manifest = files.read_manifest(folder)
    if manifest is None:
        raise FolderError(f"{folder} holds no results yet; make them without --report-only")
    before, now = manifest.get("made_from", {}), identity(experiment)
    keys = ("config", "engine_digest")
    _check_same(folder, {key: before.get(key) for key in keys}, {key: now[key] for key in keys})
    if not experiment.is_published:
        raise FolderError(
            f"{folder} has no report: the optimum is known for the physics published only"
        )
    _check_files(folder, manifest, files.REPORTED)


def _check_files(folder: Path, manifest: dict[str, Any], names: Sequence[str]) -> None:
    """Make sure that files are there as the manifest knows them."""
    for name in names:
        if manifest["files"].get(name) != files.file_digest(folder / name):
            raise FolderError(
                f"{folder / name} is not as it was written; restore it, or run all anew with "
                "--force"
            )


def _check_free(folder: Path, *, force: bool) -> None:
    """Make sure that a folder is empty, or holds a journal to go on with."""
    if force or (folder / files.JOURNAL).exists() or not any(folder.iterdir()):
        return
    raise FolderError(f"{folder} is not empty; choose another, or write into it with --force")


def _check_same(folder: Path, before: dict[str, Any], now: dict[str, Any]) -> None:
    if (what := difference(before, now)) is not None:
        raise FolderError(
            f"{folder} holds results made otherwise: {what}; choose another with --out, or throw "
            "those away with --force"
        )


def _filled(
    experiment: Experiment,
    folder: Path,
    journal: Journal,
    plan: Plan,
    progress: Callable[[int, int], None],
    say: Callable[[str], None],
) -> tuple[Outcome, Written]:
    """Do the runs that the journal lacks, then write the results."""
    _check_same(folder, journal.identity, identity(experiment))
    journal.load()
    numbers = range(len(experiment.runs()))
    done = set(journal.runs)
    if journal.dropped:
        say(
            f"the end of {folder / files.JOURNAL} is damaged ({journal.dropped} bytes): the "
            f"{len(done)} whole runs are used, the others done again"
        )
    outcome = Outcome(total=len(numbers), before=len(done))
    left = [number for number in numbers if number not in done]
    started = time.perf_counter()
    progress(0, len(left))
    with closing(do_all(experiment, left, workers=plan.workers)) as results:
        for count, result in enumerate(results, start=1):
            if isinstance(result, Done):
                journal.append(result.run, result.content)
            else:
                outcome.failed.append(result)
            progress(count, len(left))
    outcome.seconds = time.perf_counter() - started
    outcome.failed.sort(key=lambda failure: failure.run)
    written = files.write_data(folder, journal, experiment, outcome.failed)
    outcome.evaluations = written.total.evaluations
    return outcome, written


def _manifest(
    experiment: Experiment,
    plan: Plan,
    made_from: dict[str, Any],
    outcome: Outcome,
    written: Written,
) -> dict[str, Any]:
    """Return everything about the results that is not in them, but for where they come from."""
    return {
        "experiment": experiment.name,
        "command": plan.command,
        "arguments": list(plan.arguments),
        "workers": plan.workers,
        "made_from": made_from,
        "seeds": "SeedSequence(entropy, spawn_key=(cell, seed)).spawn(2): searcher, noise",
        "runs": outcome.total,
        "runs_before": outcome.before,
        "failed": [failure.run for failure in outcome.failed],
        "seconds": outcome.seconds,
        "sum": written.total.to_dict(),
        "cells": [
            {
                "cell": cell.number,
                "searcher": cell.searcher.label,
                "level": cell.level,
                "policy": cell.policy.name if cell.policy else None,
                **written.cells[cell.number].to_dict(),
            }
            for cell in experiment.cells()
            if cell.number in written.cells
        ],
        "files": written.digests,
    }
