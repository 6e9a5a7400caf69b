import io
import json
import os
import subprocess
import sys
from importlib.resources import files

import numpy as np
import pytest
from chromium import until

pytest.importorskip("starlette", reason="the app needs softvox-gym[explore]")
pytest.importorskip("uvicorn", reason="the app needs softvox-gym[explore]")


import softvox_gym
from softvox_gym import Physics, simulate
from softvox_view.explore import landscapes
from softvox_view.tessellation import cell_of

PARTS = [f"/{path.name}" for path in files("softvox_view.explore").joinpath("assets").iterdir()]


def test_it_listens_on_loopback_alone(served):
    assert served.server.socket.getsockname()[0] == "127.0.0.1"


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
    status, _, body = served.ask("/api/about", headers={"Host": host})
    assert status == 403
    assert "answers only as" in json.loads(body)["error"]


def test_localhost_is_this_machine_too(served):
    port = served.host.partition(":")[2]
    assert served.ask("/api/about", headers={"Host": f"localhost:{port}"})[0] == 200


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
    assert served.ask("/api/about", headers={"Origin": f"http://{served.host}"})[0] == 200


def test_another_site_may_link_to_the_page_but_not_embed_or_read_it(served):
    link = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
    assert served.ask("/", headers={**link, "Sec-Fetch-Dest": "document"})[0] == 200
    assert served.ask("/", headers={**link, "Sec-Fetch-Dest": "iframe"})[0] == 403
    assert served.ask("/api/about", headers={**link, "Sec-Fetch-Dest": "document"})[0] == 403
    image = {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "no-cors", "Sec-Fetch-Dest": "image"}
    assert served.ask("/api/still.png?design=6453", headers=image)[0] == 403


def test_the_atlas_is_the_table_and_the_tessellation(served):
    status, atlas = served.get("/api/atlas")
    table = softvox_gym.landscape()
    assert status == 200
    assert atlas["fitness"] == table["fitness"].tolist()
    assert atlas["noise"] == softvox_gym.noisy_landscape(1.0)["mean"].tolist()
    row, column = cell_of(np.array(atlas["cells"]))
    assert np.array_equal(row * atlas["side"] + column, np.arange(6561))


def test_a_robot_is_simulated_to_the_bits_of_the_engine(served):
    status, told = served.get("/api/robots?design=6453&compare=20002221&gravity=-3&actuation=clamp")
    physics = Physics.of({"preset": "published", "gravity": -3.0, "actuation": "clamp"})
    result = simulate([6453, "20002221"], physics)
    assert status == 200
    assert [robot["fitness"] for robot in told["robots"]] == result.fitness.tolist()
    assert [robot["design"] for robot in told["robots"]] == [6453, 4295]
    assert [robot["design"] for robot in told["recording"]["robots"]] == [6453, 4295]


@pytest.mark.parametrize("frequency", [0.01, 4, 500])
def test_a_recording_is_smooth_and_short_at_any_frequency(served, frequency):
    status, told = served.get(f"/api/robots?design=6453&frequency_hz={frequency}")
    assert status == 200
    assert 95 <= told["recording"]["frames"] <= 630  # whole steps between frames: 5 % either way


def test_the_empty_robot_can_be_shown(served):
    status, told = served.get("/api/robots?design=0")
    assert (status, told["robots"][0]["fitness"]) == (200, 0.0)


@pytest.mark.parametrize(
    ("query", "parameter", "words"),
    [
        ("", "design", "design '' is neither"),
        ("design=6561", "design", "design '6561' is neither a number from 0 to 6560"),
        ("design=1&compare=x", "compare", "design 'x' is neither"),
        ("design=1&friction_static=-1", "friction_static", "not negative, got -1.0"),
        ("design=1&gravity=", "gravity", "gravity must be a number, got ''"),
        ("design=1&density=1", "density", "there is no parameter 'density'"),
    ],
)
@pytest.mark.parametrize("path", ["/api/robots", "/api/replay.html", "/api/still.png"])
def test_a_bad_parameter_is_refused_with_its_name_and_what_was_expected(
    served, path, query, parameter, words
):
    status, told = served.get(f"{path}?{query}")
    assert (status, told["parameter"]) == (422, parameter)
    assert words in told["error"]


@pytest.mark.parametrize(
    ("path", "words"),
    [
        ("landscape?threads=9", "there is no parameter 'threads'"),
        ("landscape?strain=-3", "strain must be"),
        ("path?searcher=random&seed=-1&budget=9", "seed must be a whole number from 0 to"),
        ("path?searcher=random&seed=1&budget=2001", "budget must be a whole number from 1 to 2000"),
    ],
)
def test_bad_work_is_refused_before_it_begins(served, path, words):
    status, told = served.get(f"/api/{path}")
    assert status == 422
    assert words in told["error"]
    assert served.explorer.running == 0


def test_only_known_searchers_run_since_another_would_be_code(served):
    pytest.importorskip("softvox_search")
    _, (told,) = served.lines("/api/path", searcher="os:system", seed=1, budget=9)
    assert told["event"] == "error"
    assert "there is no searcher 'os:system'" in told["error"]


def test_a_landscape_is_computed_with_progress_to_the_bits_of_the_engine(served):
    status, events = served.lines("/api/landscape", gravity="-3")
    *progress, done = events
    result = simulate(np.arange(6561), Physics.of({"preset": "published", "gravity": -3.0}))
    assert status == 200
    assert {event["event"] for event in progress} == {"progress"}
    counts = [event["done"] for event in progress]
    assert counts == sorted(counts)
    assert done["event"] == "done"
    assert done["values"]["fitness"] == result.fitness.tolist()


def test_a_click_is_answered_while_landscapes_are_computed_and_who_goes_away_ends_one(served):
    with served.reading("/api/landscape", gravity=-7) as lines:
        assert next(lines)["event"] == "progress"
        with served.reading("/api/landscape", gravity=-8) as other:
            assert next(other)["event"] == "progress"
            assert served.get("/api/robots?design=4295&gravity=-7")[0] == 200
            assert served.explorer.running == 2
        until(lambda: served.explorer.running == 1)
        assert [line["event"] for line in lines][-1] == "done"
    until(lambda: served.explorer.running == 0)


def test_a_search_that_nobody_waits_for_is_ended(served):
    pytest.importorskip("softvox_search.single", reason="needs softvox-gym[search]")
    with served.reading("/api/path", searcher="ga", seed=1, budget=2000) as lines:
        assert next(lines)["event"] == "progress"
        assert children()
    until(lambda: served.explorer.running == 0)
    until(lambda: not children())


def children():
    """Return the processes that search."""
    found = subprocess.run(
        ["pgrep", "-P", str(os.getpid()), "-f", "softvox_view.explore.paths"],
        capture_output=True,
        check=False,
    )
    return found.stdout.split()


def test_work_that_fails_says_so(served, monkeypatch):
    def failing(*_, **__):
        raise ValueError("no such luck")

    monkeypatch.setattr(landscapes, "compute", failing)
    _, (told,) = served.lines("/api/landscape", gravity=-6.5)
    assert told == {"event": "error", "error": "no such luck"}


def test_a_replay_and_a_still_picture_can_be_had(served):
    status, headers, page = served.ask("/api/replay.html?design=6453&compare=4295")
    assert status == 200
    assert headers["content-disposition"] == 'attachment; filename="replay-6453-4295.html"'
    assert b"6453" in page
    _, headers, _ = served.ask("/api/replay.html?design=6453&gravity=-1.62&actuation=clamp")
    name = "replay-6453_gravity_-1.62_actuation_clamp.html"
    assert headers["content-disposition"] == f'attachment; filename="{name}"'
    status, headers, picture = served.ask("/api/still.png?design=6453")
    assert (status, headers["content-type"]) == (200, "image/png")
    image = pytest.importorskip("PIL.Image").open(io.BytesIO(picture))
    assert image.width > 200


def test_a_searchers_path_is_its_run_on_the_table(served):
    single = pytest.importorskip("softvox_search.single", reason="needs softvox-gym[search]")
    from softvox_search.oracle import Budget

    status, events = served.lines("/api/path", searcher="random", seed=5, budget=40)
    found = single.search("random", budget=Budget(unique=40), seed=5)
    assert status == 200
    assert events[-1]["event"] == "done"
    assert events[-1]["designs"] == found.columns["design"].tolist()
    assert events[-1]["recommended"] == found.design.index


@pytest.mark.parametrize(("name", "library"), [("ga", "deap"), ("tpe", "optuna")])
def test_a_searcher_whose_library_is_missing_says_what_to_install(name, library):
    pytest.importorskip("softvox_search.single", reason="needs softvox-gym[search]")
    code = (
        f"import sys; sys.modules[{library!r}] = None; "
        f"from softvox_view.explore.paths import main; main({name!r}, 1, 10)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    *_, told = map(json.loads, done.stdout.splitlines())
    assert name in told["error"]
    assert library in told["error"]
    assert "pip install" in told["error"]
