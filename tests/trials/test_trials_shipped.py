"""What ships of trials: simulated ones of every reality, that say so, and the paper's Table I."""

from pathlib import Path

import pytest
import trials as tool

from softvox_gym import realities, reality
from softvox_gym.data import TRIALS
from softvox_gym.trials import Trial, transfers

FILES = sorted(Path(str(TRIALS)).glob("*.json"))
ROOT = Path(__file__).parents[2]


def test_the_nine_designs_ship_in_every_reality_and_no_measurement_is_invented():
    made = [Trial.from_bytes(path.read_bytes()) for path in FILES]
    ours = [trial for trial in made if trial.who == tool.WHO]
    assert {trial.source for trial in ours} == {"simulated"}
    assert {trial.license for trial in ours} == {"CC0-1.0"}
    assert {trial.voxel_cm for trial in ours} == {1.0}
    told = sorted((trial.reality, trial.design.index) for trial in ours)
    names = ("published", *realities())
    assert told == sorted((name, design) for name in names for design in tool.DESIGNS)
    assert sum(path.stat().st_size for path in FILES) < 400_000


@pytest.mark.parametrize("name", ["published", "reversal", "lag", "high_resolution"])
def test_simulating_them_again_gives_the_same_bytes(name):
    world = tool.PUBLISHED if name == "published" else reality(name)
    for trial in tool.trials_of(world, tool.DESIGNS[2:4]):
        path = Path(str(TRIALS)) / f"{trial.digest}.json"
        assert path.read_bytes() == trial.to_bytes()


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
