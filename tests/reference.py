"""The measured data that every engine is held against."""

import csv
import json
from importlib.resources import files
from typing import Any

FOLDER = files("softvox_gym") / "reference"


def rows(name: str) -> list[dict[str, str]]:
    with (FOLDER / name).open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def document(name: str) -> Any:
    return json.loads((FOLDER / name).read_text(encoding="utf-8"))


# Rows of variants.csv that no engine but the authors' own can match, as (variant, design). These
# robots are mirror symmetric and fall to a side that the last bit decides: of 200 runs whose voxels
# start a random 2e-16 of an edge away, dx of (clamp, 6453) spreads over 0.15 and of (clamp, 5455)
# over 0.9. What can be compared is the fitness, to within its spread over such runs.
CHAOTIC = {("clamp", "6453"): 2e-3, ("clamp", "5455"): 0.1}
