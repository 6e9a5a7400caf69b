import re
import sys

import numpy as np
import pytest
from small_experiments import NOISY, SMALL

from softvox_search.experiment.checks import check
from softvox_search.experiment.config import ConfigError, read
from softvox_search.experiment.environment import answers_from_table, stack
from softvox_search.experiment.job import streams
from softvox_search.experiment.keys import EXAMPLE, KEYS
from softvox_search.oracle import Budget


def experiment_of(tmp_path, text):
    path = tmp_path / "exp.toml"
    path.write_text(text, encoding="utf-8")
    experiment = read(path)
    check(experiment, path)
    return experiment


def test_a_file_is_read_with_what_it_leaves_out_filled_in(tmp_path):
    experiment = experiment_of(tmp_path, SMALL)
    exhaustive, random, own = experiment.searchers
    assert (experiment.name, experiment.entropy, experiment.seeds) == ("exp", 1, 3)
    assert (experiment.physics, experiment.table, experiment.levels) == ("published", True, None)
    assert (exhaustive.seeds, random.seeds, own.label) == (1, 3, "with")
    assert random.budget == Budget(unique=60)
    assert own.budget == Budget(unique=20, evaluations=30)
    assert [run.cell.searcher.label for run in experiment.runs()] == (
        ["exhaustive"] + ["random"] * 3 + ["with"] * 3
    )


def test_cells_are_searcher_by_level_by_policy(tmp_path):
    experiment = experiment_of(tmp_path, NOISY)
    cells = [(cell.level, cell.policy.name) for cell in experiment.cells()]
    assert cells == [(0, "naive"), (0, "mean"), (1, "naive"), (1, "mean")]
    assert [run.seed for run in experiment.runs()] == [0, 1] * 4


def test_random_streams_are_those_of_spawned_seed_sequences(tmp_path):
    experiment = experiment_of(tmp_path, NOISY)
    cells = np.random.SeedSequence(experiment.entropy).spawn(4)
    seeds = [seed for cell in cells for seed in cell.spawn(2)]
    drawn = set()
    for run, seed in zip(experiment.runs(), seeds, strict=True):
        for ours, child in zip(streams(experiment, run), seed.spawn(2), strict=True):
            value = ours.integers(2**62)
            assert value == np.random.default_rng(child).integers(2**62)
            drawn.add(value)
    assert len(drawn) == 16


def test_comments_and_order_change_nothing_that_results_depend_on(tmp_path):
    plain = experiment_of(tmp_path, SMALL).to_dict()
    other = "# said again\nentropy = 1\nseeds = 3\n" + SMALL.partition("entropy = 1\n")[2]
    assert experiment_of(tmp_path, other).to_dict() == plain
    assert experiment_of(tmp_path, SMALL.replace("entropy = 1", "entropy = 3")).to_dict() != plain


def test_the_level_goes_innermost_or_where_the_noise_is_named(tmp_path):
    experiment = experiment_of(tmp_path, NOISY)
    assert [w.name for w in stack(experiment, 1.0)] == ["JakobiNoise", "Resample"]
    named = NOISY.replace(
        '[[policies]]\nname = "naive"',
        '[[wrappers]]\nname = "JakobiNoise"\nstrain = 0.3\n[[policies]]\nname = "naive"',
    )
    resample, noise = stack(experiment_of(tmp_path, named), 0.5)
    assert resample.name == "Resample"
    assert noise.options == {"strain": 0.3, "level": 0.5}


def test_the_table_answers_only_where_nothing_disturbs_the_simulation(tmp_path):
    noisy, small = experiment_of(tmp_path, NOISY), experiment_of(tmp_path, SMALL)
    engine = experiment_of(tmp_path, SMALL + "[env]\ntable = false\n")
    exact = experiment_of(tmp_path, SMALL + '[env]\nphysics = "exact"\n')
    measured = experiment_of(tmp_path, SMALL + '[[wrappers]]\nname = "FitnessNoise"\nsigma = 0.2\n')
    assert answers_from_table(small, None)
    assert answers_from_table(noisy, 0.0)
    assert answers_from_table(measured, None)
    assert not answers_from_table(noisy, 1.0)
    assert not answers_from_table(engine, None)
    assert not answers_from_table(exact, None)


def changed(before, after, text=SMALL):
    assert before in text
    return text.replace(before, after, 1)


BAD = {
    "unknown key": (
        changed("seeds = 3", "seeds = 3\nsedes = 3"),
        "no key sedes; did you mean seeds? Its keys are seeds, entropy",
    ),
    "missing key": (changed("seeds = 3\n", ""), "lacks the key seeds, a whole number"),
    "misspelt key": (changed("seeds", "sedes"), "lacks the key seeds", "is sedes meant"),
    "misspelt entropy": (changed("entropy", "entrpy"), "did you mean entropy? Its keys are seeds"),
    "budget huge": (
        changed("unique = 60", f"unique = {10**23}"),
        "[budget] unique must be a whole number of at least 1 and at most 2147483647, got 1000000",
    ),
    "entropy huge": (changed("entropy = 1", f"entropy = 0x{'f' * 9999}"), "got one of 39996 bits"),
    "too many digits": (changed("entropy = 1", f"entropy = {'9' * 9999}"), "can't be read"),
    "seeds huge": (
        changed("seeds = 3", f"seeds = {10**9}"),
        "make 2000000001 runs, and at most 1000000 are taken; give fewer seeds",
    ),
    "no method": (changed('"random"', '"numpy:ndarray"'), "searcher numpy:ndarray lacks ask, tell"),
    "seeds 0": (changed("seeds = 3", "seeds = 0"), "seeds must be a whole number of at least 1"),
    "seeds true": (changed("seeds = 3", "seeds = true"), "seeds must be", "got True"),
    "entropy text": (changed("entropy = 1", 'entropy = "x"'), "entropy must be", "got 'x'"),
    "budget 0": (changed("unique = 60", "unique = 0"), "[budget] unique must be", "got 0"),
    "budget negative": (changed("unique = 60", "steps = -5"), "[budget] steps must be"),
    "budget float": (changed("unique = 60", "unique = 60.0"), "[budget] unique must be"),
    "budget empty": (changed("unique = 60", ""), "budget must have unique, evaluations or both"),
    "budget key": (changed("unique = 60", "uniqe = 60"), "[budget] has no key uniqe", "unique?"),
    "no budget": (changed("[budget]\nunique = 60", ""), "lacks the key budget, a table [budget]"),
    "budget no table": (changed("[budget]\nunique = 60", "budget = 3"), "budget must be a table"),
    "not toml": ("seeds = = 3", "is not valid TOML", "line 1"),
    "searcher": (
        changed('"random"', '"rondom"'),
        "[[searchers]] no. 2 (rondom) name must be one of exhaustive",
        "did you mean random?",
    ),
    "no such module": (changed('"random"', '"no_such:Thing"'), "no module 'no_such'"),
    "option": (
        changed('"random"', '"random"\noptions = { bach = 2 }'),
        "[[searchers]] random: searcher random has no option 'bach'",
    ),
    "option date": (
        changed('"random"', '"random"\noptions = { batch = 2020-01-01 }'),
        "batch must be finite numbers",
    ),
    "searcher key": (changed('"random"', '"random"\nsede = 3'), "no. 2 (random) has no key sede"),
    "no reason": (changed('reason = "a test"', ""), "no. 3 (with) lacks the key reason"),
    "twice": (changed('label = "with"', 'label = "random"'), "random is there twice", "label"),
    "no searchers": ("seeds=1\nentropy=1\nbudget.unique=5\n", "lacks the key searchers"),
    "empty searchers": ("seeds=1\nentropy=1\nbudget.unique=5\nsearchers=[]\n", "got none"),
    "searchers no tables": ("seeds=1\nentropy=1\nbudget.unique=5\nsearchers=3\n", "[[searchers]]"),
    "id": (changed("[budget]", '[env]\nid = "X-v0"\n[budget]'), "[env] id must be one of SoftVox"),
    "physics": (changed("[budget]", '[env]\nphysics = "newton"\n[budget]'), "[env] physics: "),
    "physics field": (changed("[budget]", "[env.physics]\ngravty = 1\n[budget]"), "gravty"),
    "table": (changed("[budget]", "[env]\ntable = 1\n[budget]"), "[env] table must be true or"),
    "wrapper": (
        changed('"Resample"', '"Resampel"', NOISY),
        "[[wrappers]] no. 1 (Resampel) name must be one of FitnessNoise, JakobiNoise, Resample",
        "did you mean Resample?",
    ),
    "wrapper key": (changed("n = 2", "m = 2", NOISY), "Resample: has no key m", "n, aggregate"),
    "wrapper lacks": (changed("n = 2", "", NOISY), "Resample: lacks the key n"),
    "wrapper value": (changed("n = 2", "n = 0", NOISY), "[[wrappers]] Resample: n must be"),
    "aggregate": (
        changed("n = 2", 'n = 2\naggregate = "median"', NOISY),
        "aggregate 'median' is unknown; the aggregates are mean, min, q10, cvar25",
    ),
    "channel": (
        changed("[[wrappers]]", '[[wrappers]]\nname="JakobiNoise"\nstrian=1\n[[wrappers]]', NOISY),
        "[[wrappers]] JakobiNoise: ",
        "strian",
    ),
    "own wrapper": (changed('"Resample"\nn = 2', '"no_such:Thing"', NOISY), "no_such"),
    "two levels": (
        changed("[[wrappers]]", '[[wrappers]]\nname="JakobiNoise"\nlevel=1\n[[wrappers]]', NOISY),
        "has a level of its own beside levels; drop one",
    ),
    "levels": (changed("levels = [0, 1]", "levels = [0, -1]", NOISY), "levels must be a list"),
    "levels twice": (changed("[0, 1]", "[1, 1]", NOISY), "levels must be different numbers"),
    "levels empty": (changed("[0, 1]", "[]", NOISY), "levels must be a list of numbers"),
    "policy key": (
        changed("running_mean = true", "runing_mean = true", NOISY),
        "[[policies]] no. 2 (mean) has no key runing_mean; did you mean running_mean?",
    ),
    "policy type": (changed("running_mean = true", "running_mean = 1", NOISY), "true or false"),
    "finalists": (changed("running_mean = true", "finalists = 0", NOISY), "finalists must be"),
    "policy twice": (changed('"mean"', '"naive"', NOISY), "[[policies]] naive is there twice"),
    "policy without noise": (
        SMALL + '[[policies]]\nname = "all"\n',
        "[[policies]] are against the luck of noisy evaluations, and nothing is noisy here",
    ),
    "final stage too long": (
        changed("running_mean = true", "final_stage = true", NOISY),
        "[[policies]] mean: with random_with_replacement: a final stage of 10 finalists",
    ),
    "final stage by steps": (
        changed("unique = 24", "unique = 900\nsteps = 9", NOISY) + "[[policies]]\nname = 'end'\n"
        "final_stage = true\n",
        "[[policies]] end: final_stage needs a budget that ends at a known evaluation",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_gets_one_line_naming_file_key_and_mend(case, tmp_path):
    text, *fragments = BAD[case]
    with pytest.raises(ConfigError) as caught:
        experiment_of(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(f"{tmp_path / 'exp.toml'}: ")
    assert "\n" not in message
    for fragment in fragments:
        assert fragment in message


def test_the_example_of_the_help_is_read(tmp_path):
    experiment = experiment_of(tmp_path, EXAMPLE)
    assert len(EXAMPLE.splitlines()) == 8
    assert (experiment.entropy, experiment.seeds, len(experiment.searchers)) == (0, 10, 2)


@pytest.mark.parametrize(
    "place",
    ["", "[budget]\n", "[env]\n", "[[searchers]]\nname = 'ga'\n", "[[policies]]\nname = 'p'\n"],
)
def test_the_help_tells_of_every_key(place, tmp_path):
    surplus = "surplus = 1\n"
    text = surplus + EXAMPLE if not place else EXAMPLE + place + surplus
    if place == "[budget]\n":
        text = EXAMPLE.replace(place, place + surplus)
    with pytest.raises(ConfigError, match="has no key surplus; its keys are") as caught:
        experiment_of(tmp_path, text)
    for key in str(caught.value).partition("its keys are ")[2].split(", "):
        assert re.search(rf"\b{key}\b", KEYS)


def test_a_mark_of_byte_order_is_skipped(tmp_path):
    path = tmp_path / "exp.toml"
    path.write_text(EXAMPLE, encoding="utf-8-sig")
    assert read(path).seeds == 10


WRAPPERS = """\
from gymnasium.vector import VectorWrapper

class Drops(VectorWrapper):
    is_noisy = False

    def step(self, actions):
        *rest, infos = self.env.step(actions)
        return (*rest, {"status": infos["status"]})

class Breaks(VectorWrapper):
    is_noisy = False

    def step(self, actions):
        raise RuntimeError("no luck")

class Exits(VectorWrapper):
    def __init__(self, env):
        raise SystemExit(3)
"""


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Drops", "Drops: its step drops displacement, steps from the infos"),
        ("Breaks", "Breaks: can't be stepped: RuntimeError: no luck"),
        ("Exits", "Exits: can't be made: SystemExit: 3"),
    ],
)
def test_a_wrapper_of_ones_own_that_breaks_is_named(name, message, tmp_path, monkeypatch):
    (tmp_path / "own_wrappers.py").write_text(WRAPPERS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_wrappers", raising=False)
    around = '[[wrappers]]\nname = "FitnessNoise"\nsigma = 0.1\n'
    with pytest.raises(ConfigError) as caught:
        experiment_of(tmp_path, f'{EXAMPLE}[[wrappers]]\nname = "own_wrappers:{name}"\n{around}')
    assert message in str(caught.value)


def test_a_file_that_cannot_be_read_says_why(tmp_path):
    with pytest.raises(ConfigError, match=r"none\.toml: No such file"):
        read(tmp_path / "none.toml")
    with pytest.raises(ConfigError, match="Is a directory"):
        read(tmp_path)
    (tmp_path / "latin.toml").write_bytes(b"# \xe4\n")
    with pytest.raises(ConfigError, match="UTF-8"):
        read(tmp_path / "latin.toml")
