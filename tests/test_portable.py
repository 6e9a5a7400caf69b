"""Functions whose bits are the same everywhere are also right."""

import numpy as np
import pytest

from softvox_gym.portable import GRID, cos_sin, direction, exp, normal

ARGUMENTS = np.linspace(-8, 8, 4001)


def test_the_exponential_is_right():
    np.testing.assert_allclose(exp(ARGUMENTS), np.exp(ARGUMENTS), rtol=2e-13)


def test_cosine_and_sine_are_right():
    cosine, sine = cos_sin(ARGUMENTS)
    np.testing.assert_allclose(cosine, np.cos(ARGUMENTS), atol=1e-13)
    np.testing.assert_allclose(sine, np.sin(ARGUMENTS), atol=1e-13)


def test_nothing_is_left_exactly_as_it_was():
    zero = np.zeros(3)
    assert np.all(exp(zero) == 1)
    cosine, sine = cos_sin(zero)
    assert np.all(cosine == 1)
    assert np.all(sine == 0)


def test_normal_numbers_are_normal_and_on_the_grid():
    numbers = normal(np.random.default_rng(0), 100_000)
    assert np.all(numbers * GRID == np.rint(numbers * GRID))
    assert np.abs(numbers - np.random.default_rng(0).standard_normal(100_000)).max() <= 0.5 / GRID


def test_an_error_in_the_last_bit_is_rounded_away():
    class Off:
        def __init__(self, factor):
            self.rng, self.factor = np.random.default_rng(1), factor

        def standard_normal(self, shape):
            return self.rng.standard_normal(shape) * self.factor

    exact, off = (normal(Off(factor), 10_000) for factor in (1, 1 + 2**-52))
    assert np.array_equal(exact, off)


def test_directions_are_unit_vectors_all_around():
    vectors = direction(np.random.default_rng(0), 40_000)
    np.testing.assert_allclose((vectors**2).sum(axis=0), 1)
    # The mean of n random unit vectors has the length 1 / sqrt(n), of cos 2 phi likewise.
    assert np.linalg.norm(vectors.mean(axis=1)) < 4 / np.sqrt(40_000)
    assert abs((vectors[0] ** 2 - vectors[1] ** 2).mean()) < 4 / np.sqrt(40_000)


def test_one_direction_is_drawn_for_each():
    assert direction(np.random.default_rng(0), 3).shape == (2, 3)
    with pytest.raises(ValueError, match="negative"):
        direction(np.random.default_rng(0), -1)
