import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest

from softvox_gym import Design, landscape
from softvox_gym.landscapes.analysis import analyse
from softvox_gym.landscapes.analysis.robustness import after_error
from softvox_gym.landscapes.analysis.symmetry import symmetry_classes


@pytest.fixture(scope="module")
def fitness():
    return landscape()["fitness"]


@pytest.fixture(scope="module")
def analysis(fitness):
    return analyse(fitness)


def rows(content):
    return list(csv.DictReader(io.StringIO(content)))


def test_the_kinds_of_designs_are_counted_by_their_pieces(analysis):
    kinds = {row["kind"]: row["designs"] for row in analysis.sections["kinds"].records()}
    assert kinds["in one piece"] == landscape()["is_connected"].sum()
    parts = [kinds[name] for name in ("in one piece", "in several pieces", "empty")]
    assert sum(parts) == kinds["all designs"] == 6561
    assert kinds["empty"] == 1
    assert kinds["without active voxel"] == 2**8


def test_a_kinds_best_mean_and_quantiles_are_its_own(analysis, fitness):
    kinds = {row["kind"]: row for row in analysis.sections["kinds"].records()}
    connected = landscape()["is_connected"]
    assert kinds["in one piece"]["mean"] == pytest.approx(fitness[connected].mean())
    assert kinds["in one piece"]["fittest"] == 6453
    several = kinds["in several pieces"]
    number = [len(Design(i).components) > 1 for i in range(6561)]
    assert several["best"] == fitness[number].max() == fitness[several["fittest"]]
    assert several["q50"] == np.median(fitness[number])


def test_the_summary_for_programs_is_plain_json_that_says_the_same(analysis):
    read = json.loads(json.dumps(analysis.to_dict(), allow_nan=False))
    assert read["kinds"]["rows"][0]["fittest"] == 6453
    assert [row["classes"] for row in read["symmetry"]["rows"]] == [1665, 1035]
    assert (read["local_optima"]["number"], read["local_optima"]["plateaus"]) == (113, 0)
    assert "rows" not in read["local_optima"]  # they are in a file of their own
    assert [row["threshold"] for row in read["neutrality"]["rows"]] == [0, 0.01, 0.1]
    assert [row["fittest"] for row in read["robustness"]["rows"]] == [1, 10, 100, 6561]
    assert read["n_designs"] == 6561
    worst = after_error(analysis.fitness)["mutation"].worst
    assert worst[read["robustness"]["by_worst"]] == read["robustness"]["worst"] == worst.max()
    assert all(section["meaning"] for section in read.values() if isinstance(section, dict))


def test_the_mirror_that_swaps_x_and_y_is_the_only_symmetry_the_engine_keeps(analysis):
    for row in analysis.sections["symmetries"].records():
        if row["symmetry"] == "mirror that swaps x and y":
            assert row["largest"] < 1e-8  # what rounding makes of it; measured 2.3e-9
        else:
            assert row["above_1"] >= 10


def test_the_screen_is_a_screen(analysis):
    lines = analysis.text().splitlines()
    assert len(lines) <= 45
    assert max(map(len, lines)) <= 84
    assert not any(line != line.rstrip() for line in lines)


def test_the_screen_names_the_optima_and_what_is_left_of_the_fittest(analysis):
    shown = analysis.text()
    for number in (6453, 4295, 5757, 6255):
        assert f"\n{number} " in shown
    assert "113 local optima in 18 symmetry classes" in shown
    kept = analysis.sections["robustness"].records()[2]
    line = next(line for line in shown.splitlines() if line.startswith("the fittest 100"))
    assert f"{kept['fitness']:.4f}" in line
    assert f"{100 * kept['mutation_mean_share']:.1f} %" in line


def test_the_documentation_shows_the_screen_as_it_is(analysis):
    shown = (Path(__file__).parent.parent.parent / "docs" / "landscape.md").read_text(
        encoding="utf-8"
    )
    assert f"```text\n{analysis.text()}\n```" in shown


def test_every_table_of_the_document_is_whole(analysis):
    document = analysis.markdown().splitlines()
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
    read = rows(analysis.tables()["local_optima.csv"])
    assert len(read) == 113
    assert sum(int(row["steepest_basin"]) for row in read) == 6561
    assert sum(float(row["random_basin"]) for row in read) == pytest.approx(6561)
    for row in read:
        assert float(row["fitness"]) == analysis.fitness[int(row["design"])]
    assert all(Design(row["digits"]).index == int(row["design"]) for row in read)


def test_the_table_of_neighbours_reads_back_to_the_same_bits(analysis):
    read = rows(analysis.tables()["neighbours.csv"])
    for kind, after in after_error(analysis.fitness).items():
        for name, values in after._asdict().items():
            column = np.array([float(row[f"{kind}_{name}"]) for row in read])
            assert np.array_equal(column, values, equal_nan=True)
    assert [int(row["design"]) for row in read] == list(range(6561))


def test_the_table_of_classes_has_every_class_and_counts_every_design(analysis, fitness):
    read = rows(analysis.tables()["classes.csv"])
    assert sorted(int(row["class"]) for row in read) == np.unique(symmetry_classes()).tolist()
    spreads = [float(row["spread"]) for row in read]
    assert spreads == sorted(spreads, reverse=True)
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
    assert broken.sections["local_optima"].rows[0][0] == 4295
    assert {**broken.to_dict(), "n_diverged": 0} == still.to_dict()
    assert "1 diverged count as 0" in broken.text()


@pytest.mark.parametrize("fitness", [np.zeros(6561), np.full(6561, np.nan)])
def test_a_landscape_where_nothing_moves_is_analysed_all_the_same(fitness):
    still = analyse(fitness)
    read = json.loads(json.dumps(still.to_dict(), allow_nan=False))
    assert read["ruggedness"]["correlation_length"] is None
    assert read["local_optima"]["number"] == read["local_optima"]["plateaus"] == 1
    assert read["symmetry"]["rows"][0]["within"] is None
    assert len(still.text().splitlines()) <= 45
    assert len(rows(still.tables()["local_optima.csv"])) == 1
    assert "nan" not in still.markdown()
