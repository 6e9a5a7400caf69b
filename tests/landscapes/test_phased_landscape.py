"""The landscapes of two and of four phases: what ships, what is computed, and what it tells."""

import csv
import json
import runpy
from pathlib import Path

import numpy as np
import pytest

from softvox_gym import Lattice, Physics, Reality, evaluate, landscape, simulate
from softvox_gym.cli import main
from softvox_gym.design import Design, buildable
from softvox_gym.envs.single import SoftVoxEnv
from softvox_gym.landscapes import table as tables
from softvox_gym.landscapes.analysis import neighbours, symmetry_classes
from softvox_gym.landscapes.analysis.phased import analyse_phased, best_of_class, is_peak
from softvox_gym.landscapes.table import AXES, COMPUTED, PHASED, PHASED_DIGESTS, all_digits
from softvox_gym.manifest import digest, engine_probe

TWO, FOUR = (Lattice.of((2, 2, 2), phases=phases) for phases in (2, 4))
PUBLISHED = Reality.of("published")
DIGESTS = json.loads((COMPUTED / PHASED_DIGESTS).read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def two():
    return landscape(phases=2)


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("SOFTVOX_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def displacement(table):
    return np.stack([table[axis] for axis in AXES], axis=-1)


def test_the_engine_still_makes_the_landscape_of_two_phases_that_ships(two):
    assert len(two) == 65536
    assert digest(displacement(two)) == DIGESTS["2"]
    some = np.random.default_rng(0).choice(len(two), 100, replace=False)
    again = evaluate(some, shape=TWO)
    assert again.displacement[:, 0].tobytes() == displacement(two)[some].tobytes()
    assert again.steps[:, 0].tolist() == two["steps"][some].tolist()


def test_designs_of_one_phase_are_among_those_of_two(two):
    numbers = TWO.numbers(all_digits(Lattice()))
    plain = landscape()
    assert displacement(two)[numbers].tobytes() == displacement(plain).tobytes()
    for name in ("n_voxels", "n_active", "is_connected", "digits"):
        assert two[name][numbers].tolist() == plain[name].tolist()


def test_a_table_of_two_phases_tells_what_its_designs_are(two):
    design = Design("20303132", shape=TWO)
    row = two[design.index]
    assert (row["design"], row["digits"]) == (design.index, design.digits)
    assert (row["n_voxels"], row["n_active"]) == (6, 5)
    assert two.physics == Physics.published()


def test_two_phases_beat_one_by_nothing_and_the_best_are_confirmed(two):
    best = np.argsort(-two["fitness"], kind="stable")[:5]
    assert two["digits"][best[0]] == "00021222"
    assert two["fitness"].max() == landscape()["fitness"].max()
    result = simulate([Design(int(number), shape=TWO) for number in best])
    assert result.fitness.tobytes() == two["fitness"][best].tobytes()


def test_the_best_of_four_phases_are_confirmed_and_travel_well_over_five():
    with np.load(COMPUTED / PHASED) as archive:
        best, moved = archive["four_best"], archive["four_best_displacement"]
    fitness = np.hypot(moved[:, 0], moved[:, 1])
    assert len(best) == len(set(best.tolist())) == 1000
    assert (np.diff(fitness) <= 1e-12).all()
    assert fitness[0] > 5.5
    some = [0, 1, 2, 500, 999]
    result = simulate([Design(int(number), shape=FOUR) for number in best[some]])
    assert result.displacement.tobytes() == moved[some].tobytes()


def test_phases_that_have_no_landscape_are_refused():
    with pytest.raises(ValueError, match="phases must be at most 4 for a landscape, got 5"):
        landscape(phases=5)
    with pytest.raises(ValueError, match="phases must be from 1 to 8, got 0"):
        landscape(phases=0)


@pytest.fixture
def blocks(monkeypatch):
    """The designs of a small lattice that were simulated, in blocks of ten."""
    monkeypatch.setattr(tables, "BLOCK", 10)
    engine_probe()  # simulates as well, once
    seen, run = [], Reality.simulate

    def counted(self, stack, **options):
        seen.append(len(stack))
        return run(self, stack, **options)

    monkeypatch.setattr(Reality, "simulate", counted)
    return seen


SMALL = Lattice.of((2, 1, 1), phases=3)
BRIEF = Reality.of({"preset": "published", "duration": 0.4})


def test_a_landscape_is_simulated_once_and_then_read(cache, blocks):
    told = []
    table = tables.phased(BRIEF, SMALL, progress=lambda *done: told.append(done))
    assert (len(table), blocks) == (25, [10, 10, 5])
    assert told[-1] == (25, 25)
    wanted = evaluate(np.arange(25), BRIEF, shape=SMALL)
    assert displacement(table).tobytes() == wanted.displacement[:, 0].tobytes()
    assert tables.phased(BRIEF, SMALL).tobytes() == table.tobytes()
    assert len(blocks) == 4  # the one that was wanted
    assert len(list(cache.iterdir())) == 1


@pytest.mark.parametrize("damage", [False, True])
def test_what_a_stopped_run_left_is_taken_up(cache, blocks, damage):
    def stopped(done, total):
        if done > 12:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tables.phased(BRIEF, SMALL, progress=stopped)
    (kept,) = cache.iterdir()
    if damage:
        kept.write_bytes(kept.read_bytes()[:-1])
    del blocks[:]
    table = tables.phased(BRIEF, SMALL)
    assert blocks == [10, 10, 5] if damage else [10, 5]
    assert len(table) == 25
    assert len(list(cache.iterdir())) == 1


def test_the_tool_makes_what_ships_where_it_is_not_there(cache, tmp_path, monkeypatch):
    monkeypatch.setattr(tables, "COMPUTED", tmp_path)
    monkeypatch.setattr(
        tables, "phased_lattice", lambda phases: Lattice.of((2, 1, 1), phases=phases)
    )
    tables._two_phases.cache_clear()
    runpy.run_path(str(Path(__file__).parents[2] / "tools" / "phased.py"))["main"]()
    two, four = (
        evaluate(range(lattice.n_designs), shape=lattice)
        for lattice in map(tables.phased_lattice, (2, 4))
    )
    with np.load(tmp_path / PHASED) as archive:
        assert archive["two"].tobytes() == two.displacement.tobytes()
        assert archive["two_steps"].tolist() == two.steps[:, 0].tolist()
        best = archive["four_best"]
        assert archive["four_best_displacement"].tobytes() == four.displacement[best].tobytes()
    assert (np.diff(four.value[best]) <= 0).all()
    digests = json.loads((tmp_path / PHASED_DIGESTS).read_text(encoding="utf-8"))
    assert digests == {"2": digest(two.displacement), "4": digest(four.displacement)}


def test_where_nothing_can_be_kept_it_is_simulated_all_the_same(monkeypatch, tmp_path, blocks):
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    monkeypatch.setenv("SOFTVOX_CACHE", str(tmp_path / "file"))
    assert len(tables.phased(BRIEF, SMALL)) == 25


def test_a_table_of_four_phases_answers_only_where_it_is(cache):
    assert tables.has_table(TWO)
    assert not tables.has_table(FOUR)
    with pytest.raises(ValueError, match="softvox landscape --phases 4 makes it"):
        SoftVoxEnv(phases=4, from_table=True)


def test_the_environment_answers_from_the_table_with_the_same_bits():
    action = TWO.digits([50000])[0].astype(np.int64)
    answers = []
    for from_table in (False, True):
        directed = {"task": "directed", "heading": 90.0, "objectives": ("heading", "voxels")}
        env = SoftVoxEnv(phases=2, from_table=from_table, **directed)
        env.reset(seed=0)
        answers.append(env.step(action))
    (track, *simulated), (ends, *known) = answers
    assert ends.tobytes() == track[[0, -1]].tobytes()
    assert ends in env.observation_space
    assert str(simulated) == str(known)


def test_the_short_analysis_agrees_with_the_long_one_where_there_is_one_phase():
    rng = np.random.default_rng(0)
    fitness = rng.integers(0, 200, 6561).astype(float)
    around = fitness[neighbours()]
    peaks = (fitness[:, np.newaxis] > around).all(axis=1)
    assert is_peak(fitness, Lattice()).tolist() == peaks.tolist()
    classes = symmetry_classes()
    best = np.zeros(6561)
    np.maximum.at(best, classes, fitness)
    assert best_of_class(fitness, Lattice()).tolist() == best[classes].tolist()
    sections = analyse_phased(landscape()["fitness"], Lattice()).sections
    assert sections["local_optima"].records()[0]["number"] == 113
    assert sections["symmetry"].records()[0]["classes"] == 1035
    assert sections["symmetry"].records()[0]["above_0.1"] == 61


def test_the_landscape_of_two_phases_is_analysed(two):
    sections = analyse_phased(two["fitness"], TWO).sections
    everything, connected, kit = sections["kinds"].records()
    can_be_built = buildable(all_digits(TWO), TWO)
    assert (everything["designs"], everything["beat_one_phase"]) == (65536, 0)
    assert connected["designs"] == two["is_connected"].sum()
    assert kit["designs"] == can_be_built.sum() < connected["designs"]
    assert kit["best"] == two["fitness"][can_be_built].max()
    # Burnside's lemma, as of one phase, with 4 for 3.
    n = (4**8 + 2 * 4**2 + 4**4 + 2 * 4**4 + 2 * 4**6) // 8
    assert sections["symmetry"].records()[0]["classes"] == n
    with pytest.raises(ValueError, match=r"shape \(65536,\), entry i for design i of the 2-phase"):
        analyse_phased(np.zeros(6561), TWO)


def test_the_command_writes_the_landscape_of_two_phases(tmp_path, capsys, two):
    out = tmp_path / "out"
    assert main(["landscape", "--phases", "2", "--analyse", "--out", str(out)]) == 0
    printed = capsys.readouterr().out
    assert "00021222" in printed
    assert "which is the published one" in printed
    with (out / "landscape.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["fitness"]) for row in rows[::1000]] == two["fitness"][::1000].tolist()
    manifest = json.loads((out / "manifest.json").read_text(encoding="utf-8"))
    assert (manifest["phases"], manifest["digest"]) == (2, DIGESTS["2"])
    analysis = json.loads((out / "analysis.json").read_text(encoding="utf-8"))
    assert analysis["kinds"]["rows"][0]["designs"] == 65536
    assert "## Local optima" in (out / "analysis.md").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--phases", "5"], "--phases must be at most 4 for a landscape, got 5"),
        (["--phases", "9"], "--phases must be from 1 to 8, got 9"),
        (["--phases", "2", "--check-step"], "--check-step works with one phase only"),
    ],
)
def test_the_command_refuses_what_it_can_not_do(options, message, tmp_path, capsys):
    assert main(["landscape", *options, "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_other_bits_than_the_published_are_told(tmp_path, capsys, monkeypatch):
    table = landscape(phases=2)
    table["dx"][7] += 1
    monkeypatch.setattr("softvox_gym.cli.landscape.phased", lambda *_, **__: table)
    assert main(["landscape", "--phases", "2", "--out", str(tmp_path / "out")]) == 2
    assert "the landscape differs from the published one" in capsys.readouterr().err


def test_millions_of_designs_are_an_archive(tmp_path, capsys, monkeypatch):
    made = tables.phased(BRIEF, Lattice.of((2, 1, 1), phases=3))
    monkeypatch.setattr("softvox_gym.cli.landscape.MOST_ROWS", 20)
    monkeypatch.setattr("softvox_gym.cli.landscape.phased", lambda *_, **__: made)
    options = ["--phases", "3", "--duration", "0.4", "--out", str(tmp_path / "out")]
    assert main(["landscape", *options]) == 0
    with np.load(tmp_path / "out" / "landscape.npz") as archive:
        assert set(archive.files) == {*made.dtype.names} - {"digits"}
        assert archive["fitness"].tobytes() == made["fitness"].tobytes()
