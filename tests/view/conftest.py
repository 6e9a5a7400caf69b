"""The page and a browser to meet it with, for the tests of `softvox explore`."""

import pytest
from chromium import STILL, WEBGL, chromium


@pytest.fixture(scope="session")
def page(tmp_path_factory):
    """Return the address of the page."""
    from softvox_view.explore.page import page

    path = tmp_path_factory.mktemp("explore") / "landscape.html"
    path.write_text(page(), "utf-8")
    return path.as_uri()


@pytest.fixture(scope="session")
def driver():
    """Return a browser that all tests of the app share: to start one takes seconds."""
    from explore_page import DESKTOP, sized

    with chromium(*WEBGL, *STILL, width=1300, height=900) as driver:
        sized(driver, *DESKTOP)
        yield driver
