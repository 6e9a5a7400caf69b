"""A database of trials: a folder of their files, each named by the digest of its content.

It holds nothing else, and no index: you merge two labs' folders by copying files, and the files
alone define a folder's content. docs/trials-database.md describes both.
"""

from __future__ import annotations

from collections.abc import Callable, Container, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from softvox_gym.design import called
from softvox_gym.files import PARTIAL, check_folder, write_file
from softvox_gym.trials.trial import MOST_BYTES, Trial, TrialError, several

#: How the files' names end.
ENDING = ".json"


class Checked(NamedTuple):
    """The findings of `check` in some folders."""

    trials: tuple[Trial, ...]  #: The valid trials, sorted by digest, each once.
    faults: tuple[str, ...]  #: Lines that name the file and the remedy.
    doubts: tuple[str, ...]  #: Lines about trials that may be correct but look suspicious.


class Added(NamedTuple):
    """The trials given to `add` or `merge`, sorted by digest, each once."""

    new: tuple[Trial, ...]  #: The trials that were written.
    known: tuple[Trial, ...]  #: Those already there, perhaps of other provenance.


def shipped() -> Path:
    """Return the folder of the trials that ship with the package."""
    return Path(__file__).parents[1] / "data" / "trials"


def read(*folders: Path | str) -> tuple[Trial, ...]:
    """Return the trials of some folders, sorted by digest, each once.

    Ignores hidden files and files whose names don't end in .json.

    Raises
    ------
    TrialError
        For the first fault that `check` finds, or if a folder does not exist.
    """
    return _sorted(_held(map(Path, folders)))


def check(*folders: Path | str) -> Checked:
    """Return all faults in folders, and between them; TrialError if a folder does not exist."""
    paths = [Path(folder) for folder in folders]
    held, faults = _checked(paths)
    left = [
        f"{path} is left from an interrupted command; delete it, unless a command is running"
        for folder in paths
        for path in sorted(folder.glob(PARTIAL))
    ]
    return Checked(_sorted(held), tuple(faults), (*left, *_copies(held)))


def add(
    folder: Path | str,
    trials: Iterable[Trial] | Mapping[Trial, object],
    *,
    refuse_copies: bool = False,
) -> Added:
    """Add trials, or a mapping from trials to their names in errors, to a folder, even a new one.

    Every file is written completely or not at all. After an interruption the existing files are
    valid, and the same call completes the work. Several processes may add to one folder.

    Parameters
    ----------
    folder : Path or str
    trials : iterable of Trial, or mapping of Trial to str or Path
    refuse_copies : bool
        Refuse a measured track that another trial, given or in the folder, has too.

    Raises
    ------
    TrialError
        Before anything is written, if the folder has a fault, or two trials, given or in the
        folder, describe the same run differently.
    TypeError
        If something else than trials is given.
    """
    folder = Path(folder)
    places: Mapping[Trial, object] = (
        trials if isinstance(trials, Mapping) else dict.fromkeys(several(trials), "a trial to add")
    )
    check_folder(folder, (), force=True)
    held = _held([folder]) if folder.is_dir() else {}
    told = {trial.run: trial for trial in held}
    given = _sorted(places)
    known = tuple(one for one in given if one.run in told and _is_same(one, told[one.run]))
    new = _sorted({*given} - {*known})
    every = {**held, **{trial: places[trial] for trial in new}}
    copies = _copies(every, known=held) if refuse_copies else ()
    for fault in (*_conflicts(every), *copies):
        raise TrialError(fault)
    folder.mkdir(exist_ok=True)
    try:
        for trial in new:  # another process that writes this file meanwhile writes the same bytes
            write_file(folder / name_of(trial), trial.to_bytes(), force=True)
    except BaseException as stop:
        stop.add_note("the trials written so far are kept; the same command goes on")
        raise
    return Added(new, known)


def merge(into: Path | str, *others: Path | str) -> Added:
    """Add the trials of other folders to a folder, as `add` does; errors name both files."""
    return add(into, _held(map(Path, others)))


def name_of(trial: Trial) -> str:
    """Return the name of a trial's file."""
    return trial.digest + ENDING


def _sorted(trials: Iterable[Trial]) -> tuple[Trial, ...]:
    return tuple(sorted(set(trials), key=lambda trial: trial.digest))


def _is_same(trial: Trial, other: Trial) -> bool:
    """Return whether two trials have the same facts, even if read from different files."""
    return trial == other or replace(trial, provenance=other.provenance) == other


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
            f"there is no folder {folder}; name another, or make it with softvox trials add"
        ) from None
    except NotADirectoryError:
        raise TrialError(f"{folder} is a file; name its folder") from None
    except OSError as error:
        raise TrialError(f"{folder} can't be read ({error.strerror}); name another") from None
    return sorted(path for path in names if not path.name.startswith("."))


def _read(path: Path) -> Trial:
    """Read a file; TrialError that names it if it is no trial or is not named by its digest."""
    if path.exists() and not path.is_file():  # reading a pipe could block
        raise TrialError(f"{path} is not a file; remove it")
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
        trial = Trial.from_bytes(content)
    except OSError as error:
        raise TrialError(
            f"{path} can't be read ({error.strerror}); make it readable, or remove it"
        ) from None
    except TrialError as error:
        raise TrialError(f"{path} {error}") from None
    if path.name != name_of(trial):
        raise TrialError(
            f"{path} has content that does not match its name; restore it, or, if the change is "
            f"intended, rename it to {name_of(trial)}"
        )
    return trial


def _pairs(
    places: Mapping[Trial, object], key: Callable[[Trial], Any]
) -> Iterator[tuple[Trial, Trial]]:
    """Yield every trial whose key (other than None) an earlier trial has, and that trial."""
    first: dict[Any, Trial] = {}
    for trial in places:
        own = key(trial)
        if own is not None and (other := first.setdefault(own, trial)) != trial:
            yield trial, other


def _conflicts(places: Mapping[Trial, object]) -> Iterator[str]:
    """Yield a line for every trial whose run another trial describes too."""
    for trial, other in _pairs(places, lambda trial: trial.run):
        yield (
            f"{places[trial]} and {places[other]} describe the same run differently "
            f"({_run(trial)}); if they are two runs, change the repetition of one, otherwise keep "
            "one of them"
        )


def _run(trial: Trial) -> str:
    """Return a description of a run."""
    facts = (trial.robot, trial.reality, trial.surface, trial.date, trial.who)
    number = str(called(trial.design))[:40]
    return ", ".join([number, *filter(None, facts), f"repetition {trial.repetition}"])


def _copies(places: Mapping[Trial, object], known: Container[Trial] = ()) -> Iterator[str]:
    """Yield a line for every new trial whose measured track another one has too."""
    for trial, other in _pairs(places, _track):
        if trial not in known:
            yield (
                f"{places[trial]} and {places[other]} have the same track, which no two runs do; "
                "leave out the one that is attributed to the wrong robot"
            )


def _track(trial: Trial) -> tuple[bytes, bytes] | None:
    """Return a key that two robots can't share; None if tracks may agree by chance.

    Simulated tracks may, tracks of two points (read off a ruler), and robots that stay in place.
    """
    if trial.source == "simulated" or len(trial.cycle) < 3 or not trial.position.any():
        return None
    return trial.cycle.tobytes(), trial.position.tobytes()
