"""The app and a browser to meet it with, for the tests of `softvox explore`."""

import pytest
from chromium import STILL, WEBGL, chromium


@pytest.fixture(scope="module")
def served():
    from explore_serving import serving  # needs what the module asked for

    with serving() as running:
        yield running


@pytest.fixture(scope="module")
def driver():
    from explore_page import DESKTOP, sized

    with chromium(*WEBGL, *STILL, width=1300, height=900) as driver:
        sized(driver, *DESKTOP)
        yield driver
