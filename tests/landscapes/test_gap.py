"""The gap between simulator and realities, held to plain definitions and to what was published."""

import json

import numpy as np
import pytest
from cli_process import softvox
from scipy import stats

from softvox_gym import (
    Physics,
    Reality,
    evaluate,
    landscape,
    realities,
    reality,
    simulate,
    step_error,
)
from softvox_gym.cli import main
from softvox_gym.landscapes import gap, table
from softvox_gym.landscapes.robustness import kendall_tau
from softvox_gym.landscapes.table import AXES, N_DESIGNS

NAMES = list(realities())

#: Some designs of every reality are simulated again; of these as many.
SAMPLED = 24
FINE = 4


@pytest.mark.parametrize("name", NAMES)
def test_the_engine_still_makes_the_tables_that_ship(name):
    one, found = reality(name), reality(name).landscape()
    count = FINE if one.resolution > 1 else SAMPLED
    some = np.random.default_rng(len(name)).choice(N_DESIGNS, count, replace=False)
    again = one.simulate(some)
    wanted = np.stack([found[axis][some] for axis in AXES], axis=-1)
    assert again.displacement.tobytes() == wanted.tobytes()
    assert again.steps.tolist() == found["steps"][some].tolist()


def test_a_reality_in_other_words_has_the_table_that_ships():
    one = reality("slippery")
    again = Reality(
        "mine", {"preset": "published", "friction_static": 0.2, "friction_kinetic": 0.1}
    )
    assert again.landscape()["fitness"].tobytes() == one.landscape()["fitness"].tobytes()
    assert one.landscape().physics == again.physics


def test_the_nominal_simulator_of_other_cycles_ships_as_well():
    one = reality("area_friction")
    nominal = landscape(one.nominal)
    assert nominal.physics.cycles == pytest.approx(23)
    again = simulate([6453, 926], one.nominal)
    assert nominal["fitness"][[6453, 926]].tolist() == again.fitness.tolist()


def test_the_table_of_every_reality_ships_and_all_are_small():
    with np.load(table.COMPUTED / table.REALITIES) as archive:
        steps = {f"{name}{table.STEPS}" for name in table.shipped()}
        assert set(archive.files) == {*table.shipped(), *steps}
    assert sum(path.stat().st_size for path in table.COMPUTED.iterdir()) < 5e6


def test_a_table_has_a_physics_where_that_says_it_all():
    assert reality("soft").landscape().physics == reality("soft").physics
    assert reality("fabrication").landscape().physics is None


@pytest.fixture(scope="module")
def worths():
    return gap.value(landscape()), gap.value(reality("soft").landscape())


def test_a_row_is_what_its_meaning_says(worths):
    nominal, real = worths
    row = gap.row(reality("soft"))
    order = sorted(range(N_DESIGNS), key=lambda i: (-nominal[i], i))
    best = sorted(range(N_DESIGNS), key=lambda i: (-real[i], i))
    assert row["tau"] == pytest.approx(stats.kendalltau(nominal, real).statistic)
    assert row["srcc"] == pytest.approx(stats.pearsonr(nominal[order[:100]], real[order[:100]])[0])
    assert row["kept"] == len(set(order[:100]) & set(best[:100]))
    assert (row["best"], row["best_fitness"]) == (best[0], real[best[0]])
    for tries in (1, 10, 100):
        most = max(real[i] for i in order[:tries])
        assert row[f"regret_{tries}"] == pytest.approx(1 - most / real.max())
    assert row["class_regret_1"] <= row["regret_1"]


def test_directed_regret_is_the_mean_over_four_headings():
    nominal, real = landscape(), reality("reversal").landscape()
    regrets = []
    for axis, sign in (("dx", 1), ("dy", 1), ("dx", -1), ("dy", -1)):
        chosen = int(np.argmax(sign * nominal[axis]))
        regrets.append(1 - sign * real[axis][chosen] / (sign * real[axis]).max())
    assert gap.row(reality("reversal"))["directed_1"] == pytest.approx(np.mean(regrets))


def test_turned_are_those_that_travel_in_both_worlds_to_opposite_sides():
    nominal, real = landscape(), reality("reversal").landscape()
    angle = [np.arctan2(one["dy"], one["dx"]) for one in (nominal, real)]
    apart = np.abs((angle[0] - angle[1] + np.pi) % (2 * np.pi) - np.pi)
    among = (nominal["fitness"] > 0.25) & (real["fitness"] > 0.25)
    row = gap.row(reality("reversal"))
    assert row["turned"] == pytest.approx((apart[among] > np.pi / 2).mean())
    assert gap.share(np.ones(3, bool), np.zeros(3, bool)) == 0


def test_the_gap_is_what_was_found():
    """The numbers of docs/reality-gap.md, which were measured by another program first."""
    rows = {row["reality"]: row for row in gap.gaps([reality(n) for n in NAMES]).records()}
    taus = {"clamp": 0.97, "fabrication": 0.65, "lag": 0.57, "slippery": 0.61, "sticky": 0.64}
    taus |= {"soft": 0.41, "reversal": 0.39, "area_friction": 0.41}
    assert {name: round(rows[name]["tau"], 2) for name in taus} == taus
    best = {"clamp": 6453, "lag": 5753, "slippery": 651, "sticky": 3449, "soft": 2051}
    assert {name: rows[name]["best"] for name in best} == best
    assert rows["area_friction"]["best"] == 4237
    assert rows["reversal"]["turned_100"] == pytest.approx(0.92, abs=0.005)
    assert rows["area_friction"]["turned_100"] == pytest.approx(0.68, abs=0.005)
    assert rows["half_step"]["kept"] == 90


def test_ties_and_rows_that_do_not_vary_have_a_tau_as_scipy_says():
    rng = np.random.default_rng(3)
    for n in (2, 7, 100, 513):
        first, second = rng.integers(0, n // 2 + 1, (2, n)).astype(float)
        expected = stats.kendalltau(first, second).statistic
        assert kendall_tau(first, second) == pytest.approx(expected, abs=1e-12, nan_ok=True)
    assert np.isnan(kendall_tau(np.zeros(5), np.arange(5.0)))


def test_the_step_error_is_what_half_the_step_changes():
    known = landscape()["step_error"]
    assert (int((known > 0.1).sum()), int((known > 1).sum())) == (577, 32)
    some = [6453, 4295, 926, int(np.argmax(known))]
    assert step_error(some).tolist() == known[some].tolist()
    assert np.isnan(table.compute(Physics.published().lasting(0.2))["step_error"]).all()
    with pytest.raises(ValueError, match="single numbers"):
        step_error([1, 2], {"density": [1e6, 2e6]})


def test_the_command_prints_the_table_and_writes_it(tmp_path):
    done = softvox("reality", "clamp", "soft", "--out", "gap", cwd=tmp_path)
    lines = done.stdout.splitlines()
    assert lines[0].split()[:3] == ["reality", "tau", "SRCC"]
    assert [line.split()[0] for line in lines[1:3]] == ["clamp", "soft"]
    assert lines[-1] == "wrote gap/realities.csv"
    written = (tmp_path / "gap" / "realities.csv").read_text().splitlines()
    assert written[0].split(",") == [column.key for column in gap.COLUMNS]
    again = softvox("reality", "--out", "gap", cwd=tmp_path)
    assert "--force" in again.stderr
    rows = json.loads(softvox("reality", "soft", "--json").stdout)
    assert rows == [gap.row(reality("soft"))]


def test_designs_that_diverge_are_worth_nothing_and_told(monkeypatch, tmp_path, capsys):
    monkeypatch.setenv("SOFTVOX_CACHE", str(tmp_path))
    wild = Reality("wild", {"preset": "published", "duration": 0.5, "strain": 150.0})
    monkeypatch.setattr("softvox_gym.cli.reality.reality", lambda _: wild)
    assert main(["reality", "wild"]) == 0
    lost = np.flatnonzero(wild.landscape()["diverged"])
    assert len(lost) > 0
    last = capsys.readouterr().out.splitlines()[-1]
    assert last == f"{len(lost)} designs diverge in wild; their reward is 0"
    assert gap.value(wild.landscape())[lost].max() == 0
    tried = evaluate(lost[:4], wild)
    assert tried.diverged.all()
    assert tried.fitness.max() == 0


def test_the_command_lists_what_there_is_and_names_what_is_not():
    listed = softvox("reality", "--list").stdout
    assert all(f"{name} " in listed for name in NAMES)
    for wrong, message in {
        "sofd": "no reality 'sofd'; did you mean soft?",
        "test-30": "no reality 'test-30'; there are clamp",
        "--tsak": "no option --tsak",
    }.items():
        done = softvox("reality", wrong)
        assert done.returncode == 2
        assert message in done.stderr
        assert done.stderr.count("\n") == 1
