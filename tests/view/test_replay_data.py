"""Recordings hold the frames of a simulation, and pages hold recordings."""

import base64
import html
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from softvox_gym import Design, Physics, simulate
from softvox_gym.motion import Motion, rest_pose
from softvox_view import replay
from softvox_view.replay.data import bytes_per_frame
from softvox_view.replay.still import columns

SHORT = Physics.published().lasting(2)


@pytest.fixture(scope="module")
def result():
    return simulate([6453, 0, 2117], SHORT, frames=20)


def decoded(robot, name, *shape):
    """Return the array that counts stand for."""
    count = np.frombuffer(base64.b64decode(robot[name]), "<i2")
    scale = 1.0 if name == "quaternion" else robot["scale"]
    return (scale / 32767 * count).reshape(shape)


def centres(robot):
    return np.frombuffer(base64.b64decode(robot["centre"]), "<f4").reshape(-1, 3)


def test_a_recording_holds_every_voxels_movement_in_the_order_of_the_sites(result):
    data = replay.recording(result)
    robot = data["robots"][0]
    sites = [site for site, digit in enumerate("00021222") if digit != "0"]
    k, m = data["frames"], len(sites)
    assert robot["active"] == [int("00021222"[site] == "2") for site in sites]
    for name, width in (("position", 3), ("quaternion", 4), ("edge", 1)):
        seen = decoded(robot, name, k, m, width)
        truth = getattr(result.frames, name)[0] / (1 if name == "quaternion" else 0.01)
        expected = np.stack(
            [truth[:, site % 2, site // 2 % 2, site // 4] for site in sites], axis=1
        ).reshape(k, m, width)
        if name == "position":
            centre = expected.mean(axis=1, keepdims=True)
            np.testing.assert_array_equal(centres(robot), centre[:, 0].astype("<f4"))
            expected = expected - centre
        # Half a count of the rounding, and the float64 arithmetic around it.
        step = (1 if name == "quaternion" else robot["scale"]) / 32767
        assert (np.abs(seen - expected) <= step / 2 + 1e-12).all()
        assert step < 1e-4


def test_a_recording_says_when_each_frame_is(result):
    data = replay.recording(result)
    assert data["frames"] == len(result.frames.step)
    times = np.arange(data["frames"]) * data["seconds_per_frame"]
    np.testing.assert_allclose(times, result.frames.time[0], rtol=1e-12)
    assert data["cycles"] == pytest.approx((times[-1] - 0.25) * 4)


def test_a_recording_tells_design_fitness_and_physics(result):
    data = replay.recording(result, 2, 0)
    assert [robot["design"] for robot in data["robots"]] == [2117, 6453]
    assert data["robots"][1]["digits"] == "00021222"
    assert data["robots"][1]["fitness"] == result.fitness[0]
    assert data["robots"][1]["label"] == f"6453 · 00021222 · {result.fitness[0]:.2f} in 2 cycles"
    assert Physics.of({"preset": "exact", **data["physics"]}) == SHORT


def test_a_stride_keeps_every_so_manieth_frame(result):
    every, third = replay.recording(result, 0), replay.recording(result, 0, stride=3)
    assert third["seconds_per_frame"] == 3 * every["seconds_per_frame"]
    assert third["frames"] == len(range(0, every["frames"], 3))
    edges = decoded(every["robots"][0], "edge", every["frames"], 5, 1)[::3]
    thinned = decoded(third["robots"][0], "edge", third["frames"], 5, 1)
    np.testing.assert_array_equal(thinned, edges)


def test_a_recording_is_strict_json_of_the_size_that_is_reckoned_with(result):
    data = replay.recording(result, 0)
    text = json.dumps(data, allow_nan=False)
    names = "centre|position|quaternion|edge"
    arrays = sum(len(part) for part in re.findall(rf'"(?:{names})": "([^"]*)"', text))
    reckoned = bytes_per_frame([Design(6453)]) * data["frames"]
    assert 0.95 * reckoned < arrays <= reckoned


def test_the_empty_design_has_a_recording_without_voxels(result):
    robot = replay.recording(result, 1)["robots"][0]
    assert robot["active"] == []
    assert robot["position"] == ""


def test_a_run_that_ends_before_the_others_keeps_its_last_pose():
    result = simulate([6453, 6453], replace(SHORT, duration=[0.75, 0.5]), frames=20)
    data = replay.recording(result)
    longer, shorter = data["robots"]
    assert longer["last"] == data["frames"] - 1 > shorter["last"]
    assert (
        result.frames.time[1, shorter["last"]] <= 0.5 < result.frames.time[1, shorter["last"] + 1]
    )
    held = decoded(shorter, "position", data["frames"], 5, 3)[shorter["last"] :]
    assert (held == held[0]).all()
    assert (centres(shorter)[shorter["last"] :] == centres(shorter)[-1]).all()


def test_a_run_that_diverges_at_once_is_shown_as_built():
    phase = np.zeros((2, 2, 2, 2))
    phase[1] = 2.0**60  # too far to have parts of a turn
    result = simulate([6560, 6453], SHORT, phase=phase, frames=20)
    assert result.diverged.tolist() == [False, True]
    data = replay.recording(result)
    robot = data["robots"][1]
    assert robot["last"] == 0
    assert robot["fitness"] is None
    assert robot["label"] == "6453 · 00021222 · diverged"
    built = rest_pose(Design(6453).array)
    np.testing.assert_array_equal(Motion.of(result, 1).pose(9).position, built.position)
    json.dumps(data, allow_nan=False)


def test_a_robot_at_rest_stands_as_the_simulation_begins(result):
    built, begins = rest_pose(Design(6453).array), Motion.of(result, 0).pose(0)
    for name in ("position", "quaternion", "edge", "active"):
        np.testing.assert_allclose(getattr(built, name), getattr(begins, name), rtol=1e-12)


@pytest.mark.parametrize("every", [1, 20, 83])
def test_a_walk_is_as_long_as_the_fitness_says_whatever_the_frames(every):
    result = simulate([6453, 2117], SHORT, frames=every)
    ways = [np.hypot(*Motion.of(result, i).walk.way) for i in range(2)]
    np.testing.assert_allclose(ways, result.fitness, rtol=1e-12)


def test_a_robot_that_slides_far_is_recorded_as_finely():
    slide = replace(Physics.published(), gravity=(30.0, 0.0, -9.81), friction_kinetic=0.0)
    result = simulate(6453, replace(slide, friction_static=0.0), frames=100)
    robot = replay.recording(result)["robots"][0]
    assert centres(robot)[-1, 0] > 1000  # voxel widths; of that, 16 bits would be 0.02
    assert robot["scale"] / 32767 < 1e-4


def test_a_design_of_another_lattice_is_named_by_its_digits():
    result = simulate(Design("012210012210012210", shape=(3, 3, 2)), SHORT, frames=50)
    robot = replay.recording(result)["robots"][0]
    assert robot["design"] is None
    assert robot["label"].startswith("3×3×2 · 012210012210012210 · ")  # noqa: RUF001


def test_a_result_without_frames_can_t_be_recorded():
    with pytest.raises(ValueError, match=r"simulate\(\.\.\., frames=20\)"):
        replay.recording(simulate(6453, SHORT))


def test_places_outside_the_batch_and_strides_below_one_are_refused(result):
    with pytest.raises(ValueError, match="design 3 of the batch was asked for, which has 0 to 2"):
        replay.recording(result, 3)
    with pytest.raises(ValueError, match="design -1 of the batch"):
        replay.still(result, -1)
    with pytest.raises(ValueError, match="stride must be at least 1, got 0"):
        replay.recording(result, stride=0)


def test_designs_with_different_clocks_are_not_recorded_together():
    physics = replace(SHORT, frequency_hz=np.array([4.0, 5.0]))
    result = simulate([6453, 6453], physics, frames=20)
    with pytest.raises(ValueError, match=r"share time step and frequency, got .*4 Hz.*5 Hz"):
        replay.recording(result)
    assert replay.recording(result, 1)["frequency_hz"] == 5.0


def test_the_page_is_one_small_file_that_names_no_address(result):
    data = replay.recording(result)
    page = replay.page(data, replay.still(result))
    assert len(page.encode()) < 500_000
    assert "default-src 'none'" in page
    assert not re.search(r"https?:|//[a-z]+\.", page.replace("// ", ""))
    assert not re.search(r"^\s*import\b|\{\{\w+\}\}", page, flags=re.MULTILINE)
    held = re.search(r'id="recording">(.*?)</script>', page)[1]
    assert json.loads(held) == json.loads(json.dumps(data))


def test_a_title_is_text_and_nothing_else(result):
    page = replay.page(replay.recording(result, 0), replay.still(result, 0), title="</title><b>")
    assert "</title><b>" not in page
    assert "<title>&lt;/title&gt;&lt;b&gt;</title>" in page


def test_a_still_shows_the_designs_in_rows(result):
    assert [columns(n) for n in (0, 1, 2, 3, 4, 5, 9, 10)] == [1, 1, 2, 3, 2, 3, 3, 4]
    picture = replay.still(result, panel=(40, 30))
    assert picture.shape == (30, 120, 3)
    alone = replay.still(result, 2, panel=(40, 30))
    np.testing.assert_array_equal(picture[:, 80:], alone)


def test_a_notebook_shows_the_fittest_first_and_what_diverged():
    result = simulate([2117, 6453, 0], SHORT)
    shown = result._repr_html_()
    assert "<iframe" not in shown
    assert re.findall(r"<td>([012]{8})</td>", shown) == ["00021222", "20102220", "00000000"]
    assert f"<td>{result.fitness[1]:.3f}</td>" in shown
    assert 'src="data:image/png;base64,' in shown
    gone = simulate([6560], replace(Physics.published(), strain=150.0))
    assert "<td>diverged</td>" in gone._repr_html_()


def test_a_notebook_plays_a_result_with_frames_in_little_space():
    shown = simulate(range(6500, 6560), SHORT, frames=1)._repr_html_()
    assert len(shown) < 800_000
    assert "60 designs, the fittest 8" in shown
    inner = html.unescape(re.search(r'srcdoc="([^"]*)"', shown)[1])
    data = json.loads(re.search(r'id="recording">(.*?)</script>', inner)[1])
    assert len(data["robots"]) == 3
    assert data["frames"] <= 400


def test_a_notebook_plays_those_that_share_the_fittests_clock():
    physics = replace(SHORT, frequency_hz=np.array([4.0, 5.0, 4.0]))
    result = simulate([6453, 2117, 6489], physics, frames=20)
    inner = html.unescape(re.search(r'srcdoc="([^"]*)"', result._repr_html_())[1])
    data = json.loads(re.search(r'id="recording">(.*?)</script>', inner)[1])
    fittest = int(np.argmax(result.fitness))
    assert data["frequency_hz"] == physics.frequency_hz[fittest]
    assert data["robots"][0]["fitness"] == result.fitness[fittest]


def test_a_notebook_shows_an_empty_batch():
    assert "0 designs" in simulate([], SHORT)._repr_html_()


def test_a_notebook_shows_a_design_as_built_with_its_facts():
    shown = Design(6453)._repr_html_()
    assert '<img alt="6453 · 00021222" src="data:image/png;base64,' in shown
    row = ["6453", "2x2x2", "00021222", "5", "4", "yes"]
    assert re.findall("<td>(.*?)</td>", shown) == row


@pytest.mark.parametrize(
    ("side", "number"), [(3, str(Design("2" * 27, shape=(3, 3, 3)).index)), (4, "")]
)
def test_a_notebook_names_a_robot_on_a_large_lattice_by_its_digits(side, number):
    shape = (side,) * 3
    design = Design("2" * side**3, shape=shape)
    for shown in (design._repr_html_(), simulate(design, SHORT, frames=200)._repr_html_()):
        assert f"<td>{number}</td><td>{side}x{side}x{side}</td><td>{design.digits}</td>" in shown
