"""The map's scale, the part of it that is seen, and searchers' paths on it."""

import re
import time

import numpy as np
import pytest
from chromium import errors, needs_chromium, until
from explore_page import (
    DESKTOP,
    PHONE,
    cell_colours,
    loaded,
    map_pixels,
    mouse,
    one,
    opened,
    robots,
    shown,
    sized,
)

import softvox_gym
from softvox_view.tessellation import SIDE, cell_of

pytest.importorskip("PIL.Image")

pytestmark = needs_chromium

OPTIMUM = 6453


def seen(driver):
    """Return left, bottom and span of what the map shows, in cells."""
    return np.array([float(part) for part in shown(driver, "map", "dataset.window").split()])


def wheel(driver, turns, across=0.5, up=0.5):
    """Turn the wheel over a place of the map, a share of it to the right and upward."""
    time.sleep(0.25)  # the page may have scrolled just now
    driver.execute_script(
        """const map = document.getElementById("map"), box = map.getBoundingClientRect();
        const [turns, across, up] = arguments;
        const [x, y] = [box.left + across * box.width, box.bottom - up * box.height];
        for (let k = 0; k < Math.abs(turns); k++) {
          const deltaY = -100 * Math.sign(turns);
          const turn = { deltaY, clientX: x, clientY: y, cancelable: true };
          map.dispatchEvent(new WheelEvent("wheel", turn));
        }""",
        turns,
        across,
        up,
    )


def pressed(driver, identity):
    """Click a switch, and wait until the page took it on."""
    before = driver.current_url
    one(driver, f"#{identity}").click()
    until(lambda: driver.current_url != before)


def test_a_scale_that_is_locked_is_in_the_address_and_for_maps_of_its_kind(driver, page):
    from selenium.webdriver.support.ui import Select

    opened(driver, page)
    pressed(driver, "lock")
    top = float(re.search(r"lock=fitness%3A([\d.]+)", driver.current_url)[1])
    assert 0 <= top - softvox_gym.landscape()["fitness"].max() < 1e-4
    Select(one(driver, "#kind")).select_by_value("noise")
    until(lambda: "map=noise" in driver.current_url)
    assert (shown(driver, "high"), shown(driver, "lock", "checked")) == ("4.66", True)
    Select(one(driver, "#kind")).select_by_value(
        "difference"
    )  # none here, so that there is no scale to lock
    until(lambda: "map=difference" in driver.current_url)
    assert not one(driver, "#lock").is_selected()
    assert not one(driver, "#lock").is_enabled()
    opened(driver, page, "lock=fitness:2.5")
    assert shown(driver, "high") == "2.50"
    beyond = (softvox_gym.landscape()["fitness"] > 2.5).sum()
    assert shown(driver, "scale-note") == f"The scale is locked; {beyond} designs are beyond it."
    pressed(driver, "lock")
    assert shown(driver, "high") == "4.66"


def test_the_top_hundred_are_outlined_and_the_bars_count_all(driver, page):
    opened(driver, page, "outline=100&by=rank")
    assert shown(driver, "map", "dataset.outlined") == "100"
    ranked = map_pixels(driver)
    pressed(driver, "outline")
    assert shown(driver, "map", "dataset.outlined") == "0"
    row, column = np.nonzero((ranked != map_pixels(driver)).any(axis=2))
    top = np.argsort(softvox_gym.landscape()["fitness"])[-100:]
    cell = len(ranked) / SIDE
    own = np.stack(cell_of(top), axis=1) + 0.5
    places = np.stack([SIDE - row / cell, column / cell], axis=1)
    distance = np.abs(places[:, None] - own).max(axis=2)
    assert distance.min(axis=1).max() < 1  # from the nearest of the hundred
    assert distance.min(axis=0).max() < 1  # none is left out
    path = shown(driver, "histogram", "firstElementChild.getAttribute('d')")
    heights = 1 - np.array(re.findall(r"V([\d.]+)H", path), float)
    counts, _ = np.histogram(softvox_gym.landscape()["fitness"], 64)
    np.testing.assert_allclose(heights, np.log1p(counts) / np.log1p(counts.max()), atol=0.02)


def test_headings_have_a_ring_for_a_key_and_arrows_on_the_map(driver, page):
    opened(driver, page, "map=heading")
    ring = one(driver, "#ring")
    assert ring.is_displayed()
    assert not one(driver, "#scale").is_displayed()
    assert {"0° +x", "90° +y", "180°"} <= set(ring.text.split("\n"))
    table = softvox_gym.landscape()
    white = (cell_colours(driver) == 255).all(axis=1)
    assert not white[table["fitness"] >= 0.25].mean() > 0.1, "arrows alone are white there"
    one(driver, "#kind").send_keys("fitness")
    until(lambda: not ring.is_displayed())
    assert one(driver, "#lock").is_enabled()


def test_the_wheel_zooms_about_the_cursor_until_robots_are_drawn(driver, page):
    opened(driver, page)
    mouse(driver, 4295).perform()
    row, column = (int(place) for place in cell_of(4295))
    place = ((column + 0.5) / SIDE, (row + 0.5) / SIDE)
    wheel(driver, 9, *place)
    left, bottom, span = seen(driver)
    assert 8 < span < 11
    assert shown(driver, "hover-text").startswith("4295 ")
    assert int((place[0] * span) + left) == column
    assert int((place[1] * span) + bottom) == row
    robots = int(shown(driver, "map", "dataset.robots"))
    assert (np.floor(span) - 1) ** 2 <= robots <= (np.ceil(span) + 1) ** 2
    colours = map_pixels(driver)
    assert (np.abs(colours - [242, 69, 56]).max(axis=2) < 4).mean() > 0.003  # active voxels
    wheel(driver, -30)
    assert seen(driver).tolist() == [0, 0, SIDE]
    assert shown(driver, "map", "dataset.robots") == "0"
    driver.execute_script(
        "dispatchEvent(new Event('scroll'));"
        "document.getElementById('map').dispatchEvent(new WheelEvent('wheel', { deltaY: -100 }))"
    )
    assert seen(driver)[2] == SIDE, "who scrolls the page does not zoom the map on the way"


def test_a_drag_pans_and_chooses_nothing_and_a_click_still_does(driver, page):
    opened(driver, page)
    wheel(driver, 9)
    left, bottom, span = seen(driver)
    width = one(driver, "#map").size["width"]
    drag = mouse(driver, 3280).click_and_hold().move_by_offset(30, 0).move_by_offset(70, 50)
    drag.release().perform()
    moved = seen(driver) - [left, bottom, span]
    np.testing.assert_allclose(moved, [-100 * span / width, 50 * span / width, 0], atol=0.02)
    assert robots(driver) == "6453"
    mouse(driver, 3280).click().perform()  # the middle, of what is seen now
    until(lambda: robots(driver) != "6453")
    row, column = (int(place) for place in cell_of(int(robots(driver))))
    assert (column, row) == tuple(np.floor(seen(driver)[:2] + span / 2))


def test_keys_and_buttons_zoom_as_well(driver, page):
    loaded(driver, page, "design=0")
    canvas = one(driver, "#map")
    bare = map_pixels(driver)
    assert (bare[-20:, :20] > 250).all(axis=2).sum() > 20, "the ring in the corner is whole"
    driver.execute_script("arguments[0].focus()", canvas)
    from selenium.webdriver import Keys

    canvas.send_keys(Keys.ARROW_RIGHT, "++++")
    _, bottom, span = seen(driver)
    assert (bottom, span) == (0, pytest.approx(16, abs=0.1))
    canvas.send_keys(*[Keys.ARROW_UP] * 20)
    assert seen(driver)[1] == pytest.approx(21 - span, abs=0.02)  # it follows the cursor
    canvas.send_keys("0")
    assert np.array_equal(seen(driver), [0, 0, SIDE])
    for button, smaller in ((1, True), (3, False)):
        one(driver, f"#zoom :nth-child({button})").click()
        assert (seen(driver)[2] < SIDE) == smaller


def touch(driver, kind, *points):
    box = driver.execute_script(
        "return document.getElementById('map').getBoundingClientRect().toJSON()"
    )
    places = [
        {"x": box["left"] + x * box["width"], "y": box["top"] + y * box["height"], "id": k}
        for k, (x, y) in enumerate(points)
    ]
    driver.execute_cdp_cmd("Input.dispatchTouchEvent", {"type": kind, "touchPoints": places})


def test_two_fingers_zoom_on_a_phone_and_one_chooses(driver, page):
    sized(driver, *PHONE)
    driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": True})
    try:
        loaded(driver, page)
        driver.execute_script("scrollTo(0, 0)")
        assert shown(driver, "hover-text").startswith("Tap a cell")
        touch(driver, "touchStart", (0.3, 0.4))
        touch(driver, "touchEnd")
        until(lambda: robots(driver) != "6453")
        chosen = robots(driver)
        assert shown(driver, "hover-text").startswith(f"{chosen} ")
        touch(driver, "touchStart", (0.4, 0.5), (0.6, 0.5))
        for apart in (0.2, 0.3, 0.4):
            touch(driver, "touchMove", (0.5 - apart, 0.5), (0.5 + apart, 0.5))
        touch(driver, "touchEnd")
        assert seen(driver) == pytest.approx([30.4, 30.4, SIDE / 4], abs=0.3)
        touch(driver, "touchStart", (0.5, 0.5))
        touch(driver, "touchMove", (0.5, 0.3))
        touch(driver, "touchEnd")
        assert seen(driver)[1] < 28, "one finger pans"
        assert robots(driver) == chosen
        assert driver.execute_script("return scrollY") == 0
    finally:
        driver.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": False})
        sized(driver, *DESKTOP)


def test_on_a_sharp_screen_the_map_has_as_many_pixels(driver, page):
    size = {"width": 1280, "height": 800, "deviceScaleFactor": 2, "mobile": False}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    try:
        loaded(driver, page)
        assert shown(driver, "map", "width") == 2 * one(driver, "#map").size["width"]
    finally:
        sized(driver, *DESKTOP)


def test_a_path_plays_and_stops_at_its_end(driver, page):
    opened(driver, page, "searcher=hill_climber&seed=1&budget=40")
    until(lambda: shown(driver, "path-text"))
    whole = map_pixels(driver)
    cursor = "querySelector('line:last-of-type').getAttribute('x1')"
    end = shown(driver, "curve", cursor)
    one(driver, "#play-path").click()
    assert "pause" in shown(driver, "play-path")
    until(lambda: 1 < int(shown(driver, "upto", "value")) < 40)
    one(driver, "#play-path").click()
    assert "play" in shown(driver, "play-path")
    count = shown(driver, "upto", "value")
    assert float(shown(driver, "curve", cursor)) < float(end)
    assert not np.array_equal(map_pixels(driver), whole)
    assert shown(driver, "path-text").startswith(f"{count} of 40 evaluations")
    driver.execute_script("document.getElementById('upto').value = 38")
    one(driver, "#play-path").click()
    until(lambda: "play" in shown(driver, "play-path"))
    assert shown(driver, "upto", "value") == "40"
    assert shown(driver, "curve", cursor) == end
    assert np.array_equal(map_pixels(driver), whole)
    assert {"1", "40", "optimum 4.66"} <= set(one(driver, "#curve").text.split("\n"))


def test_searchers_are_seen_beside_each_other_and_are_in_the_address(driver, page):
    loaded(driver, page, "searcher=random&seed=1&budget=30")
    until(lambda: shown(driver, "path-text"))
    one(driver, "#add-path").click()
    assert "is shown already" in shown(driver, "path-text")
    one(driver, "#searcher").send_keys("hill_climber")
    one(driver, "#add-path").click()
    until(lambda: shown(driver, "curve", "querySelectorAll('path').length") == 2)
    address = driver.current_url.partition("#")[2]
    assert address == "searcher=hill_climber&seed=1&budget=30&also=random.1.30"
    rows = [row.text for row in driver.find_elements("css selector", "#path-list output")]
    assert [row.partition(":")[0] for row in rows] == ["random, seed 1", "hill_climber, seed 1"]
    table = softvox_gym.landscape()["fitness"]
    for row in rows:
        best, regret = map(float, re.findall(r"\d+\.\d+", row))
        assert best + regret == pytest.approx(table[OPTIMUM], abs=0.011)
    both = map_pixels(driver)
    loaded(driver, page, address)
    until(lambda: shown(driver, "path-text"))
    assert np.array_equal(map_pixels(driver), both)
    one(driver, "#path-list [aria-label='remove hill_climber, seed 1']").click()
    until(lambda: driver.current_url.endswith("#searcher=random&seed=1&budget=30"))
    assert errors(driver) == []


@pytest.mark.parametrize(
    ("address", "place", "words"),
    [
        ("by=size", "message", "by=size is no scale"),
        ("lock=fitness:x", "message", "lock=fitness:x is no scale"),
        ("lock=fitness:0", "message", "lock=fitness:0 is no scale"),
        ("searcher=random&also=%25", "path-text", "also=% is no list of paths"),
        ("searcher=random&also=none.1.5", "path-text", "searcher 'none' is not among"),
        ("searcher=random&also=" + "*".join(f"random.{k}.5" for k in range(2, 6)), "path-text",
         "4 paths at a time, got 5"),
    ],
)  # fmt: skip
def test_a_scale_or_a_path_that_is_not_there_is_told(driver, page, address, place, words):
    opened(driver, page, address)
    until(lambda: words in shown(driver, place))
    assert errors(driver) == []
