"""A run's improvements say when it came upon something better."""

import subprocess
import sys

import numpy as np
import pytest

from softvox_gym import Design
from softvox_search.report.improvements import improvements
from softvox_search.report.truth import exact_fitness, optimum


def log_of(designs, unique=None):
    sequence = np.arange(1, len(designs) + 1)
    return {
        "sequence": sequence,
        "unique_sequence": sequence if unique is None else np.asarray(unique),
        "design": np.asarray(designs, dtype=np.int16),
    }


def by_hand(columns, fitness):
    best, rows = -np.inf, []
    for sequence, unique, design in zip(*columns.values(), strict=True):
        if fitness[design] > best:
            best = fitness[design]
            rows.append((sequence, unique, design, best))
    return rows


@pytest.mark.parametrize("terms", ["raw", "class"])
def test_improvements_are_those_that_a_plain_loop_finds(terms):
    rng = np.random.default_rng(0)
    designs = rng.integers(0, 6561, 3000)
    first = np.zeros(3000, dtype=bool)
    first[np.unique(designs, return_index=True)[1]] = True
    columns = log_of(designs, np.cumsum(first))
    made = improvements(columns)
    rows = made["terms"] == terms
    names = ("sequence", "unique_sequence", "design", "fitness")
    found = list(zip(*(made[name][rows] for name in names), strict=True))
    assert len(found) > 3
    assert found == by_hand(columns, exact_fitness(terms))


def test_a_turned_optimum_has_regret_in_raw_terms_only():
    assert Design(6453).canonical() == Design(5757).canonical()
    made = improvements(log_of([0, 5757]))
    fitness = dict(zip(made["terms"], made["fitness"], strict=True))  # the last of each
    assert optimum() - fitness["raw"] == pytest.approx(0.754, abs=0.0005)
    assert fitness["class"] == optimum()


def test_class_terms_give_every_pose_of_a_robot_the_best_of_them():
    raw, shared = exact_fitness("raw"), exact_fitness("class")
    for number in np.random.default_rng(0).integers(0, 6561, 50):
        turned = [Design(int(number)).rotated(k) for k in range(4)]
        poses = [pose.index for pose in turned + [pose.mirrored() for pose in turned]]
        assert set(shared[poses]) == {raw[poses].max()}


def test_the_first_evaluation_counts_even_where_nothing_moves():
    made = improvements(log_of([0, 0, 0]))
    assert list(made["terms"]) == ["raw", "class"]
    assert list(made["sequence"]) == [1, 1]
    assert list(made["fitness"]) == [0, 0]


def test_a_run_without_evaluations_has_no_improvements():
    made = improvements(log_of([]))
    assert {len(column) for column in made.values()} == {0}


def test_unknown_terms_are_refused():
    with pytest.raises(ValueError, match="one of raw, class, got 'cooked'"):
        exact_fitness("cooked")


def test_workers_load_no_heavy_library():
    code = "import sys, softvox_search.report.improvements; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert not loaded & {"deap", "pandas", "matplotlib", "scipy"}
