"""Running an experiment into a folder: what is missing there, and nothing else."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from importlib import util
from pathlib import Path
from typing import Any

import msgspec

from softvox_gym.files import write_file
from softvox_gym.manifest import provenance
from softvox_search.experiment import results
from softvox_search.experiment.pool import Done, Failed, do_all
from softvox_search.experiment.results import Manifest, ResultsError, Say
from softvox_search.experiment.run import identity, made_with
from softvox_search.experiment.schema import Experiment, Run, UsageError, of_dict

#: As many finished runs are done again, at most, before new ones are added.
SAMPLE = 5


@dataclass(frozen=True, kw_only=True)
class Plan:
    """How to run an experiment.

    Parameters
    ----------
    command : str
        What makes the results again, for report and manifest; parts that are merged know it.
    workers : int
        Processes.
    part : (int, int), optional
        (3, 16) is the third of sixteen parts of the runs.
    force : bool
        Whether results in the folder are thrown away.
    check : bool
        Whether to do a sample of the finished runs again, and nothing else.
    report : bool
        Whether to write one.
    """

    command: str = ""
    workers: int = 1
    part: tuple[int, int] | None = None
    force: bool = False
    check: bool = False
    report: bool = True


@dataclass
class Outcome:
    """What became of an experiment.

    Parameters
    ----------
    total : int
        Runs, of the part where only that is done.
    before : int
        Those that were done already.
    repeated : int
        Finished runs that were done again, to the same bits.
    unrepeatable : int
        Finished runs that can't be, as their budget is in CPU seconds.
    failed : list of (Run, Failed)
    missing : int
        Runs that are not there, failed ones included.
    seconds : float
        s, of the runs now.
    files : list of str
        Written, relative to the folder.
    command : str
        What makes the results again.
    """

    total: int
    before: int = 0
    repeated: int = 0
    unrepeatable: int = 0
    failed: list[tuple[Run, Failed]] = field(default_factory=list)
    missing: int = 0
    seconds: float = 0.0
    files: list[str] = field(default_factory=list)
    command: str = ""


Progress = Callable[[int, int], None]


def compare(
    experiment: Experiment, folder: Path, plan: Plan, *, progress: Progress, say: Say
) -> Outcome:
    """Do the runs of an experiment that a folder lacks, then write what sums them up.

    Parameters
    ----------
    experiment : Experiment
    folder : Path
        An existing folder.
    plan : Plan
    progress : callable (done, total)
        Called for every run that is done now.
    say : callable (message)
        Called with warnings.

    Raises
    ------
    UsageError
        Where the folder holds something else, another process writes there, or a finished run now
        gives another result.
    OutputError, OSError
        Where something can't be written.
    """
    manifest = Manifest(
        experiment=experiment.to_dict(),
        command=plan.command,
        made_with=made_with(),
        code=code_digest(experiment),
        failed=[],
        files={},
    )
    runs = {identity(run, manifest.made_with): run for run in experiment.runs()}
    with _open(folder, manifest, runs, plan, say) as before:
        wanted = part_of(list(runs), plan.part)
        summaries = results.finished(folder, wanted, say)
        outcome = Outcome(total=len(wanted), before=len(summaries))
        left = [run for run in runs if run in wanted and run not in summaries]
        if left or plan.check:
            _repeat(folder, runs, summaries, plan, outcome)
        if plan.check:
            return outcome
        _do(folder, {run: runs[run] for run in left}, summaries, outcome, plan, progress)
        if before is not None:
            _take_over(manifest, before, outcome)
            if not left and _is_same(folder, before, manifest, plan):
                outcome.files = write_report(folder) if plan.report and not plan.part else []
                return outcome
        return _sum_up(folder, manifest, runs, summaries, outcome, plan)


def merge(folders: Sequence[Path], out: Path, plan: Plan, *, say: Say) -> Outcome:
    """Put the parts of an experiment together.

    Parameters
    ----------
    folders : sequence of Path
        That `compare` has written into, each a part or more.
    out : Path
        An existing folder.
    plan : Plan
        Only what it says of force and report counts.
    say : callable (message)
        Called with warnings.

    Raises
    ------
    UsageError
        Where the folders hold different experiments, or different results of a run.
    OutputError, OSError
        Where something can't be written.
    """
    manifests = [_manifest_of(folder) for folder in folders]
    first = manifests[0]
    for folder, other in zip(folders, manifests, strict=True):
        if (what := difference(first, other)) is not None:
            raise UsageError(f"{folder} and {folders[0]} hold different experiments: {what}")
    experiment = of_dict(first.experiment, str(folders[0] / results.MANIFEST))
    runs = {identity(run, first.made_with): run for run in experiment.runs()}
    with _open(out, first, runs, plan, say):
        summaries = results.finished(out, runs, say)
        outcome = Outcome(total=len(runs), before=len(summaries))
        for folder in folders:
            for run, summary in results.finished(folder, runs, say).items():
                known = summaries.setdefault(run, summary)
                if known["digest"] != summary["digest"] and runs[run].is_repeatable:
                    raise UsageError(
                        f"run {run[:16]} ({runs[run]}) has another result in {folder} than in the "
                        "folders before; find out which is right, and leave the other out"
                    )
                if known is summary:
                    content = results.run_path(folder, run).read_bytes()
                    results.write_run(out, run, content)
        notes = list(dict.fromkeys(note for one in manifests for note in one.notes))
        merged = msgspec.structs.replace(first, failed=[], files={}, notes=notes)
        return _sum_up(out, merged, runs, summaries, outcome, plan)


def part_of(identities: Sequence[str], part: tuple[int, int] | None) -> set[str]:
    """Return the runs of a part: in the order of their identities, one in so many."""
    if part is None:
        return set(identities)
    number, parts = part
    return set(sorted(identities)[number - 1 :: parts])


def write_report(folder: Path) -> list[str]:
    """Write the report on the results in a folder; return what was written.

    Raises
    ------
    ResultsError
        Where they are not all there.
    OutputError, OSError
        Where it can't be written.
    """
    from softvox_search import report

    return report.write(folder, results.read(folder))


def difference(before: Manifest, now: Manifest) -> str | None:
    """Return the first thing in which two manifests differ that results depend on, in words."""
    old, new = _depends_on(before), _depends_on(now)
    for key in new:
        if old.get(key) != new[key]:
            was, is_ = (json.dumps(one)[:60] for one in (old.get(key), new[key]))
            return f"{key} was {was}, and is {is_}"
    return None


def _depends_on(manifest: Manifest) -> dict[str, Any]:
    """Return all of it in one dict, how many runs there are last, without their title."""
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
    folder: Path, manifest: Manifest, runs: dict[str, Run], plan: Plan, say: Say
) -> Iterator[Manifest | None]:
    """Lock a folder for runs, and return the manifest that is there.

    Raises
    ------
    UsageError
        Where there are files that are no results, or runs none of which is wanted.
    """
    with results.locked(folder, say, shared=plan.part is not None):
        if plan.force:
            results.clear(folder)
        before = results.read_manifest(folder)
        there = {path.stem for path in (folder / results.FOLDER).glob("*.parquet")}
        if not plan.force and there.isdisjoint(run[:16] for run in runs):
            _check_free(folder, manifest, before, is_empty=not there)
        (folder / results.FOLDER).mkdir(exist_ok=True)
        yield before


def _check_free(
    folder: Path, manifest: Manifest, before: Manifest | None, *, is_empty: bool
) -> None:
    """Refuse a folder that holds anything else."""
    if before is None:
        if not is_empty or any(path.name != results.FOLDER for path in folder.iterdir()):
            raise UsageError(
                f"{folder} is not empty; choose another with --out, or write into it with --force"
            )
        return
    what = difference(before, manifest)
    if what is not None and (before.files or not is_empty):
        raise UsageError(
            f"{folder} holds results made otherwise, none of which is of use here: {what}; choose "
            "another with --out, or throw those away with --force"
        )


def _take_over(manifest: Manifest, before: Manifest, outcome: Outcome) -> None:
    """Keep the notes of an earlier manifest, and note that the source has changed since."""
    manifest.notes = [*before.notes]
    if before.code != manifest.code and outcome.before:
        manifest.notes.append(
            f"the source changed, from {before.code[:12]} to {manifest.code[:12]}; "
            f"{outcome.repeated} of {outcome.before} finished runs were done again, to the same "
            "bits"
        )


def _is_same(folder: Path, before: Manifest, manifest: Manifest, plan: Plan) -> bool:
    """Return whether there is nothing to write but the report."""
    return (
        not before.failed
        and before.experiment == manifest.experiment
        and before.command == manifest.command
        and bool(plan.part or before.files)
        and all(results.file_digest(folder / n) == d for n, d in before.files.items())
    )


def _repeat(
    folder: Path,
    runs: dict[str, Run],
    summaries: dict[str, dict[str, Any]],
    plan: Plan,
    outcome: Outcome,
) -> None:
    """Do a sample of the finished runs again, of as many searchers as can be, and compare the bits.

    Runs whose budget is in seconds are left out: they differ by nature.
    """
    by_searcher: dict[str, str] = {}
    repeatable = [run for run in sorted(summaries) if runs[run].is_repeatable]
    outcome.unrepeatable = len(summaries) - len(repeatable)
    for run in repeatable:
        by_searcher.setdefault(runs[run].searcher.label, run)
    chosen = [*by_searcher.values(), *repeatable]
    sample = [(run, runs[run]) for run in list(dict.fromkeys(chosen))[:SAMPLE]]
    with closing(do_all(sample, workers=plan.workers)) as outcomes:
        for one in outcomes:
            if isinstance(one, Done) and one.summary["digest"] == summaries[one.run]["digest"]:
                continue
            why = one.error if isinstance(one, Failed) else "now gives another result"
            raise UsageError(
                f"run {one.run[:16]} ({runs[one.run]}) in {folder} can't be repeated: {why}; the "
                "code has changed: choose another folder with --out, or throw all runs there away "
                "with --force"
            )
    outcome.repeated = len(sample)


def _do(
    folder: Path,
    left: dict[str, Run],
    summaries: dict[str, dict[str, Any]],
    outcome: Outcome,
    plan: Plan,
    progress: Progress,
) -> None:
    """Do runs, and write each as it is finished."""
    started = time.perf_counter()
    progress(0, len(left))
    with closing(do_all(list(left.items()), workers=plan.workers)) as outcomes:
        for count, one in enumerate(outcomes, start=1):
            if isinstance(one, Done):
                results.write_run(folder, one.run, one.content)
                summaries[one.run] = one.summary
            else:
                outcome.failed.append((left[one.run], one))
            progress(count, len(left))
    order = {run: number for number, run in enumerate(left)}
    outcome.failed.sort(key=lambda pair: order[pair[1].run])
    outcome.seconds = time.perf_counter() - started


def _sum_up(
    folder: Path,
    manifest: Manifest,
    runs: dict[str, Run],
    summaries: dict[str, dict[str, Any]],
    outcome: Outcome,
    plan: Plan,
) -> Outcome:
    """Write everything but the runs; the manifest last."""
    outcome.command = manifest.command
    manifest.failed = [failure.run for _, failure in outcome.failed]
    outcome.missing = len(part_of(list(runs), plan.part)) - len(summaries)
    is_whole = plan.part is None and outcome.missing == len(outcome.failed)
    if is_whole:
        rows = {run: summaries.get(run, {**runs[run].names(), "status": "failed"}) for run in runs}
        manifest.files = {results.RUNS: results.write_runs(folder, rows)}
    name = results.FAILED if plan.part is None else "failed-{}-of-{}.csv".format(*plan.part)
    _write_failed(folder / name, outcome)
    data = {
        **provenance(threads=1),
        "workers": plan.workers,
        "runs": len(runs),
        "seconds": outcome.seconds,
        **msgspec.structs.asdict(manifest),
    }
    text = json.dumps(data, indent=2, allow_nan=False) + "\n"
    write_file(folder / results.MANIFEST, text.encode(), force=True)
    outcome.files = [*manifest.files, *([name] if outcome.failed else []), results.MANIFEST]
    if plan.report and is_whole:
        outcome.files += write_report(folder)
    return outcome


def _write_failed(path: Path, outcome: Outcome) -> None:
    path.unlink(missing_ok=True)
    rows = [(one.run, *run.names().values(), one.error, one.trace) for run, one in outcome.failed]
    if rows:
        header = ("run", *outcome.failed[0][0].names(), "error", "trace")
        results.write_csv(path, header, rows)


def code_digest(experiment: Experiment) -> str:
    """Return a digest of the source: this package's, and of the modules that the file names."""
    named: list[str] = [one["name"] for one in experiment.wrappers]
    named += [row.name for row in experiment.searchers]
    modules = {name.partition(":")[0] for name in named if ":" in name}
    total = hashlib.sha256()
    for module in ["softvox_gym", "softvox_search", *sorted(modules)]:
        spec = util.find_spec(module)
        if spec is None or spec.origin is None:
            continue
        path = Path(spec.origin)
        for source in sorted(path.parent.rglob("*.py")) if path.name == "__init__.py" else [path]:
            total.update(source.read_bytes())
    return total.hexdigest()
