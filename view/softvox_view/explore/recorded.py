"""Searchers' paths that were recorded: the runs in folders that `softvox compare` has written."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from softvox_gym import Design, landscape
from softvox_view.explore.landscapes import listed
from softvox_view.explore.requests import BadRequestError
from softvox_view.folders import ResultsError, by_name, checked

#: What is read of the runs.
COLUMNS = ("run", "searcher", "level", "policy", "seed", "status", "evaluations", "recommended")


@dataclass(frozen=True)
class Run:
    """A finished run.

    Parameters
    ----------
    number : int
        In the folder's tables.
    evaluations : int
        That it made.
    recommended : int
        The design that it recommends.
    """

    number: int
    evaluations: int
    recommended: int


@dataclass(frozen=True)
class Recorded:
    """The finished runs of a folder.

    Parameters
    ----------
    name : str
        What the page calls the folder.
    evaluations : Path
        The table of all evaluations.
    runs : dict of dict of Run
        By searcher, with the level of noise and the policy where there are such, and by seed.
    """

    name: str
    evaluations: Path
    runs: Mapping[str, Mapping[int, Run]]

    def run(self, searcher: str, seed: int) -> Run:
        """Return a run.

        Raises
        ------
        BadRequestError
            Where there is no such searcher, or it has no finished run with that seed.
        """
        runs = self.runs.get(searcher)
        if runs is None:
            raise BadRequestError(
                f"{self.name} has no searcher {searcher[:60]!r}; it has {', '.join(self.runs)}",
                "searcher",
            )
        if seed not in runs:
            raise BadRequestError(
                f"{searcher} has no finished run with the seed {seed} in {self.name}; "
                f"its {len(runs)} have seeds from {min(runs)} to {max(runs)}",
                "seed",
            )
        return runs[seed]

    def path(self, run: Run, most: int) -> dict[str, Any]:
        """Return a run's path ready for JSON.

        Parameters
        ----------
        run : Run
        most : int
            Evaluations to return, the first ones.

        Returns
        -------
        dict
            designs, fitness : what was evaluated, in order, repetitions included, and what the
            searcher was told; total : the evaluations of the whole run; recommended : the design
            that it recommended in the end; rank : of that one in the published landscape.
        """
        import pyarrow.parquet as pq

        from softvox_search.single import Standing

        wanted = [("run", "==", run.number), ("sequence", "<=", most)]
        rows = pq.read_table(
            self.evaluations, columns=["sequence", "design", "fitness"], filters=wanted
        ).sort_by("sequence")
        return {
            "designs": rows["design"].to_pylist(),
            "fitness": listed(rows["fitness"].to_numpy()),
            "total": run.evaluations,
            "recommended": run.recommended,
            "rank": Standing.of(Design(run.recommended), landscape()["fitness"]).rank,
        }


def read_all(folders: Sequence[Path]) -> dict[str, Recorded]:
    """Read what is to be known of folders of results beforehand, by name.

    Raises
    ------
    ResultsError
        Where one is no folder of finished results, or two have the same name.
    """
    return {name: read(folder) for name, folder in by_name(folders).items()}


def read(folder: Path) -> Recorded:
    """Read what is to be known of a folder of results beforehand.

    Raises
    ------
    ResultsError
        Where it is none, not finished, or without the table of evaluations.
    """
    table, evaluations = checked(folder) / "runs.csv", folder / "evaluations.parquet"
    for path in (table, evaluations):
        if not path.is_file():
            raise ResultsError(
                f"{folder} has no {path.name}, which softvox compare FILE.toml writes there"
            )
    _check_columns(evaluations, ("run", "sequence", "design", "fitness"))
    return Recorded(folder.resolve().name, evaluations, _runs(table))


def _check_columns(path: Path, columns: Sequence[str]) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    try:
        names = pq.read_schema(path).names
    except (OSError, pa.ArrowInvalid):
        names = []
    missing = [name for name in columns if name not in names]
    if missing:
        raise ResultsError(
            f"{path} lacks the column {missing[0]}; softvox compare FILE.toml --out {path.parent} "
            "--force writes it anew"
        )


def _runs(path: Path) -> dict[str, dict[int, Run]]:
    runs: dict[str, dict[int, Run]] = {}
    try:
        with path.open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                texts = {name: row[name] for name in COLUMNS}
                if texts["status"] != "ok":
                    continue
                run = Run(*(int(texts[name]) for name in ("run", "evaluations", "recommended")))
                Design(run.recommended)
                runs.setdefault(_name(texts), {})[int(texts["seed"])] = run
    except (KeyError, TypeError, ValueError, csv.Error) as error:
        raise ResultsError(
            f"{path} can't be read as the runs of softvox compare ({error}); "
            f"softvox compare FILE.toml --out {path.parent} --force writes it anew"
        ) from None
    if not runs:
        raise ResultsError(f"{path} holds no finished run; choose another folder")
    return runs


def _name(run: Mapping[str, str]) -> str:
    """Return what the page calls a cell of the experiment."""
    level = f"noise {run['level']}" if run["level"] else ""
    return " · ".join(part for part in (run["searcher"], level, run["policy"]) if part)
