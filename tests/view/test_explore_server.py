import io
import json
import subprocess
import sys
import time
from importlib.resources import files

import numpy as np
import pytest
from chromium import until

pytest.importorskip("starlette", reason="the app needs softvox-gym[explore]")
pytest.importorskip("uvicorn", reason="the app needs softvox-gym[explore]")


import softvox_gym
from softvox_gym import Physics, simulate
from softvox_view import replay
from softvox_view.explore import landscapes
from softvox_view.tessellation import cell_of

PARTS = [f"/{path.name}" for path in files("softvox_view.explore").joinpath("assets").iterdir()]


@pytest.mark.parametrize("path", ["/", *PARTS, "/player/player.js"])
def test_the_page_and_its_parts_are_served_under_a_strict_policy(served, path):
    status, headers, body = served.ask(path)
    assert (status, len(body) > 100) == (200, True)
    assert "default-src 'self'" in headers["content-security-policy"]
    assert "http" not in headers["content-security-policy"]
    assert "access-control-allow-origin" not in headers


def test_the_page_names_no_other_host(served):
    for path in ("/", *PARTS):
        text = served.ask(path)[2].decode().replace("http://www.w3.org/2000/svg", "")
        assert "http:" not in text
        assert "https:" not in text


@pytest.mark.parametrize(
    "path", ["/..%2fapp.py", "/../app.py", "/player/..%2fpage.py", "/app.py", "/api/x"]
)
def test_nothing_else_is_served(served, path):
    assert served.ask(path)[0] == 404


@pytest.mark.parametrize("host", ["evil.example", "localhost.evil:80", ""])
def test_another_host_is_refused_as_of_a_rebound_name(served, host):
    assert served.ask("/api/start", headers={"Host": host})[0] == 400


def test_localhost_is_this_machine_too(served):
    port = served.host.partition(":")[2]
    assert served.ask("/api/start", headers={"Host": f"localhost:{port}"})[0] == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "http://127.0.0.1:1", "https://{}"]
)
@pytest.mark.parametrize("method", ["GET", "POST", "OPTIONS"])
def test_another_origin_is_refused(served, origin, method):
    headers = {"Origin": origin.format(served.host)}
    status, answered, _ = served.ask("/api/landscape", method=method, headers=headers)
    assert status == 403
    assert "access-control-allow-origin" not in answered


def test_its_own_origin_is_let_in(served):
    assert served.ask("/api/start", headers={"Origin": f"http://{served.host}"})[0] == 200


def test_another_site_may_link_to_the_page_but_not_embed_or_read_it(served):
    link = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
    assert served.ask("/", headers={**link, "Sec-Fetch-Dest": "document"})[0] == 200
    policy = served.ask("/", headers={**link, "Sec-Fetch-Dest": "iframe"})[1]
    assert "frame-ancestors 'none'" in policy["content-security-policy"]
    assert served.ask("/api/start", headers={**link, "Sec-Fetch-Dest": "document"})[0] == 403
    image = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"}
    assert served.ask("/api/still.png?design=6453", headers=image)[0] == 403


def test_the_atlas_is_the_table_and_the_tessellation(served):
    atlas = served.events("start")[-1]["answer"]
    table = softvox_gym.landscape()
    assert atlas["fitness"] == table["fitness"].tolist()
    assert atlas["noise"] == softvox_gym.noisy_landscape(1.0)["mean"].tolist()
    assert atlas["step_error"] == table["step_error"].tolist()
    row, column = cell_of(np.array(atlas["cells"]))
    assert np.array_equal(row * atlas["side"] + column, np.arange(6561))


def test_a_recording_is_of_the_designs_under_the_physics(served):
    changes = {"gravity": -3.0, "actuation": "clamp"}
    query = {"design": 6453, "compare": 20002221, **changes}
    told = served.events("recording", **query)[-1]["answer"]
    physics = Physics.of({"preset": "published", **changes})
    stride = round(float(physics.duration / physics.time_step) / told["frames"])
    made = replay.recording(simulate([6453, 4295], physics, frames=stride))
    assert told == json.loads(json.dumps(made))


@pytest.mark.parametrize("frequency", [0.01, 4, 500])
def test_a_recording_is_smooth_and_short_at_any_frequency(served, frequency):
    told = served.events("recording", design=6453, frequency_hz=frequency)[-1]["answer"]
    assert 95 <= told["frames"] <= 630  # whole steps between frames: 5 % either way


def test_the_empty_robot_can_be_shown(served):
    assert served.events("recording", design=0)[-1]["answer"]["frames"] > 0


@pytest.mark.parametrize(
    ("query", "parameter", "words"),
    [
        ("", "design", "design '' is neither"),
        ("design=6561", "design", "design '6561' is neither a number from 0 to 6560"),
        ("design=1&compare=x", "compare", "compare 'x' is neither"),
        ("design=1&friction_static=-1", "friction_static", "not negative, got -1.0"),
        ("design=1&gravity=", "gravity", "gravity must be a number, got ''"),
        ("design=1&density=1", "density", "density is no parameter"),
    ],
)
@pytest.mark.parametrize("path", ["recording", "replay.html", "still.png"])
def test_a_bad_parameter_is_refused_with_its_name_and_what_was_expected(
    served, path, query, parameter, words
):
    status, _, body = served.ask(f"/api/{path}?{query}")
    assert words in body.decode()
    if path == "recording":
        assert json.loads(body.removeprefix(b"data: "))["parameter"] == parameter
    else:
        assert (status, body.startswith(parameter.encode())) == (422, True)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("landscape?threads=9", "threads is no parameter"),
        ("landscape?strain=-3", "strain must be"),
        ("path?searcher=random&seed=-1&budget=9", "seed must be a whole number from 0 to"),
        ("path?searcher=random&seed=1&budget=2001", "budget must be a whole number from 1 to 2000"),
    ],
)
def test_bad_work_is_refused(served, path, words):
    told = json.loads(served.ask(f"/api/{path}")[2].removeprefix(b"data: "))
    assert words in told["error"]


def test_only_known_searchers_run_since_another_would_be_code(served):
    pytest.importorskip("softvox_search")
    (told,) = served.events("path", searcher="os:system", seed=1, budget=9)
    assert "searcher 'os:system' is unknown" in told["error"]


def test_a_landscape_is_computed_with_progress_to_the_bits_of_the_engine(served):
    *progress, done = served.events("landscape", gravity=-3)
    result = simulate(np.arange(6561), Physics.of({"preset": "published", "gravity": -3.0}))
    counts = [event["progress"][0] for event in progress]
    assert counts == sorted(counts)
    assert done["answer"]["values"]["fitness"] == result.fitness.tolist()


def test_a_click_is_answered_while_landscapes_are_computed_and_who_goes_away_ends_one(
    served, monkeypatch
):
    monkeypatch.setattr(landscapes, "compute", until_unwanted)
    with served.reading("landscape", gravity=-7) as mine:
        assert "progress" in next(mine)
        with served.reading("landscape", gravity=-8) as other:
            assert "progress" in next(other)
            assert "answer" in served.events("recording", design=4295, gravity=-7)[-1]
            assert served.explorer.running == 2
        until(lambda: served.explorer.running == 1)
        assert "progress" in next(mine)
    until(lambda: served.explorer.running == 0)
    until(lambda: ended == [-7, -8] or ended == [-8, -7])


ended = []


def until_unwanted(physics, *, progress, **options):
    try:
        while True:
            progress(1, 6561)
            time.sleep(0.01)
    finally:
        ended.append(physics.gravity)


def test_a_search_that_nobody_waits_for_is_ended_and_lets_the_next_one_in(served):
    pytest.importorskip("softvox_search.single", reason="needs softvox-gym[search]")
    with served.reading("path", searcher="ga", seed=1, budget=2000) as events:
        assert "progress" in next(events)
    until(lambda: served.explorer.running == 0)
    *_, told = served.events("path", searcher="random", seed=1, budget=5)
    assert len(told["answer"]["designs"]) == 5


def test_work_that_fails_says_so(served, monkeypatch):
    def failing(*_, **__):
        raise ValueError("no such luck")

    monkeypatch.setattr(landscapes, "compute", failing)
    (told,) = served.events("landscape", gravity=-6.5)
    assert told == {"error": "no such luck", "parameter": None}


def test_a_replay_and_a_still_picture_can_be_had(served):
    status, _, page = served.ask("/api/replay.html?design=6453&compare=4295&gravity=-1.62")
    assert status == 200
    assert b"6453" in page
    status, headers, picture = served.ask("/api/still.png?design=6453")
    assert (status, headers["content-type"]) == (200, "image/png")
    image = pytest.importorskip("PIL.Image").open(io.BytesIO(picture))
    assert image.width > 200


def test_a_searchers_path_is_its_run_on_the_table(served):
    single = pytest.importorskip("softvox_search.single", reason="needs softvox-gym[search]")
    from softvox_search.oracle import Budget

    told = served.events("path", searcher="random", seed=5, budget=40)[-1]["answer"]
    facts, log = single.search("random", budget=Budget(unique=40), seed=5)
    assert told["designs"] == log["design"].tolist()
    assert (told["recommended"], told["rank"]) == (facts["design"], facts["rank"])


@pytest.mark.parametrize(("name", "library"), [("ga", "deap"), ("tpe", "optuna")])
def test_a_searcher_whose_library_is_missing_says_what_to_install(name, library):
    pytest.importorskip("softvox_search.single", reason="needs softvox-gym[search]")
    code = (
        f"import sys; sys.modules[{library!r}] = None; "
        f"from softvox_view.explore.paths import search; "
        f"search({name!r}, seed=1, budget=10, progress=print)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    told = done.stderr.splitlines()[-1]
    assert name in told
    assert library in told
    assert "pip install" in told
