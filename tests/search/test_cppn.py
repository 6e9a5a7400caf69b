"""Networks stay networks whatever is mutated, and draw robots to the same bits everywhere."""

import hashlib
import random

import numpy as np
import pytest
from table_answers import made_up

from softvox_gym import Design, Lattice
from softvox_search.registry import make
from softvox_search.searchers.cppn import FUNCTIONS, INPUTS, Network, coordinates, drawn

SPACE = Lattice(3, 3, 3)

#: Places of the inputs, and of the three outputs where there is nothing between.
X, Y, Z, FAR, BIAS = range(INPUTS)
PRESENCE, PASSIVE, ACTIVE = range(INPUTS, INPUTS + 3)


def simple(links):
    return Network(("sum",) * 3, links, 3)


@pytest.fixture(autouse=True)
def seeded():
    before = random.getstate()
    random.seed(14)
    yield
    random.setstate(before)


def test_a_network_draws_what_its_links_say():
    network = simple({(X, PRESENCE): 1.0, (Z, ACTIVE): 1.0, (BIAS, PASSIVE): 0.5})
    design = Design(drawn(network, coordinates(SPACE), SPACE), shape=SPACE).array
    assert not design[:2].any()  # where x is 0 the presence is not above 0
    assert (design[2, :, :2] == 1).all()
    assert (design[2, :, 2] == 2).all()


def test_the_largest_piece_stays():
    # Where |x| + 0.3 x + 0.2 z is above 0.6: six voxels at the left, nine at the right.
    links = {(X, 5): 1.0, (5, 6): 1.0, (X, 6): 0.3, (Z, 6): 0.2, (BIAS, 6): -0.6}
    network = Network(("absolute", "sum", "sum", "sum"), links, 3)
    assert np.count_nonzero(network(coordinates(SPACE))[0] > 0) == 15
    array = Design(drawn(network, coordinates(SPACE), SPACE), shape=SPACE).array
    assert [np.count_nonzero(array[x]) for x in range(3)] == [0, 0, 9]
    assert drawn(simple({(BIAS, PRESENCE): -1.0}), coordinates(SPACE), SPACE) == [0] * 27


def test_coordinates_are_symmetric_and_nothing_along_one_voxel():
    x, y, z, far, bias = coordinates(Lattice(4, 1, 3))
    assert sorted(set(x)) == [-1, -1 / 3, 1 / 3, 1]
    assert (set(y), set(z), set(bias)) == ({0.0}, {-1.0, 0.0, 1.0}, {1.0})
    np.testing.assert_array_equal(far, far[::-1])


def test_mutated_networks_have_no_loops_and_give_numbers():
    inputs, seen = coordinates(SPACE), set()
    network = Network.random(3)
    for _ in range(1500):
        network = network.mutated(0.6)
        last = INPUTS + len(network.functions)
        assert network.functions[-3:] == ("sum",) * 3
        assert all(a < b and INPUTS <= b < last and a < last - 3 for a, b in network.links)
        seen |= set(network.functions)
        if len(network.links) > 40:
            assert np.isfinite(network(inputs)).all()
            network = Network.random(3)
    assert seen == set(FUNCTIONS)


def test_a_node_in_a_link_computes_the_same_if_it_is_a_sum(monkeypatch):
    monkeypatch.setattr("softvox_search.searchers.cppn.NAMES", ("sum",))
    network, inputs = Network.random(3), coordinates(SPACE)
    before = network(inputs)
    for _ in range(200):
        more = network.mutated(1.0)
        if len(more.functions) > len(network.functions):
            np.testing.assert_allclose(more(inputs), before, atol=1e-12)
            assert len(more.links) == len(network.links) + 1


def asked(space, n, seed=0):
    searcher = make("cppn", np.random.default_rng(seed), space=space)
    rows = []
    while len(rows) < n:
        designs = searcher.ask()
        searcher.tell(designs, *made_up(designs))
        rows += designs.tolist()
    return np.array(rows)


def test_no_design_is_proposed_again_where_there_are_enough_and_all_are_one_piece():
    rows = asked(SPACE, 120)
    assert len(np.unique(rows, axis=0)) == len(rows)
    assert all(Design(row, shape=SPACE).is_connected for row in rows)


def test_the_bits_are_these_on_every_machine():
    digest = hashlib.sha256(asked(Lattice(4, 3, 2), 90).astype(np.uint8).tobytes()).hexdigest()
    assert digest[:16] == "44e2be414b2db053"


class Phased(Lattice):
    """A lattice that says that its sites have more states than three."""

    states = 4


def test_a_site_has_as_many_states_as_its_lattice_says():
    searcher = make("cppn", np.random.default_rng(0), space=Phased(3, 3, 3))
    assert set(np.unique(searcher.ask())) == {0, 1, 2, 3}


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"structure": 1.5}, "structure must be from 0 to 1, got 1.5"),
        ({"structure": -1}, "structure"),
        ({"start": -1}, "start"),
        ({"population": 0}, "population"),
        ({"mutation": 0.1}, "searcher cppn has no option 'mutation'; its options are: population"),
    ],
)
def test_options_are_checked(options, says):
    with pytest.raises(ValueError, match=says):
        make("cppn", np.random.default_rng(0), **options)
