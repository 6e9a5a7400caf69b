"""Results in the format of IOHprofiler, which IOHanalyzer and iohinspector read.

Source: C. Doerr, H. Wang, F. Ye, S. van Rijn, T. Bäck, *IOHprofiler: a benchmarking and profiling
tool for iterative optimization heuristics*, arXiv:1810.05281, 2018; the JSON files as
IOHexperimenter 0.3 writes them.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np

from softvox_gym import Design
from softvox_gym.files import write_file
from softvox_search.experiment.results import Results, write_csv
from softvox_search.experiment.schema import Problem

#: The version of the format.
VERSION = "0.3.17"


def ioh(results: Results, out: Path) -> list[str]:
    """Write results as IOHprofiler's: a folder per algorithm, a searcher with its policy.

    A function is a level of noise, an instance is a physics and a shape (instances.csv lists
    them), the dimension is the number of sites. Of each run there are the evaluations that
    improved on all before them by the value that the searcher was told, and the last one.

    Parameters
    ----------
    results : Results
    out : Path
        An existing folder.

    Returns
    -------
    list of str
        The files written, relative to the folder.

    Raises
    ------
    ResultsError
        Where the file of a run is missing or damaged.
    OutputError, OSError
        Where something can't be written.
    """
    problems = results.problems
    levels = list(dict.fromkeys(problem.level for problem in problems))
    instances = list(dict.fromkeys((one.physics, str(one.shape)) for one in problems))
    written = ["instances.csv"]
    write_csv(
        out / written[0],
        ("instance", "physics", "shape"),
        [(number, *names) for number, names in enumerate(instances, start=1)],
    )
    done = results.runs[results.runs["status"] == "ok"]
    for (searcher, policy), runs in done.groupby(["searcher", "policy"], sort=False):
        algorithm = f"{searcher}, {policy}" if policy else str(searcher)
        for function, level in enumerate(levels, start=1):
            here = [problem for problem in problems if problem.level == level]
            name = "SoftVox" if level is None else f"SoftVox_noise_{level:g}"
            head = f"{_file_name(algorithm)}/IOHprofiler_f{function}_{name}.json"
            scenarios, data = [], {}
            for sites in sorted({problem.shape.sites for problem in here}):
                path = f"data_f{function}_{name}/IOHprofiler_f{function}_DIM{sites}.dat"
                parts = [
                    _run(results, row, problem, instances)
                    for problem in here
                    if problem.shape.sites == sites
                    for row in _of(runs, problem)
                ]
                data[path] = "".join(text for text, _ in parts)
                facts = [fact for _, fact in parts]
                scenarios.append({"dimension": sites, "path": path, "runs": facts})
            meta = {
                "version": VERSION,
                "suite": "softvox-gym",
                "function_id": function,
                "function_name": name,
                "maximization": True,
                "algorithm": {"name": algorithm, "info": results.command},
                "attributes": ["evaluations", "raw_y"],
                "scenarios": scenarios,
            }
            files = {f"{Path(head).parent}/{path}": text for path, text in data.items()}
            for path, text in {**files, head: json.dumps(meta, indent=1) + "\n"}.items():
                (out / path).parent.mkdir(parents=True, exist_ok=True)
                write_file(out / path, text.encode(), force=True)
                written.append(path)
    return written


def _of(runs: Any, problem: Problem) -> list[Any]:
    """Return the rows of the runs on a problem."""
    level = runs["level"].isna() if problem.level is None else runs["level"] == problem.level
    here = (runs["physics"] == problem.physics) & (runs["shape"] == str(problem.shape)) & level
    return list(runs[here].itertuples())


def _run(
    results: Results, row: Any, problem: Problem, instances: list[tuple[str, str]]
) -> tuple[str, dict[str, Any]]:
    """Return the rows of a run's data file, and what the JSON file says of it."""
    log = results.evaluations(row.run)
    values = log["fitness"]
    best = np.maximum.accumulate(values)
    improves = np.concatenate([[True], values[1:] > best[:-1]])
    kept = np.flatnonzero(improves | (np.arange(len(values)) == len(values) - 1))
    lines = [f"{log['sequence'][i]} {float(values[i])!r}" for i in kept]
    found = int(np.argmax(values))
    design = log["design"][found]
    key = design if isinstance(design, str) else int(design)
    digits = Design(key, shape=problem.shape).digits
    facts = {
        "instance": 1 + instances.index((problem.physics, str(problem.shape))),
        "evals": int(row.evaluations),
        "best": {
            "evals": int(log["sequence"][found]),
            "y": float(values[found]),
            "x": [int(digit) for digit in digits],
        },
    }
    return "\n".join(["evaluations raw_y", *lines]) + "\n", facts


def _file_name(text: str) -> str:
    """Return a text as the name of a folder."""
    return re.sub(r"[^\w.=+-]+", "_", text).strip("_.") or "_"
