"""What the browser tests of the app do on its page, and what they see there."""

import base64
import io
import json
import os
from functools import cache
from pathlib import Path

import numpy as np
from chromium import until

from softvox_gym import Physics, simulate
from softvox_view.tessellation import SIDE, cell_of

DESKTOP, WIDE, PHONE, SMALL = (1280, 800), (1920, 1080), (390, 844), (360, 740)

#: Where the pictures for the documentation go, if somebody wants them.
PICTURES = os.environ.get("SOFTVOX_PICTURES")


def sized(driver, width, height):
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)


#: Landscapes of this are done in a moment.
SHORT = {"settle_time": "0.01", "duration": "0.05"}
SHORT_STATE = "&".join(map("=".join, SHORT.items()))
SHORT_NUMBERS = {name: float(value) for name, value in SHORT.items()}


def loaded(driver, page, state=""):
    """Load the page anew."""
    driver.get("about:blank")
    driver.get_log("browser")
    driver.get_log("performance")
    driver.get(f"{page}#{state or 'design=6453'}")  # a first visit without would begin the story
    until(lambda: robots(driver))
    until(lambda: applied(driver) is not None)
    return driver


#: Takes back what no address tells.
AFRESH = """
const find = (id) => document.getElementById(id);
if (!find("story").hidden) find("story-end").click();
document.activeElement?.blur();
scrollTo(0, 0);
document.querySelector("#which input[value='design']").checked = true;
document.querySelector("#zoom :nth-child(3)").click();
for (const id of ["map", "map-b"]) find(id).dispatchEvent(new PointerEvent("pointerleave"));
"""
GO = """
history.replaceState(null, "", `#${arguments[0]}`);
dispatchEvent(new HashChangeEvent("hashchange"));
"""


def opened(driver, page, state=""):
    """Go to a state of the page as if from its first, and load it only where another is seen.

    The cell under the cursor stays.
    """
    if driver.current_url.partition("#")[0] != page:
        return loaded(driver, page, state)
    driver.get_log("browser")
    driver.execute_script(AFRESH + GO, "design=6453")
    if state:
        driver.execute_script(GO, state)
    until(lambda: applied(driver) is not None)
    return driver


def opened_short(driver, page, state=""):
    """Open the page with a landscape that others are soon computed beside."""
    opened(driver, page, "&".join(filter(None, [state, SHORT_STATE])))
    until(lambda: applied(driver) == SHORT)


def shown(driver, name, what="textContent"):
    return driver.execute_script(f"return document.getElementById('{name}').{what}")


def robots(driver):
    """Return the numbers of the designs that are shown in motion, as a text."""
    return shown(driver, "robot-panel", "dataset.designs")


def applied(driver):
    """Return the parameters that the map was computed with."""
    text = driver.execute_script("return document.body.dataset.parameters")
    return None if text is None else json.loads(text)


def one(driver, selector):
    return driver.find_element("css selector", selector)


def entered(driver, selector, text):
    """Type into a field in place of what is there."""
    from selenium.webdriver import Keys

    one(driver, selector).send_keys(Keys.CONTROL + "a", Keys.NULL, text, Keys.ENTER)


def mouse(driver, design):
    """Return a mouse on its way to a design's cell."""
    from selenium.webdriver import ActionChains

    canvas = one(driver, "#map")
    driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", canvas)
    row, column = (int(place) for place in cell_of(design))
    side = canvas.size["width"]
    offsets = [round(side * ((place + 0.5) / SIDE - 0.5)) for place in (column, SIDE - 1 - row)]
    return ActionChains(driver, duration=0).move_to_element_with_offset(canvas, *offsets)


def facts(driver, table="facts"):
    """Return the rows of a table by name."""
    rows = driver.execute_script(
        "return [...document.querySelectorAll(`#${arguments[0]} tr`)].map("
        "row => [...row.children].map(cell => cell.textContent))",
        table,
    )
    return {name: told for name, *told in rows}


@cache
def fitness_with(**changes):
    """Return the fitness of all designs with changes to SHORT, from the native engine."""
    physics = Physics.of({"preset": "published", **SHORT_NUMBERS, **changes})
    return simulate(np.arange(6561), physics).fitness


def map_pixels(driver):
    url = shown(driver, "map", "toDataURL()")
    from PIL import Image

    content = base64.b64decode(url.removeprefix("data:image/png;base64,"))
    return np.asarray(Image.open(io.BytesIO(content)).convert("RGB")).astype(float)


def cell_colours(driver):
    """Return the colour in the middle of every design's cell, while the whole map is seen."""
    pixels = map_pixels(driver)
    row, column = cell_of(np.arange(6561))
    middle = ((np.arange(SIDE) + 0.5) * len(pixels) / SIDE).astype(int)
    return pixels[middle[SIDE - 1 - row], middle[column]]


def kept(driver, name):
    """Keep a picture for the documentation."""
    if PICTURES:
        (Path(PICTURES) / name).write_bytes(driver.get_screenshot_as_png())
