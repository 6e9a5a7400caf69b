"""softvox replay: what it writes, and what it refuses."""

import io
import json
import re
import struct
from itertools import pairwise

import cli_process
import numpy as np
import pytest
from films import read_film

import softvox_gym.cli
import softvox_gym.missing
from softvox_gym import Physics, landscape, reality, simulate
from softvox_gym.landscapes.analysis import symmetry_classes
from softvox_gym.simulation import spaced
from softvox_view.cli import replay
from softvox_view.replay import still as still_of

image = pytest.importorskip("PIL.Image")
pytest.importorskip("imageio_ffmpeg")


@pytest.fixture
def softvox(monkeypatch, capsys, tmp_path):
    """Return what runs the command in a folder of its own: (status, output, error)."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(softvox_gym.cli, "COMMANDS", (replay,))
    monkeypatch.setattr(softvox_gym.cli, "entry_points", lambda **_: ())

    def run(*arguments):
        status = softvox_gym.cli.main(["replay", *arguments])
        said = capsys.readouterr()
        return status, said.out, said.err

    return run


def recorded(path):
    held = re.search(r'id="recording">(.*?)</script>', path.read_text("utf-8"))
    return json.loads(held[1])


def test_the_default_is_a_page_named_after_the_design(softvox, tmp_path):
    status, out, err = softvox("6453")
    assert (status, err) == (0, "")
    path = tmp_path / "replay-6453.html"
    assert path.stat().st_size < 200_000
    assert re.fullmatch(
        r"wrote replay-6453\.html: \d+ kB, 6453 · 00021222 · 4\.66 in 15 cycles\n", out
    )
    data = recorded(path)
    assert data["robots"][0]["fitness"] == simulate(6453).fitness[0]
    assert 1 / data["seconds_per_frame"] == pytest.approx(24 * 4, rel=0.01)


def test_several_designs_stand_in_one_page(softvox, tmp_path):
    assert softvox("6453", "20002221", "6489")[0] == 0
    path = tmp_path / "replay-6453-4295-6489.html"
    assert [robot["design"] for robot in recorded(path)["robots"]] == [6453, 4295, 6489]
    assert path.stat().st_size < 500_000


@pytest.mark.parametrize("designs", [["6560"] * 16, [str(i) for i in range(6400, 6416)]])
def test_sixteen_designs_still_fit_well_under_a_megabyte(softvox, tmp_path, designs):
    assert softvox(*designs, "--out", "all.html")[0] == 0
    assert (tmp_path / "all.html").stat().st_size < 750_000


def test_options_change_the_physics_and_the_cycles(softvox, tmp_path):
    options = ("--friction-static", "0.7", "--friction-kinetic", "0.4", "--cycles", "3")
    assert softvox("6453", "--out", "a.html", "--fps", "50", *options)[0] == 0
    data = recorded(tmp_path / "a.html")
    assert data["physics"]["friction_static"] == 0.7
    assert 1 / data["seconds_per_frame"] == pytest.approx(50, rel=0.02)
    assert data["cycles"] == pytest.approx(3, abs=0.1)
    assert "in 3 cycles" in data["robots"][0]["label"]


def test_cycles_follow_a_settling_of_any_length(softvox, tmp_path):
    assert softvox("6453", "--out", "a.html", "--cycles", "1", "--settle-time", "5")[0] == 0
    assert recorded(tmp_path / "a.html")["physics"]["duration"] == pytest.approx(5.25)


def test_a_gif_repeats_and_lasts_as_long_as_the_run_at_its_speed(softvox, tmp_path):
    assert softvox("6453", "--out", "a.gif", "--cycles", "2", "--width", "160")[0] == 0
    film = image.open(io.BytesIO((tmp_path / "a.gif").read_bytes()))
    assert film.size == (160, 120)
    assert film.info["loop"] == 0
    assert film.info["duration"] == 40
    # Two cycles are half a second, a whole one at half speed: 25 pictures and the first.
    assert film.n_frames in (25, 26)
    pictures = []
    for k in range(film.n_frames):
        film.seek(k)
        pictures.append(np.asarray(film.convert("RGB")).astype(int))
    changes = [np.abs(b - a).max() for a, b in pairwise(pictures)]
    # A cycle is 12.5 pictures. The robot rests in its last third: it moves by micrometres there.
    assert min(changes[:8] + changes[12:20]) > 20


@pytest.mark.parametrize(("wish", "fps"), [("30", 30), ("200", 50), ("14", 14)])
def test_a_gif_has_the_rate_asked_for_up_to_the_fastest_that_browsers_play(
    softvox, tmp_path, wish, fps
):
    options = ("--cycles", "1", "--width", "120", "--fps", wish, "--speed", "0.5")
    assert softvox("6453", "--out", "a.gif", *options)[0] == 0
    film = image.open(io.BytesIO((tmp_path / "a.gif").read_bytes()))
    assert film.n_frames == int(0.5 * fps) + 1
    lasts = [(film.seek(k), film.info["duration"])[1] for k in range(film.n_frames)]
    assert min(lasts) >= 20
    assert sum(lasts) == pytest.approx(1000 * film.n_frames / fps, abs=10)


@pytest.mark.parametrize(
    ("speed", "fps", "cycles"), [("0.01", "50", "0.1"), ("0.05", "25", "0.5"), ("3", "25", "15")]
)
def test_a_film_lasts_as_long_as_its_speed_says_however_slow(softvox, tmp_path, speed, fps, cycles):
    options = ("--speed", speed, "--fps", fps, "--cycles", cycles, "--width", "120")
    assert softvox("6453", "--out", "a.gif", *options)[0] == 0
    film = image.open(io.BytesIO((tmp_path / "a.gif").read_bytes()))
    lasts = sum((film.seek(k), film.info["duration"])[1] / 1000 for k in range(film.n_frames))
    assert lasts == pytest.approx(float(cycles) / 4 / float(speed), abs=1.1 / float(fps))


@pytest.mark.parametrize("kind", ["gif", "mp4"])
def test_a_film_tells_how_far_it_is(softvox, monkeypatch, kind):
    told = []

    class Told(replay.Progress):
        def __call__(self, done, total):
            told.append((done, total))

    monkeypatch.setattr(replay, "Progress", Told)
    assert softvox("6453", "--out", f"a.{kind}", "--cycles", "1", "--width", "120")[0] == 0
    assert told == [(k, len(told)) for k in range(1, len(told) + 1)]
    assert len(told) > 10


def test_a_narrow_picture_has_the_short_label(softvox, tmp_path):
    for name, width in (("narrow", "120"), ("wide", "480")):
        assert softvox("6453", "--out", f"{name}.png", "--width", width)[0] == 0
    ink = {}
    for name in ("narrow", "wide"):
        picture = np.asarray(image.open(tmp_path / f"{name}.png").convert("L"))
        top = picture[: round(0.11 * len(picture))]
        ink[name] = np.flatnonzero((top < 120).any(axis=0)).max() / picture.shape[1]
    assert ink["narrow"] < 0.75
    assert ink["wide"] < 0.97


def test_an_mp4_has_the_size_rate_and_pictures_asked_for(softvox, tmp_path):
    options = ("--cycles", "2", "--width", "161", "--fps", "30", "--speed", "1")
    assert softvox("6453", "6489", "--out", "a.mp4", *options)[0] == 0
    film = read_film(tmp_path / "a.mp4")
    assert (film.codec, film.fps) == ("h264", 30)
    assert film.pictures.shape[1:] == (120, 320, 3)
    assert len(film.pictures) in (15, 16)


@pytest.mark.parametrize("kind", ["html", "gif", "mp4", "png", "glb"])
def test_the_same_command_gives_the_same_bytes(softvox, tmp_path, kind):
    for name in ("a", "b"):
        options = () if kind in ("html", "glb") else ("--width", "120")
        assert softvox("6453", "--out", f"{name}.{kind}", "--cycles", "1", *options)[0] == 0
    assert (tmp_path / f"a.{kind}").read_bytes() == (tmp_path / f"b.{kind}").read_bytes()


def test_a_png_shows_the_robots_at_the_end(softvox, tmp_path):
    assert softvox("6453", "6489", "--out", "a.png", "--width", "200")[0] == 0
    picture = np.asarray(image.open(io.BytesIO((tmp_path / "a.png").read_bytes())))
    assert picture.shape == (150, 400, 3)
    result = simulate([6453, 6489], Physics.published(), frames=spaced(8831, 384))
    assert 8829 <= result.frames.step[-1] <= 8831
    still = still_of(result, panel=(200, 150))
    assert not np.array_equal(picture[:25], still[:25])  # the captions
    np.testing.assert_array_equal(picture[25:], still[25:])


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("9999",), "design '9999' is neither a number from 0 to 6560 nor 8 digits 0, 1, 2"),
        (("6453", "0002122x"), "design '0002122x' is neither"),
        (("6453", "--out", "a.avi"), "--out must end in .html, .gif, .mp4, .png, .glb, which"),
        (("6453", "--out", "none/a.html"), "--out none is not a folder; make it first"),
        (("6453", "--out", "."), "--out must end in"),
        (("6453", "--cycles", "0"), "--cycles: must be from 0.001 to 100000, got 0"),
        (("6453", "--cycles", "nan"), "--cycles: must be from 0.001 to 100000, got nan"),
        (("6453", "--cycles", "1e9"), "--cycles: must be from 0.001 to 100000, got 1e+09"),
        (("6453", "--cycles", "2", "--duration", "1"), "--cycles and --duration both say"),
        (("6453", "--fps", "0"), "--fps: must be from 0.01 to 1000, got 0"),
        (("6453", "--speed", "nan"), "--speed: must be from 0.01 to 1000, got nan"),
        (("6453", "--out", "a.png", "--fps", "9"), "--fps is for films and pages"),
        (("6453", "--width", "300"), "--width is for films and .png"),
        (("6453", "--out", "a.png", "--width", "9"), "--width: must be from 120 to 1920, got 9"),
        (("6453", "--cycles", "4000"), "give fewer designs, less time (--cycles) or a lower --fps"),
        (("6453", "--out", "a.mp4", "--cycles", "4000"), "and at most 6000 are made"),
        (("1", "2", "--out", "a.gif", "--width", "1920"), "the .gif would need 3.9 GiB of memory"),
        (tuple(["6453"] * 17), "17 designs were given, and at most 16 are shown side by side"),
        ((), "give either designs or --top N"),
        (("6453", "--top", "9"), "give either designs or --top N"),
        (("--top", "0"), "--top: must be a whole number above 0"),
        (("--top", "201"), "--top: must be from 1 to 200, got 201"),
        (("--top", "9", "--out", "a.mp4"), "--top makes a page; --out must end in .html, not .mp4"),
        (("--top", "9", "--fps", "9"), "--fps and --boxes are not for --top"),
        (("--top", "9", "--shape", "3", "1", "1"), "--shape is not for --top"),
        (("--top", "9", "--versus", "gravity=-1"), "--versus can't be combined with --top"),
        (("6453", "--versus", "garbage"), "'garbage' is neither reality=NAME nor parameters such"),
        (("6453", "--versus", "gravty=1"), "did you mean gravity=...?"),
        (("6453", "--versus", "gravity=down"), "--versus gravity must be a number, got 'down'"),
        (("6453", "--versus", "reality=x"), "--versus no reality 'x'"),
        (("6453", "--versus", "ground_contact=1"), "neither reality=NAME nor parameters"),
        (("6453", "--versus", "actuation=up"), "--actuation must be one of"),
        (("6453", "--versus", "strain=0.1", "--versus", "strain=0.1"), "is shown already"),
        (
            ("6453", *(part for k in range(4) for part in ("--versus", f"strain=0.{k}"))),
            "--versus takes at most 3 worlds",
        ),
        (("6453", "--out", "a.glb", "--boxes"), "--boxes is for pictures; a .glb always has boxes"),
        (("6453", "--out", "a.glb", "--width", "300"), "--width is for films and .png"),
        (("6453", "--friction-static", "-1"), "--friction-static must be finite and not negative"),
    ],
)
def test_bad_input_gets_one_line_and_leaves_nothing(softvox, tmp_path, arguments, said):
    status, out, err = softvox(*arguments)
    assert (status, out) == (2, "")
    assert said in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_two_worlds_share_one_scene_and_one_clock(softvox, tmp_path):
    options = ("--versus", "reality=reversal", "--cycles", "2", "--versus", "edge=0.02,strain=0.1")
    status, out, err = softvox("6453", "2117", "--out", "a.html", *options)
    assert (status, err) == (0, "")
    assert "reversal: 6453 · 00021222 · " in out
    data = recorded(tmp_path / "a.html")
    names = ["published", "reversal", "edge=0.02,strain=0.1"]
    assert [robot["world"] for robot in data["robots"]] == names * 2
    assert [robot["panel"] for robot in data["robots"]] == [0, 0, 0, 1, 1, 1]
    fitness = reality("reversal").physics.lasting(2)
    assert data["robots"][1]["fitness"] == simulate(6453, fitness).fitness[0]
    # The other's cycle takes twice as long, and its run ends later.
    assert data["frames"] * data["seconds_per_frame"] == pytest.approx(0.25 + 1.0, abs=0.02)
    assert data["robots"][0]["last"] * data["seconds_per_frame"] == pytest.approx(0.75, abs=0.02)
    shifts = np.array([robot["shift"] for robot in data["robots"][:3]])
    assert np.linalg.norm(np.diff(shifts, axis=0), axis=1) == pytest.approx([3.17] * 2, abs=0.01)


@pytest.mark.parametrize("kind", ["png", "mp4"])
def test_worlds_are_drawn_in_one_panel_with_their_names(softvox, tmp_path, kind):
    options = ("--cycles", "1", "--speed", "2")
    shown = {}
    for name, versus in (("a", ()), ("b", ("--versus", "reality=high_resolution"))):
        assert softvox("6453", "--out", f"{name}.{kind}", *options, *versus)[0] == 0
        read = (tmp_path / f"{name}.{kind}").read_bytes()
        shown[name] = (
            np.asarray(image.open(io.BytesIO(read)))
            if kind == "png"
            else read_film(tmp_path / f"{name}.mp4").pictures[-1]
        )
    assert shown["a"].shape == shown["b"].shape
    red, cyan = (
        [np.count_nonzero(p[..., a] > p[..., b].astype(int) + 80) for p in shown.values()]
        for a, b in ((0, 2), (2, 0))
    )
    assert red[1] < red[0]  # smaller, as two have to be seen
    assert cyan[1] > 2 * cyan[0]  # of the parts, those outside are passive


def test_the_top_are_one_of_each_symmetry_class_and_repeat_a_cycle(softvox, tmp_path):
    status, out, err = softvox("--top", "12", "--out", "gallery.html")
    assert (status, err) == (0, "")
    assert "12 robots, 4.66 and less" in out
    path = tmp_path / "gallery.html"
    assert path.stat().st_size < 350_000
    data = recorded(path)
    designs = [robot["design"] for robot in data["robots"]]
    assert designs[0] == 6453
    classes = symmetry_classes()[designs]
    assert len(set(classes)) == 12
    fitness = landscape()["fitness"]
    for design, robot in zip(designs, data["robots"], strict=True):
        alike = np.flatnonzero(symmetry_classes() == symmetry_classes()[design])
        assert fitness[design] == fitness[alike].max() == robot["fitness"]
    assert all(np.diff(fitness[designs]) <= 0)
    assert data["frames"] == 13
    assert 12 * data["seconds_per_frame"] * data["frequency_hz"] == pytest.approx(1, rel=0.02)


def test_a_glb_moves_a_box_per_voxel(softvox, tmp_path):
    assert softvox("6453", "--out", "a.glb", "--cycles", "1")[0] == 0
    content = (tmp_path / "a.glb").read_bytes()
    magic, version, size = struct.unpack("<4sII", content[:12])
    assert (magic, version, size) == (b"glTF", 2, len(content))
    length, kind = struct.unpack("<I4s", content[12:20])
    scene = json.loads(content[20 : 20 + length])
    binary = content[28 + length :]
    assert kind == b"JSON"
    assert scene["buffers"][0]["byteLength"] == len(binary)
    boxes = scene["nodes"][1:]
    assert [node["mesh"] for node in boxes] == [1, 0, 1, 1, 1]
    [walk] = scene["animations"]
    assert len(walk["channels"]) == 15

    def values(accessor):
        held = scene["accessors"][accessor]
        view = scene["bufferViews"][held["bufferView"]]
        part = binary[view["byteOffset"] :][: view["byteLength"]]
        return np.frombuffer(part, "<f4").reshape(held["count"], -1)

    moved = values(walk["samplers"][0]["output"])
    result = simulate(6453, Physics.published().lasting(1), frames=23)
    truth = result.frames.position[0, :, 1, 1, 0] / 0.01  # site 3, the first that has a voxel
    np.testing.assert_allclose(moved, truth, atol=2e-4)
    assert values(walk["samplers"][0]["input"])[-1, 0] == pytest.approx(result.frames.time[0, -1])
    assert np.linalg.norm(values(walk["samplers"][1]["output"]), axis=1) == pytest.approx(1.0)
    metres = np.diag([*scene["nodes"][0]["scale"]]) @ truth[0]
    np.testing.assert_allclose(metres, result.frames.position[0, 0, 1, 1, 0])


@pytest.mark.parametrize("kind", ["html", "png", "gif", "glb"])
def test_the_empty_design_is_shown_too(softvox, tmp_path, kind):
    options = ("--cycles", "1", "--versus", "strain=0.1")
    assert softvox("0", "6453", "--out", f"a.{kind}", *options)[0] == 0
    assert softvox("0", "--out", f"b.{kind}", "--cycles", "1")[0] == 0


def test_boxes_are_drawn_where_asked_for(softvox, tmp_path):
    for name, options in (("skin", ()), ("boxes", ("--boxes",))):
        assert softvox("6453", "--out", f"{name}.png", *options)[0] == 0
        assert softvox("6453", "--out", f"{name}.html", "--cycles", "1", *options)[0] == 0
    assert (tmp_path / "skin.png").read_bytes() != (tmp_path / "boxes.png").read_bytes()
    assert '"boxes":true' in (tmp_path / "boxes.html").read_text("utf-8")


def test_a_file_is_replaced_only_with_force(softvox, tmp_path):
    path = tmp_path / "a.html"
    path.write_text("mine")
    status, _, err = softvox("6453", "--out", "a.html")
    assert status == 2
    assert "a.html exists; choose another, or replace it with --force" in err
    assert path.read_text() == "mine"
    assert softvox("6453", "--out", "a.html", "--force")[0] == 0
    assert recorded(path)["robots"][0]["design"] == 6453


def test_a_missing_library_is_named_with_its_mend(softvox, monkeypatch):
    for module in (replay, softvox_gym.missing):
        monkeypatch.setattr(module, "find_spec", lambda name: None)
    status, _, err = softvox("6453", "--out", "a.mp4")
    assert status == 2
    assert "needs pillow and imageio-ffmpeg: pip install pillow imageio-ffmpeg" in err


def test_an_encoder_that_fails_is_told_in_one_line(softvox, monkeypatch, tmp_path):
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(tmp_path / "none"))
    status, _, err = softvox("6453", "--out", "a.mp4", "--cycles", "1")
    assert status == 2
    assert "the film can't be encoded" in err
    assert err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_terminal_that_knows_ascii_alone_gets_what_it_can_show(tmp_path):
    out = tmp_path / "a.html"
    done = cli_process.softvox("replay", "6453", "--out", str(out), PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == (0, "")
    assert re.match(r"wrote .*a\.html: \d+ kB, 6453 ", done.stdout)
    assert recorded(out)["robots"][0]["design"] == 6453
