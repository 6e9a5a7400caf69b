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

from softvox_gym import Design, Lattice
from softvox_gym.files import write_file
from softvox_search.experiment.results import Results, write_csv
from softvox_search.report.curves import groups, improvements

#: The version of the format.
VERSION = "0.3.17"


def ioh(results: Results, out: Path) -> list[str]:
    """Write results for IOHprofiler: a folder per algorithm, which is a searcher with its policy.

    A function is a level of noise, an instance is a physics and a shape (instances.csv lists them),
    and the dimension is the number of sites. The data of each run has the evaluations that improved
    on all before them, by the value that the searcher was told, and the last one. The folder must
    exist.

    Returns the written files, relative to the folder.

    Raises
    ------
    ResultsError
        If the file of a run is missing or damaged.
    OutputError, OSError
        If something can't be written.
    """
    problems = results.problems
    levels = list(dict.fromkeys(problem.level for problem in problems))
    instances = list(dict.fromkeys((one.physics, str(one.shape)) for one in problems))
    written = ["instances.csv"]
    rows = [
        {"instance": number, "physics": physics, "shape": shape}
        for number, (physics, shape) in enumerate(instances, start=1)
    ]
    write_csv(out / written[0], list(rows[0]), rows)
    done = results.runs[results.runs["status"] == "ok"]
    folders: set[str] = set()
    for (searcher, policy), runs in groups(done, "searcher", "policy"):
        algorithm = f"{searcher}, {policy}" if policy else str(searcher)
        folder = _folder_name(algorithm, folders)
        for function, level in enumerate(levels, start=1):
            here = runs[runs["level"].isna() if level is None else runs["level"] == level]
            name = "SoftVox" if level is None else f"SoftVox_noise_{level:g}"
            head = f"{folder}/IOHprofiler_f{function}_{name}.json"
            scenarios, data = [], {}
            sites = here["shape"].map(lambda shape: Lattice.named(shape).sites)
            for (number,), own in sorted(groups(here.assign(sites=sites), "sites")):
                path = f"data_f{function}_{name}/IOHprofiler_f{function}_DIM{number}.dat"
                parts = [_run(results, row, instances) for row in own.to_dict("records")]
                data[path] = "".join(text for text, _ in parts)
                facts = [fact for _, fact in parts]
                scenarios.append({"dimension": int(number), "path": path, "runs": facts})
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
            files = {f"{folder}/{path}": text for path, text in data.items()}
            for path, text in {**files, head: json.dumps(meta, indent=1) + "\n"}.items():
                (out / path).parent.mkdir(parents=True, exist_ok=True)
                write_file(out / path, text.encode(), force=True)
                written.append(path)
    return written


def _run(
    results: Results, row: Any, instances: list[tuple[str, str]]
) -> tuple[str, dict[str, Any]]:
    """Return the rows of a run's data file, and its entry in the JSON file."""
    log = results.evaluations(row["run"])
    at, values = improvements(log["sequence"], log["fitness"])
    best = {"evals": int(at[-1]), "y": float(values[-1])}
    lines = [f"{i} {float(value)!r}" for i, value in zip(at, values, strict=True)]
    if at[-1] < len(log["fitness"]):
        lines.append(f"{log['sequence'][-1]} {float(log['fitness'][-1])!r}")
    design = Design(log["design"][at[-1] - 1], shape=Lattice.named(row["shape"]))
    facts = {
        "instance": 1 + instances.index((row["physics"], row["shape"])),
        "evals": int(row["evaluations"]),
        "best": {**best, "x": [int(digit) for digit in design.digits]},
    }
    return "\n".join(["evaluations raw_y", *lines]) + "\n", facts


def _folder_name(text: str, taken: set[str]) -> str:
    """Return a text as a valid folder name that is not yet taken, and take it."""
    made = name = re.sub(r"[^\w.=+-]+", "_", text).strip("_.") or "_"
    number = 1
    while made.lower() in taken:  # some file systems ignore case
        made, number = f"{name}_{number}", number + 1
    taken.add(made.lower())
    return made
