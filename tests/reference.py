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


# Rows of variants.csv that no engine but the authors' own can match: a difference of the last bit
# grows to what is seen here.
CHAOTIC = {("clamp", "5455"), ("clamp", "6453"), ("frequency_5", "3275")}
