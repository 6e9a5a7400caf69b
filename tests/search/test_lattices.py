"""All searchers search any lattice, without counting through its designs."""

from functools import partial

import gymnasium as gym
import numpy as np
import pytest
from table_answers import made_up

from softvox_gym import Lattice
from softvox_search.conformance import check
from softvox_search.oracle import Budget, Oracle
from softvox_search.protocol import keys_of
from softvox_search.registry import SEARCHERS, make
from softvox_search.run import run

SHAPES = [Lattice(3, 3, 3), Lattice(4, 4, 4), Lattice(3, 2, 1)]

#: Evaluations of what takes long.
FEW = {"tpe": 30, "nevergrad": 60, "cppn": 100}


@pytest.mark.parametrize("space", SHAPES, ids=str)
@pytest.mark.parametrize("name", SEARCHERS)
def test_a_searcher_asks_for_designs_of_its_lattice_and_recommends_the_best(name, space):
    searcher = make(name, np.random.default_rng(0), space=space)
    asked, values = [], []
    while len(values) < FEW.get(name, 300):
        designs = searcher.ask()
        assert designs.shape[1:] == (space.sites,)
        assert set(np.unique(designs)) <= {0, 1, 2}
        told, info = made_up(designs)
        searcher.tell(designs, told, info)
        asked += keys_of(designs)
        values += told.tolist()
    best = searcher.recommend()
    assert best.shape == space
    assert keys_of(space.to_rows(best.array)[np.newaxis])[0] in asked
    assert made_up(space.to_rows(best.array)[np.newaxis].astype(np.int64))[0] == max(values)


@pytest.mark.parametrize("name", ["exhaustive", "random", "exhaustive_shuffled", "hill_climber"])
def test_no_design_is_asked_for_twice_and_all_of_a_small_lattice_are(name):
    space = Lattice(3, 2, 1)
    searcher = make(name, np.random.default_rng(0), space=space)
    asked = []
    while len(designs := searcher.ask()):
        searcher.tell(designs, *made_up(designs))
        asked += keys_of(designs)
    assert len(asked) == len(set(asked)) == space.n_designs == 729


def short(n, *, shape):
    """Runs of a few time steps: these tests are not about physics."""
    physics = {"duration": 0.01, "settle_time": 0.001}
    return gym.make_vec("SoftVox-v0", num_envs=n, shape=shape, physics=physics)


@pytest.mark.parametrize("name", ["exhaustive", "random", "hill_climber", "ga", "map_elites"])
def test_a_searcher_conforms_on_27_sites(name):
    check(name, evaluations=60, make_env=partial(short, shape=(3, 3, 3)))


@pytest.mark.parametrize("name", ["ga", "nevergrad"])
def test_on_64_sites_the_log_holds_digits(name):
    oracle = Oracle(partial(short, shape=(4, 4, 4)), Budget(evaluations=20))
    best = run(make(name, np.random.default_rng(0), space=oracle.space), oracle)
    columns = oracle.log.columns()
    assert best.shape == (4, 4, 4)
    assert columns["design"].dtype == "<U64"
    assert best.digits == columns["design"][columns["fitness"].argmax()]
    assert set("".join(columns["design"])) == {"0", "1", "2"}
