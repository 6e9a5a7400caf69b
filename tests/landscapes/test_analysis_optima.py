import numpy as np
import pytest

from softvox_gym import landscape
from softvox_gym.landscapes.analysis import neighbours
from softvox_gym.landscapes.analysis.graph import distance_to
from softvox_gym.landscapes.analysis.optima import climbs, local_optima, plateaus, upward_moves

#: One peak at design 5000, one unit lower per mutation.
CONE = 8.0 - distance_to(5000)


@pytest.fixture(scope="module")
def fitness():
    return landscape()["fitness"]


@pytest.fixture(scope="module")
def optima(fitness):
    return local_optima(fitness)


def test_a_cone_has_one_optimum_that_every_climb_finds():
    found = local_optima(CONE)
    assert (found.design.tolist(), found.fitness.tolist()) == ([5000], [8.0])
    for ascents in (found.steepest, found.random):
        assert np.array_equal(ascents.probability, np.ones((6561, 1)))
        # The only fitter neighbours are those a mutation nearer.
        assert ascents.steps == pytest.approx(distance_to(5000))
    assert (
        [row["finds_best"] for row in climbs(found).records()]
        == [row["climbs_to_best"] for row in climbs(found).records()]
        == [1, 1]
    )


def test_where_all_are_equal_there_is_one_plateau_of_all_designs():
    found = local_optima(np.zeros(6561))
    assert (found.design.tolist(), found.plateau.tolist()) == ([0], [6561])
    assert [row["finds_best"] for row in climbs(found).records()] == [1, 1]
    assert [row["steps"] for row in climbs(found).records()] == [0, 0]


def test_two_equal_peaks_share_the_starts_and_count_both_as_the_best():
    first, second = 0, 6560  # absent everywhere, active everywhere: 8 mutations apart
    values = 8.0 - np.minimum(distance_to(first), distance_to(second))
    found = local_optima(values)
    assert {first, second} <= set(found.design[found.fitness == 8].tolist())
    finds = [row["finds_best"] for row in climbs(found).records()][1]
    at_peaks = found.random.probability.sum(axis=0)[found.fitness == 8].sum()
    assert finds == pytest.approx(at_peaks / 6561)


def test_a_plateau_with_a_way_up_is_no_optimum_and_is_left_by_it():
    # A level pair below the peak 0: of 4 and 3, only 3 touches it.
    values = -10.0 - distance_to(0).astype(float)
    values[[3, 4]] = -1.0
    values[0] = 0.0
    assert 4 in neighbours()[3]
    assert 4 not in neighbours()[0]
    moves = upward_moves(values)
    assert moves[3].tolist() == [0]
    assert moves[4].tolist() == [0]
    assert plateaus(values)[[3, 4]].tolist() == [3, 3]
    found = local_optima(values)
    assert 3 not in found.design
    assert found.steepest.probability[4, found.design == 0] == 1


def test_a_level_top_of_two_is_one_optimum():
    values = -distance_to([0, 1]).astype(float)
    found = local_optima(values)
    assert (found.design.tolist(), found.plateau.tolist()) == ([0], [2])
    assert found.steepest.probability.sum(axis=0).tolist() == [6561]


def test_steepest_ascent_takes_the_smallest_of_equally_fit_neighbours():
    values = np.zeros(6561)
    values[[1, 2 * 3**7]] = 1.0  # both neighbours of the empty design, not of each other
    found = local_optima(values)
    assert found.design.tolist() == [1, 4374]
    assert found.steepest.probability[0].tolist() == [1, 0]
    assert found.random.probability[0].tolist() == [0.5, 0.5]


def test_every_optimum_has_no_fitter_neighbour_and_every_other_design_has_one(fitness, optima):
    # No plateau of this landscape but that of the empty design matters: see the next test.
    highest = (fitness[neighbours()] <= fitness[:, None]).all(axis=1)
    assert set(np.flatnonzero(highest).tolist()) == {*optima.design.tolist(), 0}
    assert optima.plateau.tolist() == [1] * len(optima.design)


def test_the_empty_design_stands_on_a_plateau_and_climbs_by_its_neighbours(fitness, optima):
    assert not (fitness[neighbours()[0]] > fitness[0]).any()
    assert len(upward_moves(fitness)[0]) > 0
    assert optima.random.probability[0].sum() == pytest.approx(1)


def test_all_basins_together_hold_all_designs(optima):
    for ascents in (optima.steepest, optima.random):
        assert ascents.probability.sum(axis=1) == pytest.approx(np.ones(6561))
        assert ascents.probability.sum(axis=0).sum() == pytest.approx(6561)
    assert set(np.unique(optima.steepest.probability)) == {0.0, 1.0}


def test_the_optima_are_ordered_by_fitness_and_led_by_the_best_of_the_landscape(fitness, optima):
    assert optima.design[:4].tolist() == [6453, 4295, 5757, 6255]
    assert (np.diff(optima.fitness) <= 0).all()
    assert np.array_equal(optima.fitness, fitness[optima.design])


def test_simulated_climbs_end_where_the_chain_says(fitness, optima):
    rng, n = np.random.default_rng(4), 20_000
    moves = upward_moves(fitness)
    column = {int(design): i for i, design in enumerate(optima.design)}
    ends, steps = np.zeros(len(optima.design)), np.zeros(n)
    for walk, start in enumerate(rng.integers(6561, size=n)):
        here = int(start)
        while len(moves[here]):
            here = int(rng.choice(moves[here]))
            steps[walk] += 1
        ends[column[here]] += 1
    share = optima.random.probability.mean(axis=0)
    # 113 binomial counts: 5 standard deviations leave less than 1 chance in 10,000 to all of them.
    assert (np.abs(ends / n - share) < 5 * np.sqrt(share * (1 - share) / n)).all()
    expected = climbs(optima).records()[1]
    assert abs(steps.mean() - expected["steps"]) < 5 * steps.std() / n**0.5
    assert expected["climbs_to_best"] * expected["finds_best"] == pytest.approx(1)
    spread = np.sqrt(share @ (optima.fitness - expected["mean_end"]) ** 2)
    assert abs(ends @ optima.fitness / n - expected["mean_end"]) < 5 * spread / n**0.5


def test_nearly_the_best_are_the_two_within_one_percent(optima):
    found = climbs(optima).records()[0]["finds_nearly_best"]
    assert found == pytest.approx(optima.steepest.probability.sum(axis=0)[:2].sum() / 6561)
