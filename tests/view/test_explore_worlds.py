"""Two worlds, the story, the finder and the page's layout, as somebody at a browser meets them."""

from dataclasses import replace

import numpy as np
import pytest
from chromium import errors, needs_chromium, until
from explore_page import (
    DESKTOP,
    applied,
    entered,
    facts,
    map_pixels,
    mouse,
    one,
    opened,
    robots,
    shown,
)
from node import answer, needs_node

import softvox_gym
from softvox_gym import Physics, noisy_landscape, reality, simulate
from softvox_gym.landscapes.analysis.symmetry import symmetry_classes
from softvox_gym.landscapes.robustness import kendall_tau
from softvox_gym.real_tracks import LITTLE
from softvox_view import replay
from softvox_view.explore.page import known

#: Two landscapes that are done in a moment.
SHORT = {"settle_time": 0.05, "duration": 0.1}
TWO = "&".join(f"{name}={value}&b.{name}={value}" for name, value in SHORT.items())


def fitness_in(name):
    physics = Physics.published() if name == "published" else reality(name).physics
    return simulate(np.arange(6561), replace(physics, **SHORT)).fitness


def whole(driver):
    until(lambda: applied(driver) is not None and shown(driver, "progress-row", "hidden"))


@needs_chromium
def test_two_worlds_stand_beside_each_other_and_a_point_of_their_scatter_is_a_robot(driver, page):
    from selenium.webdriver import ActionChains

    opened(driver, page, f"design=926&b.preset=slippery&{TWO}")
    whole(driver)
    first, second = (fitness_in(name) for name in ("published", "slippery"))
    assert facts(driver)[""] == ["published", "slippery", "difference"]
    assert facts(driver)["fitness"][:2] == [f"{first[926]:.4f}", f"{second[926]:.4f}"]
    assert shown(driver, "player", "player.frames") > 50
    labels = one(driver, ".softvox-labels").text
    assert "published: 926 · " in labels
    assert "slippery: 926 · " in labels
    tau = f"{kendall_tau(first, second):.2f}".replace("-", "\N{MINUS SIGN}")
    assert shown(driver, "tau") == f"Kendall’s τ {tau}"  # noqa: RUF001
    assert shown(driver, "high") == f"{max(first.max(), second.max()):.2f}", "one scale for both"
    other = "document.getElementById('map-b').toDataURL()"
    before = driver.execute_script(f"return {other}")
    mouse(driver, 4295).perform()
    told = shown(driver, "hover-text")
    assert told.startswith(f"4295 · 20002221, fitness {first[4295]:.2f}")
    assert f"; slippery: fitness {second[4295]:.2f}" in told
    assert driver.execute_script(f"return {other}") != before, "the cursor is on both"
    canvas = one(driver, "#scatter")
    driver.execute_script("arguments[0].scrollIntoView({block: 'center'})", canvas)
    ranks = [np.argsort(np.argsort(-fitness, kind="stable")) for fitness in (first, second)]
    side, margin = canvas.size["width"], 8 / 648
    places = [(1 - rank / 6561) * (1 - 2 * margin) + margin - 0.5 for rank in ranks]
    best = int(np.argmin(ranks[0]))
    offsets = (round(side * places[0][best]), -round(side * places[1][best]))
    ActionChains(driver, duration=0).move_to_element_with_offset(canvas, *offsets).click().perform()
    design = int(until(lambda: robots(driver) != "926" and robots(driver)))
    ends = (offsets[0], -offsets[1])
    apart = [place - end / side for place, end in zip(places, ends, strict=True)]
    far = np.hypot(*apart)
    assert far[design] < far.min() + 2 / side
    one(driver, "#versus").send_keys("none")
    until(lambda: facts(driver)[""] == ["A"])
    assert "b." not in driver.current_url
    assert errors(driver) == []


@needs_chromium
def test_the_papers_finding_is_one_click_away(driver, page):
    opened(driver, page, "design=926")
    one(driver, "#finding").click()
    until(lambda: facts(driver)[""] == ["published", "reversal", "difference"])
    assert facts(driver)["heading, °"][:2] == ["\N{MINUS SIGN}135.2", "60.7"]
    assert facts(driver)["rank of 6561"][:2] == ["1", "not known yet"]
    assert driver.current_url.endswith("#b.preset=reversal")
    assert shown(driver, "player", "player.frames") > 100
    driver.back()
    until(lambda: facts(driver)[""] == ["A"])
    assert shown(driver, "progress-row", "hidden"), "what is no longer wanted ends"
    assert robots(driver) == "926"


@needs_chromium
def test_a_world_is_kept_beside_the_next(driver, page):
    opened(driver, page)
    one(driver, "#keep").click()
    entered(driver, "#value-gravity", "-3")
    until(lambda: facts(driver)[""] == ["gravity -3", "published", "difference"])
    assert driver.current_url.endswith("#gravity=-3&b.preset=published")


@needs_chromium
@pytest.mark.parametrize(
    ("address", "words"),
    [
        ("b.gravity=x", "The second world: gravity must be a number, got 'x'"),
        ("b.preset=toString", "The second world: there is no physics toString"),
        ("voxels=9", "there is no filter voxels 9"),
    ],
)
def test_a_mistake_about_a_world_or_a_filter_is_told(driver, page, address, words):
    opened(driver, page, f"design=926&{address}")
    assert shown(driver, "message").startswith(words)
    assert driver.current_url.endswith("#design=926")
    assert errors(driver) == []


@needs_chromium
def test_the_story_is_told_once_to_who_comes_without_an_address(driver, page):
    opened(driver, page)
    driver.execute_script("localStorage.clear()")  # nobody was here before
    driver.get("about:blank")
    driver.get(page)
    until(lambda: "One voxel breathes" in shown(driver, "story-title"))
    until(lambda: robots(driver) == "2")
    one(driver, "#story-next").click()
    until(lambda: robots(driver) == "6453")
    one(driver, "#story-next").click()
    assert "All 6561" in shown(driver, "story-title")
    one(driver, "#story-next").click()
    until(lambda: shown(driver, "value-gravity", "value") == "-1.62")
    one(driver, "#story-next").click()
    until(lambda: facts(driver)[""] == ["published", "reversal", "difference"])
    assert shown(driver, "story-next") == "Done"
    one(driver, "#story-back").click()
    assert "Another gravity" in shown(driver, "story-title")
    one(driver, "#story-end").click()
    assert shown(driver, "story", "hidden")
    driver.get("about:blank")
    driver.get(page)
    until(lambda: robots(driver))
    assert shown(driver, "story", "hidden")
    one(driver, "#tell").click()
    until(lambda: robots(driver) == "2")
    assert driver.switch_to.active_element.get_attribute("id") == "story-next"


@needs_chromium
def test_the_fittest_are_listed_and_filters_narrow_them_and_dim_the_map(driver, page):
    from selenium.webdriver.support.select import Select

    opened(driver, page)
    table = softvox_gym.landscape()
    cards = "return [...document.querySelectorAll('#leaders button')].map((b) => +b.dataset.design)"
    order = np.argsort(-table["fitness"], kind="stable")
    assert driver.execute_script(cards) == order[:12].tolist()
    one(driver, "#more").click()
    assert driver.execute_script(cards) == order[:24].tolist()
    bare = map_pixels(driver)
    Select(one(driver, "#filters [name=voxels]")).select_by_value("4")
    Select(one(driver, "#filters [name=towards]")).select_by_value("180")
    Select(one(driver, "#filters [name=robust]")).select_by_value("0.5")
    turn = np.abs(np.degrees(np.arctan2(table["dy"], table["dx"])) % 360 - 180)
    share = noisy_landscape(1.0)["mean"] / np.maximum(table["fitness"], 1e-9)
    passes = (table["n_voxels"] == 4) & (turn <= 22.5) & (share >= 0.5)
    passes &= table["fitness"] >= LITTLE
    assert shown(driver, "passing") == f"{passes.sum()} of 6561 designs pass"
    listed = order[passes[order]]
    assert driver.execute_script(cards) == listed[:12].tolist()
    assert (map_pixels(driver) != bare).mean() > 0.5
    assert driver.current_url.endswith("#voxels=4&towards=180&robust=0.5")
    one(driver, "#filters [name=each]").click()
    classes = symmetry_classes()[listed]
    first = listed[np.sort(np.unique(classes, return_index=True)[1])]
    assert driver.execute_script(cards) == first[:12].tolist()
    one(driver, "#random").click()
    drawn = int(until(lambda: robots(driver) != "6453" and robots(driver)))
    assert drawn in first
    driver.back()
    one(driver, "#leaders button:nth-child(1)").click()
    until(lambda: robots(driver) == str(first[0]))


def rectangle(driver, selector):
    return driver.execute_script(
        "const r = document.querySelector(arguments[0]).getBoundingClientRect();"
        "return [r.left, r.top, r.width, r.height]",
        selector,
    )


@needs_chromium
def test_the_robot_is_as_large_as_the_map_and_can_fill_the_page(driver, page):
    from selenium.webdriver import Keys

    opened(driver, page)
    *_, map_width, map_height = rectangle(driver, "#map")
    *_, width, height = rectangle(driver, "#player canvas")
    assert width >= map_width
    assert height >= map_height
    one(driver, "#robot-panel .fill").click()
    assert rectangle(driver, "#robot-panel") == [0, 0, *DESKTOP]
    *_, width, height = rectangle(driver, "#player canvas")
    assert width > 900
    assert height > map_height
    one(driver, "#player .full").click()
    until(lambda: driver.execute_script("return document.fullscreenElement?.id") == "player")
    until(lambda: rectangle(driver, "#player canvas")[3] > height)
    driver.execute_script("document.exitFullscreen()")
    one(driver, "body").send_keys(Keys.ESCAPE)
    until(lambda: rectangle(driver, "#robot-panel")[2] < 600)


@needs_chromium
def test_what_is_said_moves_nothing(driver, page):
    opened(driver, page)
    places = [rectangle(driver, name) for name in ("main", "#value-gravity", "#player")]
    entered(driver, "#find-text", "6561")
    until(lambda: "is neither" in shown(driver, "message"))
    entered(driver, "#value-friction_static", "-1")
    until(lambda: shown(driver, "error-friction_static"))
    assert [rectangle(driver, name) for name in ("main", "#value-gravity", "#player")] == places


CONTRASTS = """
const light = (text) => {
  const [r, g, b] = text.match(/[\\d.]+/g).map((c) => (c / 255) ** 2.2);
  return 0.2126 * r + 0.7152 * g + 0.0722 * b + 0.05;
};
const ground = (e) => {
  const { backgroundColor } = getComputedStyle(e);
  const isClear = backgroundColor.endsWith(", 0)") && e.parentElement;
  return isClear ? ground(e.parentElement) : backgroundColor;
};
return [...document.querySelectorAll("h1, h2, p, label, legend, button, select, input, th, td")]
  .filter((e) => e.offsetParent && !e.disabled && e.type !== "range" && !e.closest("#player"))
  .map((e) => {
    const [a, b] = [getComputedStyle(e).color, ground(e)].map(light);
    return [Math.max(a, b) / Math.min(a, b), e.outerHTML.slice(0, 80)];
  })
  .filter(([ratio]) => ratio < 4.5);
"""


@needs_chromium
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_words_can_be_read_by_day_and_by_night(driver, page, scheme):
    feature = {"name": "prefers-color-scheme", "value": scheme}
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
    try:
        opened(driver, page)
        one(driver, "#tell").click()
        assert driver.execute_script(CONTRASTS) == []
        floor = "return getComputedStyle(document.body).backgroundColor.slice(4, -1)"
        shades = driver.execute_script(floor).split(",")
        assert (sum(map(int, shades)) > 380) == (scheme == "light")
    finally:
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


NO_WEBGL = """{
  const { getContext } = HTMLCanvasElement.prototype;
  HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    return kind === "webgl2" ? null : getContext.call(this, kind, ...more);
  };
}"""


@needs_chromium
@pytest.mark.parametrize(
    ("without", "place", "words"),
    [
        ("delete globalThis.DecompressionStream", "message", "no DecompressionStream"),
        ("WebAssembly.validate = () => false", "lacking", "no WebAssembly with SIMD"),
        (NO_WEBGL, "player", "has no WebGL 2"),
    ],
)
def test_what_a_browser_lacks_is_told(driver, page, without, place, words):
    add, remove = (f"Page.{verb}ScriptToEvaluateOnNewDocument" for verb in ("add", "remove"))
    made = driver.execute_cdp_cmd(add, {"source": without})
    try:
        driver.get("about:blank")
        driver.get(f"{page}#design=6453")
        until(lambda: words in one(driver, f"#{place}").text)
        if place == "player":  # the rest of the page is as ever, with a still picture
            until(lambda: shown(driver, "player", "querySelector('img')?.naturalWidth > 200"))
            assert facts(driver)["fitness"] == ["4.6573"]
    finally:
        driver.execute_cdp_cmd(remove, made)
        driver.get("about:blank")


@needs_node
def test_kendalls_tau_is_that_of_python(tmp_path):
    rng = np.random.default_rng(2)
    rows = rng.integers(0, 9, (2, 300)), rng.normal(size=(2, 300)), np.array([[1, 2, 3], [3, 2, 1]])
    script = "return Float64Array.from(given, ([a, b]) => versus.kendall(a, b));"
    told = answer(tmp_path, script, [row.tolist() for row in rows])
    expected = [kendall_tau(*row.astype(float)) for row in rows]
    np.testing.assert_allclose(told, expected, rtol=1e-12)


@needs_node
def test_recordings_of_two_clocks_are_one_by_the_nearest_frame(tmp_path):
    physics = [
        Physics.of({"preset": "published", "duration": 0.5}),
        Physics.of({"preset": "published", "duration": 1.0, "youngs_modulus": 3e6}),
    ]
    first, second = (replay.recording(simulate([6453, 13], one, frames=20)) for one in physics)
    script = "return recording.together(given, ['here', 'there']);"
    told = answer(tmp_path, script, [first, second])
    step = max(first["seconds_per_frame"], second["seconds_per_frame"])
    assert told["seconds_per_frame"] == step
    assert told["frames"] == second["frames"] > first["frames"]
    labels = [robot["label"].split(" · ")[0] for robot in told["robots"]]
    assert labels == ["here: 6453", "there: 6453", "here: 13", "there: 13"]
    assert told["robots"][1]["position"] == second["robots"][0]["position"]
    centres = [
        np.frombuffer(__import__("base64").b64decode(robot["centre"]), "<f4").reshape(-1, 3)
        for robot in (first["robots"][0], told["robots"][0])
    ]
    for frame in (0, 10, told["frames"] - 1):
        nearest = min(round(frame * step / first["seconds_per_frame"]), first["frames"] - 1)
        assert centres[1][frame].tolist() == centres[0][nearest].tolist()
    assert known()["style"] == first["style"]
