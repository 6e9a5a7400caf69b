"""What all tests share."""

import pytest


@pytest.fixture(autouse=True, scope="session")
def own_cache(tmp_path_factory):
    """Keep the landscapes that tests compute out of the user's cache."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOFTVOX_CACHE", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture(scope="session")
def published_result():
    """Return all designs under the published physics, track and energy too, simulated once."""
    import numpy as np

    from softvox_gym import simulate

    return simulate(np.arange(6561), track=1, energy=True)
