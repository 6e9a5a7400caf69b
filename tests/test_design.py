"""A design is a value on a lattice."""

import copy
import pickle
import tracemalloc

import numpy as np
import pytest

from softvox_gym import Design, Lattice
from softvox_gym.design import BodyFacts

BEST = Design(6453)


def test_all_ways_of_writing_a_design_are_equal():
    ways = [
        6453,
        np.int64(6453),
        np.uint16(6453),
        np.array(6453),
        "00021222",
        [0, 0, 0, 2, 1, 2, 2, 2],
        (0, 0, 0, 2, 1, 2, 2, 2),
        np.array([0, 0, 0, 2, 1, 2, 2, 2]),
        BEST.array,
        BEST,
    ]
    assert {Design(way) for way in ways} == {BEST}


@pytest.mark.parametrize("index", [0, 1, 2, 3, 6453, 6560])
def test_index_and_digits_name_the_same_design(index):
    design = Design(index)
    assert design.index == index
    assert Design(design.digits) == design
    assert sum(int(digit) * 3**i for i, digit in enumerate(design.digits)) == index


def test_every_index_is_another_design():
    assert len({Design(i) for i in range(6561)}) == 6561
    assert [Design(i).index for i in range(6561)] == list(range(6561))


def test_the_array_is_indexed_x_y_z():
    design = Design("01200000")
    assert design.shape == (2, 2, 2)
    assert design.array[1, 0, 0] == 1
    assert design.array[0, 1, 0] == 2
    assert not design.array.flags.writeable


def test_a_design_on_another_lattice_keeps_its_sites_in_order():
    array = np.arange(24).reshape(2, 3, 4) % 3
    design = Design(array)
    assert design.shape == (2, 3, 4)
    np.testing.assert_array_equal(design.array, array)
    assert Design(design.digits, shape=(2, 3, 4)) == design
    assert Design(design.index, shape=(2, 3, 4)) == design
    assert design.digits[1 + 2 * (2 + 3 * 3)] == str(array[1, 2, 3])


def test_designs_on_different_lattices_differ():
    assert Design("1", shape=(1, 1, 1)) != Design("10", shape=(2, 1, 1))
    assert Design("10", shape=(2, 1, 1)) != Design("10", shape=(1, 2, 1))
    assert Design(1) != 1


def test_counts():
    assert (BEST.n_voxels, BEST.n_active) == (5, 4)
    assert (Design(0).n_voxels, Design(0).n_active) == (0, 0)
    assert (Design(3280).n_voxels, Design(3280).n_active) == (8, 0)


def test_components_hang_together_by_faces_only():
    assert Design("10000001").components == ((0,), (7,))
    assert Design("11010000").components == ((0, 1, 3),)
    assert BEST.components == ((3, 4, 5, 6, 7),)
    assert Design(0).components == ()


def test_a_robot_is_connected_when_it_is_one_piece():
    assert BEST.is_connected
    assert Design(1).is_connected
    assert not Design("10000001").is_connected
    assert not Design(0).is_connected


def test_nothing_is_remembered_of_large_bodies():
    lattice = Lattice.of((8, 8, 8))
    rows = lattice.random(20, np.random.default_rng(0))
    tracemalloc.start()
    assert BodyFacts.of(rows, lattice).is_connected.any()
    kept = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    assert kept < 5_000  # bytes; the designs alone have twice as many


def test_four_quarter_turns_are_none():
    for index in range(0, 6561, 41):
        design = Design(index)
        turned = design
        for k in range(1, 5):
            turned = turned.rotated()
            assert turned == design.rotated(k) == design.rotated(k - 4)
        assert turned == design


def test_a_quarter_turn_takes_x_to_y():
    design = Design(np.array([[[1], [0]], [[2], [0]]]))  # 1 at the origin, 2 one step along x
    turned = design.rotated().array
    assert turned[1, 0, 0] == 1
    assert turned[1, 1, 0] == 2


def test_half_a_quarter_turn_is_refused():
    with pytest.raises(TypeError, match="k must be a whole number"):
        BEST.rotated(0.5)


def test_turning_swaps_the_sides_of_the_lattice():
    assert Design(0, shape=(2, 3, 4)).rotated().shape == (3, 2, 4)


def test_mirroring_twice_is_nothing():
    for index in range(0, 6561, 41):
        assert Design(index).mirrored().mirrored() == Design(index)


def test_a_class_of_symmetry_has_one_canonical_design():
    sizes = {True: set(), False: set()}
    for index in range(6561):
        design = Design(index)
        for reflections, seen in sizes.items():
            canonical = design.canonical(reflections=reflections)
            assert canonical.index <= index
            seen.add(canonical)
    for index in range(0, 6561, 29):
        design = Design(index)
        assert design.rotated().canonical(reflections=False) == design.canonical(reflections=False)
        assert design.mirrored().canonical() == design.canonical() == design.canonical().canonical()
    # Burnside: columns have 9 states; turns fix 9^4, 9, 9^2, 9, and mirrors 9^2, 9^2, 9^3, 9^3.
    assert len(sizes[False]) == (9**4 + 9 + 9**2 + 9) // 4
    assert len(sizes[True]) == (9**4 + 9 + 9**2 + 9 + 2 * 9**2 + 2 * 9**3) // 8


def test_a_design_is_a_value():
    assert pickle.loads(pickle.dumps(BEST)) == BEST
    assert copy.deepcopy(BEST) == BEST
    assert len({BEST, Design(6453), Design(7)}) == 2
    with pytest.raises(AttributeError, match="can't be changed"):
        BEST.index = 3
    with pytest.raises(ValueError, match="read-only"):
        BEST.array[0, 0, 0] = 1


def test_the_repr_makes_the_design():
    for design in (BEST, Design(5, shape=(1, 2, 3))):
        assert eval(repr(design)) == design


@pytest.mark.parametrize(
    ("given", "options", "error", "message"),
    [
        (6561, {}, ValueError, "outside 0 ... 6560, the designs of a 2x2x2 lattice"),
        (-1, {}, ValueError, "outside"),
        (3**60, {"shape": (3, 4, 5)}, ValueError, r"3\^60 - 1"),
        ("00021223", {}, ValueError, "0, 1 and 2 only"),
        ("0002122x", {}, ValueError, "0, 1 and 2 only"),
        ("0002122²", {}, ValueError, "0, 1 and 2 only"),
        (
            "000212220",
            {},
            ValueError,
            "9 digits, but a 2x2x2 lattice has 8 sites; Design.*uses another",
        ),
        ([0, 1, 2], {}, ValueError, "3 digits, but"),
        ([0, 0, 0, 2, 1, 2, 2, 3], {}, ValueError, "got 3"),
        ([[0, 1], [2, 1]], {}, ValueError, r"shape \(2, 2\)"),
        ([[0], [0, 1]], {}, ValueError, "ragged"),
        (np.zeros((2, 0, 2), int), {}, ValueError, "positive sides"),
        (np.zeros((2, 2, 2)), {}, TypeError, "float64"),
        (["0", "1"], {}, TypeError, "whole numbers"),
        (2.0, {}, TypeError, "whole numbers"),
        (True, {}, TypeError, "whole numbers"),
        (None, {}, TypeError, "whole numbers"),
        (5, {"shape": (2, 2)}, ValueError, "three whole numbers"),
        (5, {"shape": (2, 2, 0)}, ValueError, "positive sides"),
        (5, {"shape": (2, 2, 1.5)}, ValueError, "three whole numbers"),
        (5, {"shape": 8}, ValueError, "three whole numbers"),
        (0, {"shape": (10**6,) * 3}, ValueError, "at most 1000000 are allowed"),
        (10**4000, {"shape": (4, 4, 4)}, ValueError, r"of 13288 bits is outside .* 3\^64 - 1"),
        (b"00021222", {}, TypeError, "whole numbers, got bytes"),
        (np.zeros((2, 2, 2), int), {"shape": (1, 2, 4)}, ValueError, "shape=1x2x4 was given"),
    ],
)
def test_what_is_no_design_is_refused_with_its_reason(given, options, error, message):
    with pytest.raises(error, match=message):
        Design(given, **options)


def test_a_design_of_a_large_lattice_is_its_digits():
    rng = np.random.default_rng(0)
    array = rng.integers(3, size=(20, 20, 20))
    design = Design(array)
    assert Design(design.index, shape=(20, 20, 20)) == design
    assert Design(0, shape=(100, 100, 100)).n_voxels == 0
    assert Design(3**27 - 1, shape=(3, 3, 3)).digits == "2" * 27
