"""Trials of robots in the app: on the map, and their tracks beside the simulated ones.

What is called measured here is made from the pseudo-reality `area_friction`, with noise.
"""

import json
import re
from argparse import Namespace
from dataclasses import replace

import numpy as np
import pytest
from chromium import errors, needs_chromium, until
from explore_page import facts, loaded, map_pixels, one, opened, shown
from node import answer, needs_node

from softvox_gym import Design, Lattice, simulate
from softvox_gym.cli import main
from softvox_gym.cli.terminal import BadInputError
from softvox_gym.real_tracks import track_at
from softvox_gym.trials.database import add, read, shipped
from softvox_view.cli.explore import trials_of
from softvox_view.explore.trials import MOST, told

#: Of those that ship, in which measured ones may be some day.
SIMULATED = {
    (trial.reality, trial.design.index): trial
    for trial in read(shipped())
    if trial.source == "simulated"
}


def as_measured(design, repetition):
    """What a lab might have measured of a robot with voxels of 1.5 cm."""
    trial = SIMULATED["area_friction", design]
    noise = np.random.default_rng([design, repetition]).normal(0, 0.1, trial.position.shape)
    noise[0] = 0
    facts = {"source": "measured", "reality": "", "date": "2026-11-27", "voxel_cm": 1.5}
    position = (trial.position + noise) * 1.5
    return replace(
        trial, position=position, surface="acrylic", repetition=repetition, who="Lab", **facts
    )


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    folder = tmp_path_factory.mktemp("trials") / "lab"
    large = replace(as_measured(573, 1), design=Design(2, shape=[3, 3, 3]))
    add(folder, [as_measured(6453, 1), as_measured(6453, 2), as_measured(573, 1), large])
    worlds = ("published", "reversal")
    add(folder, [trial for trial in SIMULATED.values() if trial.reality in worlds])
    return folder


@pytest.fixture(scope="module")
def page(lab):
    path = lab.parent / "landscape.html"
    assert main(["explore", "--trials", str(lab), "--out", str(path)]) == 0
    return path.as_uri()


def test_trials_are_told_by_what_they_were_tried_in_in_voxel_widths(lab):
    groups = json.loads(json.dumps(told(read(lab))))
    names = ["measured: acrylic, 4 Hz", "simulated: published", "simulated: reversal"]
    assert list(groups) == names
    assert {
        name: len(runs) for name, runs in groups["measured: acrylic, 4 Hz"]["designs"].items()
    } == {
        "573": 1,
        "6453": 2,
    }
    short = SIMULATED["reversal", 573]
    points = groups["simulated: reversal"]["designs"]["573"][0]["points"]
    np.testing.assert_allclose(points, np.c_[short.cycle, short.position], atol=1e-4)


def test_a_long_track_keeps_its_whole_cycles_and_its_end():
    trial = as_measured(6453, 1)
    assert len(trial.cycle) > MOST
    ((group,),) = (made["designs"]["6453"] for made in told([trial]).values())
    cycle, *position = np.array(group["points"]).T
    assert len(cycle) <= MOST
    assert set(range(91)) <= set(cycle.tolist())
    exact = track_at(cycle, trial.cycle, trial.position) / 1.5
    np.testing.assert_allclose(np.c_[position[0], position[1]], exact, atol=1e-4)
    endless = replace(trial, cycle=trial.cycle * 50.5, cycles=None)
    ((group,),) = (made["designs"]["6453"] for made in told([endless]).values())
    assert len(group["points"]) == MOST
    assert group["points"][-1][0] == 4545


def test_robots_that_the_map_has_not_are_left_out_and_a_folder_of_them_refused(
    tmp_path, lab, capsys
):
    trials_of(Namespace(trials=[lab], shipped=False))
    words = "softvox: warning: 1 of 22 trials are of other lattices, and left out\n"
    assert capsys.readouterr().err == words
    assert {*SIMULATED.values()} <= {*trials_of(Namespace(trials=[], shipped=True))}
    large = tmp_path / "large"
    add(large, [trial for trial in read(lab) if trial.design.lattice != Lattice()])
    for folder, words in [(large, "no trial of a 2x2x2 robot"), (tmp_path / "no", "")]:
        with pytest.raises(BadInputError, match=rf"^--trials .*{folder}.*{words}"):
            trials_of(Namespace(trials=[folder], shipped=False))


@needs_chromium
def test_a_measured_design_has_its_tracks_over_the_simulated_one(driver, page):
    loaded(driver, page)
    until(lambda: facts(driver, "trials-views"))
    runs = [as_measured(6453, repetition) for repetition in (1, 2)]
    mean = np.mean([track_at(np.array([15.0]), t.cycle, t.position) / 1.5 for t in runs], axis=0)[0]
    here = simulate([6453]).displacement[0, :2]
    numbers = facts(driver, "trials-views")
    assert numbers[""] == ["published", "trials"]
    assert numbers["after cycles"] == ["15", "15"]
    assert numbers["distance"] == [f"{np.hypot(*end):.2f}" for end in (here, mean)]
    assert numbers["ends apart"] == [f"{np.hypot(*(here - mean)):.2f}", ""]
    assert "the mean of 2 trials, measured" in shown(driver, "trials-views")
    assert shown(driver, "trials-key") == " 2 designs, 3 trials, measured: acrylic, 4 Hz"
    assert len(driver.find_elements("css selector", "#trials-views path.measured")) == 2
    one(driver, "#whole").click()
    numbers = facts(driver, "trials-views")
    assert numbers["after cycles"] == ["15", "90"]
    end = np.mean([t.position[-1] / 1.5 for t in runs], axis=0)
    headings = [np.degrees(np.arctan2(y, x)) for x, y in (here, end)]
    minus = "\N{MINUS SIGN}"
    assert numbers["heading, °"] == [f"{angle:.1f}".replace("-", minus) for angle in headings]
    turn = abs((headings[0] - headings[1] + 180) % 360 - 180)
    assert float(numbers["heading error, °"][0]) == pytest.approx(turn, abs=0.06)
    assert driver.current_url.endswith("#whole=yes")
    assert errors(driver) == []


@needs_chromium
def test_a_design_that_nobody_tried_is_refused_by_name_and_those_tried_are_found(driver, page):
    opened(driver, page, "design=926")
    words = "Nobody measured design 926 in “measured: acrylic, 4 Hz”"
    until(lambda: words in shown(driver, "trials-views"))
    assert "measured were 573, 6453." in shown(driver, "trials-views")
    script = "softvox.trials(arguments[0]).then(arguments[1], (e) => arguments[1](e.message))"
    assert driver.execute_async_script(script, 926).startswith(words)
    assert len(driver.execute_async_script(script, 6453)) == 2
    assert "there are no trials moon" in driver.execute_async_script(
        script.replace("(arguments[0])", "(arguments[0], 'moon')"), 6453
    )
    bare = map_pixels(driver)
    one(driver, "#filters [name=tried]").click()
    cards = "return [...document.querySelectorAll('#leaders button')].map((b) => +b.dataset.design)"
    assert driver.execute_script(cards) == [6453, 573]
    assert (map_pixels(driver) != bare).mean() > 0.5
    one(driver, "#leaders li:nth-child(2) button").click()
    until(lambda: "Design 573 from above" in shown(driver, "trials-views"))
    assert driver.current_url.endswith("#design=573&tried=yes")
    assert errors(driver) == []


@needs_chromium
def test_what_is_shown_is_chosen_by_keys_and_kept_in_the_address(driver, page):
    from selenium.webdriver.support.select import Select

    opened(driver, page)
    with_pins = map_pixels(driver)
    one(driver, "#tried-in").send_keys("none")
    until(lambda: not shown(driver, "trials-views"))
    assert driver.current_url.endswith("#trials=none")
    assert shown(driver, "trials-key", "hidden")
    changed = (map_pixels(driver) != with_pins).any(axis=2).sum()
    assert 20 < changed < 800, "two pins are gone, and nothing else has changed"
    Select(one(driver, "#tried-in")).select_by_value("simulated: reversal")
    until(lambda: "1 trial, simulated" in shown(driver, "trials-views"))
    assert shown(driver, "trials-key") == " 9 designs, 9 trials, simulated: reversal"
    assert re.search(r"#trials=simulated%3A\+reversal$", driver.current_url)
    opened(driver, page, "trials=simulated: published&compare=573")
    until(lambda: shown(driver, "trials-views", "children.length") == 2)
    numbers = facts(driver, "trials-views")  # of 573, the second
    assert numbers["distance"] == [f"{simulate([573]).fitness[0]:.2f}"] * 2
    assert numbers["ends apart"] == ["0.00", ""]
    assert numbers["heading error, °"] == ["0.0", ""]
    opened(driver, page, "trials=moon")
    assert shown(driver, "message").startswith("there are no trials moon; there are measured: a")
    assert errors(driver) == []


@needs_node
def test_tracks_are_compared_after_as_many_cycles_as_all_have_or_at_their_ends(tmp_path):
    here = {"name": "here", "points": [[0, 0, 0], [2, 4, 0], [3, 4, 4]]}
    runs = [{"points": [[0, 0, 0], [4, 0, 8]]}, {"points": [[0, 0, 0], [5, 0, 10]]}]
    simulated = [here, {"name": "lost", "points": None}]
    script = "return [0, 1].map((whole) => trials.compared(given[0], given[1], 'measured', whole));"
    (own, lost, tried), ends = answer(tmp_path, script, [simulated, runs])
    assert (own["cycles"], own["end"], tried["cycles"], tried["end"]) == (3, [4, 4], 3, [0, 6])
    assert own["turn"] == pytest.approx(45)
    assert own["apart"] == pytest.approx(np.hypot(4, 2))
    assert {lost[name] for name in ("cycles", "distance", "heading", "turn", "apart")} == {None}
    assert (ends[0]["cycles"], ends[-1]["cycles"], ends[-1]["end"]) == (3, 4.5, [0, 9])
