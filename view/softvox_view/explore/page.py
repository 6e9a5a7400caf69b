"""The page: one file with the engine, the tables and the player; it makes no network requests."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.resources import files
from math import isfinite
from typing import TYPE_CHECKING, Any

import numpy as np

import softvox_gym
from softvox_gym import Physics, engine, noisy_landscape, realities
from softvox_gym.landscapes.analysis.symmetry import symmetry_classes
from softvox_gym.physics import (
    ACTUATIONS,
    MOST,
    PRESETS,
    SPECS,
    STEPS_PER_CYCLE,
    Bounds,
    ParameterSpec,
)
from softvox_view import replay
from softvox_view.explore.paths import packed, recorded
from softvox_view.explore.trials import told
from softvox_view.replay.data import looks
from softvox_view.replay.page import MODULES as PLAYER
from softvox_view.replay.page import filled, in_script, joined, template
from softvox_view.tessellation import SIDE, design_at

if TYPE_CHECKING:
    from softvox_gym.trials import Trial
    from softvox_search.experiment.results import Results

#: The modules; each imports only earlier ones.
MODULES = [
    f"{name}.js"
    for name in (
        *("physics", "engine", "recording", "simulator", "search"),
        *("world", "page", "colours", "robot", "panels", "zoom", "sheet", "map", "legend"),
        *("curve", "paths", "controls", "versus", "finder", "trials", "story", "app"),
    )
]


def page(results: Mapping[str, Results] | None = None, trials: Sequence[Trial] = ()) -> str:
    """Return the page as HTML, with paths of recorded runs, by folder name, and trials."""
    texts = [*(_asset(name, "replay") for name in PLAYER), *map(_asset, MODULES)]
    parts = {
        "style": replay.style() + _asset("app.css"),
        "data": in_script({**_data(results or {}), "trials": told(trials)}),
        "script": joined(texts),
    }
    return filled(_asset("index.html"), parts)


def known() -> dict[str, Any]:
    """Return the facts about the physics for the page, ready for JSON."""
    presets = {name: Physics.preset(name) for name in PRESETS}
    worlds = {one.name: one.physics for one in realities().values() if one.is_plain}
    degrees = Bounds("between -80 and 80 degrees", -80, 80, "[]")  # upright, it holds no robot
    tilts = (
        ParameterSpec(0.0, "°", degrees, "tilt of the floor", slider=(0, 30, 0.5), name="tilt"),
        ParameterSpec(
            *(0.0, "°", Bounds("between -360 and 360 degrees", -360, 360, "[]")),
            *("downhill towards", None, (-180, 180, 5)),
            name="downhill",
        ),
    )
    return {
        "specs": [_spec(spec) for spec in SPECS],
        "tilts": [_spec(spec) for spec in tilts],
        "presets": {name: made.to_dict() for name, made in {**presets, **worlds}.items()},
        "actuations": ACTUATIONS,
        "parameters": engine.PARAMETERS.names,
        "stepsPerCycle": STEPS_PER_CYCLE,
        "mostSteps": MOST,
        "style": looks(),
    }


def _spec(spec: ParameterSpec) -> dict[str, Any]:
    kinds = {bool: "flag", str: "choice"}
    words, low, high, ends = spec.bounds
    return {
        "name": spec.name,
        "kind": kinds.get(type(spec.default), "number"),
        "words": words,
        "low": low if isfinite(low) else None,
        "high": high if isfinite(high) else None,
        "ends": ends,
        "label": spec.about.partition(",")[0].capitalize(),
        "unit": spec.unit.replace("^2", "²"),
        "slider": spec.slider,
    }


def _data(results: Mapping[str, Results]) -> dict[str, Any]:
    """Return all data of the page, ready for JSON."""
    table = softvox_gym.landscape()
    row, column = np.divmod(np.arange(len(table)), SIDE)
    noise = noisy_landscape(1.0)["mean"]
    tables = {
        "cells": design_at(row, column).astype("<u2"),
        "classes": symmetry_classes().astype("<u2"),
        "is_connected": table["is_connected"].astype("u1"),
        **{name: table[name].astype("<f8") for name in ("dx", "dy", "step_error")},
        "noise": noise.astype("<f8"),
    }
    return {
        "version": softvox_gym.__version__,
        "known": known(),
        "tables": {name: packed(values) for name, values in tables.items()},
        "results": {name: recorded(found) for name, found in results.items()},
        "engine": packed(files(__package__).joinpath("assets", "engine.wasm").read_bytes()),
        "replay": packed(template(speed=replay.SPEED, autoplay=True).encode()),
    }


def _asset(name: str, package: str = "explore") -> str:
    return files(f"softvox_view.{package}").joinpath("assets", name).read_text(encoding="utf-8")
