"""What noise does to the landscape."""

import csv
import io
import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from cli_process import snapshot, softvox

from softvox_gym import landscape, noisy_landscape
from softvox_gym.landscapes import robustness
from softvox_gym.landscapes.noisy import LEVELS


@pytest.fixture(scope="module")
def levels():
    return robustness.levels().records()


def survivors(level):
    return robustness.published(level).facts["survivors"]


def test_without_noise_nothing_moves(levels):
    exact = levels[0]
    assert (exact["level"], exact["best"], exact["overlap"], exact["retained"]) == (0, 6453, 100, 1)
    assert exact["kendall_tau"] == pytest.approx(1)


def test_the_ranking_moves_more_with_more_noise(levels):
    assert [row["level"] for row in levels] == list(LEVELS)
    for less, more in pairwise(levels):
        for name in ("overlap", "kendall_tau", "overlap_q10"):
            assert less[name] > more[name]


def test_kendalls_tau_is_that_of_scipy(levels):
    stats = pytest.importorskip("scipy.stats")
    noisy, exact = noisy_landscape(1)["mean"], landscape()["fitness"]
    expected = stats.kendalltau(exact, noisy, variant="b").statistic
    assert levels[2]["kendall_tau"] == pytest.approx(expected, abs=1e-12)
    ties = np.array([1.0, 1, 2, 2, 3, 0]), np.array([1.0, 2, 2, 2, 0, 0])
    expected = stats.kendalltau(*ties, variant="b").statistic
    assert robustness.kendall_tau(*ties) == pytest.approx(expected)


def test_the_published_designs_are_ranked_among_all():
    rows = robustness.published(1.0).records()
    mean = noisy_landscape(1)["mean"]
    assert [row["rank"] for row in rows] == list(range(1, 101))
    for row in rows:
        assert row["noisy_rank"] == 1 + np.count_nonzero(mean > row["mean"])
        assert row["survives"] == (row["noisy_rank"] <= 100)
    assert [row["design"] for row in rows if row["is_sensitive"]] == [6453, 4295, 6481, 6507]
    assert survivors(1.0) == sum(row["survives"] for row in rows)


def test_the_command_tells_of_levels_and_survivors(tmp_path):
    done = softvox("robustness", "--out", str(tmp_path / "noise"))
    assert done.returncode == 0, done.stderr
    assert f"{survivors(1.0)} of the published top 100" in done.stdout
    assert "sensitive" in done.stdout
    files = snapshot(tmp_path / "noise")
    assert set(files) == {
        "levels.csv",
        *(
            f"{kind}_level_{level:g}.csv"
            for level in LEVELS[1:]
            for kind in ("top100", "landscape")
        ),
    }
    rows = list(csv.DictReader(io.StringIO(files["landscape_level_2.csv"].decode())))
    assert [float(row["mean"]) for row in rows] == noisy_landscape(2)["mean"].tolist()


def test_all_hundred_are_listed_where_asked_for():
    done = softvox("robustness", "--all", "--level", "0.5")
    assert done.returncode == 0
    assert all(
        digits in done.stdout
        for digits in [row["digits"] for row in robustness.published(0.5).records()]
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--level", "0.7"), "--level must be one of 0, 0.5, 1, 2, 4, got 0.7"),
        (("--level", "much"), "must be a number"),
    ],
)
def test_a_level_that_was_not_measured_is_refused(arguments, message):
    done = softvox("robustness", *arguments)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1


def test_as_json_it_says_all():
    data = json.loads(softvox("robustness", "--json", "--level", "0").stdout)
    assert [row["level"] for row in data["levels"]["rows"]] == list(LEVELS)
    assert (data["published"]["level"], len(data["published"]["rows"])) == (0, 100)
    assert data["levels"]["rows"][0]["best"] == data["published"]["rows"][0]["design"] == 6453


def test_a_folder_in_use_is_refused(tmp_path):
    (tmp_path / "mine").write_text("x")
    done = softvox("robustness", "--out", str(tmp_path))
    assert done.returncode == 2
    assert "not empty" in done.stderr
    assert list(snapshot(tmp_path)) == ["mine"]


def test_the_documents_table_is_what_the_command_prints(levels):
    text = (Path(__file__).parents[2] / "docs" / "noise.md").read_text(encoding="utf-8")
    names = {0.0: "0", 0.5: "½", 1.0: "1", 2.0: "2", 4.0: "4"}
    for row in levels:
        error = f" ± {row['standard_error']:.3f}" if row["standard_error"] else ""
        line = (
            f"| {names[row['level']]} | {row['best']} | {row['digits']} | {row['mean']:.3f}{error} "
            f"| {row['kendall_tau']:.2f} | {row['kendall_tau_top']:.2f} | {row['overlap']} "
            f"| {row['overlap_q10']} | {row['retained']:.0%} |".replace("%", " %")
        )
        assert line in text
        assert row["p_diverged"] == 0
    stay = (
        f"{survivors(1)} of the published top hundred stay among the best hundred** at level 1, "
        f"{survivors(2)} at"
    )
    assert stay in text
