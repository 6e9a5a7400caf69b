"""The report's tables, on runs whose answers can be counted."""

import numpy as np
import pandas as pd
import pytest
from made_results import FITNESS, OPTIMUM, VALUES, random_runs, results, run

import softvox_gym
from softvox_gym import Design
from softvox_search.report import noise, tables
from softvox_search.report.curves import (
    TARGETS,
    best,
    ecdf,
    finished,
    first_at,
    hypervolume,
    improvements,
    positions,
    targets,
)
from softvox_search.report.statistics import compare
from softvox_search.report.truth import exact_fitness

BEST, SECOND, TURNED, STILL = 6453, 4295, 5757, 0


def made(*runs, **options):
    return tables.make(results(*runs, **options))


def rows_of(table, **where):
    for name, value in where.items():
        table = table[table[name] == value]
    return table


def row_of(table, **where):
    (row,) = rows_of(table, **where).to_dict("records")
    return row


def below(curves, at):
    return OPTIMUM - best(curves, np.array(at))


def test_improvements_are_those_that_a_plain_loop_finds():
    rng = np.random.default_rng(0)
    designs = rng.integers(0, 6561, 3000)
    is_new = np.zeros(3000, dtype=bool)
    is_new[np.unique(designs, return_index=True)[1]] = True
    at = np.cumsum(is_new)
    largest, expected = -np.inf, []
    for unique, fitness in zip(at, FITNESS[designs], strict=True):
        if fitness > largest:
            largest = fitness
            expected.append((unique, fitness))
    assert len(expected) > 3
    assert list(zip(*improvements(at, FITNESS[designs]), strict=True)) == expected


def test_the_first_evaluation_counts_even_where_nothing_moves():
    curve = improvements(np.array([1, 2, 3]), np.zeros(3))
    assert [list(values) for values in curve] == [[1], [0]]
    assert [len(values) for values in improvements(np.zeros(0, int), np.zeros(0))] == [0, 0]


def test_class_terms_give_every_pose_of_a_robot_the_best_of_them():
    exact = exact_fitness()
    for number in np.random.default_rng(0).integers(0, 6561, 50):
        turned = [Design(int(number)).rotated(k) for k in range(4)]
        poses = [pose.index for pose in turned + [pose.mirrored() for pose in turned]]
        assert set(exact["class"][poses]) == {exact["raw"][poses].max()}


def test_a_turned_optimum_has_regret_in_raw_terms_only():
    assert Design(BEST).canonical() == Design(TURNED).canonical()
    runs = finished(results(run(0, "a", [STILL, TURNED])))
    assert below(runs["raw"], [2]) == pytest.approx(0.754, abs=0.0005)
    np.testing.assert_array_equal(below(runs["class"], [1, 2]), [[OPTIMUM, 0]])


def test_a_run_keeps_its_best_value_and_has_none_before_it_begins():
    runs = finished(results(run(0, "a", [STILL, TURNED, STILL, SECOND])))
    values = best(runs["raw"], np.array([0, 1, 2, 3, 4, 9]))
    np.testing.assert_array_equal(values, [FITNESS[[0, 0, TURNED, TURNED, SECOND, SECOND]]])


def test_a_target_is_reached_by_the_first_evaluation_that_is_as_good():
    runs = finished(results(run(0, "a", [STILL, SECOND, BEST]), run(1, "a", [STILL] * 3)))
    for share, first in ((0.99, 2), (1, 3)):
        at = first_at(runs["raw"], share * runs["goal"])
        np.testing.assert_array_equal(at, [first, np.inf])


def test_curves_agree_with_the_log_at_every_place():
    orders = np.random.default_rng(0).permuted(np.tile(np.arange(6561), (4, 1)), axis=1)
    runs = finished(results(*(run(i, "a", order) for i, order in enumerate(orders))))
    at = positions(6561)
    assert (at[0], at[-1]) == (1, 6561)
    expected = [[FITNESS[order[:place]].max() for place in at] for order in orders]
    np.testing.assert_array_equal(best(runs["raw"], at), expected)


def test_the_distribution_of_runtimes_counts_pairs_of_runs_and_targets():
    regret = OPTIMUM - np.random.default_rng(0).choice(FITNESS, size=(7, 5))
    regret[0, 0] = 0
    regret[1, 1] = targets(OPTIMUM)[20]  # a target counts as reached where it is met exactly
    expected = [
        sum(regret[i, j] <= target for i in range(7) for target in targets(OPTIMUM)) / (7 * TARGETS)
        for j in range(5)
    ]
    np.testing.assert_allclose(ecdf(regret, [OPTIMUM] * 7), expected, rtol=1e-14)


def test_the_hardest_target_is_met_by_the_optimum_alone_and_the_easiest_by_all():
    regret = np.sort(OPTIMUM - FITNESS)
    assert regret[0] <= targets(OPTIMUM)[-1] < regret[1]
    assert targets(OPTIMUM)[0] >= regret[-1]
    row = row_of(made(run(0, "a", [STILL]))["problems"])
    assert (row["known"], row["goal"], row["finest"]) == (True, OPTIMUM, 1)
    # At most four designs meet a target: the four poses of the best robot in class terms.
    met = [np.sum(exact_fitness()["class"] >= OPTIMUM - target) for target in targets(OPTIMUM)]
    assert row["hard"] == sum(count <= 4 for count in met)


def test_targets_follow_a_small_goal_and_none():
    assert targets(0.5)[-1] == 0.005
    np.testing.assert_array_equal(targets(0.0), 0)


def test_fixed_budgets_hold_the_last_value_and_say_how_many_runs_got_there():
    runs = [run(0, "a", [STILL] * 49 + [BEST] + [STILL] * 60), run(1, "a", [TURNED] * 60)]
    table = made(*runs)["fixed_budget"]
    assert sorted(set(table["budget"])) == [50, 100, 110]
    row = row_of(table, terms="raw", budget=100)
    assert (row["runs"], row["reached"], row["success"]) == (2, 0.5, 0.5)
    assert row["mean"] == row["iqm"] == pytest.approx((OPTIMUM - FITNESS[TURNED]) / 2)
    assert row_of(table, terms="class", budget=100)["mean"] == 0
    assert row_of(table, terms="raw", budget=110)["reached"] == 0.5  # so many exactly


def test_fixed_budgets_are_empty_where_a_searchers_own_budget_is_smaller():
    runs = [run(0, "a", [STILL] * 100), run(1, "short", [STILL] * 60)]
    found = made(*runs, budgets={"short": {"unique": 60}})
    short = rows_of(found["fixed_budget"], searcher="short", terms="raw")
    assert list(short["iqm"].isna()) == [False, True]
    assert not rows_of(found["fixed_budget"], searcher="a")["iqm"].isna().any()
    assert set(found["pairs"]["budget"]) == {50}


@pytest.mark.parametrize(
    ("budget", "limit"),
    [
        ({"unique": 100, "evaluations": 80, "steps": None}, 80),
        ({"cpu_seconds": 3.0}, 1),
        ({"unique": 100}, 100),
    ],
)
def test_unique_evaluations_are_limited_by_whatever_the_budget_states(budget, limit):
    runs = finished(results(run(0, "a", [STILL]), budgets={"a": budget}))
    assert list(runs["limit"]) == [limit]


def test_fixed_targets_have_the_expected_running_time():
    runs = [
        run(0, "a", [STILL, STILL, SECOND, BEST, STILL]),
        run(1, "a", [STILL] * 7),
        run(2, "a", [BEST, STILL]),
    ]
    table = made(*runs)["fixed_target"]
    row = row_of(table, terms="raw", target=1.0)
    assert (row["runs"], row["successes"], row["success"]) == (3, 2, 2 / 3)
    assert row["ert"] == (4 + 7 + 1) / 2
    assert row["median"] == 2.5
    assert row["low"] <= row["ert"] <= row["high"]
    assert row_of(table, terms="raw", target=0.99)["ert"] == (3 + 7 + 1) / 2
    assert row_of(table, terms="raw", target=0.95)["fitness"] == 0.95 * OPTIMUM
    assert list(table["designs"]) == [2, 2, 1, 4, 4, 4]


def test_a_target_that_no_run_reached_takes_infinitely_long():
    table = made(run(0, "a", [STILL]), run(1, "a", [STILL]))["fixed_target"]
    assert np.isinf(table[["ert", "low", "high"]]).all(axis=None)
    assert table["median"].isna().all()


def test_the_expected_running_time_of_random_order_is_that_of_theory():
    table = made(*random_runs(["random"], 400, 6561))["fixed_target"]
    # Drawn without replacement the first of k is at 6562 / (k + 1) on average.
    for terms, target, k in (("raw", 1.0, 1), ("raw", 0.99, 2), ("class", 1.0, 4)):
        expected = 6562 / (k + 1)
        variance = 6562 * (6561 - k) * k / ((k + 1) ** 2 * (k + 2))
        error = np.sqrt(variance / 400)
        assert row_of(table, terms=terms, target=target)["ert"] == pytest.approx(
            expected, abs=4 * error
        )


def test_pairs_compare_best_values_and_adjust_all_pairs_of_a_budget():
    some = results(*random_runs(["a", "b", "c"], 12, 60))
    table = tables.make(some)["pairs"]
    assert len(table) == 2 * 2 * 3  # terms, budgets 50 and 60, pairs
    values = {
        name: best(own["raw"], np.array([50]))[:, 0]
        for name, own in finished(some).groupby("searcher")
    }
    here = rows_of(table, terms="raw", budget=50)
    row = row_of(here, a="a", b="c")
    assert (row["u"], row["p"], row["a12"]) == compare(values["a"], values["c"])
    smallest = here.sort_values("p").iloc[0]
    assert smallest["p_holm"] == min(1, 3 * smallest["p"])


def test_anytime_has_a_row_for_every_place_and_its_band_holds_the_curve():
    table = made(*random_runs(["a", "b"], 8, 200))["anytime"]
    assert len(table) == 2 * 2 * len(positions(200))
    assert (table["low"] <= table["iqm"]).all()
    assert (table["iqm"] <= table["high"]).all()
    for _, curve in table.groupby(["terms", "searcher"]):
        assert curve["iqm"].is_monotonic_decreasing
        assert curve["ecdf"].is_monotonic_increasing


def test_failed_runs_are_counted_and_left_out():
    some = results(
        run(0, "a", [BEST]), run(1, "a", [STILL], status="failed"), run(2, "b", [STILL, STILL])
    )
    assert row_of(tables.overview(some.runs), searcher="a")["failed"] == 1
    assert list(finished(some)["searcher"]) == ["a", "b"]


def test_levels_are_compared_one_by_one_under_the_first_policy():
    found = made(*random_runs(["a", "b"], 2, 20, levels=(1.0, 0.0), policies=("naive", "all")))
    assert found["problems"][["level", "policy"]].to_numpy().tolist() == [
        [0.0, "naive"],
        [1.0, "naive"],
    ]
    assert set(found["anytime"]["searcher"]) == {"a", "b"}
    assert set(found["anytime"]["policy"]) == {"naive"}


@pytest.fixture(scope="module")
def brief(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOFTVOX_CACHE", str(tmp_path_factory.mktemp("cache")))
        return exact_fitness(VALUES["brief"])["raw"]


def test_every_physics_has_its_own_optimum(brief):
    fittest = int(brief.argmax())
    assert fittest != BEST
    runs = [run(0, "a", [STILL, BEST]), run(1, "a", [BEST, fittest], physics="brief")]
    found = made(*runs)
    assert list(found["problems"]["goal"]) == [
        OPTIMUM,
        brief.max(),
        pytest.approx(np.nan, nan_ok=True),
    ]
    regret = rows_of(found["fixed_budget"], physics="brief", terms="raw", measure="regret")
    assert list(regret["mean"]) == [0]
    first = rows_of(found["anytime"], physics="brief", terms="raw", unique=1)
    assert list(first["iqm"]) == [brief.max() - brief[BEST]]


def test_running_times_and_targets_are_pooled_over_physics(brief):
    fittest = int(brief.argmax())
    runs = [
        run(0, "a", [STILL, BEST]),
        run(1, "a", [STILL, STILL, STILL]),
        run(2, "a", [STILL, STILL, STILL, fittest], physics="brief"),
        run(3, "b", [BEST]),  # not put to the other physics
    ]
    found = made(*runs)
    row = row_of(found["fixed_target"], physics="", terms="raw", target=1.0)
    assert (row["searcher"], row["runs"], row["successes"]) == ("a", 3, 2)
    assert row["ert"] == (2 + 3 + 4) / 2
    curve = rows_of(found["anytime"], physics="", terms="raw")
    assert set(curve["searcher"]) == {"a"}
    assert row_of(curve, unique=4)["ecdf"] == pytest.approx((2 + 1 / TARGETS) / 3)  # still: easiest
    assert curve["iqm"].isna().all()
    assert not len(rows_of(found["fixed_budget"], physics=""))
    assert not len(rows_of(found["pairs"], physics=""))


def test_where_no_optimum_is_known_the_best_found_so_far_counts():
    shape = (3, 3, 3)
    runs = [
        run(0, "a", [5, 6, 7], shape=shape, fitness=[1.0, 3.0, 2.0]),
        run(1, "a", [5, 6, 7], shape=shape, fitness=[1.0, 1.0, 4.0]),
        run(2, "b", [8], shape=shape, fitness=[2.0]),
    ]
    found = made(*runs)
    row = row_of(found["problems"])
    assert (row["known"], row["goal"], row["shape"]) == (False, 4.0, "3x3x3")
    assert set(found["anytime"]["terms"]) == {"raw"}  # of turned designs nothing is known
    values = rows_of(found["anytime"], searcher="a", measure="best")
    assert list(values["iqm"]) == [1.0, 2.0, 3.5]
    row = row_of(found["fixed_target"], searcher="a", target=1.0)
    assert (row["fitness"], row["successes"], row["ert"]) == (4.0, 1, 6.0)
    assert np.isnan(row["designs"])
    assert set(rows_of(found["fixed_budget"], searcher="b")["success"]) == {0.0}


def test_the_hypervolume_is_that_worked_out_by_hand():
    """On four sites, the best of at most 1, 2, 3, 4 voxels, in turn: their mean is the volume."""
    at, voxels = np.arange(1, 7), np.array([2, 3, 2, 4, 1, 0])
    fitness = np.array([1.0, 3.0, 0.5, 2.0, 2.0, 0.0])
    curve = hypervolume(at, fitness, voxels, 4)
    assert list(curve.at) == [1, 2, 5]  # 0, 1, 1, 1; then 0, 1, 3, 3; then 2, 2, 3, 3
    assert list(curve.fitness) == [0.75, 1.75, 2.5]
    none = hypervolume(at[:1], np.zeros(1), np.array([4]), 4)
    assert (len(none.at), best([none], at)[0, -1]) == (0, 0.0)


def test_the_hypervolume_is_the_area_that_counting_points_gives():
    rng = np.random.default_rng(14)
    fitness, voxels = rng.integers(0, 20, size=30).astype(float), rng.integers(28, size=30)
    points = [(f, v) for f in range(20) for v in range(1, 28)]  # of unit squares up to (0, 28)
    covered = sum(any((fitness > f) & (voxels <= v)) for f, v in points)
    assert hypervolume(np.arange(30), fitness, voxels, 27).fitness[-1] == pytest.approx(
        covered / 27
    )


@pytest.mark.parametrize(
    ("shape", "designs"),
    [((3, 3, 3), [0, 2, 3**26 + 1]), ((4, 4, 4), ["0" * 64, "2" + "0" * 63, "10" * 2 + "0" * 60])],
)
def test_hypervolume_counts_voxels_of_numbers_and_of_digits(shape, designs):
    designs = np.array(designs, dtype=object)
    found = made(
        run(0, "a", designs, shape=shape, fitness=[0.0, 1.0, 2.0]),
        run(1, "a", designs[:1], shape=shape, fitness=[0.0]),
        run(2, "b", [BEST]),
    )["hypervolume"]
    sites, rows = np.prod(shape), rows_of(found, shape="x".join(map(str, shape)))
    assert len(rows) == len(found)  # of 2x2x2 the optimum is known
    assert list(rows["unique"]) == [1, 2, 3]
    assert list(rows["iqm"]) == [0.0, 0.5, pytest.approx((2 * sites - 1) / sites / 2)]
    assert list(rows["reached"]) == [1.0, 0.5, 0.5]


def test_designs_of_any_size_can_be_recommended_where_nothing_is_known():
    designs = np.array(["0" * 64, "1" * 64], dtype=object)
    runs = run(0, "a", designs, shape=(4, 4, 4), level=1.0, fitness=[0.0, 1.5], believed=1.5)
    found = made(runs, run(1, "a", [BEST], level=0.0, believed=4.0))
    row = row_of(found["recommendations"], shape="4x4x4")
    assert row["recommended"] == "1" * 64
    assert np.isnan(row["true_regret"])
    assert row_of(found["recommendations"], shape="2x2x2")["true_regret"] == 0


def test_files_of_problems_have_names_of_their_own_whatever_the_labels(monkeypatch):
    labels = ("published", "a/b", "a b", "ALL", "all", "../x", "é")
    found = made(*(run(i, "s", [STILL], physics=label) for i, label in enumerate(labels)))
    names = list(found["problems"]["name"])
    assert len({name.lower() for name in names}) == len(labels) + 1
    assert all(set(name) <= set("abcdefghijklmnopqrstuvwxyz0123456789_.-") for name in names)
    assert names[0] == "_published"


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


@pytest.mark.parametrize(("amounts", "is_known"), [({}, True), ({"friction": 0.0}, False)])
def test_of_noise_with_other_amounts_nothing_is_known_but_at_level_0(amounts, is_known):
    made = results(*random_runs(["a"], 1, 5, levels=(0.0, 1.0)))
    for problem in made.problems:
        problem.wrappers = ({"name": "JakobiNoise", **amounts},)
    told = tables.make(made)["recommendations"].set_index("level")["true_value"]
    assert told.notna().to_dict() == {0.0: True, 1.0: is_known}


@pytest.mark.usefixtures("halved")
def test_recommendations_are_held_against_the_truth_at_their_level():
    found = made(
        run(0, "a", [BEST], level=0.0, believed=4.7),
        run(1, "a", [TURNED], level=1.0, believed=2.5),
    )
    frame = found["recommendations"]
    exact = row_of(frame, level=0.0)
    assert (exact["true_value"], exact["true_regret"]) == (OPTIMUM, 0)
    assert exact["optimism"] == 4.7 - OPTIMUM
    noisy = row_of(frame, level=1.0)
    assert noisy["true_value"] == FITNESS[TURNED] / 2
    assert noisy["true_regret"] == (OPTIMUM - FITNESS[TURNED]) / 2
    assert noisy["optimism"] == 2.5 - FITNESS[TURNED] / 2
    assert list(found["problems"]["truth"]) == [
        "the best is design 6453, 4.6573 (exact)",
        "the best is design 6453, 2.3286 ± 0.1000 (standard error)",
    ]


@pytest.mark.usefixtures("halved")
def test_a_level_that_nobody_measured_is_left_empty_with_a_note():
    found = made(*random_runs(["a"], 3, 5, levels=(9.0,)))
    frame = found["recommendations"]
    assert frame[["true_value", "true_regret", "optimism"]].isna().all(axis=None)
    assert list(found["problems"]["truth"]) == [
        "no true values (no landscape at noise level 9; there are levels 0, 1)"
    ]
    summary = found["noise_searchers"]
    assert (summary["known"] == 0).all()
    assert summary["true_regret"].isna().all()


def judged(rows):
    names = ["level", "policy", "searcher", "true_regret", "optimism"]
    return pd.DataFrame(rows, columns=names).assign(
        physics="published", shape="2x2x2", true_value=1.0
    )


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
    table = noise.by_policy(frame)
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
    (row,) = noise.by_policy(frame).to_dict("records")
    assert row["optimism"] == row["optimism_low"] == row["optimism_high"] == 0.5


def test_runs_without_a_true_value_are_left_out_and_counted():
    frame = judged([(1.0, "", "a", 0.2, 0.1), (1.0, "", "a", np.nan, np.nan)])
    frame.loc[1, "true_value"] = np.nan
    (row,) = noise.by_searcher(frame).to_dict("records")
    assert (row["runs"], row["known"]) == (2, 1)
    assert (row["true_regret"], row["optimism"]) == (0.2, 0.1)


def test_no_two_labels_get_one_file():
    labels = pd.Series(["x_2", "x", "X"])
    names = tables._file_names(labels)
    assert len(set(names.values())) == 1 + len(labels)
    assert names["x_2"] == "x_2"
