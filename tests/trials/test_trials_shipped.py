"""What ships of trials: simulated ones of every reality, that say so, and the paper's Table I."""

from pathlib import Path

import pytest
import trials as tool

from softvox_gym import realities, reality
from softvox_gym.trials import transfers
from softvox_gym.trials.database import check, name_of, read, shipped

ROOT = Path(__file__).parents[2]


def test_the_nine_designs_ship_in_every_reality_and_no_measurement_is_invented():
    ours = [trial for trial in read(shipped()) if trial.who == tool.WHO]
    assert {trial.source for trial in ours} == {"simulated"}
    assert {trial.license for trial in ours} == {"CC0-1.0"}
    assert {trial.voxel_cm for trial in ours} == {1.0}
    told = sorted((trial.reality, trial.design.index) for trial in ours)
    names = ("published", *realities())
    assert told == sorted((name, design) for name in names for design in tool.DESIGNS)
    assert sum((shipped() / name_of(trial)).stat().st_size for trial in ours) < 400_000


def test_what_ships_has_no_fault_and_nothing_beside_the_trials():
    assert check(shipped()).faults == ()
    assert [path.name for path in shipped().iterdir() if path.suffix != ".json"] == ["README.md"]


@pytest.mark.parametrize("name", ["published", "reversal", "lag", "high_resolution"])
def test_simulating_them_again_gives_the_same_bytes(name):
    world = tool.PUBLISHED if name == "published" else reality(name)
    for trial in tool.trials_of(world, tool.DESIGNS[2:4]):
        assert (shipped() / name_of(trial)).read_bytes() == trial.to_bytes()


def test_the_papers_table_of_transfers_has_its_numbers_and_sources():
    rows = transfers()
    assert len(rows) == 25
    assert sum(row.controllers for row in rows) == 85
    assert sum(row.morphologies for row in rows) == 171
    assert (rows[-1].key, rows[-1].morphologies) == ("kriegman2020scalable", 108)
    assert all(row.authors and row.title and row.venue for row in rows)
    text = (ROOT / "docs" / "reality-gap.md").read_text("utf-8")
    for row in rows:
        source = f"{row.authors}, {row.title}, {row.venue}"
        assert f"| {source} | {row.year} | {row.controllers} | {row.morphologies} |" in text
