"""A headless Chromium for tests of pages; they are skipped where it is not installed."""

import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pytest

FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
    "--force-device-scale-factor=1",
]

#: Drawn by the processor, so that the pictures need no graphics card; edges are smoothed for the
#: pictures that are kept alone, as that takes a fifth of the time.
WEBGL = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
if "SOFTVOX_PICTURES" not in os.environ:
    WEBGL.append("--webgl-msaa-sample-count=0")
NO_WEBGL = ["--disable-3d-apis"]

#: Robots stand still until played: drawing them would keep all processors busy.
STILL = ["--force-prefers-reduced-motion"]

PATIENCE = 90  # s: the machine may do much else

STARTED = count()  # browsers, of this process

MISSING = [name for name in ("chromium", "chromedriver") if shutil.which(name) is None] + [
    name for name in ("selenium",) if find_spec(name) is None
]

needs_chromium = pytest.mark.skipif(
    bool(MISSING),
    reason=f"{', '.join(MISSING)} not found: apt-get install chromium chromium-driver, "
    "pip install 'softvox-gym[browser-test]'",
)


@contextmanager
def chromium(*flags: str, width: int = 900, height: int = 640) -> Iterator[Any]:
    """Yield a driver of a browser with a profile of its own."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = str(shutil.which("chromium"))
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    # Not a port of those that systems give away: it could be somebody's else before it is used.
    # Each browser of a process has its own, or to end one would end another's driver.
    port = 10_000 + (os.getpid() + 5_003 * next(STARTED)) % 20_000
    service = webdriver.ChromeService(str(shutil.which("chromedriver")), port=port)
    with TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        own = [f"--window-size={width},{height}", f"--user-data-dir={profile}"]
        for flag in (*FLAGS, *flags, *own):
            options.add_argument(flag)
        driver = webdriver.Chrome(options=options, service=service)
        try:
            yield driver
        finally:
            driver.quit()


def until(condition: Callable[[], Any]) -> Any:
    """Wait for something that does not fail and is not false, and return it."""
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        if found := condition():
            return found
        time.sleep(0.03)
    raise AssertionError("waited in vain")


def opened(driver: Any, path: Path) -> None:
    """Open a file, what earlier pages logged being forgotten."""
    driver.get("about:blank")
    driver.get_log("browser")
    driver.get_log("performance")
    driver.get(path.as_uri())


def errors(driver: Any) -> list[str]:
    """Return what went wrong on the page, as its console says."""
    return [entry["message"] for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]


def requests(driver: Any) -> list[str]:
    """Return the addresses that pages asked for, but those that hold their content themselves."""
    import json

    messages = [json.loads(row["message"])["message"] for row in driver.get_log("performance")]
    asked = [
        message["params"]["request"]["url"]
        for message in messages
        if message["method"] == "Network.requestWillBeSent"
    ]
    return [address for address in asked if not address.startswith("data:")]
