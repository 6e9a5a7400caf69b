"""Paths of searchers that were recorded by softvox compare, over the map."""

import base64
import zlib
from dataclasses import replace
from urllib.parse import urlencode

import numpy as np
import pytest
from chromium import errors, needs_chromium, until
from cli_process import softvox

pytest.importorskip("msgspec", reason="needs softvox-gym[search]")

from explore_page import loaded, map_pixels, one, opened, shown

from softvox_gym import landscape
from softvox_gym.cli.terminal import BadInputError
from softvox_view.cli.options import read_results
from softvox_view.explore.paths import recorded

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
def page(folder):
    path = folder.parent / "landscape.html"
    done = softvox("explore", "--results", str(folder), "--out", str(path))
    assert done.returncode == 0, done.stderr
    return path.as_uri()


def unpacked(text, dtype):
    return np.frombuffer(zlib.decompress(base64.b64decode(text)), dtype).tolist()


def test_a_recorded_path_is_the_runs_evaluations_in_order(folder):
    results = read_results([folder])["small results"]
    told = recorded(results)
    assert list(told) == [RANDOM, "hill_climber · noise 0.5 · none"]
    assert list(told[RANDOM]) == ["0", "1"]
    runs = results.runs
    (run,) = runs[(runs["searcher"] == "random") & (runs["seed"] == 1)].to_dict("records")
    mine = parquet.read_table(folder / run["file"]).to_pylist()
    one = told[RANDOM]["1"]
    assert unpacked(one["designs"], "<u2") == [row["design"] for row in mine]
    assert unpacked(one["fitness"], "<f8") == [row["fitness"] for row in mine]
    assert one["total"] == len(mine) == 60
    assert one["recommended"] == int(run["recommended"])


@needs_chromium
@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"results": "other"}, "results 'other' are not there; softvox explore"),
        ({"searcher": "random"}, f"searcher 'random' is not among {RANDOM}, hill"),
        ({"seed": "2"}, "seed 2 was not recorded: "),
        ({"seed": "-1"}, "seed must be a whole number from 0 to"),
        ({"budget": "0"}, "budget must be a whole number from 1 to 2000"),
    ],
)
def test_what_was_not_recorded_is_refused(driver, page, changes, words):
    query = {"results": "small results", "searcher": RANDOM, "seed": "1", "budget": "60"}
    opened(driver, page, urlencode(query | changes))
    assert words in until(lambda: shown(driver, "path-text"))


def test_two_folders_of_one_name_are_refused(folder):
    with pytest.raises(BadInputError, match="two folders of results are called small results"):
        read_results([folder, folder])


def test_failed_runs_and_those_on_other_lattices_have_no_path_on_the_map(folder):
    results = read_results([folder])["small results"]
    runs = results.runs.copy()
    runs.loc[runs.index[0], "status"] = "failed"
    runs.loc[runs.index[-1], "shape"] = "3x3x3"
    shown = recorded(replace(results, runs=runs))
    assert sum(map(len, shown.values())) == len(runs) - 2 == 2


def test_the_command_refuses_a_folder_that_is_none(tmp_path):
    done = softvox("explore", "--results", str(tmp_path / "none"))
    assert (done.returncode, done.stdout) == (2, "")
    assert f"{tmp_path / 'none'}" in done.stderr
    assert "softvox compare FILE.toml --out" in done.stderr
    assert done.stderr.count("\n") == 1


def recommended(folder, seed):
    """Return what a run recommends and its rank, as the page tells it."""
    design = recorded(read_results([folder])["small results"])[RANDOM][str(seed)]["recommended"]
    fitness = landscape()["fitness"]
    return f"{design}, rank {1 + (fitness > fitness[design]).sum()}"


def chosen(driver, name, text):
    from selenium.webdriver.support.ui import Select

    Select(one(driver, f"#{name}")).select_by_visible_text(text)


@needs_chromium
def test_a_recorded_path_is_laid_over_the_map_and_shared_by_its_address(driver, page, folder):
    opened(driver, page)
    bare = map_pixels(driver)
    chosen(driver, "results", "small results")
    assert shown(driver, "search") == "Show"
    assert shown(driver, "seed", "value") == "0"
    chosen(driver, "searcher", RANDOM)
    one(driver, "#search").click()
    said = until(lambda: shown(driver, "path-text"))
    end = f"; it recommends {recommended(folder, 0)} of all"
    assert said.startswith("60 of 60 evaluations, 60 designs; ◆ best ")
    assert said.endswith(end)
    seen = map_pixels(driver)
    assert (seen != bare).any()
    address = driver.current_url
    loaded(driver, page, address.partition("#")[2])
    assert until(lambda: shown(driver, "path-text")) == said
    assert np.array_equal(map_pixels(driver), seen)
    one(driver, "#clear-path").click()
    assert np.array_equal(map_pixels(driver), bare)
    assert "results" not in driver.current_url
    assert errors(driver) == []


@needs_chromium
def test_of_a_longer_run_the_first_evaluations_are_shown(driver, page, folder):
    opened(driver, page, f"results=small+results&searcher={RANDOM}&seed=1&budget=7")
    said = until(lambda: shown(driver, "path-text"))
    assert said.startswith("7 of 7 evaluations, 7 designs; ◆ best ")
    design, rank = recommended(folder, 1).split(",")
    end = f"; it recommends {design} after all 60,{rank} of all"
    assert said.endswith(end)
