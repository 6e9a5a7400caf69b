"""The page: one file with the engine, the tables and all else; it asks the network for nothing."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

from softvox_gym import Physics, engine, realities
from softvox_gym.physics import (
    ACTUATIONS,
    MOST,
    PRESETS,
    SPECS,
    STEPS_PER_CYCLE,
    ParameterSpec,
)
from softvox_view import replay

if TYPE_CHECKING:
    pass


def known() -> dict[str, Any]:
    """Return what the page knows of the physics, ready for JSON."""
    presets = {name: Physics.preset(name) for name in PRESETS}
    worlds = {one.name: one.physics for one in realities().values() if one.is_plain}
    return {
        "specs": [_spec(spec) for spec in SPECS],
        "presets": {name: made.to_dict() for name, made in {**presets, **worlds}.items()},
        "actuations": ACTUATIONS,
        "parameters": engine.PARAMETERS.names,
        "stepsPerCycle": STEPS_PER_CYCLE,
        "mostSteps": MOST,
        "style": replay.looks(),
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
    }
