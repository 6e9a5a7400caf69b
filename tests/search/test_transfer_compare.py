"""Comparisons of transfer methods: their file, their runs, and the report."""

import numpy as np
import pandas as pd
import pytest
from search.small_experiments import BROKEN_METHOD

from softvox_gym import Task, landscape, reality
from softvox_gym.landscapes.gap import value
from softvox_search.experiment import transfer as experiments
from softvox_search.experiment.compare import compare, merge
from softvox_search.experiment.environments import check
from softvox_search.experiment.results import ResultsError, read
from softvox_search.experiment.schema import UsageError, of_dict
from softvox_search.report import write
from softvox_search.report.transfer import group_of, make, page

FILE = {
    "title": "small",
    "seeds": 2,
    "tests": 10,
    "realities": ["soft", "lag"],
    "tasks": ["directed", "displacement"],
    "methods": [
        {"name": "random"},
        {"name": "simulator_top", "seeds": 1},
        {"name": "ite", "seeds": 1, "options": {"kernel": ["hamming", "behaviour"]}, "tests": 5},
        {"name": "oracle", "seeds": 1},
    ],
}


def quiet(done, total):
    """Show no progress."""


def do(folder, data=FILE, **options):
    folder.mkdir(exist_ok=True)
    experiment = of_dict(data, "small.toml")
    options = {"command": "softvox compare small.toml", "progress": quiet, **options}
    return compare(experiment, folder, say=print, **options)


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    outcome = do(folder)
    assert (outcome.total, outcome.failed) == (24, [])
    return read(folder, of_transfer=True)


def test_a_run_per_method_reality_task_and_seed(results):
    runs = results.runs
    assert set(runs["method"]) == {
        *("random", "simulator_top", "ite(kernel=hamming)", "ite(kernel=behaviour)", "oracle")
    }
    assert len(runs) == 2 * 2 * (2 + 1 + 2 + 1)
    assert set(runs["status"]) == {"ok"}
    log = results.evaluations(runs["run"][0])
    assert log["heading"].tolist() == np.repeat([0.0, 90, 180, 270], 10).tolist()
    assert log["test"].tolist() == list(range(1, 11)) * 4


def test_what_a_log_says_is_true_of_the_landscape(results):
    row = results.runs[results.runs["reality"] == "lag"].iloc[0]
    log = results.evaluations(row["run"])
    for heading in (0.0, 90.0, 180.0, 270.0):
        real = value(reality("lag").landscape(), Task(row["task"], heading))
        here = log["heading"] == heading
        assert np.allclose(log["reward"][here], real[log["design"][here]])
        assert np.allclose(log["regret"][here], 1 - real[log["recommended"][here]] / real.max())
    assert row["regret"] == pytest.approx(log["regret"][log["test"] == 10].mean())


def test_the_same_command_goes_on_and_parts_give_the_same_bytes(results, tmp_path):
    again = do(results.folder)
    assert (again.before, again.total) == (24, 24)
    assert do(results.folder, check=True).repeated == 5
    for number in (1, 2):
        do(tmp_path / str(number), part=(number, 2))
    (tmp_path / "all").mkdir()
    merge([tmp_path / "1", tmp_path / "2"], tmp_path / "all", say=print)
    assert (tmp_path / "all/runs.csv").read_bytes() == (results.folder / "runs.csv").read_bytes()


def test_what_is_added_changes_no_run(results, tmp_path):
    one = {**FILE, "realities": ["lag"], "methods": FILE["methods"][:1], "tasks": ["directed"]}
    do(tmp_path, one)
    runs = read(tmp_path, of_transfer=True).runs.set_index("run")
    assert runs.equals(results.runs.set_index("run").loc[runs.index])


def test_the_report_is_of_the_runs(results):
    tables = make(results)
    regret = tables["regret"].set_index(["task", "reality", "method", "tests"])
    of_random = results.runs[
        (results.runs["method"] == "random")
        & (results.runs["task"] == "directed")
        & (results.runs["reality"] == "soft")
    ]
    last = regret.loc["directed", "soft", "random", 10]
    assert last["regret"] == pytest.approx(of_random["regret"].mean())
    assert last["low"] <= last["regret"] <= last["high"]
    assert (regret.xs("oracle", level="method")["regret"] == 0).all()
    needed = tables["tests_needed"].set_index(["task", "reality", "method"])
    assert (needed.xs("oracle", level="method")["regret"] == 1).all()
    first = value(landscape(), Task("directed", 0.0)).argmax()
    row = results.runs[
        (results.runs["method"] == "simulator_top") & (results.runs["task"] == "directed")
    ].iloc[0]
    assert results.evaluations(row["run"])["design"][0] == first


def test_its_page_and_pictures_are_written_and_again_the_same(results):
    files = write(results.folder, results)
    assert {"report.md", "figures/directed.png", "tables/regret.csv"} <= set(files)
    text = (results.folder / "report.md").read_text(encoding="utf-8")
    assert "### Regret after 10 tests" in text
    assert text.count("figures/") == 2
    before = {name: (results.folder / name).read_bytes() for name in files}
    write(results.folder, results)
    assert before == {name: (results.folder / name).read_bytes() for name in files}


def test_sets_are_held_against_the_references_reality_by_reality():
    curves = {"random": [0.9, 0.8, 0.7], "gp_ucb": [0.5, 0.3, 0.6], "simulator_top": [0.4] * 3}
    runs = pd.DataFrame(
        [
            {
                **{"method": method, "reality": f"public-{i}", "task": "directed", "seed": 0},
                **{"run": f"{method}-{i}", "status": "ok", "tests": 1, "simulations": 0},
                **dict.fromkeys(experiments.TransferTask.summary[3:-3], 0.5),
                "is_specified": True,
            }
            for method, values in curves.items()
            for i in range(len(values))
        ]
    )

    class Made:
        def __init__(self):
            self.runs, self.title, self.command = runs, "made", "softvox compare made.toml"

        def evaluations(self, run):
            method, _, i = run.rpartition("-")
            one = np.array([curves[method][int(i)]])
            return {"test": np.array([1]), "regret": one, "class_regret": one}

    tables = make(Made())
    row = tables["against"].set_index(["method", "against"]).loc[("gp_ucb", "random")]
    assert row["difference"] == pytest.approx(np.mean([-0.4, -0.5, -0.1]))
    assert row["p"] == pytest.approx(0.25)  # of three pairs of one sign: 2 / 2^3
    assert row["p_holm"] == pytest.approx(0.5)
    regret = tables["regret"].set_index("method")
    assert regret.loc["gp_ucb", "regret"] == pytest.approx(np.mean(curves["gp_ucb"]))
    assert "### Against random, public" in page(Made(), tables, [])


def test_a_set_is_told_of_as_far_as_all_its_realities_were_tested(tmp_path):
    method = {"name": "random", "label": "r"}
    data = FILE | {
        "seeds": 1,
        "tasks": ["displacement"],
        "methods": [
            method | {"realities": ["public-0"], "tests": 3},
            method | {"realities": ["public-1"], "tests": 5},
        ],
    }
    outcome = do(tmp_path / "out", data)
    assert outcome.is_whole
    regret = make(read(tmp_path / "out", of_transfer=True))["regret"]
    assert regret["tests"].tolist() == [1, 2, 3]


def test_groups():
    assert [group_of(name) for name in ("public-3", "test-0", "soft", "half_step")] == [
        *("public", "test", "soft", "half_step")
    ]
    assert experiments.members(["named"])[0] == "clamp"
    assert experiments.members(["public"])[-1] == "public-29"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"realities": ["sotf"]}, "did you mean soft"),
        ({"tasks": ["direct"]}, "did you mean directed"),
        ({"tests": 7000}, "tests must be at most 6561"),
        ({"tasks": ["directed", "directed"]}, "directed is there twice"),
        ({"realities": ["soft", "named"]}, "soft is there twice"),
        ({"method": []}, "did you mean methods"),
        ({"methods": []}, "methods must be"),
        ({"methods": [{"name": "random", "option": {}}]}, "did you mean options"),
        ({"methods": [{"name": "random"}, {"name": "random"}]}, "random in soft is there twice"),
        ({"methods": [{"name": "ite", "options": {"kernel": []}}]}, "must not be empty"),
        ({"seeds": 1000000}, "at most 1000000 are taken"),
    ],
)
def test_a_file_that_is_none_is_told_in_one_line(change, says):
    with pytest.raises(UsageError, match=says):
        of_dict({**FILE, **change}, "small.toml")


@pytest.mark.parametrize(
    ("method", "says"),
    [
        ({"name": "itte"}, "did you mean 'ite'"),
        ({"name": "ite", "options": {"kernle": 1}}, "has no option 'kernle'"),
        ({"name": "ite", "options": {"kernel": "cosine"}}, "kernel must be hamming or behaviour"),
    ],
)
def test_methods_are_tried_before_the_work(method, says):
    experiment = of_dict({**FILE, "methods": [method]}, "small.toml")
    with pytest.raises(UsageError, match=says):
        check(experiment, "small.toml", quiet)


def test_a_method_that_fails_is_named_and_the_others_go_on(tmp_path, monkeypatch):
    (tmp_path / "broken_methods.py").write_text(BROKEN_METHOD)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))  # of the workers
    methods = [{"name": "broken_methods:Nonsense"}, {"name": "random"}]
    outcome = do(tmp_path / "results", {**FILE, "methods": methods, "tasks": ["displacement"]})
    assert len(outcome.failed) == 4
    assert "recommended an invalid design" in outcome.failed[0][1].error
    runs = read(tmp_path / "results", of_transfer=True).runs
    assert sorted(runs["status"]) == ["failed"] * 4 + ["ok"] * 4


def test_an_option_may_have_the_name_of_something_of_the_run(tmp_path, monkeypatch):
    (tmp_path / "with_tests.py").write_text(
        "from softvox_search.transfer import Method\n"
        "class First(Method):\n"
        "    def __init__(self, simulator, task, rng, *, tests):\n"
        "        super().__init__(simulator, task, rng)\n"
        "    def ask(self):\n"
        "        return self.untested().argmax()\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    method = {"name": "with_tests:First", "options": {"tests": 7}}
    run = of_dict(FILE | {"methods": [method], "tasks": ["displacement"]}, "x.toml").runs()[0]
    assert experiments.cross(run)[1]["design"].tolist() == list(range(10))


def test_results_of_methods_are_not_taken_for_those_of_searchers(results):
    with pytest.raises(ResultsError, match="of transfer methods, and those of searchers"):
        read(results.folder)
