"""The report's statistics agree with closed forms, with scipy, and with counting by hand."""

import numpy as np
import pytest
from scipy import stats

from softvox_search.report import statistics
from softvox_search.report.statistics import (
    band,
    compare,
    expected_running_time,
    holm,
    iqm,
    mean,
    resampled,
    running_time_band,
)


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.mark.parametrize("n", range(1, 22))
def test_the_interquartile_mean_is_scipys_trimmed_mean(n):
    values = rng(n).normal(size=(5, n))
    np.testing.assert_allclose(iqm(values), stats.trim_mean(values, 0.25, axis=1), rtol=1e-14)


def test_the_interquartile_mean_leaves_out_a_quarter_at_either_end():
    assert iqm([100, 4, 1, 2, 3, 5, -100, 6]) == (2 + 3 + 4 + 5) / 4
    assert iqm([7.5]) == 7.5


def test_a_band_of_the_mean_has_the_width_of_its_standard_error(monkeypatch):
    monkeypatch.setattr(statistics, "RESAMPLES", 20_000)
    values = rng().normal(size=400)
    low, high = band(values, statistic=mean)
    error = values.std() / np.sqrt(400)
    # The bootstrap distribution is normal here but for O(1/n). A 2.5 % quantile of 20,000 draws
    # has the standard error sqrt(0.025 * 0.975 / 20000) / phi(1.96) = 0.019 standard errors.
    assert (values.mean() - low) / error == pytest.approx(1.96, abs=4 * 0.019)
    assert (high - values.mean()) / error == pytest.approx(1.96, abs=4 * 0.019)


def test_a_band_covers_the_true_value_as_often_as_it_says():
    samples = rng().normal(size=(50, 400))  # 50 runs, 400 experiments; the true value is 0
    low, high = band(samples)
    covered = np.mean((low <= 0) & (high >= 0))
    # 400 experiments: the standard error of the share is sqrt(0.95 * 0.05 / 400) = 0.011.
    assert covered == pytest.approx(0.95, abs=4 * 0.011)


def test_a_band_is_the_same_every_time():
    values = rng().normal(size=(20, 3))
    first, second = (band(values) for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_a_column_has_the_same_band_alone_as_among_others():
    values = rng().normal(size=(20, 3))
    together = band(values)
    alone = band(values[:, 1])
    assert (together[0][1], together[1][1]) == (alone[0], alone[1])


def test_runs_that_agree_have_a_band_without_width():
    low, high = band(np.full((10, 2), 0.1))
    np.testing.assert_allclose([low, high], 0.1, rtol=1e-15)


def test_a_single_run_has_no_band():
    low, high = band([[1.0, 2.0]])
    assert np.isnan([*low, *high]).all()
    low, high = band([1.0, 2.0, 3.0], strata=["a", "b", "c"])
    assert np.isnan([low, high]).all()


def test_every_stratum_is_drawn_as_often_as_it_has_runs():
    strata = np.array(["a", "b", "a", "c", "a"])
    drawn = strata[resampled(strata)]
    assert drawn.shape == (2000, 5)
    for label, count in (("a", 3), ("b", 1), ("c", 1)):
        assert ((drawn == label).sum(axis=1) == count).all()


def test_strata_keep_the_differences_between_searchers_out_of_the_band():
    values = np.concatenate([np.zeros(10), np.ones(10)])
    low, high = band(values, statistic=mean, strata=np.repeat([0, 1], 10))
    assert (low, high) == (0.5, 0.5)
    low, high = band(values, statistic=mean)
    assert low < 0.4 < 0.6 < high


def test_the_expected_running_time_is_all_evaluations_per_success():
    # Hits after 10 and 30, and two runs that ended without after 100 and 60.
    time = expected_running_time([10, 100, 30, 60], [True, False, True, False])
    assert time == (10 + 100 + 30 + 60) / 2


def test_the_expected_running_time_without_any_success_is_infinite():
    times = expected_running_time([[5, 5], [5, 7]], [[False, False], [True, True]])
    np.testing.assert_array_equal(times, [np.inf, 6])


def test_the_expected_running_time_estimates_that_of_restarts():
    # Each evaluation hits with probability 0.01, and a run is given up after 50: restarts don't
    # matter to a process without memory, which takes 100 evaluations on average.
    first = rng().geometric(0.01, size=100_000)
    time = expected_running_time(np.minimum(first, 50), first <= 50)
    # Successes among 100,000 runs: mean 39,500; the estimate is about 100 +- 100 / sqrt(39500).
    assert time == pytest.approx(100, abs=4 * 0.5)


def test_the_band_of_a_running_time_reaches_to_infinity_and_has_no_width_without_spread():
    low, high = running_time_band([3, 9, 9], [True, False, False], strata=np.zeros(3))
    assert (low, high) == (3, np.inf)
    # Each problem's runs are drawn among themselves: here all of them are alike.
    used, problems = [3, 3, 9, 9], ["easy", "easy", "hard", "hard"]
    band_of_both = running_time_band(used, [True, True, False, False], strata=problems)
    assert band_of_both == (12, 12)
    assert np.isnan(running_time_band([3, 9], [True, False], strata=["a", "b"])).all()


def test_a12_counts_pairs():
    a, b = rng().integers(0, 6, 13), rng(1).integers(0, 6, 9)
    wins = sum((x > y) + 0.5 * (x == y) for x in a for y in b)
    found = compare(a, b)
    assert found.u == wins
    assert found.a12 == wins / (13 * 9)
    assert compare(b, a).a12 == pytest.approx(1 - found.a12, rel=1e-15)


def test_a12_is_one_where_the_first_is_always_larger():
    assert compare([4, 5, 6], [1, 2, 3]).a12 == 1
    assert compare([1, 2, 3], [4, 5, 6]).a12 == 0


def test_small_samples_are_compared_exactly():
    # Of the C(6, 3) = 20 ways to share out six ranks, two are as extreme as full separation.
    assert compare([4, 5, 6], [1, 2, 3]).p == pytest.approx(2 / 20, rel=1e-12)


def test_large_samples_with_ties_are_compared_by_the_corrected_normal_approximation():
    a, b = rng().integers(0, 5, 40), rng(1).integers(1, 6, 50)
    n = len(a) + len(b)
    _, ties = np.unique(np.concatenate([a, b]), return_counts=True)
    spread = 40 * 50 / 12 * (n + 1 - (ties**3 - ties).sum() / (n * (n - 1)))
    found = compare(a, b)
    z = (abs(found.u - 1000) - 0.5) / np.sqrt(spread)
    assert found.p == pytest.approx(2 * stats.norm.sf(z), rel=1e-10)


def test_samples_that_are_all_tied_do_not_differ():
    assert compare([2.0, 2.0], [2.0, 2.0, 2.0]) == (3.0, 1.0, 0.5)


def test_holm_steps_down():
    # Sorted 0.005, 0.01, 0.03, 0.04 times 4, 3, 2, 1: the last, 0.04, may not be below 0.06.
    np.testing.assert_allclose(holm([0.01, 0.04, 0.03, 0.005]), [0.03, 0.06, 0.06, 0.02])


def test_holm_stops_at_one_and_leaves_a_single_hypothesis_alone():
    np.testing.assert_array_equal(holm([0.5, 0.9]), [1.0, 1.0])
    np.testing.assert_array_equal(holm([0.04]), [0.04])
    assert len(holm([])) == 0
