"""The committed comparisons: a slice of their runs, done again, gives the same bits."""

import csv
import json
from pathlib import Path

import pytest

from softvox_gym.landscapes.table import origin
from softvox_search.experiment.config import read
from softvox_search.experiment.environment import Environments
from softvox_search.experiment.job import do

BASELINES = Path(__file__).parents[2] / "baselines"
NAMES = ("noise_free", "noise")

#: Every so many cells, of which one run is done again.
CELLS_APART = {"noise_free": 1, "noise": 9}


def committed(name):
    with (BASELINES / name / "runs.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def manifest(name):
    return json.loads((BASELINES / name / "manifest.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", NAMES)
def test_a_slice_done_again_gives_the_same_bits(name):
    experiment = read(BASELINES / f"{name}.toml")
    rows = committed(name)
    runs = experiment.runs()
    assert len(rows) == len(runs)
    environments = Environments(experiment)
    cells = list(experiment.cells())[:: CELLS_APART[name]]
    for cell in cells:
        seed = (7 * cell.number) % cell.searcher.seeds
        run = next(r for r in runs if r.cell.number == cell.number and r.seed == seed)
        summary = do(experiment, run, environments).summary
        row = rows[run.number]
        for key, value in summary.items():
            assert row[key] == ("" if value is None else str(value)), (run, key)


@pytest.mark.parametrize("name", NAMES)
def test_it_was_made_from_the_file_beside_it_and_from_this_engine(name):
    made_from = manifest(name)["made_from"]
    config = json.loads(json.dumps(read(BASELINES / f"{name}.toml").to_dict()))
    assert made_from["config"] == config
    assert made_from["engine_digest"] == origin()["engine_digest"]


@pytest.mark.parametrize("name", NAMES)
def test_no_run_failed(name):
    assert {row["status"] for row in committed(name)} == {"ok"}


def test_enough_seeds_were_run():
    for name, seeds in (("noise_free", 100), ("noise", 50)):
        experiment = read(BASELINES / f"{name}.toml")
        assert experiment.seeds >= seeds
        assert all(one.seeds >= seeds or one.reason for one in experiment.searchers)


def test_every_table_and_figure_that_a_report_shows_is_there():
    for name in NAMES:
        folder = BASELINES / name
        text = (folder / "report.md").read_text(encoding="utf-8")
        shown = [part.split(")")[0] for part in text.split("](")[1:]]
        assert shown
        assert all((folder / path).is_file() for path in shown)
