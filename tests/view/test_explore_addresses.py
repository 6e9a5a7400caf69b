"""What the address tells is what is seen, and what goes wrong is told and leaves that as it was."""

import pytest
from chromium import errors, needs_chromium, until
from explore_page import (
    SHORT,
    SHORT_STATE,
    applied,
    entered,
    facts,
    fitness_with,
    loaded,
    mouse,
    one,
    opened,
    opened_short,
    robots,
    shown,
)

from softvox_gym import simulate

pytestmark = needs_chromium


def state(driver):
    return driver.current_url.partition("#")[2]


def went(driver, text):
    """Change the address as somebody does who pastes a link into it."""
    driver.execute_script("location.hash = arguments[0]", text)


@pytest.mark.parametrize(
    ("address", "place", "words", "seen"),
    [
        ("design=9999", "message", "design '9999' is neither a number", ""),
        ("compare=9999", "message", "design '9999' is neither a number", ""),
        ("design=4295&compare=x", "message", "design 'x' is neither", "design=4295"),
        ("design=x&compare=4295", "message", "design 'x' is neither", "compare=4295"),
        ("friction_static=-1", "error-friction_static", "must be finite and not negative", ""),
        ("nonsense=1", "message", "nonsense is no parameter", ""),
        ("toString=1&design=4295", "message", "toString is no parameter", "design=4295"),
        ("map=bogus", "message", "there is no map bogus; the maps are fitness, heading", ""),
    ],
)
def test_an_address_with_a_mistake_says_so_and_shows_the_rest(
    driver, page, address, place, words, seen
):
    opened(driver, page, address)
    assert words in shown(driver, place)
    assert applied(driver) == {}
    expected = {"": "6453", "design=4295": "4295", "compare=4295": "6453 4295"}[seen]
    until(lambda: robots(driver) == expected)
    assert state(driver) == seen
    assert errors(driver) == []


def test_two_mistakes_are_both_told(driver, page):
    loaded(driver, page, "compare=x&gravity=bad")
    assert shown(driver, "error-gravity") == "gravity must be a number, got 'bad'"
    assert "design 'x' is neither" in shown(driver, "message")


@pytest.mark.parametrize(
    ("address", "words", "seen"),
    [
        ("design=4295&gravity=bad", "gravity must be a number", "4295"),
        ("design=9999", "design '9999' is neither", "2117"),
    ],
)
def test_another_address_with_a_mistake_keeps_what_was_seen_where_it_can(
    driver, page, address, words, seen
):
    opened(driver, page, "design=2117")
    went(driver, address)
    until(lambda: words in shown(driver, "message") + shown(driver, "error-gravity"))
    until(lambda: robots(driver) == seen)
    assert state(driver) == f"design={seen}"
    one(driver, "#which input[value='compare']").click()
    mouse(driver, 116).click().perform()
    until(lambda: robots(driver) == f"{seen} 116")
    one(driver, "#which input[value='design']").click()


def test_back_and_forward_lead_through_what_was_seen(driver, page):
    opened_short(driver, page)
    mouse(driver, 4295).click().perform()
    until(lambda: robots(driver) == "4295")
    entered(driver, "#value-gravity", "-3")
    until(lambda: applied(driver) == {**SHORT, "gravity": "-3"})
    driver.back()
    until(lambda: applied(driver) == SHORT)
    assert (robots(driver), state(driver)) == ("4295", f"design=4295&{SHORT_STATE}")
    assert shown(driver, "value-gravity", "value") == "-9.81"
    driver.back()
    until(lambda: robots(driver) == "6453")
    driver.forward()
    until(lambda: robots(driver) == "4295")
    driver.forward()
    until(lambda: applied(driver) == {**SHORT, "gravity": "-3"})
    assert facts(driver)["fitness"] == [f"{fitness_with(gravity=-3.0)[4295]:.4f}"]
    assert facts(driver)["published"] == [f"{simulate(4295).fitness[0]:.4f}"]
    assert errors(driver) == []


def test_what_is_refused_is_no_step_back(driver, page):
    opened(driver, page, "design=4295")
    before = driver.execute_script("return history.length")
    entered(driver, "#find-text", "6561")
    until(lambda: shown(driver, "message"))
    entered(driver, "#value-friction_static", "-1")
    until(lambda: shown(driver, "error-friction_static"))
    assert driver.execute_script("return history.length") == before
    assert state(driver) == "design=4295"


def test_a_click_just_before_a_landscape_arrives_is_not_lost(driver, page):
    """The robots of the new landscape are asked for while those of the click are under way."""
    opened_short(driver, page)
    for delay, gravity, design in ((0, "-3", "4295"), (60, "-4", "2117"), (600, "-5", "926")):
        driver.execute_script(
            """const [delay, gravity, design] = arguments;
            const field = document.getElementById("value-gravity");
            field.value = gravity;
            field.dispatchEvent(new Event("change"));
            setTimeout(() => {
              document.getElementById("find-text").value = design;
              document.getElementById("find").requestSubmit();
            }, delay);""",
            *(delay, gravity, design),
        )
        until(lambda gravity=gravity: applied(driver) == {**SHORT, "gravity": gravity})
        until(lambda design=design: robots(driver) == design)
        assert state(driver) == f"design={design}&{SHORT_STATE}&gravity={gravity}"


def test_the_robot_that_a_click_sets_is_the_one_to_edit(driver, page):
    opened(driver, page, "design=6453&compare=4295")
    one(driver, "#which input[value='compare']").click()
    assert shown(driver, "find-text", "value") == "4295"
    one(driver, "[data-site='1']").click()
    until(lambda: robots(driver) == f"6453 {4295 + 3}")
    one(driver, "#which input[value='design']").click()
    assert shown(driver, "find-text", "value") == "6453"


def test_a_path_that_is_refused_leaves_the_address_and_the_path_seen_before(driver, page):
    seen = "searcher=random&seed=1&budget=20"
    opened(driver, page, seen)
    said = until(lambda: shown(driver, "path-text"))
    driver.execute_script("document.getElementById('path').noValidate = true")
    entered(driver, "#budget", "9000")
    until(lambda: "budget must be a whole number" in shown(driver, "path-text"))
    assert state(driver) == seen
    entered(driver, "#budget", "20")
    until(lambda: shown(driver, "path-text") == said)


def lost(driver, verb):
    """Take the player's graphics away (lose), or give them back (restore)."""
    driver.execute_async_script(
        "const [verb, done] = arguments, canvas = document.querySelector('#player canvas');"
        "window.card ??= canvas.getContext('webgl2').getExtension('WEBGL_lose_context');"
        "const event = { lose: 'webglcontextlost', restore: 'webglcontextrestored' }[verb];"
        "canvas.addEventListener(event, () => setTimeout(done), { once: true });"
        "card[`${verb}Context`]()",
        verb,
    )


def test_without_graphics_the_robot_chosen_is_shown_still_and_moves_again_with_them(driver, page):
    opened(driver, page)
    lost(driver, "lose")
    entered(driver, "#find-text", "4295")
    until(lambda: robots(driver) == "4295")
    still = "querySelector('.softvox-lost img')?.naturalWidth > 200"
    until(lambda: shown(driver, "player", still))
    assert "took the graphics away" in shown(driver, "player")
    stage = one(driver, "#player .softvox-stage")
    assert stage.size["height"] > 150
    lost(driver, "restore")
    assert shown(driver, "player", "querySelector('img')") is None
    assert "4295 · " in one(driver, ".softvox-labels").text
    entered(driver, "#find-text", "100")
    until(lambda: robots(driver) == "100")
    assert "100 · " in one(driver, ".softvox-labels").text
    assert shown(driver, "player", "player.supported")


def test_infinite_travel_is_crossed_out(driver, page):
    opened(driver, page, f"strain=1e300&{SHORT_STATE}")
    until(lambda: applied(driver) == {**SHORT, "strain": "1e300"})
    assert "designs diverged (\N{MULTIPLICATION SIGN})" in shown(driver, "changes")
    assert shown(driver, "unit").endswith("\N{MULTIPLICATION SIGN}: diverged")
    assert (facts(driver)["fitness"], facts(driver)["rank of 6561"]) == (["diverged"], ["none"])
    assert "6453 was the best: it diverged" in shown(driver, "changes")
    assert errors(driver) == []
