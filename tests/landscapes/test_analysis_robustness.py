import numpy as np
import pytest

from softvox_gym import Design, landscape
from softvox_gym.landscapes.analysis.robustness import after_error, robustness


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
    for kind, others in (
        ("mutation", anything),
        ("dead_actuator", changed(design, "2", "1")),
        ("missing_voxel", changed(design, "12", "0")),
    ):
        after = after_error(fitness)[kind]
        if others:
            assert after.mean[design] == pytest.approx(fitness[others].mean())
            assert after.worst[design] == fitness[others].min()
        else:
            assert np.isnan([after.mean[design], after.worst[design]]).all()


def test_an_error_that_can_not_happen_leaves_no_number(fitness):
    after = after_error(fitness)
    actuators = np.array([Design(i).n_active for i in range(6561)])
    assert np.array_equal(np.isnan(after["dead_actuator"].mean), actuators == 0)
    assert np.flatnonzero(np.isnan(after["missing_voxel"].worst)).tolist() == [0]
    assert not np.isnan(after["mutation"].mean).any()


def group(values, rank):
    """What the so many fittest keep."""
    rows = robustness(values, after_error(values)).records()
    return next(row for row in rows if row["fittest"] == rank)


def test_one_mutation_of_all_designs_leaves_their_mean_as_it_is(fitness):
    found = group(fitness, 6561)
    assert found["mutation_designs"] == 6561
    assert found["fitness"] == pytest.approx(fitness.mean())
    assert found["mutation_mean_share"] == pytest.approx(1)


def test_a_group_is_summed_up_by_ratios_of_averages():
    values = np.zeros(6561)
    values[[2, 6]] = 4.0, 2.0  # an actuator at site 0, one at site 1
    values[1] = 1.0
    found = group(values, 10)
    # With an actuator are 2, 6, 5, 7 and 8 of 0 ... 9; only 2 becomes one that travels, 1.
    assert found["dead_actuator_designs"] == 5
    assert found["dead_actuator_mean_share"] == pytest.approx(1 / (4 + 2))
    assert found["dead_actuator_worst_share"] == pytest.approx(1 / (4 + 2))


def test_fitness_that_is_not_positive_has_no_share_to_keep():
    found = group(np.zeros(6561), 10)
    assert found["fitness"] == 0
    assert found["mutation_mean_share"] is found["mutation_worst_share"] is None


def test_designs_that_an_error_can_not_befall_are_left_out():
    values = np.zeros(6561)
    values[1] = 1.0  # the fittest has no actuator
    found = group(values, 1)
    assert (found["dead_actuator_designs"], found["dead_actuator_mean_share"]) == (0, None)
    assert (found["missing_voxel_designs"], found["missing_voxel_mean_share"]) == (1, 0)


def test_the_best_design_loses_two_thirds_to_an_average_mutation_and_all_to_the_worst(fitness):
    found = group(fitness, 1)
    assert found["mutation_mean_share"] == pytest.approx(0.3245, abs=5e-5)
    assert found["mutation_worst_share"] < 0.004
