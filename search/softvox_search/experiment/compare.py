"""Running the experiment of a folder: only the runs that are missing there."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from functools import partial
from importlib import util
from pathlib import Path
from typing import Any

import msgspec

from softvox_gym.files import write_file
from softvox_gym.manifest import provenance
from softvox_search.experiment import results
from softvox_search.experiment.pool import Done, Failed, Task, do_all
from softvox_search.experiment.results import Manifest, ResultsError, Say
from softvox_search.experiment.run import identity, made_with
from softvox_search.experiment.schema import Experiment, Run, UsageError, of_dict
from softvox_search.experiment.transfer import TransferExperiment, TransferTask

#: The least number of finished runs to repeat before new ones are added; it is more if there are
#: more searchers or methods, as one run of each is repeated.
SAMPLE = 5

#: (3, 16) is the third of sixteen parts of the runs.
Part = tuple[int, int]

AnyRun = Run | TransferTask

Summaries = dict[str, dict[str, Any]]

#: A function that does runs, and yields each when it is finished.
DoAll = Callable[[Sequence[Task]], Generator[Done | Failed, None, None]]


@dataclass(kw_only=True)
class Outcome:
    """The outcome of an experiment, or of a part if only that was done."""

    total: int  #: Runs.
    before: int  #: Finished runs that were there already.
    repeated: int = 0  #: Finished runs that were repeated, with the same bits.
    unrepeatable: int = 0  #: Finished runs that can't be repeated: their budget is in CPU seconds.
    failed: list[tuple[AnyRun, Failed]] = field(default_factory=list)
    missing: int = 0  #: Runs without a result, failed ones included.
    is_whole: bool = False  #: Whether every run is done or has failed, so a report can be made.
    seconds: float = 0.0  #: s, duration of the runs done now.
    files: list[str] = field(default_factory=list)  #: Files written now, without runs; relative.
    command: str  #: The command that reproduces the results.


def compare(
    experiment: Experiment | TransferExperiment,
    folder: Path,
    *,
    command: str,
    workers: int = 1,
    cluster: DoAll | None = None,
    part: Part | None = None,
    force: bool = False,
    check: bool = False,
    progress: Callable[[int, int], None],
    say: Say,
) -> Outcome:
    """Do the runs of an experiment that a folder lacks, then write the summary files.

    The folder must exist. The command, which reproduces the results, goes into report and manifest.

    Parameters
    ----------
    cluster : callable, optional
        A function that does the runs instead of local processes, as `pool.do_all` does.
    part : (int, int), optional
        Do only the given part of the runs: (3, 16) is the third of sixteen.
    force : bool
        Whether to delete results in the folder.
    check : bool
        Whether to repeat only a sample of the finished runs.
    progress : callable (done, total)
        Called for every run that is done now.
    say : callable (message)
        Called with warnings.

    Raises
    ------
    UsageError
        If the folder holds something else, another process writes there, or a repeated run gives
        a different result.
    OutputError, OSError
        If a file can't be written.
    """
    now = Manifest(
        experiment=experiment.to_dict(),
        command=command,
        made_with=made_with(experiment.libraries),
        code=code_digest(experiment),
        failed=[],
        files={},
    )
    runs = {identity(run, now.made_with): run for run in experiment.runs()}
    wanted = part_of(list(runs), part)
    do = cluster or partial(do_all, workers=workers)
    with _open(folder, now, runs, force=force, shared=part is not None, say=say) as before:
        done = results.finished(folder, wanted, say)
        left = {run: runs[run] for run in runs if run in wanted and run not in done}
        outcome = Outcome(total=len(wanted), before=len(done), command=command)
        if left or check:
            _repeat(folder, {run: runs[run] for run in sorted(done)}, done, do, outcome)
        if check:
            return outcome
        _do(folder, left, done, do, outcome, progress)
        if before is not None:
            now.notes = [*before.notes]
            if before.code != now.code and outcome.before:
                now.notes.append(
                    f"the source changed, from {before.code[:12]} to {now.code[:12]}; "
                    f"{outcome.repeated} of {outcome.before} finished runs were done again, to the "
                    "same bits"
                )
            if not left and _is_summed_up(folder, before, now, part):
                outcome.is_whole = part is None
                return outcome
        _sum_up(folder, now, runs, done, outcome, workers=workers, part=part)
        return outcome


def merge(folders: Sequence[Path], out: Path, *, force: bool = False, say: Say) -> Outcome:
    """Merge the parts of an experiment, each in its own folder, into an existing folder.

    Raises
    ------
    UsageError
        If the folders hold different experiments or different results of the same run, or force
        would delete one of the parts.
    OutputError, OSError
        If a file can't be written.
    """
    if force and any(folder.resolve() == out.resolve() for folder in folders):
        raise UsageError(
            f"{out} is one of the parts, whose runs --force would throw away; drop --force, or "
            "give another --out"
        )
    manifests = [_manifest_of(folder) for folder in folders]
    first = manifests[0]
    for folder, other in zip(folders, manifests, strict=True):
        if (what := difference(first, other)) is not None:
            raise UsageError(f"{folder} and {folders[0]} hold different experiments: {what}")
    experiment = of_dict(first.experiment, str(folders[0] / results.MANIFEST))
    runs = {identity(run, first.made_with): run for run in experiment.runs()}
    with _open(out, first, runs, force=force, shared=False, say=say):
        done = results.finished(out, runs, say)
        outcome = Outcome(total=len(runs), before=len(done), command=first.command)
        for folder in folders:
            for run, summary in results.finished(folder, runs, say).items():
                known = done.setdefault(run, summary)
                if known["digest"] != summary["digest"] and runs[run].is_repeatable:
                    raise UsageError(
                        f"run {run[:16]} ({runs[run]}) has another result in {folder} than in "
                        "an earlier folder; find out which is right, and leave the other out"
                    )
                if known is summary:
                    content = results.run_path(folder, run).read_bytes()
                    write_file(results.run_path(out, run), content, force=True)
        notes = list(dict.fromkeys(note for one in manifests for note in one.notes))
        merged = msgspec.structs.replace(first, failed=[], files={}, notes=notes)
        _sum_up(out, merged, runs, done, outcome)
        return outcome


def part_of(identities: Sequence[str], part: Part | None) -> set[str]:
    """Return the runs of a part: every n-th of the runs sorted by identity."""
    if part is None:
        return set(identities)
    number, parts = part
    return set(sorted(identities)[number - 1 :: parts])


def difference(before: Manifest, now: Manifest) -> str | None:
    """Return the first difference of two manifests that affects results, in words."""
    old, new = _depends_on(before), _depends_on(now)
    for key in new:
        if old.get(key) != new[key]:
            was, is_ = (json.dumps(one)[:60] for one in (old.get(key), new[key]))
            return f"{key} was {was}, and is {is_}"
    return None


def _depends_on(manifest: Manifest) -> dict[str, Any]:
    """Return all that results depend on in one dict: without the title, and seeds last."""
    experiment = {k: v for k, v in manifest.experiment.items() if k not in ("title", "seeds")}
    made_with = dict(manifest.made_with)
    versions = made_with.pop("versions", {})
    return {**versions, **made_with, **experiment, "seeds": manifest.experiment.get("seeds")}


def _manifest_of(folder: Path) -> Manifest:
    manifest = results.read_manifest(folder)
    if manifest is None:
        raise ResultsError(
            f"{folder} holds no results; softvox compare FILE.toml --part 1/2 --out {folder} makes "
            "some"
        )
    return manifest


@contextmanager
def _open(
    folder: Path, now: Manifest, runs: dict[str, AnyRun], *, force: bool, shared: bool, say: Say
) -> Iterator[Manifest | None]:
    """Lock a folder for runs, and return its manifest.

    Raises
    ------
    UsageError
        If it has files that are not results, or only runs that the experiment does not need.
    """
    with results.locked(folder, say, shared=shared):
        if force:
            results.clear(folder)
        before = results.read_manifest(folder)
        there = {path.stem for path in (folder / results.FOLDER).glob("*.parquet")}
        if not force and there.isdisjoint(run[:16] for run in runs):
            others = {path.name for path in folder.iterdir()} - {results.FOLDER}
            if before is None and (there or others):
                raise UsageError(
                    f"{folder} is not empty; choose another with --out, or write into it with "
                    "--force"
                )
            what = difference(before, now) if before and (before.files or there) else None
            if what is not None:
                raise UsageError(
                    f"{folder} holds results made differently, none of which is of use here: {what}"
                    "; choose another with --out, or delete those with --force"
                )
        (folder / results.FOLDER).mkdir(exist_ok=True)
        yield before


def _is_summed_up(folder: Path, before: Manifest, now: Manifest, part: Part | None) -> bool:
    """Return whether a folder without missing runs has all its summary files."""
    return (
        not before.failed
        and before.experiment == now.experiment
        and before.command == now.command
        and bool(part or before.files)
        and all(results.file_digest(folder / name) == d for name, d in before.files.items())
    )


def _repeat(
    folder: Path, runs: dict[str, AnyRun], done: Summaries, do: DoAll, outcome: Outcome
) -> None:
    """Repeat a sample of the finished runs, at least one of each kind; compare the bits.

    Runs with a budget in CPU seconds are left out, as they differ each time.
    """
    repeatable = {run: one for run, one in runs.items() if one.is_repeatable}
    outcome.unrepeatable = len(runs) - len(repeatable)
    firsts = {one.kind: run for run, one in reversed(repeatable.items())}
    chosen = dict.fromkeys([*firsts.values(), *repeatable])
    sample = [(run, runs[run]) for run in list(chosen)[: max(SAMPLE, len(firsts))]]
    with closing(do(sample)) as outcomes:
        for one in outcomes:
            if isinstance(one, Done) and one.summary["digest"] == done[one.run]["digest"]:
                continue
            why = one.error if isinstance(one, Failed) else "now gives another result"
            raise UsageError(
                f"run {one.run[:16]} ({runs[one.run]}) in {folder} can't be repeated: {why}; the "
                "code has changed: choose another folder with --out, or delete all runs there with "
                "--force"
            )
    outcome.repeated = len(sample)


def _do(
    folder: Path,
    left: dict[str, AnyRun],
    done: Summaries,
    do: DoAll,
    outcome: Outcome,
    progress: Callable[[int, int], None],
) -> None:
    """Do runs, and write each when it is finished."""
    started = time.perf_counter()
    progress(0, len(left))
    failed = {}
    with closing(do(list(left.items()))) as outcomes:
        for count, one in enumerate(outcomes, start=1):
            if isinstance(one, Done):
                write_file(results.run_path(folder, one.run), one.content, force=True)
                done[one.run] = one.summary
            else:
                failed[one.run] = one
            progress(count, len(left))
    outcome.failed = [(left[run], failed[run]) for run in left if run in failed]
    outcome.seconds = time.perf_counter() - started


def _sum_up(
    folder: Path,
    manifest: Manifest,
    runs: dict[str, AnyRun],
    done: Summaries,
    outcome: Outcome,
    *,
    workers: int = 1,
    part: Part | None = None,
) -> None:
    """Write all files except the runs and the report; the manifest last."""
    manifest.failed = [failure.run for _, failure in outcome.failed]
    outcome.missing = outcome.total - len(done)
    outcome.is_whole = part is None and outcome.missing == len(outcome.failed)
    if outcome.is_whole:
        rows = [
            {"run": name, **run.names(), "status": "failed", **done.get(name, {})}
            for name, run in runs.items()
        ]
        manifest.files = {
            results.RUNS: results.write_runs(folder, rows, next(iter(runs.values())).summary)
        }
    failed = results.FAILED if part is None else "failed-{}-of-{}.csv".format(*part)
    (folder / failed).unlink(missing_ok=True)
    rows = [
        {"run": one.run, **run.names(), "error": one.error, "trace": one.trace}
        for run, one in outcome.failed
    ]
    if rows:
        results.write_csv(folder / failed, list(rows[0]), rows)
    data = {
        **provenance(threads=1),
        "workers": workers,
        "runs": len(runs),
        "seconds": outcome.seconds,
        **msgspec.structs.asdict(manifest),
    }
    text = json.dumps(data, indent=2, allow_nan=False) + "\n"
    write_file(folder / results.MANIFEST, text.encode(), force=True)
    outcome.files = [*manifest.files, *([failed] if rows else []), results.MANIFEST]


def code_digest(experiment: Experiment | TransferExperiment) -> str:
    """Return a digest of the source of this package and of the modules that the file names."""
    return digest_of(modules(experiment))


def modules(experiment: Experiment | TransferExperiment) -> list[str]:
    """Return the modules that an experiment's results depend on."""
    own = {name.partition(":")[0] for name in experiment.named() if ":" in name}
    return ["softvox_gym", "softvox_search", *sorted(own)]


def digest_of(modules: Sequence[str]) -> str:
    """Return a digest of the source of modules, including all modules of packages."""
    total = hashlib.sha256()
    for module in modules:
        spec = util.find_spec(module)
        if spec is None or spec.origin is None:
            continue
        path = Path(spec.origin)
        for source in sorted(path.parent.rglob("*.py")) if path.name == "__init__.py" else [path]:
            total.update(source.read_bytes())
    return total.hexdigest()
