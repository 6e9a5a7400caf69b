"""Searchers and comparisons of designs whose active voxels have several phases."""

import gymnasium as gym
import numpy as np
import pytest

from softvox_gym import TABLE_ENV_ID, Design, Lattice, landscape
from softvox_gym.cli import main
from softvox_search import check
from softvox_search.experiment.compare import compare
from softvox_search.experiment.environments import Environments, answers_from_table
from softvox_search.experiment.results import read
from softvox_search.experiment.run import do
from softvox_search.experiment.schema import Experiment, UsageError, of_dict
from softvox_search.oracle import Budget, Oracle
from softvox_search.protocol import SearcherError
from softvox_search.registry import SEARCHERS, make
from softvox_search.report import tables
from softvox_search.report.truth import exact_fitness, truth_at
from softvox_search.searchers.hill_climber import neighbours

TWO, FOUR = (Lattice.of((2, 2, 2), phases=phases) for phases in (2, 4))

#: Of a file, as tomllib reads it.
DATA = {
    "seeds": 2,
    "phases": 2,
    "budget": {"evaluations": 40},
    "searchers": [{"name": "random"}, {"name": "ga", "options": {"population": 10}}],
}


def table_env(n):
    return gym.make_vec(TABLE_ENV_ID, num_envs=n, phases=2)


@pytest.mark.parametrize("name", sorted(set(SEARCHERS) - {"exhaustive"}))
def test_every_searcher_asks_for_all_phases_and_recommends_the_best(name):
    oracle = Oracle(table_env, Budget(evaluations=48))
    assert oracle.space == TWO
    searcher = make(name, np.random.default_rng(0), space=TWO)
    while not oracle.is_exhausted:
        searcher.tell(*oracle.evaluate(searcher.ask()))
    columns = oracle.log.columns()
    assert set(TWO.digits(columns["design"]).ravel().tolist()) == {0, 1, 2, 3}
    best = searcher.recommend()
    assert best.lattice == TWO
    assert columns["fitness"].max() == landscape(phases=2)["fitness"][best.index]


def test_a_searcher_on_phases_keeps_the_rules():
    check("map_elites", evaluations=20, make_env=table_env)


def test_the_neighbours_differ_in_one_digit_each():
    design = FOUR.digits([1234567])[0].astype(np.int64)
    around = neighbours(design, FOUR.states)
    assert len(np.unique(around, axis=0)) == 40
    assert ((around != design).sum(axis=1) == 1).all()
    assert around.min() >= 0
    assert around.max() < 6
    with pytest.raises(ValueError, match="batch must be at most 40"):
        make("hill_climber", np.random.default_rng(0), space=FOUR, batch=41)


def test_the_oracle_refuses_a_phase_that_there_is_not():
    oracle = Oracle(table_env, Budget(evaluations=5))
    with pytest.raises(SearcherError, match="digits 0, 1, 2 and 3 only"):
        oracle.evaluate(np.full((1, 8), 4))
    with pytest.raises(SearcherError, match="has shape 4-phase"):
        oracle.evaluate([Design(5, shape=FOUR)])


def test_phases_are_part_of_a_runs_identity_and_of_no_other_file():
    (one, *_) = of_dict(DATA, "file").runs()
    assert one.problem.shape == TWO
    assert one.to_dict()["problem"]["phases"] == 2
    assert one.names()["shape"] == "2-phase 2x2x2"
    plain = of_dict({key: value for key, value in DATA.items() if key != "phases"}, "file")
    assert "phases" not in plain.to_dict()
    assert "phases" not in plain.runs()[0].to_dict()["problem"]
    experiment = of_dict(DATA, "file")
    assert of_dict(experiment.to_dict(), "again") == experiment
    assert isinstance(experiment, Experiment)


@pytest.mark.parametrize("phases", [0, 9, "two"])
def test_a_file_with_other_phases_is_refused(phases):
    with pytest.raises(UsageError, match="file: phases must be"):
        of_dict({**DATA, "phases": phases}, "file")


def test_the_table_answers_with_the_bits_of_simulation(monkeypatch, tmp_path):
    given = {**DATA, "budget": {"evaluations": 8}, "searchers": [{"name": "random"}]}
    digests = []
    for table in (True, False):
        (run, *_) = of_dict({**given, "table": table}, "file").runs()
        assert answers_from_table(run.problem) == table
        digests.append(do(run, Environments())[0]["digest"])
    assert digests[0] == digests[1]
    monkeypatch.setenv("SOFTVOX_CACHE", str(tmp_path))
    assert not answers_from_table(of_dict({**given, "phases": 4}, "file").problems()[0])


def test_what_is_known_of_phases(monkeypatch, tmp_path):
    monkeypatch.setenv("SOFTVOX_CACHE", str(tmp_path))
    known = exact_fitness("published", TWO)
    assert known["raw"].tolist() == landscape(phases=2)["fitness"].tolist()
    assert (known["class"] >= known["raw"]).all()
    assert exact_fitness("published", FOUR) is None
    assert truth_at(0, "published", TWO)[1] == "the best is design 43392, 4.6573 (exact)"
    assert truth_at(1.0, "published", TWO)[0] is None
    assert "not every design" in truth_at(0, "published", FOUR)[1]


def test_a_comparison_knows_the_optimum_of_its_phases(tmp_path):
    outcome = compare(
        of_dict(DATA, "file"),
        tmp_path,
        command="softvox compare file",
        progress=lambda *_: None,
        say=print,
    )
    assert (outcome.total, outcome.failed) == (4, [])
    made = tables.make(read(tmp_path))
    (problem,) = made["problems"].to_dict("records")
    assert (problem["shape"], problem["known"], problem["finest"]) == ("2-phase 2x2x2", True, 1)
    assert problem["goal"] == landscape(phases=2)["fitness"].max()
    assert set(made["fixed_budget"]["measure"]) == {"regret"}
    assert set(made["fixed_budget"]["terms"]) == {"raw", "class"}


def test_the_command_searches_designs_of_phases(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = ["--searcher", "random", "--budget", "20", "--no-picture"]
    assert main(["search", *options, "--phases", "2"]) == 0
    assert "of 65536" in capsys.readouterr().out
    assert main(["search", *options, "--phases", "9"]) == 2
    assert "--phases must be from 1 to 8, got 9" in capsys.readouterr().err
