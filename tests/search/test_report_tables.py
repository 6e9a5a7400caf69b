"""The report's tables, on runs whose answers can be counted."""

import numpy as np
import pandas as pd
import pytest
from made_results import FITNESS, OPTIMUM, random_runs, results, run

import softvox_gym
from softvox_search.report import recommendations, tables
from softvox_search.report.cells import cells_of, sections_of
from softvox_search.report.curves import TARGETS, ecdf, hard_targets, positions, targets
from softvox_search.report.statistics import compare

BEST, SECOND, TURNED, STILL = 6453, 4295, 5757, 0


def section_of(*runs, **options):
    (section,) = sections_of(cells_of(results(*runs, **options)))
    return section


def rows_of(table, **where):
    for name, value in where.items():
        table = table[table[name] == value]
    return table


def row_of(table, **where):
    (row,) = rows_of(table, **where).to_dict("records")
    return row


def test_a_run_keeps_its_best_value_and_has_none_before_it_begins():
    (cell,) = section_of(run(0, "a", [STILL, TURNED, STILL, SECOND])).cells
    best = cell.best("raw", np.array([0, 1, 2, 3, 4, 9]))
    np.testing.assert_array_equal(best, [FITNESS[[0, 0, TURNED, TURNED, SECOND, SECOND]]])
    np.testing.assert_array_equal(cell.regret("class", np.array([1, 2])), [[OPTIMUM, 0]])


def test_a_hit_is_the_first_evaluation_that_reaches_the_target():
    (cell,) = section_of(run(0, "a", [STILL, SECOND, BEST]), run(1, "a", [STILL] * 3)).cells
    np.testing.assert_array_equal(cell.hit("raw", 0.99 * OPTIMUM), [2, np.inf])
    np.testing.assert_array_equal(cell.hit("raw", OPTIMUM), [3, np.inf])


def test_curves_agree_with_the_log_at_every_place():
    orders = np.random.default_rng(0).permuted(np.tile(np.arange(6561), (4, 1)), axis=1)
    (cell,) = section_of(*(run(i, "a", order) for i, order in enumerate(orders))).cells
    at = positions(6561)
    assert (at[0], at[-1]) == (1, 6561)
    expected = [[FITNESS[order[:place]].max() for place in at] for order in orders]
    np.testing.assert_array_equal(cell.best("raw", at), expected)


def test_the_distribution_of_runtimes_counts_pairs_of_runs_and_targets():
    regret = OPTIMUM - np.random.default_rng(0).choice(FITNESS, size=(7, 5))
    regret[0, 0] = 0
    regret[1, 1] = targets()[20]  # a target counts as reached where it is met exactly
    expected = [
        sum(regret[i, j] <= target for i in range(7) for target in targets()) / (7 * TARGETS)
        for j in range(5)
    ]
    np.testing.assert_allclose(ecdf(regret), expected, rtol=1e-14)


def test_the_hardest_target_is_met_by_the_optimum_alone_and_the_easiest_by_all():
    regret = np.sort(OPTIMUM - FITNESS)
    assert regret[0] <= targets()[-1] < regret[1]
    assert targets()[0] >= regret[-1]
    # At most four designs meet a target: the four poses of the best robot in class terms.
    met = [np.sum(regret <= target) for target in targets()]
    assert hard_targets(4) == sum(count <= 4 for count in met)


def test_fixed_budgets_hold_the_last_value_and_say_how_many_runs_got_there():
    runs = [run(0, "a", [STILL] * 49 + [BEST] + [STILL] * 60), run(1, "a", [TURNED] * 60)]
    table = tables.fixed_budget(section_of(*runs, budget={"unique": 110}))
    assert sorted(set(table["budget"])) == [50, 100, 110]
    row = row_of(table, terms="raw", budget=100)
    assert (row["runs"], row["reached"], row["success"]) == (2, 0.5, 0.5)
    assert row["mean"] == row["iqm"] == pytest.approx((OPTIMUM - FITNESS[TURNED]) / 2)
    assert row_of(table, terms="class", budget=100)["mean"] == 0
    assert row_of(table, terms="raw", budget=110)["reached"] == 0.5  # so many exactly


def test_fixed_budgets_are_empty_where_a_searchers_own_budget_is_smaller():
    runs = [run(0, "a", [STILL] * 100), run(1, "short", [STILL] * 60)]
    budget = {"unique": 100, "searchers": {"short": {"unique": 60}}}
    section = section_of(*runs, budget=budget)
    table = tables.fixed_budget(section)
    short = rows_of(table, searcher="short", terms="raw")
    assert list(short["iqm"].isna()) == [False, True]
    assert not rows_of(table, searcher="a")["iqm"].isna().any()
    assert set(tables.pairs(section)["budget"]) == {50}


def test_the_nominal_budget_limits_the_unique_evaluations_as_well():
    (cell,) = section_of(
        run(0, "a", [STILL]), budget={"unique": 100, "evaluations": 80, "steps": None}
    ).cells
    assert cell.limit == 80


def test_fixed_targets_have_the_expected_running_time():
    runs = [
        run(0, "a", [STILL, STILL, SECOND, BEST, STILL]),
        run(1, "a", [STILL] * 7),
        run(2, "a", [BEST, STILL]),
    ]
    table = tables.fixed_target(section_of(*runs))
    row = row_of(table, terms="raw", target=1.0)
    assert (row["runs"], row["hits"], row["success"]) == (3, 2, 2 / 3)
    assert row["ert"] == (4 + 7 + 1) / 2
    assert row["median"] == 2.5
    assert row["low"] <= row["ert"] <= row["high"]
    assert row_of(table, terms="raw", target=0.99)["ert"] == (3 + 7 + 1) / 2
    assert row_of(table, terms="raw", target=0.95)["fitness"] == 0.95 * OPTIMUM


def test_a_target_that_no_run_reached_takes_infinitely_long():
    table = tables.fixed_target(section_of(run(0, "a", [STILL]), run(1, "a", [STILL])))
    assert np.isinf(table[["ert", "low", "high"]]).all(axis=None)
    assert table["median"].isna().all()


def test_the_expected_running_time_of_random_order_is_that_of_theory():
    table = tables.fixed_target(section_of(*random_runs(["random"], 400, 6561)))
    # Drawn without replacement the first of k is at 6562 / (k + 1) on average.
    for terms, target, k in (("raw", 1.0, 1), ("raw", 0.99, 2), ("class", 1.0, 4)):
        expected = 6562 / (k + 1)
        variance = 6562 * (6561 - k) * k / ((k + 1) ** 2 * (k + 2))
        error = np.sqrt(variance / 400)
        assert row_of(table, terms=terms, target=target)["ert"] == pytest.approx(
            expected, abs=4 * error
        )


def test_pairs_compare_best_values_and_adjust_all_pairs_of_a_budget():
    runs = random_runs(["a", "b", "c"], 12, 60)
    section = section_of(*runs)
    table = tables.pairs(section)
    assert len(table) == 2 * 2 * 3  # terms, budgets 50 and 60, pairs
    best = {cell.searcher: cell.best("raw", np.array([50]))[:, 0] for cell in section.cells}
    here = rows_of(table, terms="raw", budget=50)
    row = row_of(here, a="a", b="c")
    assert (row["u"], row["p"], row["a12"]) == compare(best["a"], best["c"])
    smallest = here.sort_values("p").iloc[0]
    assert smallest["p_holm"] == min(1, 3 * smallest["p"])


def test_anytime_has_a_row_for_every_place_and_its_band_holds_the_curve():
    table = tables.anytime(section_of(*random_runs(["a", "b"], 8, 200)))
    assert len(table) == 2 * 2 * len(positions(200))
    assert (table["low"] <= table["iqm"]).all()
    assert (table["iqm"] <= table["high"]).all()
    for _, curve in table.groupby(["terms", "searcher"]):
        assert curve["iqm"].is_monotonic_decreasing
        assert curve["ecdf"].is_monotonic_increasing


def test_failed_runs_are_counted_and_left_out():
    made = results(
        run(0, "a", [BEST]), run(1, "a", [STILL], status="failed"), run(2, "b", [STILL, STILL])
    )
    assert row_of(tables.overview(made), searcher="a")["failed"] == 1
    cells = cells_of(made)
    assert [(cell.searcher, len(cell.run)) for cell in cells] == [("a", 1), ("b", 1)]


def test_levels_are_compared_one_by_one_under_the_first_policy():
    made = results(*random_runs(["a", "b"], 2, 20, levels=(1.0, 0.0), policies=("naive", "all")))
    sections = sections_of(cells_of(made))
    assert [(section.level, section.policy) for section in sections] == [
        (0.0, "naive"),
        (1.0, "naive"),
    ]
    assert all(len(section.cells) == 2 for section in sections)


@pytest.fixture
def halved(monkeypatch):
    """At every level but 0 and 9 all designs are worth half, up to a standard error of 0.1."""

    def noisy_landscape(level):
        if level == 9:
            raise ValueError("no landscape at noise level 9; there are levels 0, 1")
        table = np.zeros(6561, dtype=[("mean", float), ("std", float), ("draws", int)])
        table["mean"], table["std"], table["draws"] = FITNESS / 2, 0.8, 64
        return table

    monkeypatch.setattr(softvox_gym, "noisy_landscape", noisy_landscape, raising=False)


@pytest.mark.usefixtures("halved")
def test_recommendations_are_held_against_the_truth_at_their_level():
    made = results(
        run(0, "a", [BEST], level=0.0, believed=4.7),
        run(1, "a", [TURNED], level=1.0, believed=2.5),
    )
    frame, notes = recommendations.recommendations(cells_of(made))
    exact = row_of(frame, run=0)
    assert (exact["true_value"], exact["true_regret"]) == (OPTIMUM, 0)
    assert exact["optimism"] == 4.7 - OPTIMUM
    noisy = row_of(frame, run=1)
    assert noisy["true_value"] == FITNESS[TURNED] / 2
    assert noisy["true_regret"] == (OPTIMUM - FITNESS[TURNED]) / 2
    assert noisy["optimism"] == 2.5 - FITNESS[TURNED] / 2
    assert notes == [
        "Level 0: the best is design 6453, 4.6573 (exact).",
        "Level 1: the best is design 6453, 2.3286 ± 0.1000 (standard error).",
    ]


@pytest.mark.usefixtures("halved")
def test_a_level_that_nobody_measured_is_left_empty_with_a_note():
    made = results(*random_runs(["a"], 3, 5, levels=(9.0,)))
    frame, notes = recommendations.recommendations(cells_of(made))
    assert frame[["true_value", "true_regret", "optimism"]].isna().all(axis=None)
    assert notes == [
        "Level 9: no true values (no landscape at noise level 9; there are levels 0, 1)."
    ]
    summary = recommendations.by_searcher(frame)
    assert (summary["known"] == 0).all()
    assert summary["true_regret"].isna().all()


def judged(rows):
    names = ["level", "policy", "searcher", "true_regret", "optimism"]
    return pd.DataFrame(rows, columns=names).assign(true_value=1.0)


def test_policies_are_compared_with_the_naive_one_level_by_level():
    rng = np.random.default_rng(0)
    shift = {"mean": 0.3, "naive": 0.5, "all": 0.0}
    frame = judged(
        [
            (level, policy, searcher, rng.normal(shift[policy], 0.2), rng.normal(0, 1))
            for level in (0.5, 1.0)
            for policy in shift
            for searcher in "ab"
            for _ in range(10)
        ]
    )
    table = recommendations.by_policy(frame)
    for level in (0.5, 1.0):
        here = rows_of(frame, level=level)
        naive = rows_of(here, policy="naive")["true_regret"]
        found = {
            policy: compare(rows_of(here, policy=policy)["true_regret"], naive)
            for policy in ("mean", "all")
        }
        rows = {policy: row_of(table, level=level, policy=policy) for policy in shift}
        assert np.isnan(rows["naive"]["true_regret_p"])
        for policy, comparison in found.items():
            assert rows[policy]["true_regret_p"] == comparison.p
            assert rows[policy]["true_regret_a12"] == comparison.a12 < 0.5
        smaller, larger = sorted(("mean", "all"), key=lambda policy: found[policy].p)
        assert rows[smaller]["true_regret_p_holm"] == 2 * found[smaller].p
        assert rows[larger]["true_regret_p_holm"] == max(2 * found[smaller].p, found[larger].p)


def test_the_band_of_a_policy_leaves_out_the_differences_between_searchers():
    frame = judged([(1.0, "", name, value, value) for name, value in [("a", 0), ("b", 1)] * 5])
    (row,) = recommendations.by_policy(frame).to_dict("records")
    assert row["optimism"] == row["optimism_low"] == row["optimism_high"] == 0.5


def test_runs_without_a_true_value_are_left_out_and_counted():
    frame = judged([(1.0, "", "a", 0.2, 0.1), (1.0, "", "a", np.nan, np.nan)])
    frame.loc[1, "true_value"] = np.nan
    (row,) = recommendations.by_searcher(frame).to_dict("records")
    assert (row["runs"], row["known"]) == (2, 1)
    assert (row["true_regret"], row["optimism"]) == (0.2, 0.1)
