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
