"""A database of trials: a folder of their files, each named by the digest of its content.

Nothing else is kept in it, no index: two labs' folders are merged by copying files, and what a
folder holds is what its files say. docs/trials-database.md describes both.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from softvox_gym.files import OutputError, write_file
from softvox_gym.trials.trial import MOST_BYTES, Trial, TrialError

#: Of the files' names.
ENDING = ".json"


class Added(NamedTuple):
    """What `add` was given, each trial once, sorted by digest."""

    #: Those that it has written.
    new: tuple[Trial, ...]
    #: Those that the folder held already.
    known: tuple[Trial, ...]


def shipped() -> Path:
    """Return the folder of the trials that ship with the package."""
    return Path(__file__).parents[1] / "data" / "trials"


def read(*folders: Path) -> tuple[Trial, ...]:
    """Read the trials of some folders.

    Files whose names don't end in .json are left alone, and hidden ones.

    Returns
    -------
    tuple of Trial
        Sorted by digest, each once.

    Raises
    ------
    TrialError
        At the first fault, naming the file and the remedy; also where two trials tell one run.
    """
    held: dict[Trial, Path] = {}
    for folder in folders:
        for path in _files(folder):
            held.setdefault(_read(path), path)
    for fault in _told_twice(held):
        raise TrialError(fault)
    return _sorted(held)


def faults(folder: Path) -> list[str]:
    """Return every fault of a folder, a line each that names the file and the remedy.

    Raises
    ------
    TrialError
        Where there is no such folder.
    """
    held: dict[Trial, Path] = {}
    found: list[str] = []
    for path in _files(folder):
        try:
            held[_read(path)] = path
        except TrialError as error:
            found.append(str(error))
    return [*found, *_told_twice(held)]


def add(folder: Path, trials: Iterable[Trial]) -> Added:
    """Add trials to a folder, which is made where there is none.

    Every file appears whole. Whatever interrupts it, what is there is good, and the same call again
    completes it.

    Raises
    ------
    TrialError
        Before anything is written: where the folder has a fault, or a trial tells a run otherwise
        than another one, of these or of the folder.
    softvox_gym.files.OutputError
        Where the folder can't be written to.
    """
    given = _sorted(trials)
    held = {trial: folder / name_of(trial) for trial in read(folder)} if folder.exists() else {}
    places = {trial: Path(name_of(trial)) for trial in given} | held
    for fault in _told_twice(places):
        raise TrialError(fault)
    new = tuple(trial for trial in given if trial not in held)
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(f"{folder} can't be made ({error.strerror}); choose another") from None
    for trial in new:  # whoever writes the same file meanwhile writes the same bytes
        write_file(folder / name_of(trial), trial.to_bytes(), force=True)
    return Added(new, tuple(trial for trial in given if trial in held))


def merge(into: Path, *others: Path) -> Added:
    """Add what other folders hold to a folder, as `add` does."""
    return add(into, read(*others))


def name_of(trial: Trial) -> str:
    """Return the name of a trial's file."""
    return trial.digest + ENDING


def _sorted(trials: Iterable[Trial]) -> tuple[Trial, ...]:
    return tuple(sorted(set(trials), key=lambda trial: trial.digest))


def _files(folder: Path) -> Iterator[Path]:
    if not folder.is_dir():
        is_there = folder.exists()
        raise TrialError(
            f"{folder} is {'a file' if is_there else 'not there'}; name a folder of trials, or "
            "make one with softvox trials add"
        )
    yield from sorted(
        path for path in folder.iterdir() if path.suffix == ENDING and not path.name.startswith(".")
    )


def _read(path: Path) -> Trial:
    """Read a file; TrialError that names it where it is no trial, or not named by its digest."""
    try:
        with path.open("rb") as file:
            content = file.read(MOST_BYTES + 1)
        trial = Trial.from_bytes(content)
    except OSError as error:
        raise TrialError(f"{path} can't be read ({error.strerror}); take it out") from None
    except TrialError as error:
        raise TrialError(f"{path}: {error}") from None
    if path.name != name_of(trial):
        raise TrialError(
            f"{path}: its content is another than its name says; restore it, or, where the change "
            f"is meant, call it {name_of(trial)}"
        )
    return trial


def _told_twice(places: Mapping[Trial, Path]) -> Iterator[str]:
    """Yield a line for every trial that tells a run which another one tells otherwise."""
    first: dict[tuple[Any, ...], Trial] = {}
    for trial, path in places.items():
        other = first.setdefault(trial.run, trial)
        if other != trial:
            yield (
                f"{path} and {places[other]} tell one run otherwise (design, conditions, date, who "
                "and repetition are the same); number repetitions on, or keep one of the files"
            )
