"""Landscapes drawn at random in the place of those that take seconds to simulate."""

import numpy as np
import pytest

from softvox_gym import Physics
from softvox_search.transfer import simulator


@pytest.fixture
def cheap_models(monkeypatch):
    """Let every physics but the published have a made-up landscape, the same each time."""
    simulate, made = simulator._landscape, {}

    def landscape(physics):
        if physics == Physics.published():
            return simulate(physics)
        if physics not in made:
            rng = np.random.default_rng(round(1e9 * float(physics.friction_static)) + len(made))
            made[physics] = rng.normal(size=(6561, 3))
        return made[physics]

    simulator._stack.cache_clear()
    monkeypatch.setattr(simulator, "_landscape", landscape)
    yield landscape
    simulator._stack.cache_clear()
