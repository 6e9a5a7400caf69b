import math

import numpy as np
import pytest

from softvox_gym import Design, landscape
from softvox_gym.landscapes.analysis import neighbours, symmetry_classes
from softvox_gym.landscapes.analysis.graph import all_digits, distance_to
from softvox_gym.landscapes.analysis.ruggedness import (
    autocorrelation,
    correlation_length,
    neutrality,
    ruggedness,
    variance_by_order,
)


@pytest.fixture(scope="module")
def fitness():
    return landscape()["fitness"]


def test_a_cone_correlates_fully_with_the_distance_to_its_top():
    found = ruggedness(-2.0 * distance_to(1234))
    assert found.facts["fittest"] == [1234]
    assert found.facts["to_best"] == pytest.approx(-1)
    assert [row["mean_fitness"] for row in found.records()] == [-2.0 * d for d in range(1, 9)]
    class_of_best = np.flatnonzero(symmetry_classes() == 4295)
    images = ruggedness(-distance_to(class_of_best).astype(float))
    assert images.facts["fittest"] == class_of_best.tolist()
    assert images.facts["to_class"] == pytest.approx(-1)


def test_the_correlation_with_distance_is_that_over_all_designs_one_by_one(fitness):
    best = Design(6453).digits
    distance = [
        sum(a != b for a, b in zip(Design(i).digits, best, strict=True)) for i in range(6561)
    ]
    expected = np.corrcoef(distance, fitness)[0, 1]
    assert ruggedness(fitness).facts["to_best"] == pytest.approx(expected)


def test_independent_values_do_not_correlate_and_a_sum_over_sites_falls_in_a_line():
    noise = np.random.default_rng(5).normal(size=6561)
    rho = autocorrelation(noise, lags=3)
    # rho(1) is a mean of 52488 products of independent values: 5 standard deviations.
    assert abs(rho[1]) < 5 / math.sqrt(52488)
    added = all_digits() @ np.array([1.0, 3, -2, 5, 0, 1, 1, 2])
    assert autocorrelation(added, lags=4) == pytest.approx((1 - 3 / 16) ** np.arange(5))
    assert variance_by_order(added) == pytest.approx([1, 0, 0, 0, 0, 0, 0, 0])


@pytest.mark.parametrize("order", range(1, 9))
def test_a_product_over_k_sites_is_an_interaction_of_order_k(order):
    centred = all_digits() - 1.0
    found = variance_by_order(centred[:, :order].prod(axis=1))
    assert found == pytest.approx(np.eye(8)[order - 1])


def test_the_orders_of_interaction_explain_the_autocorrelation(fitness):
    shares, rho = variance_by_order(fitness), autocorrelation(fitness, lags=10)
    assert shares.sum() == pytest.approx(1)
    eigenvalues = 1 - 3 * np.arange(1, 9) / 16
    assert rho == pytest.approx([shares @ eigenvalues**lag for lag in range(11)], abs=1e-12)


def test_the_share_of_order_one_is_that_of_the_sites_main_effects(fitness):
    digits = all_digits()
    effects = [
        np.mean([(fitness[digits[:, site] == d].mean() - fitness.mean()) ** 2 for d in range(3)])
        for site in range(8)
    ]
    assert variance_by_order(fitness)[0] == pytest.approx(sum(effects) / fitness.var())


def test_simulated_walks_correlate_as_the_transition_matrix_says(fitness):
    rng, walkers, length, lags = np.random.default_rng(6), 2000, 200, 5
    here = rng.integers(6561, size=walkers)
    seen = np.empty((length, walkers))
    for step in range(length):
        seen[step] = fitness[here]
        here = neighbours()[here, rng.integers(16, size=walkers)]
    seen = (seen - fitness.mean()) / fitness.std()
    expected = autocorrelation(fitness, lags=lags)
    for lag in range(1, lags + 1):
        per_walk = (seen[: length - lag] * seen[lag:]).mean(axis=0)
        # The walkers are independent: their spread gives the error of the mean.
        error = per_walk.std() / math.sqrt(walkers)
        assert abs(per_walk.mean() - expected[lag]) < 5 * error
        assert error < 0.01


def test_the_correlation_length_is_where_an_exponential_has_fallen_by_e():
    assert correlation_length(math.exp(-1 / 4)) == pytest.approx(4)
    assert correlation_length(-math.exp(-1 / 4)) == pytest.approx(4)
    assert correlation_length(0.0) == 0


def test_where_all_are_equal_there_is_nothing_to_correlate():
    same = np.full(6561, 0.1)
    assert autocorrelation(same) is None
    assert variance_by_order(same) is None
    facts = dict(ruggedness(same).facts)
    assert len(facts.pop("fittest")) == 6561
    assert set(facts.values()) == {None}
    assert neutral(same, 0.0) == (1, 16, 6561, 1)


def neutral(values, threshold):
    """Share, degree, largest network and networks of the mutations that change no more."""
    return neutrality(values, (threshold,)).rows[0][-4:]


def test_neutral_pairs_are_counted_once_and_their_networks_followed():
    values = np.arange(6561.0) * 10  # all apart
    values[3], values[4] = values[1], values[1] + 0.05  # 1 - 4 - 3: 1 and 3 are no neighbours
    assert neutral(values, 0.0)[0] == 0
    share, degree, largest, networks = neutral(values, 0.1)
    assert share == 2 / 52488
    assert degree == pytest.approx(2 * 2 / 6561)
    assert (largest, networks) == (3, 1)


def test_a_change_of_exactly_the_threshold_is_neutral():
    values = 0.5 * distance_to(0)
    assert neutral(values, 0.5)[0] == 1
    # Only the mutations between passive and active keep the distance: 8 of the 24 pairs of values.
    assert neutral(values, 0.49)[0] == pytest.approx(1 / 3)
