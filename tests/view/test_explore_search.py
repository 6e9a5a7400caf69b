"""The searchers that the page runs itself."""

import numpy as np
import pytest
from node import answer, needs_node

from softvox_gym import landscape

pytestmark = needs_node

SCRIPT = """return given.runs.map(([name, seed, budget]) =>
  search.search(name, { seed, budget }, given.table));"""


def searched(folder, runs):
    table = landscape()["fitness"].tolist()
    return answer(folder, SCRIPT, {"runs": runs, "table": table})


@pytest.mark.parametrize("name", ["random", "hill_climber"])
def test_a_searcher_evaluates_no_design_twice_up_to_all(tmp_path, name):
    budgets = [1, 60, 6561, 7000]
    for budget, path in zip(
        budgets, searched(tmp_path, [[name, 3, b] for b in budgets]), strict=True
    ):
        assert len(set(path["designs"])) == len(path["designs"]) == min(budget, 6561)
        fitness = landscape()["fitness"][path["designs"]]
        assert path["fitness"] == fitness.tolist()
        assert path["recommended"] == path["designs"][int(fitness.argmax())]


def test_another_seed_is_another_run_and_the_same_one_the_same(tmp_path):
    first, second, other = searched(tmp_path, [["random", seed, 50] for seed in (1, 1, 2)])
    assert first == second
    assert first != other


def test_the_hill_climber_climbs(tmp_path):
    """Of Python's, 8 neighbours at a time, the optimum takes 2282 designs on average."""
    runs = searched(tmp_path, [["hill_climber", seed, 6561] for seed in range(60)])
    found = [run["designs"].index(6453) + 1 for run in runs]
    assert np.mean(found) == pytest.approx(2282, abs=4 * 1500 / np.sqrt(60))
