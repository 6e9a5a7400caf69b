"""A database of trials: a folder of their files, each named by the digest of its content.

Nothing else is kept in it, no index: two labs' folders are merged by copying files, and what a
folder holds is what its files say. docs/trials-database.md describes both.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from softvox_gym.design import called
from softvox_gym.files import check_folder, write_file
from softvox_gym.trials.trial import MOST_BYTES, Trial, TrialError, several

#: Of the files' names.
ENDING = ".json"


class Checked(NamedTuple):
    """What `check` found in some folders."""

    trials: tuple[Trial, ...]  #: That are whole, sorted by digest, each once.
    faults: tuple[str, ...]  #: Lines that name the file and the remedy.
    doubts: tuple[str, ...]  #: Lines about what may be right, and looks as if it were not.


class Added(NamedTuple):
    """What `add` and `merge` were given, sorted by digest, each once."""

    new: tuple[Trial, ...]  #: Those that were written.
    known: tuple[Trial, ...]  #: Those that the folder held, be it of other provenance.


def shipped() -> Path:
    """Return the folder of the trials that ship with the package."""
    return Path(__file__).parents[1] / "data" / "trials"


def read(*folders: Path | str) -> tuple[Trial, ...]:
    """Return the trials of some folders, sorted by digest, each once.

    Files whose names don't end in .json are left alone, and hidden ones.

    Raises
    ------
    TrialError
        For the first fault that `check` finds, or where there is no such folder.
    """
    return _sorted(_held(map(Path, folders)))


def check(*folders: Path | str) -> Checked:
    """Tell all that is wrong in folders, and between them; TrialError where there is none."""
    paths = [Path(folder) for folder in folders]
    held, faults = _checked(paths)
    left = [
        f"{path} is left of a command that was interrupted; delete it, unless one runs now"
        for folder in paths
        for path in sorted(folder.glob(".*.json.partial-*"))
    ]
    return Checked(_sorted(held), tuple(faults), (*left, *_copies(held)))


def add(
    folder: Path | str,
    trials: Iterable[Trial] | Mapping[Trial, str],
    *,
    refuse_copies: bool = False,
) -> Added:
    """Add trials, or a mapping of them to what errors call each, to a folder, which may be new.

    Every file appears whole. Whatever interrupts it, what is there is good, and the same call again
    completes it. Several processes may add to one folder.

    Parameters
    ----------
    folder : Path or str
    trials : iterable of Trial, or mapping of Trial to str
    refuse_copies : bool
        Refuse a measured track that another trial has too, of these or of the folder.

    Raises
    ------
    TrialError
        Before anything is written: where the folder has a fault, or two trials, of these or of the
        folder, describe the same run differently.
    TypeError
        For what are no trials.
    """
    if not isinstance(trials, Mapping):
        trials = dict.fromkeys(several(trials), "a trial to add")
    return _add(Path(folder), trials, refuse_copies=refuse_copies)


def merge(into: Path | str, *others: Path | str) -> Added:
    """Add what other folders hold to a folder, as `add` does; errors name the files of both."""
    return _add(Path(into), _held(map(Path, others)))


def name_of(trial: Trial) -> str:
    """Return the name of a trial's file."""
    return trial.digest + ENDING


def _sorted(trials: Iterable[Trial]) -> tuple[Trial, ...]:
    return tuple(sorted(set(trials), key=lambda trial: trial.digest))


def _add(folder: Path, places: Mapping[Trial, object], *, refuse_copies: bool = False) -> Added:
    check_folder(folder, (), force=True)
    held = _held([folder]) if folder.is_dir() else {}
    told = {trial.run: trial for trial in held}
    given = _sorted(places)
    known = tuple(trial for trial in given if _is_same(trial, told.get(trial.run)))
    new = _sorted({*given} - {*known})
    every = {**held, **{trial: places[trial] for trial in new}}
    copies = _copies(every, known=held) if refuse_copies else ()
    for fault in (*_conflicts(every), *copies):
        raise TrialError(fault)
    folder.mkdir(exist_ok=True)
    try:
        for trial in new:  # whoever writes the same file meanwhile writes the same bytes
            write_file(folder / name_of(trial), trial.to_bytes(), force=True)
    except BaseException as stop:
        stop.add_note("the trials written so far are kept; the same command goes on")
        raise
    return Added(new, known)


def _is_same(trial: Trial, other: Trial | None) -> bool:
    """Return whether they say the same, be it read from another file."""
    if other is None or trial == other:
        return trial == other
    return replace(trial, provenance=other.provenance) == other


def _held(folders: Iterable[Path]) -> dict[Trial, Path]:
    """Return trials and their files; TrialError for the first fault."""
    held, faults = _checked(folders)
    if faults:
        others = f" ({len(faults) - 1} more: softvox trials check)" if len(faults) > 1 else ""
        raise TrialError(faults[0] + others)
    return held


def _checked(folders: Iterable[Path]) -> tuple[dict[Trial, Path], list[str]]:
    """Return trials and their files, and all faults."""
    held: dict[Trial, Path] = {}
    faults: list[str] = []
    for path in (path for folder in folders for path in _files(folder)):
        try:
            held.setdefault(_read(path), path)
        except TrialError as error:
            faults.append(str(error))
    return held, [*faults, *_conflicts(held)]


def _files(folder: Path) -> list[Path]:
    try:
        names = [path for path in folder.iterdir() if path.suffix == ENDING]
    except FileNotFoundError:
        raise TrialError(
            f"there is no folder {folder}; name one of trials, or make one: softvox trials add"
        ) from None
    except NotADirectoryError:
        raise TrialError(f"{folder} is a file; name the folder that it is in") from None
    except OSError as error:
        raise TrialError(f"{folder} can't be read ({error.strerror}); name another") from None
    return sorted(path for path in names if not path.name.startswith("."))


def _read(path: Path) -> Trial:
    """Read a file; TrialError that names it where it is no trial, or not named by its digest."""
    if path.exists() and not path.is_file():  # a pipe would keep us waiting
        raise TrialError(f"{path} is no file; take it out")
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
        trial = Trial.from_bytes(content)
    except OSError as error:
        raise TrialError(
            f"{path} can't be read ({error.strerror}); mend that, or take it out"
        ) from None
    except TrialError as error:
        raise TrialError(f"{path} {error}") from None
    if path.name != name_of(trial):
        raise TrialError(
            f"{path} holds another content than its name says; restore it, or, where the change is "
            f"meant, call it {name_of(trial)}"
        )
    return trial


def _pairs(
    places: Mapping[Trial, object], key: Callable[[Trial], Any]
) -> Iterator[tuple[Trial, Trial]]:
    """Yield every trial that has a key, not None, of an earlier one; and that."""
    first: dict[Any, Trial] = {}
    for trial in places:
        own = key(trial)
        if own is not None and (other := first.setdefault(own, trial)) != trial:
            yield trial, other


def _conflicts(places: Mapping[Trial, object]) -> Iterator[str]:
    """Yield a line for every trial of a run that another one describes as well."""
    for trial, other in _pairs(places, lambda trial: trial.run):
        yield (
            f"{places[trial]} and {places[other]} describe the same run differently "
            f"({_run(trial)}); if they are two runs, give one another repetition, otherwise keep "
            "one of them"
        )


def _run(trial: Trial) -> str:
    """Return what a person knows a run by."""
    facts = (trial.robot, trial.reality, trial.surface, trial.date, trial.who)
    number = str(called(trial.design))[:40]
    return ", ".join([number, *filter(None, facts), f"repetition {trial.repetition}"])


def _copies(places: Mapping[Trial, object], known: Container[Trial] = ()) -> Iterator[str]:
    """Yield a line for every trial, not known, whose measured track another one has too."""
    for trial, other in _pairs(places, _track):
        if trial not in known:
            yield (
                f"{places[trial]} and {places[other]} have the same track, and no two runs do; "
                "leave out the one that is not of its robot"
            )


def _track(trial: Trial) -> tuple[bytes, bytes] | None:
    """Return what two robots can't share; None where they may be alike by chance.

    That may simulated tracks, those of two points, read off a ruler, and robots that stay.
    """
    if trial.source == "simulated" or len(trial.cycle) < 3 or not trial.position.any():
        return None
    return trial.cycle.tobytes(), trial.position.tobytes()
