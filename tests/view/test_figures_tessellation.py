import numpy as np
import pytest

from softvox_gym import Design
from softvox_view.tessellation import SIDE, cell_of, design_at, mapped


def test_the_map_is_a_bijection():
    rows, columns = cell_of(np.arange(6561))
    assert len(set(zip(rows.tolist(), columns.tolist(), strict=True))) == 6561
    assert rows.min() == columns.min() == 0
    assert rows.max() == columns.max() == 80 == SIDE - 1
    assert np.array_equal(design_at(rows, columns), np.arange(6561))


@pytest.mark.parametrize(
    ("digits", "cell"),
    [
        ("00000000", (0, 0)),
        ("11111111", (40, 40)),
        ("22222222", (80, 80)),
        ("10000000", (0, 27)),
        ("01000000", (27, 0)),
        ("00200000", (0, 18)),
        ("00010000", (9, 0)),
        ("00001000", (0, 3)),
        ("00000200", (6, 0)),
        ("00000010", (0, 1)),
        ("00000001", (1, 0)),
        ("00021222", (2 * 9 + 2 * 3 + 2, 1 * 3 + 2)),
    ],
)
def test_a_design_lies_where_its_digits_say(digits, cell):
    assert tuple(map(int, cell_of(Design(digits).index))) == cell
    assert design_at(*cell) == Design(digits).index


def test_every_square_of_a_third_holds_the_designs_of_one_outer_pair():
    numbers = design_at(*np.indices((81, 81)))
    for right in range(3):
        for up in range(3):
            square = numbers[27 * up : 27 * up + 27, 27 * right : 27 * right + 27]
            assert set((square % 3).ravel()) == {right}
            assert set((square // 3 % 3).ravel()) == {up}


def test_values_laid_out_are_found_at_their_cells():
    values = np.random.default_rng(0).normal(size=(6561, 3))
    laid = mapped(values)
    assert laid.shape == (81, 81, 3)
    for design in (0, 405, 3280, 6453, 6560):
        assert np.array_equal(laid[cell_of(design)], values[design])


def test_shapes_are_kept_and_broadcast():
    assert cell_of(np.zeros((2, 3), dtype=np.uint8))[0].shape == (2, 3)
    assert design_at(0, np.arange(81)).shape == (81,)
    assert np.shape(design_at(0, 0)) == ()


@pytest.mark.parametrize("design", [-1, 6561])
def test_a_number_without_a_design_is_refused(design):
    with pytest.raises(ValueError, match=rf"design index {design} is outside"):
        cell_of(design)


def test_a_cell_off_the_map_is_refused():
    with pytest.raises(ValueError, match="column must be 0 to 80, got 81"):
        design_at(0, 81)
    with pytest.raises(ValueError, match="row must be 0 to 80"):
        design_at([3, -1], 0)
