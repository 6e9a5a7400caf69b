"""The committed baseline of learners: its files agree, and slices done again give the same.

Run once more by `make docs`, whose environment has the learners' libraries.
"""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from softvox_search.report.statistics import band

BASELINES = Path(__file__).parents[2] / "baselines"


def loaded():
    spec = importlib.util.spec_from_file_location("learners", BASELINES / "learners.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


learners = loaded()
FOLDER = learners.FOLDER
CURVES, RUNS = (pd.read_csv(FOLDER / f"{name}.csv") for name in ("curves", "runs"))
RUN = ["problem", "method", "seed"]


def curve(problem, method, seed):
    own = (CURVES["problem"] == problem) & (CURVES["method"] == method) & (CURVES["seed"] == seed)
    return CURVES[own].reset_index(drop=True)


def assert_begins(outcome, expected, *, rel=1e-5):
    """Compare the first points of a curve, which has six figures, with episodes done again."""
    apart = int(expected["episodes"][0])
    made = learners.curve(outcome.fitness, len(outcome.fitness) // apart)
    for name in ("best", "recent"):
        np.testing.assert_allclose(made[name], expected[name][: len(made[name])], rtol=rel)


def test_every_method_has_every_seed_and_as_many_episodes_as_its_rivals():
    for name, problem in learners.PROBLEMS.items():
        own = RUNS[RUNS["problem"] == name]
        assert list(own["method"]) == [m for m in problem.methods for _ in learners.SEEDS]
        assert list(own["seed"]) == [*learners.SEEDS] * len(problem.methods)
        assert set(own["episodes"]) == {problem.episodes}
    assert set(RUNS["problem"]) == set(learners.PROBLEMS)


def test_runs_end_where_their_curves_do():
    ends = CURVES.groupby(RUN, sort=False).tail(1).reset_index(drop=True)
    columns = [*RUN, "episodes", "best", "recent"]
    pd.testing.assert_frame_equal(ends[columns], RUNS[columns])
    for _, own in CURVES.groupby(RUN):
        assert len(own) == learners.POINTS
        assert own["best"].is_monotonic_increasing
        assert (own["recent"] <= own["best"]).all()


def test_the_report_is_what_is_made_of_the_runs_today():
    manifests = json.loads((FOLDER / "manifest.json").read_text(encoding="utf-8"))
    report = (FOLDER / "report.md").read_text(encoding="utf-8")
    assert report == learners.page(RUNS, manifests)
    for name, problem in learners.PROBLEMS.items():
        assert manifests[name]["settings"] == problem.settings
    assert (FOLDER / "learners.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("problem", ["control_6453", "control_6560"])
def test_ppo_steers_better_than_chance_by_more_than_both_bands(problem):
    own = RUNS[RUNS["problem"] == problem].set_index("method")
    low, _ = band(own.loc["ppo", "recent"])
    _, high = band(own.loc["random", "recent"])
    assert low > 1.5 * high


def test_slices_of_chance_and_evolution_done_again_give_the_same():
    again = learners.random_control(6453, 1, 32)
    assert_begins(again, curve("control_6453", "random", 1))
    for method, name in (("random", "random"), ("evolution", "mu_plus_lambda")):
        again = learners.searched(name, 2, 1024)
        assert_begins(again, curve("growth", method, 2))
        assert_begins(again, curve("discrete", method, 2))


def test_a_problem_that_is_none_is_refused_with_those_that_are():
    with pytest.raises(SystemExit, match=r"no such problem: walking; there are control_6453, "):
        learners.main(["walking"])


def test_slices_of_the_learners_done_again_give_the_same():
    """On other processors PyTorch's last bits may differ, and with them those of a walk."""
    torch = pytest.importorskip("torch", reason="needs softvox-gym[learn]")
    pytest.importorskip("sb3_contrib", reason="needs softvox-gym[learn]")
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        again = learners.ppo(6453, 1, 32)  # before it has learnt anything
        assert_begins(again, curve("control_6453", "ppo", 1), rel=1e-2)
        again = learners.maskable(1, 64)  # of which the second half has
        assert_begins(again, curve("growth", "maskable_ppo", 1))
    finally:
        torch.set_num_threads(threads)
