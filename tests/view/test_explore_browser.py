"""The app as somebody at a browser meets it."""

import base64
import csv
import json
import re
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from chromium import PATIENCE, errors, needs_chromium, requests, until
from chromium import opened as chromium_opened
from explore_page import (
    DESKTOP,
    PHONE,
    SHORT,
    SHORT_NUMBERS,
    SHORT_STATE,
    SMALL,
    WIDE,
    applied,
    cell_colours,
    entered,
    facts,
    fitness_with,
    kept,
    loaded,
    map_pixels,
    mouse,
    one,
    opened,
    opened_short,
    robots,
    shown,
    sized,
)
from node import answer, needs_node

import softvox_gym
from softvox_gym import Design, Physics, reality, simulate
from softvox_gym.manifest import digest
from softvox_gym.real_tracks import LITTLE
from softvox_gym.verify import GOLDEN
from softvox_view.explore.page import page as whole_page
from softvox_view.explore.paths import packed
from softvox_view.tessellation import cell_of

image = pytest.importorskip("PIL.Image")

pytestmark = needs_chromium


def test_it_loads_without_an_error_and_asks_nobody_else(driver, page):
    loaded(driver, page)
    assert applied(driver) == {}
    assert robots(driver) == "6453"
    assert facts(driver)["fitness"] == ["4.6573"]
    assert facts(driver)["rank of 6561"] == ["1"]
    error = softvox_gym.landscape()["step_error"][6453]
    assert facts(driver)["step error, voxel widths"] == [f"{error:.4f}"]
    assert shown(driver, "player", "player.supported")
    assert errors(driver) == []
    own = (page, "blob:", "chrome:")  # chrome: the new tab's, before
    assert [url for url in requests(driver) if not url.startswith(own)] == []


def test_lighter_is_fitter_on_the_map(driver, page):
    opened(driver, page)
    fitness = softvox_gym.landscape()["fitness"]
    row, column = cell_of(np.arange(6561))
    # Cells near the mark of the design shown may lie under it.
    own = cell_of(6453)
    free = np.maximum(abs(row - own[0]), abs(column - own[1])) > 5
    lightness = cell_colours(driver) @ [0.2126, 0.7152, 0.0722]
    order = np.flatnonzero(free)[np.argsort(fitness[free])]
    falls = lightness[order][:-1] - lightness[order][1:]
    assert falls.max() <= 1  # a count of 255: the anchors are rounded
    assert lightness[order][-1] - lightness[order][0] > 150


def test_hovering_shows_the_robot_and_its_numbers(driver, page):
    opened(driver, page)
    mouse(driver, 4295).perform()
    assert shown(driver, "hover-text").startswith("4295 · 20002221, fitness 4.65")
    shapes = driver.execute_script("return document.querySelectorAll('#hover-robot circle').length")
    assert shapes == 3 * Design(4295).n_active  # a dot on each of the three faces seen
    assert robots(driver) == "6453"


def test_a_click_simulates_and_replays_and_is_in_the_address(driver, page):
    opened(driver, page)
    mouse(driver, 4295).click().perform()
    until(lambda: robots(driver) == "4295")
    assert facts(driver)["fitness"] == [f"{simulate(4295).fitness[0]:.4f}"]
    assert "4295" in shown(driver, "player")
    assert shown(driver, "player", "player.frames") > 100
    assert driver.current_url.endswith("#design=4295")
    assert errors(driver) == []


def test_keys_alone_lead_to_a_robot(driver, page):
    from selenium.webdriver import Keys

    opened(driver, page, "design=0")
    canvas = one(driver, "#map")
    driver.execute_script("arguments[0].focus()", canvas)
    assert driver.switch_to.active_element == canvas
    canvas.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_UP, Keys.SHIFT + Keys.ARROW_UP)
    number = int(shown(driver, "hover-text").partition(" ")[0])
    assert tuple(int(place) for place in cell_of(number)) == (10, 1)
    canvas.send_keys(Keys.ENTER)
    until(lambda: robots(driver) == str(number))


def test_everything_that_can_be_used_is_reached_by_tab_and_has_a_name(driver, page):
    opened(driver, page)
    nameless = driver.execute_script(
        """return [...document.querySelectorAll("button, input, select, a, summary, [tabindex]")]
        .filter((e) => e.offsetParent && !(e.getAttribute("aria-label") || e.textContent.trim()
            || e.labels?.length)).map((e) => e.outerHTML)"""
    )
    unreachable = driver.execute_script(
        """return [...document.querySelectorAll("button, input, select, a, canvas[role], summary")]
        .filter((e) => e.offsetParent && e.tabIndex < 0).map((e) => e.outerHTML)"""
    )
    assert (nameless, unreachable) == ([], [])


def test_a_parameter_let_go_recomputes_all_and_tells_what_changed(driver, page):
    opened(driver, page, "duration=0.28")  # so long that it is seen under way
    until(lambda: applied(driver) == {"duration": "0.28"})
    high = shown(driver, "high")
    one(driver, "#lock").click()
    entered(driver, "#value-gravity", "-3")
    until(lambda: re.match("[1-9][0-9]* of 6561", shown(driver, "progress-text")))
    grey = (map_pixels(driver) == [226, 230, 235]).all(axis=2).mean()
    assert 0.01 < grey < 1, "cells fill in as they come"
    until(lambda: applied(driver) == {"duration": "0.28", "gravity": "-3"})
    fitness = fitness_with(gravity=-3.0, duration=0.28, settle_time=0.25)
    before = softvox_gym.landscape()["fitness"]
    top = [set(np.argsort(-values, kind="stable")[:100]) for values in (before, fitness)]
    told = shown(driver, "changes")
    assert f"{len(top[0] & top[1])} of the top 100 stayed" in told
    assert f"★ {fitness.argmax()} is" in told
    until(lambda: facts(driver)["fitness"] == [f"{fitness[6453]:.4f}"])
    assert facts(driver)["published"] == ["4.6573"]
    assert shown(driver, "high") == high != f"{fitness.max():.2f}"
    one(driver, "#lock").click()
    until(lambda: shown(driver, "high") == f"{fitness.max():.2f}")
    assert shown(driver, "scale-note") == f"Rescaled: it ended at {high} before."
    one(driver, "#kind").send_keys("difference")
    most = np.abs(fitness - before).max()
    until(lambda: shown(driver, "high") == f"+{most:.2f}")
    assert errors(driver) == []


@needs_node
def test_what_changed_is_told_in_ranks(tmp_path):
    script = "return panels.changesOf([3, 2, 1, 2], [null, 2, 4, 2]);"
    told = answer(tmp_path, script, None)
    assert (told["best"], told["former"]) == (2, 0)
    assert told["lines"] == [
        "3 of the top 100 stayed",
        "★ 2 is the best now: 4.00, was rank 4",
        "☆ 0 was the best: it diverged",
        "mean change +1.000 voxel widths",
        "1 designs diverged (×)",  # noqa: RUF001
    ]


@needs_node
def test_what_hardly_travels_has_no_heading(tmp_path):
    script = "return given.map((dy) => panels.inBrief(0, { dx: [0], dy: [dy], fitness: [1] }));"
    told = answer(tmp_path, script, [-LITTLE, -0.999 * LITTLE])
    assert told == ["fitness 1.00, heading \N{MINUS SIGN}90°", "fitness 1.00"]


def test_a_slider_moved_fast_ends_where_it_was_left(driver, page):
    from selenium.webdriver import Keys

    opened_short(driver, page)
    slider = one(driver, "#slider-friction_static")
    slider.send_keys(*[Keys.ARROW_LEFT] * 6)
    assert shown(driver, "value-friction_static", "value") == "0.7"
    until(lambda: applied(driver) == {**SHORT, "friction_static": "0.7"})
    assert driver.current_url.endswith(f"#{SHORT_STATE}&friction_static=0.7")
    one(driver, "#reset").click()
    until(lambda: applied(driver) == {})
    assert shown(driver, "value-friction_static", "value") == "1"


def test_a_bad_parameter_is_told_beside_it_and_changes_nothing(driver, page):
    opened(driver, page)
    before = map_pixels(driver)
    entered(driver, "#value-friction_static", "-1")
    said = until(lambda: shown(driver, "error-friction_static"))
    assert said == "friction_static must be finite and not negative, got -1"
    assert one(driver, "#value-friction_static").get_attribute("aria-invalid") == "true"
    assert np.array_equal(map_pixels(driver), before)
    assert driver.current_url.endswith("#")
    entered(driver, "#value-friction_static", "1")
    until(lambda: not shown(driver, "error-friction_static"))


@pytest.mark.parametrize("text", ["6561", "0002122", "<b>x</b>"])
def test_a_design_that_does_not_exist_is_told(driver, page, text):
    opened(driver, page)
    entered(driver, "#find-text", text)
    said = until(lambda: shown(driver, "message"))
    assert said == (f"design '{text}' is neither a number from 0 to 6560 nor 8 digits 0, 1, 2")
    assert robots(driver) == "6453"


def test_a_design_is_found_by_its_digits(driver, page):
    opened(driver, page)
    entered(driver, "#find-text", "20002221")
    until(lambda: robots(driver) == "4295")


def test_a_design_is_found_by_drawing_it(driver, page):
    opened(driver, page, "design=0")
    for site, clicks in ((0, 2), (5, 1)):
        for _ in range(clicks):
            one(driver, f"[data-site='{site}']").click()
    drawn = str(Design("20000100").index)
    until(lambda: robots(driver) == drawn)
    name = one(driver, "[data-site='5']").get_attribute("aria-label")
    assert name == "x 1, y 0, z 1: passive"


def test_two_designs_are_compared(driver, page):
    opened(driver, page)
    one(driver, "#which input[value='compare']").click()
    mouse(driver, 4295).click().perform()
    until(lambda: robots(driver) == "6453 4295")
    first, second = simulate([6453, 4295]).fitness
    change = f"\N{MINUS SIGN}{first - second:.4f}"
    assert facts(driver)["fitness"] == [f"{first:.4f}", f"{second:.4f}", change]
    one(driver, "#end-compare").click()
    until(lambda: robots(driver) == "6453")


def test_an_address_brings_back_what_was_seen(driver, page):
    loaded(driver, page, f"design=4295&compare=6453&map=heading&gravity=-3&{SHORT_STATE}")
    until(lambda: applied(driver) == {**SHORT, "gravity": "-3"})
    assert robots(driver) == "4295 6453"
    assert shown(driver, "kind", "value") == "heading"
    assert shown(driver, "value-gravity", "value") == "-3"


def test_two_tabs_do_not_disturb_each_other(driver, page):
    opened_short(driver, page)
    first = driver.current_window_handle
    one(driver, "#value-actuation").send_keys("clamp")
    driver.switch_to.new_window("tab")
    try:
        sized(driver, *DESKTOP)
        opened(driver, page, "design=4295")
        assert (applied(driver), facts(driver)["design"]) == ({}, ["4295"])
        opened(driver, page, f"gravity=-3&{SHORT_STATE}")
        until(lambda: applied(driver) == {**SHORT, "gravity": "-3"})
        second = map_pixels(driver)
    finally:
        driver.close()
        driver.switch_to.window(first)
    until(lambda: applied(driver) == {**SHORT, "actuation": "clamp"})
    assert robots(driver) == "6453"
    assert not np.array_equal(map_pixels(driver), second)


def test_a_searchers_path_lies_over_the_map(driver, page):
    opened(driver, page)
    bare = map_pixels(driver)
    one(driver, "#searcher").send_keys("hill_climber")
    entered(driver, "#budget", "60")
    said = until(lambda: shown(driver, "path-text"))
    assert said.startswith("60 of 60 evaluations, 60 designs; ◆ best ")
    assert (map_pixels(driver) != bare).any()
    assert "searcher=hill_climber&seed=1&budget=60" in driver.current_url
    driver.execute_script("document.getElementById('upto').value = 20")
    entered(driver, "#find-text", "4295")
    until(lambda: robots(driver) == "4295")
    driver.back()
    until(lambda: robots(driver) == "6453")
    assert shown(driver, "upto", "value") == "20"  # the path is not searched again
    one(driver, "#clear-path").click()
    assert np.array_equal(map_pixels(driver), bare)


def test_what_is_seen_can_be_downloaded(driver, page, tmp_path):
    opened(driver, page)
    where = {"behavior": "allow", "downloadPath": str(tmp_path)}
    driver.execute_cdp_cmd("Browser.setDownloadBehavior", where)
    names = {
        "save-csv": "landscape.csv",
        "save-png": "landscape-fitness.png",
        "save-replay": "replay-6453.html",
    }
    for button in names:
        one(driver, f"#{button}").click()
    until(lambda: all((tmp_path / name).exists() for name in names.values()))
    table = softvox_gym.landscape()
    with (tmp_path / "landscape.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["digits"] for row in rows] == table["digits"].tolist()
    for name in ("dx", "dy", "fitness"):
        assert [float(row[name]) for row in rows] == table[name].tolist()
    with image.open(tmp_path / "landscape-fitness.png") as picture:
        assert picture.size == (680, 750)
    opened_short(driver, page)
    changes = "settle_time_0.01_duration_0.05"
    saved = {"save-csv": f"landscape_{changes}.csv", "save-png": f"landscape-fitness_{changes}.png"}
    for button in saved:
        one(driver, f"#{button}").click()
    until(lambda: all((tmp_path / name).exists() for name in saved.values()))
    with (tmp_path / saved["save-csv"]).open(newline="") as file:
        fitness = [float(row["fitness"]) for row in csv.DictReader(file)]
    assert fitness == fitness_with().tolist()
    replay = tmp_path / "replay-6453.html"
    chromium_opened(driver, replay)
    until(lambda: driver.execute_script("return document.getElementById('robots').player?.frames"))
    assert "6453 · 00021222 · 4.66 in 15 cycles" in driver.title
    assert errors(driver) == []
    assert [url for url in requests(driver) if url != replay.as_uri()] == []


STATES = (
    f"design=6453&compare=4295&map=difference&{SHORT_STATE}",
    f"design=6453&compare=4295&b.gravity=-3&{SHORT_STATE}&b.settle_time=0.01&b.duration=0.05",
)


@pytest.mark.parametrize("size", [DESKTOP, WIDE, PHONE, SMALL], ids=str)
def test_a_screen_is_used_and_nothing_sticks_out(driver, page, size):
    sized(driver, *size)
    try:
        # A phone is known when the page loads.
        for state, show in zip(STATES, (loaded if size == PHONE else opened, opened), strict=True):
            show(driver, page, state)
            width, whole, left, right, wide = driver.execute_script(
                "const { clientWidth: width, scrollWidth } = document.documentElement;"
                "const { left, right } = document.querySelector('main').getBoundingClientRect();"
                "return [width, scrollWidth, left, right,"
                "[...document.querySelectorAll('main *')].filter((e) => e.offsetParent &&"
                "!e.matches('#facts:has(th:nth-child(5)) *') &&"  # a table of many scrolls
                "e.getBoundingClientRect().right > width + 1).map((e) => e.outerHTML)]"
            )
            assert wide == []
            for name in ("kind", "versus"):
                assert shown(driver, name, "offsetWidth") > 105, "what is chosen can be read"
            assert whole == width
            assert left < 20
            assert right > width - 20
    finally:
        sized(driver, *DESKTOP)


def test_the_picture_for_the_readme_can_be_taken(driver, page):
    """With SOFTVOX_PICTURES=docs it is kept as docs/explore.png."""
    sized(driver, 1280, 900)
    opened(driver, page, "design=6453&searcher=hill_climber&seed=1&budget=100")
    until(lambda: shown(driver, "path-text"))
    mouse(driver, 4295).perform()
    driver.execute_script(
        "const p = document.getElementById('player').player; p.pause(); p.seek(150)"
    )
    assert shown(driver, "player", "player.frame") == 150
    driver.execute_script("scrollTo(0, 0)")
    kept(driver, "explore.png")
    assert len(driver.get_screenshot_as_png()) > 50_000
    sized(driver, *DESKTOP)


def called(driver, call):
    """Return what a promise of a Float64Array of the page becomes, or its error's text."""
    driver.set_script_timeout(PATIENCE)
    told = driver.execute_async_script(
        f"""const done = arguments[0];
        const text = (made) => {{
          let text = "";
          for (const byte of new Uint8Array(made.buffer)) text += String.fromCharCode(byte);
          done({{ bits: btoa(text) }});
        }};
        Promise.resolve().then(() => {call}).then(text).catch((error) => done(String(error)));"""
    )
    return told if isinstance(told, str) else np.frombuffer(base64.b64decode(told["bits"]))


def test_the_page_computes_the_published_landscape_to_the_native_bits(driver, page):
    opened(driver, page)
    driver.execute_script(
        "window.done = 0;"
        "const onBlock = (places) => (window.done += places.length);"
        "window.whole = softvox.landscape({}, { onBlock });"
    )
    for some in range(500, 6561, 500):  # it is long: each part may take as much time as others do
        until(lambda some=some: driver.execute_script("return window.done") >= some)
    displacement = called(driver, "window.whole").reshape(6561, 3)
    assert digest(displacement) == GOLDEN


def test_the_page_simulates_any_designs_to_the_native_bits(driver, page):
    opened(driver, page)
    designs = np.random.default_rng(6).integers(0, 6561, 70).tolist()
    for changes in ({}, {"gravity": [1, 0, -8], "strain": 0.4, "duration": 1.1}):
        made = Physics.of({"preset": "published", **changes})
        told = called(driver, f"softvox.simulate({designs}, {json.dumps(changes)})")
        assert told.tobytes() == simulate(designs, made).displacement.tobytes()
    phase = np.random.default_rng(7).uniform(0, 1, (2, 8))
    told = called(
        driver, f"softvox.simulate([6453, 926], {{}}, {{phase: {phase.ravel().tolist()}}})"
    )
    stack = phase.reshape(2, 2, 2, 2).transpose(0, 3, 2, 1)
    assert told.tobytes() == simulate([6453, 926], phase=stack).displacement.tobytes()
    assert len(called(driver, "softvox.simulate([])")) == 0
    assert "no design 6561" in called(driver, "softvox.simulate([6561])")
    assert "mass is no parameter" in called(driver, "softvox.landscape({mass: 1})")
    assert "no physics reversed" in called(driver, "softvox.simulate([1], 'reversed')")
    assert "a physics is an object" in called(driver, "softvox.simulate([1], 5)")
    assert "must be a list" in called(driver, "softvox.simulate(6453)")
    short = called(driver, "softvox.simulate([1, 2], {}, {strain: [1]})")
    assert "strain must be 8 finite numbers" in short


def test_by_rank_a_tenth_of_the_designs_has_a_tenth_of_the_colours(driver, page):
    opened(driver, page, "by=rank")
    colours = cell_colours(driver)
    order = np.argsort(softvox_gym.landscape()["fitness"])
    medians = [np.median(colours[part], axis=0) for part in np.array_split(order, 10)]
    steps = np.linalg.norm(np.diff(medians, axis=0), axis=1)
    assert steps.min() > 0.3 * steps.max()
    assert (shown(driver, "kind", "value"), shown(driver, "by", "value")) == ("fitness", "rank")
    assert (shown(driver, "low"), shown(driver, "high")) == ("0", "4.66")
    one(driver, "#by").send_keys("value")
    until(lambda: not np.array_equal(cell_colours(driver), colours))


def test_what_is_said_well_does_not_look_like_an_error(driver, page):
    opened(driver, page)
    colour = "return getComputedStyle(document.getElementById('message')).backgroundColor"
    one(driver, "#share").click()
    until(lambda: "link is" in shown(driver, "message"))
    good = driver.execute_script(colour)
    entered(driver, "#find-text", "6561")
    until(lambda: "is neither" in shown(driver, "message"))
    assert driver.execute_script(colour) != good


def test_a_new_wish_ends_the_old_one_and_a_click_does_not_wait_for_it(driver, page):
    opened(driver, page)
    entered(driver, "#value-gravity", "-2")
    until(lambda: re.match("[1-9]", shown(driver, "progress-text")))
    entered(driver, "#find-text", "4295")
    until(lambda: robots(driver) == "4295")
    assert not shown(driver, "progress-row", "hidden")
    assert facts(driver)["rank of 6561"] == ["not known yet"]
    dimmed = "return getComputedStyle(document.getElementById('leaders')).opacity"
    until(lambda: float(driver.execute_script(dimmed)) < 1)
    one(driver, "#reset").click()
    until(lambda: applied(driver) == {})
    assert shown(driver, "progress-row", "hidden")
    assert driver.execute_script(dimmed) == "1"
    until(lambda: facts(driver)["published"] == facts(driver)["fitness"])
    assert not (map_pixels(driver) == [226, 230, 235]).all(axis=2).any()


def test_a_world_is_a_preset_of_the_physics(driver, page):
    opened(driver, page, f"preset=slippery&{SHORT_STATE}&gravity=-8")
    world = {"preset": "slippery", "gravity": "-8", **SHORT}
    until(lambda: applied(driver) == world)
    assert shown(driver, "value-friction_kinetic", "value") == "0.1"
    physics = replace(reality("slippery").physics, gravity=-8.0, **SHORT_NUMBERS)
    assert facts(driver)["fitness"] == [f"{simulate(6453, physics).fitness[0]:.4f}"]


def test_an_engine_that_does_not_start_is_told(driver, tmp_path):
    data = packed(files("softvox_view.explore").joinpath("assets/engine.wasm").read_bytes())
    whole = whole_page()
    assert data in whole
    broken = tmp_path / "broken.html"
    broken.write_text(whole.replace(data, packed(b"none")), "utf-8")
    chromium_opened(driver, broken)
    until(lambda: "WebAssembly" in shown(driver, "message"))
