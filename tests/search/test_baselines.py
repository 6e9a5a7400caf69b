"""The committed comparisons: a slice of their runs, done again, gives the same bits."""

from pathlib import Path

import pytest

from softvox_gym import realities
from softvox_search.experiment.environments import Environments
from softvox_search.experiment.results import read, read_manifest
from softvox_search.experiment.run import do, made_with
from softvox_search.experiment.schema import Run
from softvox_search.experiment.schema import read as read_file
from softvox_search.report import page as searchers
from softvox_search.report import text, transfer

BASELINES = Path(__file__).parents[2] / "baselines"
NAMES = ("noise_free", "noise", "transfer", "lattices", "phased")

#: Every so many cells, of which one run is done again.
CELLS_APART = {"noise_free": 1, "noise": 23, "transfer": 13, "lattices": 15, "phased": 1}

#: Methods that simulate for long, or need what the tests don't.
COSTLY = ("eea", "domain_randomisation", "simopt", "npe", "mfbo")

#: Evaluations that are done again where the table that answered does not ship.
FEW = 200


def is_cheap(run):
    """Whether a run can be done again here: what it is done in ships, and so does its method."""
    if isinstance(run, Run):
        is_simulated = run.problem.shape.phases > 2
        return not is_simulated or run.searcher.budget.checked().evaluations <= FEW
    return run.reality in realities() and run.kind not in COSTLY


@pytest.mark.parametrize("name", NAMES)
def test_a_slice_done_again_gives_the_same_bits(name):
    rows = read(BASELINES / name, of_transfer=None).runs.to_dict("records")
    runs = read_file(BASELINES / f"{name}.toml").runs()
    assert [row["status"] for row in rows] == ["ok"] * len(runs)
    cells = {}
    for run, row in zip(runs, rows, strict=True):
        names = run.names()
        del names["seed"]
        if is_cheap(run):
            cells.setdefault(str(names), []).append((run, row))
    environments = Environments()
    for number, cell in list(enumerate(cells.values()))[:: CELLS_APART[name]]:
        run, row = cell[7 * number % len(cell)]
        summary, _ = do(run, environments)
        assert {key: row[key] for key in summary if summary[key] is not None} == {
            key: value for key, value in summary.items() if value is not None
        }, run


@pytest.mark.parametrize(
    ("name", "seeds"),
    [("noise_free", 100), ("noise", 50), ("transfer", 20), ("lattices", 1), ("phased", 30)],
)
def test_it_was_made_from_the_file_beside_it_with_enough_seeds_and_from_this_engine(name, seeds):
    manifest, experiment = read_manifest(BASELINES / name), read_file(BASELINES / f"{name}.toml")
    assert manifest.experiment == experiment.to_dict()
    assert manifest.failed == []
    assert manifest.made_with["engine_probe"] == made_with()["engine_probe"]
    assert experiment.seeds >= seeds


@pytest.mark.parametrize("name", NAMES)
def test_every_table_and_figure_that_a_report_shows_is_there(name):
    text = (BASELINES / name / "report.md").read_text(encoding="utf-8")
    shown = [part.split(")")[0] for part in text.split("](")[1:]]
    assert shown
    assert all((BASELINES / name / path).is_file() for path in shown)


@pytest.mark.parametrize("name", NAMES)
def test_its_page_is_what_is_made_of_its_tables_today(name):
    folder = BASELINES / name
    pictures = [path.name for path in (folder / "figures").iterdir()]
    page = transfer.page if name == "transfer" else searchers.page
    made = page(read(folder, of_transfer=None), text.read(folder / "tables"), pictures)
    assert (folder / "report.md").read_text(encoding="utf-8") == made
