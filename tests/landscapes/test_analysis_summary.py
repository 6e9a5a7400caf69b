import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

from softvox_gym import Design, landscape
from softvox_gym.landscapes.analysis import analyse
from softvox_gym.landscapes.analysis.groups import groups, n_pieces
from softvox_gym.landscapes.analysis.report import markdown, text
from softvox_gym.landscapes.analysis.symmetry import symmetry_classes
from softvox_gym.landscapes.analysis.tables import tables


@pytest.fixture(scope="module")
def fitness():
    return landscape()["fitness"]


@pytest.fixture(scope="module")
def analysis(fitness):
    return analyse(fitness)


def rows(content):
    return list(csv.DictReader(io.StringIO(content)))


def test_the_kinds_of_designs_are_counted_by_their_pieces(fitness):
    found = groups(fitness)
    table = landscape()
    assert found["one_piece"].designs == table["is_connected"].sum()
    parts = [found[kind].designs for kind in ("one_piece", "several_pieces", "empty")]
    assert sum(parts) == found["all"].designs == 6561
    assert found["empty"].designs == 1
    assert found["no_actuator"].designs == 2**8
    assert n_pieces()[Design("10010110").index] == 4


def test_a_kinds_best_mean_and_quantiles_are_its_own(fitness):
    connected = landscape()["is_connected"]
    found = groups(fitness)
    several = np.flatnonzero(n_pieces() > 1)
    assert found["one_piece"].mean == pytest.approx(fitness[connected].mean())
    assert found["one_piece"].fittest == 6453
    assert found["several_pieces"].best == fitness[several].max()
    assert fitness[found["several_pieces"].fittest] == fitness[several].max()
    assert found["several_pieces"].quantiles[0.5] == np.median(fitness[several])


def test_the_summary_for_programs_is_plain_json_that_says_the_same(analysis):
    read = json.loads(json.dumps(analysis.to_dict(), allow_nan=False))
    assert read["groups"]["all"]["fittest"] == 6453
    assert read["symmetry"]["turns"]["n_classes"] == 1665
    assert read["symmetry"]["turns_and_reflections"]["n_classes"] == 1035
    assert read["local_optima"]["number"] == len(analysis.optima.design)
    assert read["local_optima"]["climbs"]["steepest"]["finds_best"] == pytest.approx(
        analysis.optima.basins(analysis.optima.steepest)[0] / 6561
    )
    assert read["random_walk"]["autocorrelation"] == list(analysis.autocorrelation)
    assert [each["threshold"] for each in read["neutrality"]] == [0, 0.01, 0.1]
    assert [each["fittest"] for each in read["robustness"]["mutation"]] == [1, 10, 100, 6561]
    worst = analysis.after["mutation"].worst
    assert worst[read["robustness"]["fittest_by_worst_neighbour"]] == worst.max()


def test_the_mirror_that_swaps_x_and_y_is_the_only_symmetry_the_engine_keeps(analysis):
    for found in analysis.broken:
        if found.symmetry == "mirror that swaps x and y":
            assert found.largest < 1e-8  # what rounding makes of it; measured 2.3e-9
        else:
            assert found.above[1.0] >= 10


def test_the_screen_is_a_screen(analysis):
    lines = text(analysis).splitlines()
    assert len(lines) <= 45
    assert max(map(len, lines)) <= 84
    assert not any(line != line.rstrip() for line in lines)


def test_the_screen_names_the_optima_and_what_is_left_of_the_fittest(analysis):
    shown = text(analysis)
    for number in (6453, 4295, 5757, 6255):
        assert f"\n{number} " in shown
    assert "113 local optima in 18 symmetry classes" in shown
    kept = analysis.kept["mutation"][100]
    line = next(line for line in shown.splitlines() if line.startswith("the fittest 100"))
    assert f"{kept.own:.4f}" in line
    assert f"{100 * kept.mean_share:.1f} %" in line


def test_the_documentation_shows_the_screen_as_it_is(analysis):
    shown = (Path(__file__).parent.parent.parent / "docs" / "landscape.md").read_text(
        encoding="utf-8"
    )
    assert f"```text\n{text(analysis)}\n```" in shown


def test_every_table_of_the_document_is_whole(analysis):
    document = markdown(analysis).splitlines()
    tables_seen, width = 0, None
    for line in document:
        if line.startswith("|"):
            bars = line.count("|")
            tables_seen += width is None
            assert width in (None, bars), line
            width = bars
        else:
            width = None
    assert tables_seen == sum(line.startswith("## ") for line in document) == 9


def test_the_table_of_optima_has_them_all_with_whole_basins(analysis):
    read = rows(tables(analysis)["local_optima.csv"])
    assert [int(row["design"]) for row in read] == analysis.optima.design.tolist()
    assert sum(int(row["steepest_basin"]) for row in read) == 6561
    assert sum(float(row["random_basin"]) for row in read) == pytest.approx(6561)
    assert [float(row["fitness"]) for row in read] == analysis.optima.fitness.tolist()
    assert all(Design(row["digits"]).index == int(row["design"]) for row in read)


def test_the_table_of_neighbours_reads_back_to_the_same_bits(analysis):
    read = rows(tables(analysis)["neighbours.csv"])
    for kind, after in analysis.after.items():
        for name in ("mean", "worst"):
            column = np.array([float(row[f"{kind}_{name}"]) for row in read])
            assert np.array_equal(column, getattr(after, name), equal_nan=True)
    assert [int(row["design"]) for row in read] == list(range(6561))


def test_the_table_of_classes_has_every_class_and_counts_every_design(analysis, fitness):
    read = rows(tables(analysis)["classes.csv"])
    assert [int(row["class"]) for row in read] == np.unique(symmetry_classes()).tolist()
    assert sum(int(row["size"]) for row in read) == 6561
    top = next(row for row in read if row["class"] == "4295")
    assert (top["size"], top["fittest"], top["is_connected"]) == ("4", "6453", "True")
    assert float(top["spread"]) == fitness[6453] - fitness[[5757, 6255]].min()
    assert float(top["mean"]) == pytest.approx(fitness[[4295, 5757, 6255, 6453]].mean())


def test_a_design_that_diverged_is_analysed_as_one_that_goes_nowhere(fitness):
    some, zero = fitness.copy(), fitness.copy()
    some[6453], zero[6453] = np.nan, 0.0
    broken, still = analyse(some), analyse(zero)
    assert broken.n_diverged == 1
    assert still.n_diverged == 0
    assert broken.optima.design[0] == 4295
    assert {**broken.to_dict(), "n_diverged": 0} == still.to_dict()
    assert "1 diverged count as 0" in text(broken)


@pytest.mark.parametrize("fitness", [np.zeros(6561), np.full(6561, np.nan)])
def test_a_landscape_where_nothing_moves_is_analysed_all_the_same(fitness):
    still = analyse(fitness)
    read = json.loads(json.dumps(still.to_dict(), allow_nan=False))
    assert read["random_walk"]["correlation_length"] is None
    assert read["local_optima"]["number"] == read["local_optima"]["plateaus"] == 1
    assert read["symmetry"]["turns"]["within"] is None
    assert len(text(still).splitlines()) <= 45
    assert len(rows(tables(still)["local_optima.csv"])) == 1
    assert "nan" not in markdown(still)
