"""Methods that may test what was measured, and nothing else."""

import json
from dataclasses import replace

import numpy as np
import pytest
from cheap_models import cheap_models  # noqa: F401, a fixture
from pseudo_trials import NINE, trials_in

from softvox_gym import Physics, Reality, Task, reality
from softvox_gym.cli import main
from softvox_gym.cli.terminal import BadInputError
from softvox_gym.landscapes.gap import class_best, srcc
from softvox_gym.landscapes.robustness import kendall_tau
from softvox_gym.landscapes.table import displacements, landscape
from softvox_gym.trials import database
from softvox_search import SearcherError
from softvox_search.cli.transfer import _answerable
from softvox_search.transfer import METHODS, Method, Simulator, Test, make, transfer
from softvox_search.transfer.protocol import half_best
from softvox_search.transfer.run import heading_error, regrets, truth

MASK = np.isin(np.arange(6561), NINE)
NORTH = Task("directed", 90.0)

#: Options with which a method takes little time.
QUICK = {
    "gp_ucb": {"learn_at": [99]},
    "eea": {"size": 3, "ensemble": 2},
    "domain_randomisation": {"size": 3},
    "transferability": {"population": 8, "generations": 2},
    "simopt": {"candidates": 12, "draws": 3, "rounds": 1, "fit_at": [1, 3]},
    "npe": {"fit_at": (3,), "draws": 30, "particles": 2, "candidates": 12},
    "mfbo": {"simulated": 20, "candidates": 20, "iterations": 3, "learn_at": (0,)},
}
NEEDS = {"npe": "sbi.neural_nets", "mfbo": "botorch.models"}


@pytest.fixture(scope="module")
def real():
    return Reality.from_trials(trials_in("reversal", NINE))


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.usefixtures("cheap_models")
def test_every_method_tests_what_was_measured_until_nothing_is_left(name, real):
    if name in NEEDS:
        from softvox_search.torch_random import quiet_library

        try:
            quiet_library(NEEDS[name])
        except ImportError:
            pytest.skip(f"{NEEDS[name]} is not installed")
    run = transfer(name, reality=real, task=NORTH, **QUICK.get(name, {}))
    assert sorted(run.tested.tolist()) == sorted(NINE)
    assert run.rewards == pytest.approx(real.displacement[run.tested, 1])
    assert np.isnan(run.regret[~MASK[run.recommended]]).all()
    assert not np.isnan(run.regret[MASK[run.recommended]]).any()
    assert run.is_specified is False


def test_asked_by_hand_it_ends_where_nothing_is_left():
    mask = np.isin(np.arange(6561), [17, 926])
    for name in ("random", "gp_ucb", "simulator_top", "transferability"):
        made = make(
            name, Simulator(Physics.published(), testable=mask), NORTH, np.random.default_rng(0)
        )
        for _ in range(2):
            made.tell(Test(made.ask(), 1.0, np.array([0.0, 1.0, 0.0])))
        assert made.ask() is None


def test_what_is_lost_is_a_share_of_the_best_measured(real):
    class Bold(Method):
        """Recommends what was measured, and then what was not, nor any of its class."""

        def ask(self):
            return int(np.flatnonzero(self.untested())[0])

        def recommend(self):
            return (6453, 17)[len(self.tests) - 1]

    run = transfer(Bold, reality=real, task=NORTH, tests=2)
    rewards = real.displacement[:, 1]
    best = np.nanmax(rewards)
    assert run.regret[0] == 1 - rewards[6453] / best
    assert np.isnan(run.regret[1])
    whole = np.where(np.isnan(rewards), -np.inf, rewards)
    assert run.class_regret[0] == 1 - class_best(whole)[6453] / best
    assert np.isnan(run.class_regret[1])
    left = real.testable.copy()
    left[run.tested] = False
    said = displacements(landscape())
    assert run.kendall_before == kendall_tau(said[left, 1], rewards[left])
    assert run.srcc_after == srcc(said[left, 1], rewards[left])
    assert run.heading_error == heading_error(said[left], real.displacement[left])
    off = np.square(said - real.displacement)[real.testable].sum()
    assert run.distance == np.sqrt(off / np.square(real.displacement[real.testable]).sum())


def test_nothing_is_known_of_a_loss_where_nothing_measured_goes_that_way():
    rewards = np.full(6561, np.nan)
    rewards[[17, 40]] = -1.0, -2.0
    assert np.isnan(regrets(rewards, np.array([17, 40]))).all()
    assert not np.any(regrets(-np.ones(6561), np.array([17, 40])))


def test_tests_are_as_many_as_were_measured(real):
    assert len(transfer("random", reality=real).tested) == 9
    with pytest.raises(ValueError, match="tests must be at most 9, the designs that were measured"):
        transfer("random", reality=real, tests=10)


def test_a_method_that_asks_for_what_nobody_measured_is_refused_by_name(real):
    def one_of_my_own(test, simulator, task, rng):
        test(6453)
        test(18)

    words = "method one_of_my_own asked for what can't be tested: design 18 was not measured in"
    with pytest.raises(SearcherError, match=words):
        transfer(one_of_my_own, reality=real)


def test_a_test_shows_the_mean_track(real):
    shown = []

    class Curious(Method):
        wants_track = True

        def ask(self):
            return 6453

        def tell(self, test):
            super().tell(test)
            shown.append(test)

    transfer(Curious, reality=real, tests=1)
    (one,) = shown
    assert one.track.shape == (61, 3)
    assert one.track[-1] == pytest.approx(one.displacement)
    assert one.track[0].tolist() == [0, 0, 0]


def test_a_simulator_says_which_designs_can_be_tested():
    assert Simulator(Physics.published()).testable.all()
    made = Simulator(Physics.published(), testable=MASK.tolist()).testable
    assert (made == MASK).all()
    assert not made.flags.writeable
    for wrong in (MASK[:9], MASK * 1, np.zeros(6561, bool)):
        with pytest.raises(ValueError, match="testable must be 6561 bools, some of them true"):
            Simulator(Physics.published(), testable=wrong)


def test_candidates_are_drawn_of_those_that_can_be_tested():
    values = np.arange(6561.0)
    made = half_best(values, 400, np.random.default_rng(0), MASK)
    assert sorted(made.tolist()) == sorted(NINE)
    whole = half_best(values, 400, np.random.default_rng(0), np.ones(6561, bool))
    assert (whole == half_best(values, 400, np.random.default_rng(0))).all()


def test_the_truth_of_a_simulated_reality_is_its_landscape():
    assert (truth(reality("soft")) == displacements(landscape(reality("soft")))).all()


def test_nothing_is_told_of_ways_that_no_robot_goes(capsys):
    still = replace(trials_in("reversal", [17])[0], cycle=[0, 15], position=[[0, 0], [0, 1]])
    where = Reality.from_trials([still])
    tasks = [Task("directed", heading) for heading in (0.0, 90.0, 270.0)]
    assert _answerable(where, tasks) == [tasks[1]]
    assert "no robot of --trials goes towards 0, 270 degrees; left out" in capsys.readouterr().err
    where = Reality.from_trials([replace(still, position=[[0, 0], [0, 0]])])
    with pytest.raises(BadInputError, match="no robot of --trials goes anywhere"):
        _answerable(where, [Task("displacement")])


def test_a_picture_without_a_line_says_why(real):
    class Bold(Method):
        def ask(self):
            return int(np.flatnonzero(self.untested())[0])

        def recommend(self):
            return 17

    from softvox_search.report.crossing import picture

    run = transfer(Bold, reality=real, task=NORTH, tests=2)
    losses, _ = picture([run], displacements(landscape()), truth(real)).axes
    assert [text.get_text() for text in losses.texts] == ["unknown: nobody measured the design"]


# The command.


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    here = tmp_path_factory.mktemp("measured")
    database.add(here / "trials", trials_in("reversal", NINE))
    database.add(here / "talc", trials_in("reversal", [6453], powder="talc"))
    return here


@pytest.fixture
def folder(made, monkeypatch):
    monkeypatch.chdir(made)
    return made


def test_the_command_tells_what_was_measured(folder, capsys):
    assert main(["transfer", "--trials", "trials", "--method", "ite", "--no-picture"]) == 0
    out, err = capsys.readouterr()
    lines = out.splitlines()
    assert err == "softvox: warning: no robot of --trials goes towards 180 degrees; left out\n"
    assert max(map(len, lines)) <= 80
    assert lines[0] == "ite in trials, directed along 0, 90, 270 degrees; seed 0"
    assert [line.split()[0] for line in lines[3:7]] == ["1", "2", "5", "9"]
    assert "trials         9 runs of 9 designs, after 15 cycles on acrylic, simulated in" in lines
    assert "               reversal" in lines
    assert "cycles         15 of the robots, 15 simulated" in lines


def test_json_has_null_for_what_nobody_knows_and_the_picture_no_line(folder, capsys):
    (folder / "bold.py").write_text(
        "import numpy as np\n"
        "from softvox_search.transfer import Method\n"
        "class Bold(Method):\n"
        "    def ask(self): return int(np.flatnonzero(self.untested())[0])\n"
        "    def recommend(self): return 17\n"
    )
    command = ["transfer", "--trials", "trials", "--method", "bold:Bold", "--tests", "2"]
    assert main([*command, "--cycles", "9:15", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["mean"]["regret"] == [None, None]
    assert told["runs"][0]["regret"] == [None, None]
    assert told["trials"]["designs"] == sorted(NINE)
    assert (told["trials"]["source"], told["trials"]["cycles"]) == ("simulated", 9)
    assert told["trials"]["simulated_cycles"] == pytest.approx(15)
    assert (told["reality"], told["diverged"]) == ("trials", 0)
    assert (folder / told["picture"]).stat().st_size > 10_000
    assert main([*command, "--no-picture", "--heading", "0"]) == 0
    assert "     1 unknown       unknown" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--trials", "none"], "--trials: there is no folder none"),
        (["--trials", "trials", "--reality", "soft"], "give either --reality or --trials"),
        (["--trials", "trials", "--tests", "10"], "--tests must be at most 9, the designs that"),
        (["--trials", "trials", "--cycles", "90:23"], "--trials: 9 of 9 runs end before 90 cycles"),
        (["--trials", "trials", "--trials", "talc"], "--trials: the trials differ in powder"),
        (["--trials", "talc", "--heading", "-90"], "no robot of --trials goes towards 270 degrees"),
        (["--trials", "trials", "--trials", "talc", "--powder=talc", "--heading=-90"], "towards"),
        (["--trials", "talc", "--surface", "ice"], "--trials: none of the 1 trials matches"),
        (["--simulated-in", "soft"], "--simulated-in needs --trials DIR; give that as well"),
        (["--cycles", "9"], "--cycles needs --trials"),
        (["--trials", "."], "--trials: there are no trials; give at least one"),
        (["--trials", "trials", "--cycles=-1"], "--cycles: must be N or REAL:SIMULATED, above 0"),
        (["--trials", "trials", "--cycles", "1:0"], "--cycles: must be N or REAL:SIMULATED"),
        (["--trials", "trials", "--cycles", "1:2:3"], "--cycles: must be N or REAL:SIMULATED"),
        (["--trials", "trials", "--cycles", "9:"], "--cycles: must be a number, got ''"),
    ],
)
def test_what_the_command_can_not_do_it_says_in_a_line(folder, capsys, options, words):
    assert main(["transfer", *options, "--no-picture"]) == 2
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 1)
    assert words in err
