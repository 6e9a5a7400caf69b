import csv
import io
import json
import sys

import gymnasium as gym
import numpy as np
import pyarrow.parquet as pq
import pytest
from cli_process import anew, snapshot, softvox
from PIL import Image

import softvox_gym
from softvox_gym import Design, Lattice
from softvox_gym.cli import main
from softvox_search.log import COLUMNS
from softvox_search.registry import SEARCHERS, options_of


def pixels(content):
    return np.asarray(Image.open(io.BytesIO(content)))


def test_a_search_says_what_it_found_how_good_that_is_and_when(tmp_path):
    done = softvox("search", "--searcher", "random", "--seed", "1", "--budget", "200", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    said = dict(line.split(None, 1) for line in done.stdout.splitlines())
    design = Design(int(said["design"]))
    fitness = softvox_gym.landscape()["fitness"]
    own = fitness[design.index]
    assert said["digits"] == design.digits
    assert said["fitness"] == f"{own:.4f} voxel widths, of the best {fitness.max():.4f}"
    assert said["regret"] == f"{fitness.max() - own:.4f}"
    assert said["rank"] == f"{1 + (fitness > own).sum()} of 6561"
    assert said["found"].endswith("of 200 (200 counted as unique)")
    assert said["picture"] == "search-random-1.png"
    assert "believed" not in said


def test_the_picture_is_that_of_the_environment(tmp_path):
    softvox("search", "--searcher", "exhaustive", "--budget", "6", cwd=tmp_path)
    image = pixels((tmp_path / "search-exhaustive-0.png").read_bytes())
    env = gym.make(softvox_gym.ENV_ID, render_mode="rgb_array").unwrapped
    env.reset()
    env.step(np.array([2, 1, 0, 0, 0, 0, 0, 0]))  # design 5, the best of the first six
    assert (image == env.render()).all()


def test_the_same_seed_gives_the_same_and_another_does_not(tmp_path):
    command = ("search", "--searcher", "hill_climber", "--budget", "80", "--no-picture", "--json")
    first, other = (softvox(*command, "--seed", seed, cwd=tmp_path) for seed in "12")
    again = anew(*command, "--seed", "1", cwd=tmp_path)  # its hashes are others
    assert first.stdout == again.stdout != other.stdout
    assert snapshot(tmp_path) == {}


def test_as_json_and_as_a_table_it_says_the_same(tmp_path):
    command = ("search", "--searcher", "random_with_replacement", "--budget", "400", "--json")
    done = softvox(*command, "--out", "log.csv", "--picture", "p.png", cwd=tmp_path)
    data = json.loads(done.stdout)
    assert softvox(*command, "--out", "log.parquet", "--no-picture", cwd=tmp_path).returncode == 0
    with (tmp_path / "log.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    table = pq.read_table(tmp_path / "log.parquet")
    assert list(rows[0]) == table.column_names == list(COLUMNS)
    assert [float(row["fitness"]) for row in rows] == table["fitness"].to_pylist()
    assert {row["noise_seed"] for row in rows} == {""}
    assert table["noise_seed"].null_count == len(rows) == data["evaluations"]
    assert data["unique"] == 400 < data["evaluations"]
    hit = rows[data["found_at"] - 1]
    assert int(hit["design"]) == data["design"]
    assert float(hit["fitness"]) == data["fitness"] == max(float(row["fitness"]) for row in rows)
    assert data["regret"] == data["best"] - data["fitness"]
    assert data["picture"] == "p.png"
    assert pixels((tmp_path / "p.png").read_bytes()).any()


def test_under_noise_it_says_what_the_searcher_believes(tmp_path):
    command = ("search", "--searcher", "random", "--noise", "1", "--budget", "60", "--no-picture")
    plain = json.loads(softvox(*command, "--json", cwd=tmp_path).stdout)
    assert plain["level"] == 1
    assert plain["believed"] != plain["fitness"]
    assert (plain["unique"], plain["evaluations"]) == (60, 60)
    under = plain["under_noise"]
    means = softvox_gym.noisy_landscape(1.0)["mean"]
    assert under["fitness"] == means[plain["design"]]
    assert under["regret"] == means.max() - under["fitness"]
    text = softvox(*command, cwd=tmp_path).stdout
    assert f"believed      {plain['believed']:.4f}, at level 1" in text
    assert f"under noise   mean {under['fitness']:.4f}, of the best {means.max():.4f}" in text


def test_other_physics_are_held_against_their_own_best(tmp_path):
    command = ("search", "--searcher", "random", "--budget", "30", "--no-picture", "--json")
    short = ("--physics", "exact", "--duration", "0.75")
    data = json.loads(softvox(*command, *short, cwd=tmp_path).stdout)
    fitness = softvox_gym.simulate(
        np.arange(6561), softvox_gym.Physics.of({"duration": 0.75})
    ).fitness
    assert data["best"] == fitness.max()
    assert data["fitness"] == fitness[data["design"]]
    assert data["rank"] == 1 + (fitness > data["fitness"]).sum()


def test_the_searchers_are_listed_with_a_sentence_each_and_their_options():
    text = softvox("search", "--list").stdout
    assert max(map(len, text.splitlines())) <= 80
    heads = [line.split()[0] for line in text.splitlines() if not line.startswith(" ")]
    assert heads == list(SEARCHERS)
    listed = json.loads(softvox("search", "--list", "--json").stdout)
    assert [entry["name"] for entry in listed] == heads
    assert len({entry["about"] for entry in listed}) == len(listed)
    for entry in listed:
        assert entry["about"] in " ".join(text.split())
        assert entry["options"] == options_of(entry["name"])
        for key, value in entry["options"].items():
            assert f"{key}={json.dumps(value)}" in text


def test_a_search_that_finds_nothing_new_says_why_it_ended(tmp_path):
    command = ("search", "--searcher", "own:Narrow", "--budget", "50", "--no-picture")
    (tmp_path / "own.py").write_text(PRINTS)
    said = softvox(*command, cwd=tmp_path).stdout
    assert "ended         by 1000 evaluations: only 20 of 50 designs were new" in said
    some = softvox("search", "--searcher", "random", "--budget", "9000", "--no-picture")
    assert "ended         by the searcher, which proposed no more: 6561 of 9000" in some.stdout


PRINTS = """\
import numpy as np
from softvox_search.protocol import SearcherBase

print("imported")

class Narrow(SearcherBase):
    def __init__(self, space, rng, *, how=""):
        print("made")
        if how == "not made":
            raise RuntimeError("no luck\\nat all")
        super().__init__(space, rng)
        self.how = how

    def ask(self, n=None):
        print("asked")
        if self.how == "raises":
            raise OSError("no luck\\nat all")
        if self.how == "exits":
            raise SystemExit(0)
        if self.how == "illegal":
            return [[0, 1, 2, 3, 0, 0, 0, 0]]
        return np.arange(20)


def draws(evaluate, space, rng, *, size=5):
    print("called")
    while True:
        evaluate(space.random(size, rng))
"""


def test_what_a_searcher_prints_does_not_spoil_the_json(tmp_path):
    (tmp_path / "own.py").write_text(PRINTS)
    command = ("search", "--searcher", "own:Narrow", "--budget", "20", "--no-picture", "--json")
    done = softvox(*command, cwd=tmp_path)
    assert json.loads(done.stdout)["ended_by"] == "unique"
    assert {"imported", "made", "asked"} == set(done.stderr.split())


@pytest.mark.parametrize(
    ("how", "message"),
    [
        ("not made", "RuntimeError: no luck at all"),
        ("raises", "OSError: no luck at all"),
        ("exits", "SystemExit: 0"),
    ],
)
def test_what_a_searcher_raises_is_shown_and_summed_up_in_a_line(how, message, tmp_path):
    (tmp_path / "own.py").write_text(PRINTS)
    command = ("search", "--searcher", "own:Narrow", "--option", f"how={how}", "--no-picture")
    done = softvox(*command, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (1, "")
    assert "Traceback" in done.stderr
    assert 'own.py", line' in done.stderr
    assert done.stderr.splitlines()[-1] == (f"softvox: error: searcher own:Narrow raised {message}")


def test_only_a_picture_that_was_named_is_protected(tmp_path):
    for seed in ("1", "2", "1"):
        done = softvox("search", "--searcher", "ga", "--budget", "60", "--seed", seed, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
    noisy = ("search", "--searcher", "ga", "--budget", "60", "--seed", "1", "--noise", "1.5")
    done = softvox(*noisy, cwd=tmp_path)
    assert "under noise   not known at level 1.5; known at 0, 0.5, 1, 2, 4" in done.stdout
    assert {path.name for path in tmp_path.iterdir()} == {
        "search-ga-1.png",
        "search-ga-2.png",
        "search-ga-1-noise-1.5.png",
    }
    named = softvox(*noisy, "--picture", "search-ga-1.png", cwd=tmp_path)
    assert "--picture search-ga-1.png exists" in named.stderr


def test_a_searcher_of_ones_own_is_found_in_the_current_folder(tmp_path):
    (tmp_path / "own.py").write_text(PRINTS)
    options = ("--searcher", "own:draws", "--option", "size=3", "--budget", "30", "--json")
    done = softvox("search", *options, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["ended_by"] == "unique"
    assert (tmp_path / "search-draws-0.png").exists()
    refused = softvox("search", *options, "--noise", "1", "--running-mean", cwd=tmp_path)
    assert "a policy against luck needs a searcher with ask" in refused.stderr


def test_on_another_lattice_the_best_is_not_known_and_no_regret_told(tmp_path):
    short = ("--duration", "0.02", "--settle-time", "0.01")
    command = ("search", "--searcher", "ga", "--shape", "4x4x4", "--budget", "12", *short)
    data = json.loads(softvox(*command, "--json", "--out", "log.csv", cwd=tmp_path).stdout)
    assert data["shape"] == [4, 4, 4]
    assert not {"regret", "rank", "best"} & set(data)
    with (tmp_path / "log.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert data["digits"] == rows[data["found_at"] - 1]["design"]
    assert data["fitness"] == max(float(row["fitness"]) for row in rows)
    design = Design(data["digits"], shape=Lattice(4, 4, 4))
    assert softvox_gym.evaluate(
        design, {"duration": 0.02, "settle_time": 0.01, "preset": "published"}
    ).value == [data["fitness"]]
    assert (tmp_path / "search-ga-0.png").exists()
    text = softvox(*command, "--noise", "1", "--no-picture", cwd=tmp_path).stdout
    assert "voxel widths; the best of 4x4x4 is not known" in text
    assert "under noise   not known on 4x4x4" in text
    assert "regret" not in text
    assert "rank" not in text


def test_a_list_can_be_had_where_a_library_is_missing(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "deap", None)
    monkeypatch.delitem(sys.modules, "softvox_search.searchers.afpo", raising=False)
    assert main(["search", "--list"]) == 0
    text = capsys.readouterr().out
    assert "needs deap: pip install deap" in text
    assert 'optimizer="PortfolioDiscreteOnePlusOne"' in text


BAD = {
    "search": "--searcher",
    "search --searcher afop": "did you mean 'afpo'?",
    "search --searcher no_such:Thing": "no module 'no_such'",
    "search --searcher ga --option populaton=3": "has no option 'populaton'; its options are:",
    "search --searcher ga --option population=0": "population must be",
    "search --searcher ga --option population": "--option must be KEY=VALUE",
    "search --searcher ga --budget 0": "--budget",
    "search --searcher ga --evaluations -1": "--evaluations",
    "search --searcher ga --seed -1": "--seed",
    "search --searcher ga --noise -1": "--noise must be a number that is not negative",
    "search --searcher ga --noise nan": "--noise must be",
    "search --searcher ga --final-stage": "--final-stage works with noise only",
    "search --searcher ga --noise 1 --budget 50 --final-stage": "--searcher ga: a final stage of",
    "search --searcher ga --out file": "--out must end in .csv or .parquet",
    "search --searcher ga --out old.csv": "--out old.csv exists",
    "search --searcher ga --picture old.png": "--picture old.png exists",
    "search --searcher ga --picture p.jpg": "--picture must end in .png",
    "search --searcher ga --seed 7 --picture search-ga-7.png": "search-ga-7.png exists",
    "search --searcher numpy:ndarray": "searcher numpy:ndarray lacks ask, tell",
    "search --searcher os:path": "--searcher os:path: module os has no class or function 'path'",
    f"search --searcher ga --budget {10**23}": f"above 0 and at most 999999999, got {10**23}",
    f"search --searcher ga --seed {10**23}": "of at most 18 digits",
    "search --searcher ga --gravity 1 2": "--gravity",
    "search --searcher ga --densty 1": "did you mean --density?",
    "search --searcher ga --shape 0 2 2": "--shape",
    "search --searcher ga --shape 999 999 999": "--shape 999x999x999 has",
}


@pytest.mark.parametrize("command", BAD)
def test_bad_input_is_one_line_naming_the_mend_and_nothing_is_written(
    command, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    for name in ("old.csv", "old.png", "search-ga-7.png"):
        (tmp_path / name).touch()
    status = main(command.split())
    said = capsys.readouterr()
    assert (status, said.out) == (2, "")
    assert len(said.err.splitlines()) == 1
    assert said.err.startswith("softvox: error: ")
    assert BAD[command] in said.err
    assert len(list(tmp_path.iterdir())) == 3


def test_a_searcher_that_asks_for_what_is_no_design_is_named_in_one_line(tmp_path):
    (tmp_path / "own.py").write_text(PRINTS)
    options = ("--searcher", "own:Narrow", "--option", "how=illegal", "--quiet")
    done = softvox("search", *options, cwd=tmp_path, PYTHONDONTWRITEBYTECODE="1")
    assert (done.returncode, done.stdout) == (2, "")
    assert "searcher own:Narrow returned invalid designs" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["own.py"]
