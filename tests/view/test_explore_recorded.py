"""Paths of searchers that were recorded by softvox compare, over the map."""

import csv
import shutil

import numpy as np
import pytest
from chromium import errors, needs_chromium, until
from cli_process import softvox

pytest.importorskip("starlette", reason="the app needs softvox-gym[explore]")
pytest.importorskip("uvicorn", reason="the app needs softvox-gym[explore]")
pytest.importorskip("softvox_search.single", reason="needs softvox-gym[search]")

from explore_page import map_pixels, one, opened, shown
from explore_serving import serving
from softvox_view.folders import ResultsError

from softvox_gym import landscape
from softvox_view.explore.recorded import read, read_all

parquet = pytest.importorskip("pyarrow.parquet", reason="needs softvox-gym[search]")

EXPERIMENT = """
seeds = 2
levels = [0.5]
[budget]
unique = 60
[[policies]]
name = "none"
[[searchers]]
name = "random"
[[searchers]]
name = "hill_climber"
"""
RANDOM = "random · noise 0.5 · none"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("recorded")
    (made / "small.toml").write_text(EXPERIMENT, "utf-8")
    done = softvox("compare", "small.toml", "--out", "small results", "--no-report", cwd=made)
    assert done.returncode == 0, done.stderr
    return made / "small results"


@pytest.fixture(scope="module")
def served(folder):
    with serving(read_all([folder])) as running:
        yield running


def asked(served, **changes):
    query = {"results": "small results", "searcher": RANDOM, "seed": "1", "budget": "60"}
    return served.lines("/api/path", **query | changes)


def test_what_was_recorded_is_offered(served):
    told = served.get("/api/about")[1]["results"]
    assert told == {"small results": [RANDOM, "hill_climber · noise 0.5 · none"]}


@pytest.mark.parametrize("budget", [60, 7])
def test_a_recorded_path_is_the_runs_evaluations_in_order(served, folder, budget):
    status, events = asked(served, budget=str(budget))
    with (folder / "runs.csv").open(newline="") as file:
        (run,) = [
            row for row in csv.DictReader(file) if (row["searcher"], row["seed"]) == ("random", "1")
        ]
    rows = parquet.read_table(folder / "evaluations.parquet").to_pylist()
    mine = [row for row in rows if row["run"] == int(run["run"])]
    assert status == 200
    told = events[-1]
    assert told["designs"] == [row["design"] for row in mine[:budget]]
    assert told["fitness"] == [row["fitness"] for row in mine[:budget]]
    assert told["total"] == len(mine) == 60
    assert told["recommended"] == int(run["recommended"])
    fitness = landscape()["fitness"]
    assert told["rank"] == 1 + (fitness > fitness[told["recommended"]]).sum()


@pytest.mark.parametrize(
    ("changes", "parameter", "words"),
    [
        ({"results": "other"}, "results", "there are no results 'other'; softvox explore"),
        ({"searcher": "random"}, "searcher", f"has no searcher 'random'; it has {RANDOM}, hill"),
        ({"seed": "2"}, "seed", "no finished run with the seed 2 in small results; its 2 have"),
        ({"seed": "-1"}, "seed", "seed must be a whole number from 0 to"),
        ({"budget": "0"}, "budget", "must be a whole number from 1 to 2000"),
    ],
)
def test_what_was_not_recorded_is_refused(served, changes, parameter, words):
    status, (told,) = asked(served, **changes)
    assert (status, told["parameter"]) == (422, parameter)
    assert words in told["error"]


def spoiled(folder, tmp_path, spoil):
    other = tmp_path / "other"
    shutil.copytree(folder, other)
    spoil(other)
    return other


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (shutil.rmtree, "is not a folder; name one that softvox compare has written"),
        (lambda at: (at / "runs.csv").unlink(), "has no runs.csv, which softvox compare FILE.toml"),
        (lambda at: (at / "evaluations.parquet").unlink(), "has no evaluations.parquet, which"),
        (lambda at: (at / "evaluations.parquet").write_bytes(b"x"), "lacks the column run;"),
        (lambda at: (at / "runs.csv").write_bytes(b"\xff\xfe"), "can't be read as the runs"),
        (lambda at: (at / "runs.csv").write_text("run,seed\n0,0\n"), "can't be read as the runs"),
        (lambda at: (at / "runs.csv").write_text("run,seed\n"), "holds no finished run; choose"),
        (lambda at: (at / "runs.csv").write_text(f'run\n"{"x" * 200_000}"\n'), "can't be read as"),
    ],
)
def test_a_folder_without_paths_is_refused_with_the_mend(folder, tmp_path, spoil, words):
    other = spoiled(folder, tmp_path, spoil)
    with pytest.raises(ResultsError) as caught:
        read(other)
    assert str(caught.value).startswith(str(other))
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_two_folders_of_one_name_are_refused(folder):
    with pytest.raises(ResultsError, match="two folders of results are called small results"):
        read_all([folder, folder])


def test_a_failed_run_has_no_path(folder, tmp_path):
    def fail(at):
        lines = (at / "runs.csv").read_text("utf-8").splitlines(keepends=True)
        failed = [line.replace(",ok,", ",failed,") for line in lines[:2]]
        (at / "runs.csv").write_text("".join([*failed, *lines[2:]]), "utf-8")

    found = read(spoiled(folder, tmp_path, fail))
    assert [sorted(runs) for runs in found.runs.values()] == [[1], [0, 1]]


def test_the_command_refuses_a_folder_that_is_none(tmp_path):
    done = softvox("explore", "--no-browser", "--results", str(tmp_path / "none"))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f"softvox: error: --results {tmp_path / 'none'} is not a folder; name one that softvox "
        "compare has written\n"
    )


def chosen(driver, name, text):
    from selenium.webdriver.support.ui import Select

    Select(one(driver, f"#{name}")).select_by_visible_text(text)


@needs_chromium
def test_a_recorded_path_is_laid_over_the_map_and_shared_by_its_address(driver, served):
    opened(driver, served)
    bare = map_pixels(driver)
    chosen(driver, "results", "small results")
    assert shown(driver, "search") == "Show"
    assert shown(driver, "seed", "value") == "0"
    chosen(driver, "searcher", RANDOM)
    one(driver, "#search").click()
    said = until(lambda: shown(driver, "path-text"))
    path = asked(served, seed="0")[1][-1]
    end = f"; it recommends {path['recommended']}, rank {path['rank']} of all"
    assert said.startswith("60 of 60 evaluations, 60 designs; ◆ best ")
    assert said.endswith(end)
    seen = map_pixels(driver)
    assert (seen != bare).any()
    address = driver.current_url
    opened(driver, served, address.partition("#")[2])
    assert until(lambda: shown(driver, "path-text")) == said
    assert np.array_equal(map_pixels(driver), seen)
    one(driver, "#clear-path").click()
    assert np.array_equal(map_pixels(driver), bare)
    assert "results" not in driver.current_url
    assert errors(driver) == []


@needs_chromium
def test_of_a_longer_run_the_first_evaluations_are_shown(driver, served):
    opened(driver, served, f"results=small+results&searcher={RANDOM}&seed=1&budget=7")
    said = until(lambda: shown(driver, "path-text"))
    path = asked(served)[1][-1]
    assert said.startswith("7 of 7 evaluations, 7 designs; ◆ best ")
    end = f"; it recommends {path['recommended']} after all 60, rank {path['rank']} of all"
    assert said.endswith(end)


@needs_chromium
def test_results_that_are_not_there_are_named(driver, served):
    opened(driver, served, "results=gone&searcher=random&seed=1&budget=7")
    assert "there are no results 'gone'" in until(lambda: shown(driver, "path-text"))
