"""The page of a replay in a browser: it draws what it is asked for, and asks for nothing."""

import base64
import io
import json
from dataclasses import replace

import numpy as np
import pytest
from chromium import NO_WEBGL, WEBGL, chromium, errors, needs_chromium, opened, requests, until

from softvox_gym import Physics, raster, simulate
from softvox_gym.motion import Motion
from softvox_view import replay
from softvox_view.replay.still import Panels

pytestmark = needs_chromium
image = pytest.importorskip("PIL.Image")

PLAYER = "const player = document.getElementById('robots').player; "


@pytest.fixture(scope="module")
def result():
    return simulate([6453, 4295, 6489], frames=23)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, result):
    made = tmp_path_factory.mktemp("pages")
    for name, places in {"one": (0,), "three": (0, 1, 2)}.items():
        data, still = replay.recording(result, *places), replay.still(result, *places)
        (made / f"{name}.html").write_text(replay.page(data, still, autoplay=False), "utf-8")
        (made / f"{name}-plays.html").write_text(replay.page(data, still, speed=0.25), "utf-8")
    few = Physics.published().lasting(2)
    moon = replace(few, gravity=-1.62)
    worlds = {"published": few, "<b>moon": moon}
    results = {name: simulate([6453], physics, frames=23) for name, physics in worlds.items()}
    still = replay.still(results["published"])
    both = replay.page(replay.versus(results), still, autoplay=False)
    (made / "worlds.html").write_text(both, "utf-8")
    lap = replay.lap(simulate([6453, 6013, 5079], frames=46))
    gallery = replay.page(lap, still, autoplay=False, gallery=True)
    (made / "gallery.html").write_text(gallery, "utf-8")
    (made / "empty.html").write_text("<!doctype html>", "utf-8")
    (made / "notebook.html").write_text(f"<!doctype html>{result._repr_html_()}", "utf-8")
    return made


@pytest.fixture(scope="module")
def driver():
    with chromium(*WEBGL, height=500) as driver:
        yield driver


@pytest.fixture
def fresh(driver, folder):
    """Return the page of one robot, loaded anew."""
    opened(driver, folder / "one.html")
    return driver


#: Takes back what a test did to the player.
AFRESH = """
document.activeElement?.blur();
document.querySelector(".speed").value = "0.5";
for (const one of document.querySelectorAll("details")) one.open = false;
player.pause();
player.view = { azimuth: 0, elevation: 27, zoom: 1, follow: false, boxes: false };
player.seek(0);
window.isShared = true;
"""


@pytest.fixture
def page(driver, folder):
    """Return the page of one robot as it is at first; one loaded for another test is not shared."""
    if not driver.execute_script("return window.isShared"):
        opened(driver, folder / "one.html")
    driver.get_log("browser")
    asked(driver, AFRESH)
    return driver


def asked(driver, code):
    return driver.execute_script(PLAYER + code)


def picture(driver):
    """Return what the player shows as an array."""
    url = asked(driver, "return player.picture()")
    content = base64.b64decode(url.removeprefix("data:image/png;base64,"))
    return np.asarray(image.open(io.BytesIO(content)).convert("RGB")).astype(int)


def coloured(picture):
    """Return where a picture is red and where it is cyan."""
    red, _, blue = np.moveaxis(picture, -1, 0)
    return np.stack([red - blue > 60, blue - red > 60])


def scrub(driver, frame):
    """Move the slider to a frame, as a hand does."""
    asked(
        driver,
        "const slider = document.querySelector('input.frame');"
        f"slider.value = {frame}; slider.dispatchEvent(new Event('input'))",
    )


def test_the_page_loads_without_an_error_a_request_or_a_global(fresh, folder):
    names = "return Object.getOwnPropertyNames(window)"
    on_page = set(fresh.execute_script(names))
    assert asked(fresh, "return player.supported")
    assert picture(fresh).std() > 10
    assert errors(fresh) == []
    assert requests(fresh) == [(folder / "one.html").as_uri()]
    fresh.get((folder / "empty.html").as_uri())
    assert on_page - set(fresh.execute_script(names)) == set()


def test_scrubbing_changes_what_is_seen(page):
    scrub(page, 20)
    before = picture(page)
    scrub(page, 300)
    after = picture(page)
    assert np.count_nonzero(coloured(before) != coloured(after)) > 1000
    clock = page.find_element("css selector", ".clock").text
    assert clock == f"{300 * 23 * 4.5297e-4:.2f} s, cycle 12"


def drawn_by_the_other(result, frame, shape, *, boxes=False):
    height, width, _ = shape
    panels = Panels([[(result, 0)]], panel=(width, height), boxes=boxes)
    return panels.picture(lambda _: frame).astype(int)


@pytest.mark.parametrize("frame", [0, 101, 250, 383])
def test_the_frame_shown_is_the_frame_asked_for(page, result, frame):
    asked(page, f"player.seek({frame})")
    assert asked(page, "return player.frame") == frame
    picture_seen = picture(page)
    seen = coloured(picture_seen)

    def overlap(other):
        """Return the share of the coloured pixels in which the still picture is the same."""
        expected = coloured(drawn_by_the_other(result, other, picture_seen.shape))
        return np.count_nonzero(expected & seen) / np.count_nonzero(expected | seen)

    # The two renderers differ in the pixels of the edges, a line or two per hundred.
    assert overlap(frame) > 0.97
    others = [other for other in (frame - 6, frame + 6) if 12 <= other < 384 and frame > 0]
    assert all(overlap(other) < overlap(frame) for other in others)


@pytest.mark.parametrize("boxes", [False, True])
def test_the_whole_picture_is_that_of_the_other_renderer(page, result, boxes):
    """Floor, grid, axes, ghost, ruler, path, shadow, skin and shading; letters are not compared."""
    asked(page, f"player.view = {{ boxes: {str(boxes).lower()} }}")
    for frame in (12, 300):
        asked(page, f"player.seek({frame})")
        seen = picture(page)
        height, width, _ = seen.shape
        drawn = drawn_by_the_other(result, frame, seen.shape, boxes=boxes)
        letters = np.zeros((height, width), bool)
        letters[int(0.93 * height) :, : width // 2] = True  # how far it is
        letters[int(0.74 * height) : int(0.87 * height)] = True  # the ruler's
        # Counts of 255, mostly at edges. Without the ghost it is 1.7, without shadow or grid more.
        assert np.abs(seen - drawn)[~letters].mean() < 0.6


def violet(driver):
    red, green, blue = np.moveaxis(picture(driver), -1, 0)
    return np.count_nonzero((blue - green > 40) & (red - green > 15) & (blue - red > 15))


def test_the_trail_grows_from_where_the_pump_begins(page):
    asked(page, "player.view = { follow: false, elevation: 80 }")
    lengths = []
    for frame in (0, 20, 180, 240, 300, 383):
        asked(page, f"player.seek({frame})")
        lengths.append(violet(page))
    assert lengths[:2] == [0, 0]
    assert lengths[2] > 30  # pixels; before, the robot still stands on it
    assert all(np.diff(lengths[2:]) > 50)


def test_the_strips_show_distance_and_true_volume_in_step(page, result):
    captions = page.find_elements("css selector", ".softvox-strips figcaption")
    for frame in (10, 300, 30):
        asked(page, f"player.seek({frame})")
        edge = result.frames.edge[0, frame] / 0.01
        start, now = (Motion.of(result, 0).pose(k).position.mean(axis=0) for k in (24, frame))
        gone = np.hypot(*(now - start)[:2]) if frame > 24 else 0.0
        assert captions[0].text == f"distance, voxel widths: {gone:.2f}"
        assert captions[1].text == f"volume, relative to rest: {np.nanmean(edge**3):.2f}"
    assert np.nanmean(result.frames.edge[0, 30] ** 3) > 1.3e-6  # it is not at rest all the time
    lowest = asked(
        page,
        """const points = document.querySelector(".volume polyline").getAttribute("points");
        return Math.max(...points.split(" ").map((point) => Number(point.split(",")[1])));""",
    )
    assert lowest == 96  # where it rests: nothing contracts, so there is no trough


def test_the_floor_is_dark_where_the_page_is(page):
    def scheme(wish):
        features = [{"name": "prefers-color-scheme", "value": wish}]
        page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": features})

    only = "document.documentElement.style.colorScheme"
    light = picture(page).mean()
    try:
        scheme("dark")
        until(lambda: picture(page).mean() < 100 < light)
        page.execute_script(f"{only} = 'light'")
        asked(page, "player.load(JSON.parse(document.getElementById('recording').textContent))")
        assert picture(page).mean() == light
    finally:
        page.execute_script(f"{only} = ''")
        scheme("light")


def test_a_click_on_a_strip_goes_to_that_moment(page):
    from selenium.webdriver import ActionChains

    strip = page.find_element("css selector", ".softvox-strips .distance")
    ActionChains(page).move_to_element(strip).click().perform()
    assert asked(page, "return player.frame") == pytest.approx(191.5, abs=1.5)
    cursor = page.find_element("css selector", ".distance .cursor").get_attribute("d")
    assert cursor.startswith("M50") or cursor.startswith("M49")


def test_the_page_says_why_a_body_is_under_the_floor(page):
    note = page.find_element("css selector", ".softvox-sunk")
    note.find_element("css selector", "summary").click()
    assert "touches the ground half an edge below its centre" in note.text


def saved(page, button):
    """Return the bytes of the file that a button saves, and its name."""
    # The page may fetch nothing, not even what it has made itself.
    page.execute_script(
        "const make = URL.createObjectURL; URL.createObjectURL = (blob) => {"
        "const reader = new FileReader(); reader.onload = () => (window.bytes = reader.result);"
        "reader.readAsDataURL(blob); window.blob = blob.type; return make.call(URL, blob); };"
        "HTMLAnchorElement.prototype.click = function () { window.saved = this.download; };"
        "window.bytes = null"
    )
    page.execute_script(f"document.querySelector('.softvox-save .{button}').click()")
    url = until(lambda: page.execute_script("return window.bytes"))
    return base64.b64decode(url.partition(",")[2]), page.execute_script("return window.saved")


def test_a_glb_of_the_page_is_that_of_the_command(page, result):
    def parts(content):
        size = int.from_bytes(content[12:16], "little")
        return json.loads(content[20 : 20 + size]), np.frombuffer(content[28 + size :], "u1")

    content, name = saved(page, "glb")
    assert name == "softvox-6453.glb"
    ours, theirs = (parts(made) for made in (content, replay.glb(replay.recording(result, 0))))
    assert ours[0] == theirs[0]
    time = slice(theirs[0]["bufferViews"][2]["byteOffset"], None)
    numbers = [bytes_[time].view("<f4") for _, bytes_ in (ours, theirs)]
    np.testing.assert_allclose(*numbers, atol=1e-6)


def test_a_png_of_the_page_has_the_words_too(page):
    content, name = saved(page, "png")
    assert name == "softvox-6453.png"
    shown = np.asarray(image.open(io.BytesIO(content)).convert("RGB")).astype(int)
    bare = picture(page)[: shown.shape[0], : shown.shape[1]]
    changed = np.abs(shown - bare).max(axis=-1) > 60
    assert changed[: len(changed) // 5, : changed.shape[1] // 2].sum() > 200
    assert np.count_nonzero(changed) < 0.02 * changed.size


def test_a_film_is_recorded_until_it_is_stopped(page):
    page.find_element("css selector", ".softvox-save summary").click()
    button = page.find_element("css selector", ".film")
    assert button.text in ("MP4", "WebM")
    word = button.text
    page.execute_script(
        "document.querySelector('.speed').value = '0.125';"  # it does not end by itself meanwhile
        "const make = URL.createObjectURL; URL.createObjectURL = (blob) => {"
        "window.film = [blob.type, blob.size]; return make.call(URL, blob); };"
        "HTMLAnchorElement.prototype.click = function () { window.saved = this.download; };"
    )
    button.click()
    until(lambda: asked(page, "return player.playing && player.frame > 3"))
    assert button.text == "stop"
    button.click()
    kind, size = until(lambda: page.execute_script("return window.film"))
    assert kind == f"video/{word.lower()}"
    assert size > 1000
    assert page.execute_script("return window.saved") == f"softvox-6453.{word.lower()}"
    assert button.text == word


def test_a_frame_beyond_the_recording_is_its_nearest_end(page):
    assert asked(page, "player.seek(1e9); return player.frame") == 383
    assert asked(page, "player.seek(-5); return player.frame") == 0


def test_each_frame_is_announced_with_its_time_and_cycle(page):
    detail = asked(
        page,
        "const seen = []; const element = document.getElementById('robots');"
        "element.addEventListener('frame', (event) => seen.push(event.detail));"
        "player.seek(120); return seen",
    )
    assert len(detail) == 1
    assert detail[0]["frame"] == 120
    assert detail[0]["time"] == pytest.approx(120 * 23 * 4.5297e-4, rel=1e-4)
    assert detail[0]["cycle"] == pytest.approx((detail[0]["time"] - 0.25) * 4, rel=1e-4)


def test_playing_goes_on_and_pausing_stops(page):
    asked(page, "player.seek(0); player.play()")
    until(lambda: asked(page, "return player.frame") >= 5)
    stopped = asked(page, "player.pause(); return player.frame")
    assert stopped >= 5
    later = "requestAnimationFrame(() => requestAnimationFrame(arguments[0]))"
    page.execute_async_script(later)
    assert asked(page, "return [player.frame, player.playing]") == [stopped, False]


def test_the_buttons_play_pause_and_bring_the_view_back(page):
    button = page.find_element("css selector", ".play")
    for word, playing in (("pause", True), ("play", False)):
        button.click()
        assert (button.text, asked(page, "return player.playing")) == (word, playing)
    asked(page, "player.view = { azimuth: 10, elevation: 50, zoom: 2 }")
    page.find_element("css selector", ".reset").click()
    view = {"azimuth": 0, "elevation": 27, "zoom": 1, "follow": False, "boxes": False}
    assert asked(page, "return player.view") == view


def test_playing_begins_again_after_the_last_frame(page):
    asked(page, "player.seek(380); player.play()")
    until(lambda: asked(page, "return player.frame") < 300)
    asked(page, "player.pause()")


@pytest.mark.parametrize("speed", [0.125, 1, 2])
def test_the_speed_chosen_is_the_speed_played(page, speed):
    """The browser's pictures come when the test says, 20 of them in a second."""
    frame = asked(
        page,
        f"""const due = []; const real = window.requestAnimationFrame;
        window.requestAnimationFrame = (draw) => due.push(draw);
        document.querySelector(".speed").value = "{speed}";
        player.seek(0); player.play();
        for (let now = 0; now <= 1000; now += 50) due.shift()(now);
        player.pause(); window.requestAnimationFrame = real;
        return player.frame;""",
    )
    assert frame == int(speed / (23 * 4.5296291666709763e-4) + 1e-6)


def test_the_picture_is_as_large_as_the_window_lets_it_be(page):
    size = "const c = document.querySelector('canvas'); return [c.width, c.height]"
    before = page.execute_script(size)
    window = page.get_window_size()
    page.set_window_size(window["width"] - 200, window["height"] - 20)
    try:
        until(lambda: page.execute_script(size) == [before[0] - 200, before[1] - 20])
    finally:
        page.set_window_size(window["width"], window["height"])


def test_another_recording_gives_the_memory_of_the_one_before_back(page):
    alive = asked(
        page,
        """const of = WebGL2RenderingContext.prototype; let alive = 0;
        const { createBuffer, deleteBuffer } = of;
        of.createBuffer = function () { alive++; return createBuffer.call(this); };
        of.deleteBuffer = function (b) { alive--; deleteBuffer.call(this, b); };
        const data = JSON.parse(document.getElementById("recording").textContent);
        const counts = [0, 1, 2, 3].map(() => { player.load(data); return alive; });
        Object.assign(of, { createBuffer, deleteBuffer });
        return counts;""",
    )
    assert alive == [0, 0, 0, 0]


def test_keys_work_before_anything_was_clicked(page):
    from selenium.webdriver import ActionChains, Keys

    page.execute_script(
        "addEventListener('keydown', (event) => (window.kept = event.defaultPrevented))"
    )
    ActionChains(page).send_keys(Keys.SPACE).perform()
    assert asked(page, "return player.playing")
    assert page.execute_script("return window.kept")  # from scrolling the page
    ActionChains(page).send_keys(Keys.SPACE, ".", ".", "f").perform()
    assert not asked(page, "return player.playing || !player.view.follow")


def test_keys_orbit_zoom_step_and_follow(page):
    from selenium.webdriver.common.keys import Keys

    canvas = page.find_element("css selector", "canvas")
    asked(page, "player.seek(100)")
    canvas.send_keys(Keys.ARROW_LEFT, Keys.ARROW_UP, "+", ".", "f")
    view = asked(page, "return player.view")
    assert view == {
        **{"azimuth": -5, "elevation": 32, "zoom": pytest.approx(1.1)},
        **{"follow": True, "boxes": False},
    }
    assert asked(page, "return player.frame") == 101
    before = picture(page)
    canvas.send_keys(Keys.HOME)
    assert asked(page, "return player.view.azimuth") == 0
    assert np.count_nonzero(picture(page) != before) > 1000


def test_dragging_orbits_and_the_wheel_zooms(page):
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.actions.wheel_input import ScrollOrigin

    canvas = page.find_element("css selector", "canvas")
    ActionChains(page).drag_and_drop_by_offset(canvas, 100, 50).perform()
    view = asked(page, "return player.view")
    assert view["azimuth"] == pytest.approx(-40)
    assert view["elevation"] == pytest.approx(27 + 20)
    ActionChains(page).scroll_from_origin(ScrollOrigin.from_element(canvas), 0, -120).perform()
    assert asked(page, "return player.view.zoom") > 1.2


def test_another_button_than_the_first_orbits_nothing(page):
    from selenium.webdriver.common.action_chains import ActionBuilder
    from selenium.webdriver.common.actions.mouse_button import MouseButton

    actions = ActionBuilder(page)
    mouse = actions.pointer_action
    mouse.move_to_location(200, 100)
    mouse.pointer_down(MouseButton.RIGHT)
    mouse.move_to_location(300, 150)
    mouse.pointer_up(MouseButton.RIGHT)
    actions.perform()
    assert asked(page, "return player.view.azimuth") == 0


def test_two_fingers_zoom(page):
    def touch(kind, *points):
        page.execute_cdp_cmd(
            "Input.dispatchTouchEvent",
            {"type": kind, "touchPoints": [{"x": x, "y": 100, "id": i} for i, x in points]},
        )

    touch("touchStart", (0, 300), (1, 400))
    touch("touchMove", (0, 250), (1, 450))
    touch("touchEnd")
    assert asked(page, "return player.view.zoom") == pytest.approx(2.0)
    assert asked(page, "return player.view.azimuth") == 0


def test_without_follow_the_robot_leaves_its_place(page):
    def middle(frame):
        asked(page, f"player.seek({frame})")
        return np.argwhere(coloured(picture(page)).any(axis=0)).mean(axis=0)

    moved = {}
    for follow in ("true", "false"):
        asked(page, f"player.view = {{ follow: {follow} }}")
        moved[follow] = np.abs(middle(380) - middle(30)).max()
    assert moved["true"] < 40 < 100 < moved["false"]


def test_without_follow_all_of_the_path_is_in_sight(page):
    asked(page, "player.view = { follow: false }")
    for frame in (0, 200, 383):
        asked(page, f"player.seek({frame})")
        seen = coloured(picture(page)).any(axis=0)
        assert seen.sum() > 300
        edges = (seen[0], seen[-1], seen[:, 0], seen[:, -1])
        assert not any(edge.any() for edge in edges)


def test_a_recording_of_another_kind_is_refused(page):
    refused = asked(page, "try { player.load({}) } catch (error) { return error.message }")
    assert refused == "not a recording that this player knows: softvox-replay, version 2"


def test_volume_counts_from_what_was_built(fresh):
    """A voxel may be made of parts."""
    asked(
        fresh,
        """const data = JSON.parse(document.getElementById("recording").textContent);
        const robots = data.robots.map((robot) => ({ ...robot, scale: robot.scale / 2 }));
        player.load({ ...data, robots });""",
    )
    caption = fresh.find_elements("css selector", ".softvox-strips figcaption")[1]
    assert caption.text == "volume, relative to rest: 1.00"


def test_the_wheel_scrolls_a_page_that_can_scroll_until_the_player_is_chosen(fresh):
    from selenium.webdriver import ActionChains
    from selenium.webdriver.common.actions.wheel_input import ScrollOrigin

    fresh.execute_script("document.body.style.height = '3000px'; document.body.style.flex = 'none'")
    fresh.execute_script("document.getElementById('robots').style.height = '400px'")
    canvas = fresh.find_element("css selector", "canvas")
    origin = ScrollOrigin.from_element(canvas)
    ActionChains(fresh).scroll_from_origin(origin, 0, 60).perform()
    assert asked(fresh, "return player.view.zoom") == 1
    assert until(lambda: fresh.execute_script("return scrollY"))
    canvas.click()
    ActionChains(fresh).scroll_from_origin(origin, 0, -60).perform()
    assert until(lambda: asked(fresh, "return player.view.zoom") > 1)


def test_while_the_graphics_card_is_lost_there_is_a_message_and_the_still_picture(fresh):
    asked(fresh, "player.seek(100)")
    before = picture(fresh)
    fresh.execute_async_script(
        "const done = arguments[0], canvas = document.querySelector('canvas');"
        "window.card = canvas.getContext('webgl2').getExtension('WEBGL_lose_context');"
        "canvas.addEventListener('webglcontextlost', () => setTimeout(done));"
        "card.loseContext()"
    )
    assert not asked(fresh, "return player.supported")
    lost = fresh.find_element("css selector", ".softvox-lost")
    assert "took the graphics away" in lost.text
    assert lost.find_element("css selector", "img").is_displayed()
    asked(fresh, "player.play(); player.seek(3); player.view = { follow: false }; player.seek(100)")
    assert asked(fresh, "return player.picture()") is None
    fresh.execute_async_script(
        "const done = arguments[0], canvas = document.querySelector('canvas');"
        "canvas.addEventListener('webglcontextrestored', () => setTimeout(done));"
        "card.restoreContext()"
    )
    assert fresh.find_elements("css selector", ".softvox-lost") == []
    np.testing.assert_array_equal(picture(fresh), before)
    assert errors(fresh) == []


def test_a_destroyed_player_leaves_the_element_as_it_was(fresh):
    asked(fresh, "player.destroy()")
    element = fresh.find_element("id", "robots")
    assert element.find_elements("css selector", "canvas") == []
    assert element.find_element("css selector", "img").is_displayed()
    assert errors(fresh) == []


def test_two_worlds_stand_in_one_panel(driver, folder):
    opened(driver, folder / "worlds.html")
    asked(driver, "player.seek(150)")
    [panel] = driver.find_elements("css selector", ".softvox-labels div")
    names = [span.text for span in panel.find_elements("css selector", ".name")]
    assert [name.split(":")[0] for name in names] == ["published", "<b>moon"]
    marks = [span.text for span in panel.find_elements("css selector", ".mark")]
    assert {"0", "1", "published", "<b>moon"} <= set(marks)
    assert len(driver.find_elements("css selector", ".distance polyline")) == 2
    assert errors(driver) == []


def test_a_gallery_shows_those_within_its_filters_and_walks_on(driver, folder):
    opened(driver, folder / "gallery.html")
    labels = "return document.querySelectorAll('.softvox-labels div').length"
    assert driver.execute_script(labels) == 3
    first = picture(driver)
    asked(driver, "player.seek(player.frames - 1)")
    assert np.abs(picture(driver) - first).mean() < 20  # a lap ends as it began
    driver.execute_script(
        "const input = document.querySelector('[data-of=fitness][data-end=low]');"
        "input.value = 3.65; input.dispatchEvent(new Event('input', { bubbles: true }))"
    )
    assert driver.find_element("css selector", "output").text == "2 of 3 robots"
    assert driver.execute_script(labels) == 2
    assert errors(driver) == []


def test_a_page_plays_by_itself_unless_less_motion_is_wished_for(driver, folder):
    opened(driver, folder / "one-plays.html")
    assert asked(driver, "return player.playing")
    assert driver.find_element("css selector", ".speed").get_attribute("value") == "0.25"
    wish = [{"name": "prefers-reduced-motion", "value": "reduce"}]
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": wish})
    try:
        opened(driver, folder / "one-plays.html")
        assert not asked(driver, "return player.playing")
    finally:
        driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": []})


def test_designs_stand_side_by_side_with_their_fitness(driver, folder):
    def names():
        return [name.text for name in driver.find_elements("css selector", ".softvox-labels .name")]

    opened(driver, folder / "three.html")
    assert [name.split(" in ")[0] for name in names()] == [
        "6453 · 00021222 · 4.66",
        "4295 · 20002221 · 4.65",
        "6489 · 00102222 · 3.49",
    ]
    shades = driver.execute_script(
        "return ['.name', '.distance polyline'].map((of) => [...document.querySelectorAll(of)].map("
        "(e) => getComputedStyle(e)[of === '.name' ? 'color' : 'stroke']))"
    )
    assert shades[0] == shades[1], "a robot's name has the colour of its curve"
    assert len(set(shades[0])) == 3
    labels = driver.find_elements("css selector", ".softvox-labels div")
    lefts = [label.rect["x"] for label in labels]
    assert lefts == sorted(set(lefts))
    red = coloured(picture(driver))[0]
    assert all(panel.any() for panel in np.array_split(red, 3, axis=1))
    size = driver.get_window_size()
    try:
        driver.set_window_size(520, 300)
        until(lambda: names() == ["6453 · 4.66", "4295 · 4.65", "6489 · 3.49"])
        driver.set_window_size(520, 800)  # two columns
        until(lambda: picture(driver).shape[0] > 400)
        seen = picture(driver)
        height, width, _ = seen.shape
        empty = seen[height // 2 + 5 :, width // 2 + 5 :]  # no robot stands there
        assert (empty == np.rint(np.array(raster.BACKGROUND) * 255)).all()
    finally:
        driver.set_window_size(size["width"], size["height"])
    assert errors(driver) == []


def test_a_notebook_shows_the_players_of_a_result_with_frames(driver, folder):
    opened(driver, folder / "notebook.html")
    driver.switch_to.frame(driver.find_element("css selector", "iframe"))
    assert asked(driver, "return player.supported && player.frames") == 384
    driver.switch_to.default_content()
    assert errors(driver) == []


def test_without_webgl_there_is_a_message_and_the_still_picture(folder):
    with chromium(*NO_WEBGL) as driver:
        opened(driver, folder / "three.html")
        assert not asked(driver, "return player.supported")
        message = driver.find_element("css selector", ".softvox-message")
        assert "no WebGL 2" in message.text
        still = driver.find_element("css selector", "img")
        assert still.is_displayed()
        assert driver.execute_script("return arguments[0].naturalWidth", still) == 900
        assert "Row by row: 6453" in driver.find_element("id", "robots").text
        asked(driver, "player.view = { follow: false, zoom: 2 }; player.play(); player.seek(9)")
        assert asked(driver, "return player.picture()") is None
        assert errors(driver) == []
