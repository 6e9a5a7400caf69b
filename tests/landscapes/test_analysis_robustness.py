import math

import numpy as np
import pytest

from softvox_gym import Design, landscape
from softvox_gym.landscapes.analysis.robustness import (
    after_dead_actuator,
    after_missing_voxel,
    after_mutation,
    kept,
)


@pytest.fixture(scope="module")
def fitness():
    return landscape()["fitness"]


def changed(design, wanted, digit):
    """The designs in which one site that has a wanted digit has another."""
    digits = Design(design).digits
    return [
        Design(digits[:site] + digit + digits[site + 1 :]).index
        for site in range(8)
        if digits[site] in wanted and digits[site] != digit
    ]


@pytest.mark.parametrize("design", [6453, 4295, 1, 2, 3280, 5000])
def test_every_error_is_tried_at_every_place_where_it_can_happen(fitness, design):
    anything = [other for digit in "012" for other in changed(design, "012", digit)]
    for after, others in (
        (after_mutation(fitness), anything),
        (after_dead_actuator(fitness), changed(design, "2", "1")),
        (after_missing_voxel(fitness), changed(design, "12", "0")),
    ):
        if others:
            assert after.mean[design] == pytest.approx(fitness[others].mean())
            assert after.worst[design] == fitness[others].min()
        else:
            assert np.isnan([after.mean[design], after.worst[design]]).all()


def test_an_error_that_can_not_happen_leaves_no_number(fitness):
    actuators = np.array([Design(i).n_active for i in range(6561)])
    assert np.array_equal(np.isnan(after_dead_actuator(fitness).mean), actuators == 0)
    assert np.flatnonzero(np.isnan(after_missing_voxel(fitness).worst)).tolist() == [0]
    assert not np.isnan(after_mutation(fitness).mean).any()


def test_one_mutation_of_all_designs_leaves_their_mean_as_it_is(fitness):
    found = kept(fitness, after_mutation(fitness), np.arange(6561))
    assert found.designs == 6561
    assert found.own == pytest.approx(fitness.mean())
    assert found.mean_share == pytest.approx(1)
    assert found.least_share is None  # some travel nowhere, so have no share to keep


def test_a_group_is_summed_up_by_ratios_of_averages():
    values = np.zeros(6561)
    values[[2, 6]] = 4.0, 2.0  # an actuator at site 0, one at site 1
    values[1] = 1.0
    found = kept(values, after_dead_actuator(values), np.array([2, 6]))
    assert (found.designs, found.own, found.mean, found.worst) == (2, 3.0, 0.5, 0.5)
    assert found.mean_share == found.worst_share == pytest.approx(1 / 6)
    assert found.least_share == 0


def test_designs_that_an_error_can_not_befall_are_left_out():
    values = np.arange(6561.0)
    found = kept(values, after_dead_actuator(values), np.array([1, 2]))
    assert (found.designs, found.own, found.mean) == (1, 2.0, 1.0)
    nobody = kept(values, after_dead_actuator(values), np.array([0, 1]))
    assert nobody.designs == 0
    assert nobody.own is nobody.mean_share is nobody.least_share is None


def test_fitness_that_is_not_positive_has_no_share_to_keep():
    values = np.zeros(6561)
    found = kept(values, after_mutation(values), np.array([5]))
    assert (found.own, found.mean, found.mean_share, found.least_share) == (0, 0, None, None)


def test_the_best_design_loses_two_thirds_to_an_average_mutation_and_all_to_the_worst(fitness):
    found = kept(fitness, after_mutation(fitness), np.array([6453]))
    assert math.isclose(found.mean_share, 0.3245, abs_tol=5e-5)
    assert found.least_share == found.worst_share < 0.004
