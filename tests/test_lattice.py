"""A lattice numbers its sites and its designs, small and large."""

import numpy as np
import pytest

from softvox_gym import Design, Lattice

SHAPES = [(2, 2, 2), (1, 1, 1), (3, 2, 1), (3, 3, 3), (13, 3, 1), (4, 4, 4), (2, 5, 11)]


def test_the_default_is_the_papers_lattice():
    assert Lattice() == (2, 2, 2)
    assert (Lattice().sites, Lattice().n_designs, str(Lattice())) == (8, 6561, "2x2x2")


@pytest.mark.parametrize("shape", SHAPES)
def test_numbers_and_digits_name_the_same_designs(shape):
    lattice = Lattice.of(shape)
    rows = lattice.random(20, np.random.default_rng(0))
    numbers = lattice.numbers(rows)
    assert numbers.dtype == (np.int64 if lattice.sites < 40 else object)
    assert numbers.tolist() == [Design(row, shape=shape).index for row in rows]
    np.testing.assert_array_equal(lattice.digits(numbers), rows)
    last = np.array([lattice.n_designs - 1], dtype=object)
    assert (lattice.digits(last) == 2).all()


@pytest.mark.parametrize("shape", SHAPES)
def test_rows_and_arrays_hold_the_same_designs(shape):
    lattice = Lattice.of(shape)
    rows = lattice.random(3, np.random.default_rng(0)).astype(np.uint8)
    stack = lattice.to_stack(rows)
    assert stack.shape == (3, *shape)
    np.testing.assert_array_equal(stack[1], Design(rows[1], shape=shape).array)
    np.testing.assert_array_equal(lattice.to_rows(stack), rows)


def test_int64_ends_after_39_sites():
    assert 3**39 < 2**63 < 3**40
    assert Lattice.of((39, 1, 1)).has_int64_numbers
    assert not Lattice.of((40, 1, 1)).has_int64_numbers


def test_sides_are_checked_wherever_they_come_from():
    for shape in ((10**6,) * 3, Lattice(10**6, 10**6, 10**6)):
        with pytest.raises(ValueError, match="sites; at most 1000000 are allowed"):
            Design(0, shape=shape)
    with pytest.raises(ValueError, match="positive sides"):
        Lattice.of(Lattice(-2, -2, 2))


@pytest.mark.parametrize("number", [-1, 27, 2**70])
def test_a_number_that_no_design_has_is_refused(number):
    with pytest.raises(ValueError, match=r"outside 0 \.\.\. 26, the designs of a 3x1x1 lattice"):
        Lattice(3, 1, 1).digits(np.array([number], dtype=object))


def test_half_a_number_is_refused():
    with pytest.raises(TypeError, match="number must be a whole number, got"):
        Lattice().digits(0.5)


def test_neighbours_share_a_face():
    assert sorted(Lattice().neighbours(0)) == [1, 2, 4]
    lattice = Lattice(3, 4, 5)
    for site in range(lattice.sites):
        assert all(site in lattice.neighbours(other) for other in lattice.neighbours(site))
    assert len(list(lattice.neighbours(1 + 3 * (1 + 4 * 1)))) == 6
