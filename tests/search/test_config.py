import re
import sys

import numpy as np
import pytest
from small_experiments import NOISY, SMALL

from softvox_gym import Physics
from softvox_search.cli.compare import EXAMPLE
from softvox_search.cli.compare import KEYS as HELP
from softvox_search.experiment.environments import answers_from_table, check
from softvox_search.experiment.run import identity, made_with, streams
from softvox_search.experiment.schema import KEYS, UsageError, of_dict, read
from softvox_search.oracle import Budget


def experiment_of(tmp_path, text):
    path = tmp_path / "exp.toml"
    path.write_text(text, encoding="utf-8")
    experiment = read(path)
    check(experiment, str(path), lambda done, total: None)
    return experiment


def problem_of(tmp_path, text):
    return experiment_of(tmp_path, text).problems()[0]


def identities(experiment):
    return [identity(run, made_with()) for run in experiment.runs()]


def test_a_file_is_read_with_what_it_leaves_out_filled_in(tmp_path):
    experiment = experiment_of(tmp_path, SMALL)
    exhaustive, random, own = experiment.searcher_choices()
    assert (experiment.title, experiment.entropy, experiment.seeds) == ("exp", 1, 3)
    (problem,) = experiment.problems()
    assert (problem.physics, problem.shape, problem.level) == ("published", (2, 2, 2), None)
    assert (exhaustive.seeds, random.seeds, own.label) == (1, 3, "with")
    assert random.budget.checked() == Budget(unique=60)
    assert own.budget.checked() == Budget(unique=20, evaluations=30)
    labels = [run.searcher.label for run in experiment.runs()]
    assert labels == ["exhaustive"] + ["random"] * 3 + ["with"] * 3
    assert of_dict(experiment.to_dict(), "") == experiment


AXES = """\
seeds = 2
shape = [[2, 2, 2], [1, 2, 3]]
physics = ["published", { shear_ratio = 0.5 }, { label = "ice", preset = "published", \
friction_static = 0.1, friction_kinetic = 0.1 }]
budget.unique = 30
[[searchers]]
name = "ga"
options = { population = [20, 30], crossover = 0.5 }
[[searchers]]
name = "hill_climber"
label = "climb"
options = { batch = [1, 2] }
"""


def test_axes_are_searcher_by_problem_by_policy_by_seed_and_lists_are_sweeps(tmp_path):
    (tmp_path / "exp.toml").write_text(AXES)
    experiment = read(tmp_path / "exp.toml")
    labels = ["ga(population=20)", "ga(population=30)", "climb(batch=1)", "climb(batch=2)"]
    assert [choice.label for choice in experiment.searcher_choices()] == labels
    assert experiment.searcher_choices()[1].options == {"population": 30, "crossover": 0.5}
    assert [(p.physics, str(p.shape)) for p in experiment.problems()] == [
        ("published", "2x2x2"),
        ("published", "1x2x3"),
        ("shear_ratio=0.5", "2x2x2"),
        ("shear_ratio=0.5", "1x2x3"),
        ("ice", "2x2x2"),
        ("ice", "1x2x3"),
    ]
    assert Physics.of(experiment.problems()[2].values).shear_ratio == pytest.approx(0.5)
    ice = experiment.problems()[4]
    assert Physics.of(ice.values).friction_kinetic == 0.1
    assert ice.to_dict()["physics"] == {"friction_static": 0.1, "friction_kinetic": 0.1}
    assert len(set(identities(experiment))) == len(experiment.runs()) == 4 * 6 * 2

    noisy = experiment_of(tmp_path, NOISY)
    runs = [(run.problem.level, run.policy.name, run.seed) for run in noisy.runs()]
    assert runs == [(lev, name, s) for lev in (0, 1) for name in ("naive", "mean") for s in (0, 1)]


def test_streams_are_keyed_by_names_and_by_the_seed_alone(tmp_path):
    (tmp_path / "exp.toml").write_text(AXES)
    runs = read(tmp_path / "exp.toml").runs()
    drawn = {rng.integers(2**62) for run in runs for rng in streams(run)}
    assert len(drawn) == 2 * len(runs)
    text = AXES.replace("unique = 30", "unique = 300").replace("crossover = 0.5", "mutation = 0.1")
    (tmp_path / "exp.toml").write_text(text.replace("[20, 30]", "[20, 30, 40]"))
    more = read(tmp_path / "exp.toml").runs()
    again = {rng.integers(2**62) for run in more for rng in streams(run)}
    assert drawn < again
    assert len(again) == 2 * len(more)


def test_the_stream_of_a_run_is_that_of_its_names(tmp_path):
    """Held against a computation of its own: changing it changes every result."""
    import hashlib

    run = experiment_of(tmp_path, SMALL).runs()[2]
    text = (
        '{"level":null,"physics":"published","policy":"","searcher":"random","seed":1,'
        '"shape":"2x2x2"}'
    )
    words = np.frombuffer(hashlib.sha256(text.encode()).digest(), dtype="<u4").tolist()
    children = np.random.SeedSequence(1, spawn_key=words).spawn(2)
    for ours, child in zip(streams(run), children, strict=True):
        assert ours.integers(2**62) == np.random.default_rng(child).integers(2**62)


def test_identities_depend_on_content_not_on_comments_order_or_title(tmp_path):
    plain = identities(experiment_of(tmp_path, SMALL))
    other = "# said again\ntitle = 'T'\nentropy = 1\nseeds = 3\n" + SMALL.partition("= 1\n")[2]
    assert identities(experiment_of(tmp_path, other)) == plain
    for old, new in (("entropy = 1", "entropy = 3"), ("unique = 60", "unique = 61")):
        changed_ = identities(experiment_of(tmp_path, SMALL.replace(old, new)))
        assert not set(changed_[:4]) & set(plain)


def test_the_level_goes_innermost_or_where_the_noise_is_named(tmp_path):
    problem = experiment_of(tmp_path, NOISY).problems()[1]
    assert [one["name"] for one in problem.stack()] == ["JakobiNoise", "Resample"]
    named = NOISY.replace(
        '[[policies]]\nname = "naive"',
        '[[wrappers]]\nname = "JakobiNoise"\nstrain = 0.3\n[[policies]]\nname = "naive"',
    )
    resample, noise = experiment_of(tmp_path, named).problems()[1].stack()
    assert resample["name"] == "Resample"
    assert noise == {"name": "JakobiNoise", "strain": 0.3, "level": 1.0}


def test_the_table_answers_only_where_nothing_disturbs_the_simulation(tmp_path):
    quiet, noisy = experiment_of(tmp_path, NOISY).problems()
    measured = SMALL + '[[wrappers]]\nname = "FitnessNoise"\nsigma = 0.2\n'
    assert answers_from_table(quiet)
    assert not answers_from_table(noisy)
    assert answers_from_table(problem_of(tmp_path, SMALL))
    assert answers_from_table(problem_of(tmp_path, measured))
    for line in ("table = false", 'physics = "exact"'):
        assert not answers_from_table(problem_of(tmp_path, f"{line}\n{SMALL}"))
    (tmp_path / "exp.toml").write_text(f"shape = [3, 2, 2]\n{SMALL}")
    assert not answers_from_table(read(tmp_path / "exp.toml").problems()[0])


def changed(before, after, text=SMALL):
    assert before in text
    return text.replace(before, after, 1)


BAD = {
    "unknown key": (
        changed("seeds = 3", "seeds = 3\nsedes = 3"),
        "has no key sedes; did you mean seeds?; its keys are seeds, entropy",
    ),
    "missing key": (changed("seeds = 3\n", ""), "lacks the key seeds"),
    "misspelt entropy": (changed("entropy", "entrpy"), "did you mean entropy?; its keys are seeds"),
    "budget huge": (
        changed("unique = 60", f"unique = {10**23}"),
        "budget unique must be int <= 2147483647, got 1000000",
    ),
    "entropy huge": (changed("entropy = 1", f"entropy = 0x{'f' * 9999}"), "finite numbers"),
    "too many digits": (changed("entropy = 1", f"entropy = {'9' * 9999}"), "is not valid TOML"),
    "seeds huge": (
        changed("seeds = 3", f"seeds = {10**9}"),
        "make 2000000001 runs, and at most 1000000 are taken; give fewer",
    ),
    "sweeps huge": (
        SMALL
        + '[[searchers]]\nname = "ga"\noptions = { '
        + ", ".join(f"{letter} = {list(range(100))}" for letter in "abcde")
        + " }\n",
        "runs, and at most 1000000 are taken; give fewer",
    ),
    "no physics": (changed("seeds = 3", "seeds = 3\nphysics = []"), "physics must be", "[]"),
    "noise": (changed("seeds = 3", "seeds = 3\nnoise = [0, 1]"), "did you mean levels?"),
    "seeds 0": (changed("seeds = 3", "seeds = 0"), "seeds must be int >= 1, got 0"),
    "seeds true": (changed("seeds = 3", "seeds = true"), "seeds must be int", "got True"),
    "entropy text": (changed("entropy = 1", 'entropy = "x"'), "entropy must be int", "got 'x'"),
    "budget negative": (changed("unique = 60", "steps = -5"), "budget steps must be int >= 1"),
    "budget float": (changed("unique = 60", "unique = 60.5"), "budget unique must be", "60.5"),
    "budget empty": (changed("unique = 60", ""), "budget must have unique, evaluations or"),
    "budget key": (changed("unique = 60", "uniqe = 60"), "budget has no key uniqe", "unique?"),
    "no budget": (changed("[budget]\nunique = 60", ""), "lacks the key budget"),
    "budget no table": (
        changed("[budget]\nunique = 60", "budget = 3"),
        "budget must be table, not int, got 3",
    ),
    "not toml": ("seeds = = 3", "is not valid TOML", "line 1"),
    "searcher": (
        changed('"random"', '"rondom"'),
        "[[searchers]] rondom: there is no searcher 'rondom'; did you mean 'random'?",
    ),
    "no such module": (
        changed('"random"', '"no_such:Thing"'),
        "no_such:Thing: ",
        "module 'no_such'",
    ),
    "no method": (changed('"random"', '"numpy:ndarray"'), "searcher numpy:ndarray lacks ask"),
    "option": (
        changed('"random"', '"random"\noptions = { bach = 2 }'),
        "[[searchers]] random: searcher random has no option 'bach'",
    ),
    "option date": (
        changed('"random"', '"random"\noptions = { batch = 2020-01-01 }'),
        "searchers no. 2 (random) options must be bool | int | float | str | list, not date",
    ),
    "option nan": (
        changed('"random"', '"random"\noptions = { batch = nan }'),
        "values must be texts, finite numbers",
    ),
    "empty sweep": (
        changed('"random"', '"random"\noptions = { batch = [] }'),
        "[[searchers]] random options must not be empty lists",
    ),
    "searcher key": (changed('"random"', '"random"\nsede = 3'), "no. 2 (random) has no key sede"),
    "twice": (changed('label = "with"', 'label = "random"'), "random is there twice", "label"),
    "no searchers": ("seeds=1\nentropy=1\nbudget.unique=5\n", "lacks the key searchers"),
    "empty searchers": ("seeds=1\nentropy=1\nbudget.unique=5\nsearchers=[]\n", "got []"),
    "searchers no tables": ("seeds=1\nbudget.unique=5\nsearchers=3\n", "searchers must be list"),
    "physics": (f'physics = "newton"\n{SMALL}', "physics newton: ", "published"),
    "physics field": (f"physics = {{ gravty = 1 }}\n{SMALL}", "physics gravty=1: ", "'gravty'"),
    "physics label": (
        f"physics = [{{ label='a', gravity=-1 }}, {{ label='a', gravity=-2 }}]\n{SMALL}",
        "physics a is there twice; give one of them another label",
    ),
    "physics twice": (f'physics = ["exact", "exact"]\n{SMALL}', "physics exact is there twice"),
    "shape twice": (f"shape = [[2, 2, 2], [2, 2, 2]]\n{SMALL}", "shape 2x2x2 is there twice"),
    "shape": (f"shape = [2, 2]\n{SMALL}", "shape"),
    "shape 0": (f"shape = [[2, 2, 0]]\n{SMALL}", "shape no. 1 no. 3 must be int >= 1, got 0"),
    "table": (f"table = 1\n{SMALL}", "table must be bool, not int, got 1"),
    "wrapper": (
        changed('"Resample"', '"Resampel"', NOISY),
        "there is no wrapper 'Resampel'; did you mean Resample?; they are FitnessNoise, ",
    ),
    "wrapper nameless": (changed('name = "Resample"\n', "", NOISY), "lacks the key name, a text"),
    "wrapper key": (changed("n = 2", "m = 2", NOISY), "Resample: ", "its keys are n, aggregate"),
    "wrapper value": (changed("n = 2", "n = 0", NOISY), "published 2x2x2: n must be"),
    "aggregate": (
        changed("n = 2", 'n = 2\naggregate = "median"', NOISY),
        "aggregate 'median' is unknown; the aggregates are mean, min, q10, cvar25",
    ),
    "channel": (
        changed("[[wrappers]]", '[[wrappers]]\nname="JakobiNoise"\nstrian=1\n[[wrappers]]', NOISY),
        "[[wrappers]] JakobiNoise, Resample, on published 2x2x2: ",
        "strian",
    ),
    "own wrapper": (changed('"Resample"\nn = 2', '"no_such:Thing"', NOISY), "no_such"),
    "two levels": (
        changed("[[wrappers]]", '[[wrappers]]\nname="JakobiNoise"\nlevel=1\n[[wrappers]]', NOISY),
        "has its own level beside levels; drop one",
    ),
    "levels": (
        changed("levels = [0, 1]", "levels = [0, -1]", NOISY),
        "levels no. 2 must be float",
    ),
    "levels twice": (changed("[0, 1]", "[1, 1]", NOISY), "levels 1 is there twice"),
    "levels alike": (changed("[0, 1]", "[0.1234561, 0.1234562]", NOISY), "0.123456 is there twice"),
    "levels 0": (changed("[0, 1]", "[0.0, -0.0]", NOISY), "levels 0 is there twice"),
    "levels empty": (changed("[0, 1]", "[]", NOISY), "levels must be list of length >= 1, got []"),
    "policy key": (
        changed("running_mean = true", "runing_mean = true", NOISY),
        "policies no. 2 (mean) has no key runing_mean; did you mean running_mean?",
    ),
    "policy type": (changed("running_mean = true", "running_mean = 1", NOISY), "must be bool"),
    "finalists": (changed("running_mean = true", "finalists = 0", NOISY), "finalists must be"),
    "policy twice": (changed('"mean"', '"naive"', NOISY), "[[policies]] naive is there twice"),
    "policy without noise": (
        SMALL + '[[policies]]\nname = "all"\n',
        "[[policies]] deal with noisy evaluations, but nothing is noisy here",
    ),
    "final stage too long": (
        changed("running_mean = true", "final_stage = true", NOISY),
        "[[policies]] mean: with random_with_replacement: a final stage of 10 finalists",
    ),
    "final stage by steps": (
        changed("unique = 24", "unique = 900\nsteps = 9", NOISY) + "[[policies]]\nname = 'end'\n"
        "final_stage = true\n",
        "[[policies]] end: ",
        "final_stage",
        "steps",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_a_bad_file_gets_one_line_naming_file_key_and_remedy(case, tmp_path):
    text, *fragments = BAD[case]
    with pytest.raises(UsageError) as caught:
        experiment_of(tmp_path, text)
    message = str(caught.value)
    assert message.startswith(f"{tmp_path / 'exp.toml'}: ")
    assert "\n" not in message
    assert "$" not in message
    for fragment in fragments:
        assert fragment in message


def test_the_example_of_the_help_is_read_and_the_help_tells_of_every_key(tmp_path):
    experiment = experiment_of(tmp_path, EXAMPLE)
    assert (experiment.entropy, experiment.seeds, len(experiment.searcher_choices())) == (0, 10, 3)
    for keys in KEYS.values():
        for key in keys:
            assert re.search(rf"\b{key}\b", HELP)


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
        return (*rest, {"steps": infos["steps"]})

class Silent(VectorWrapper):
    pass

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
        ("Drops", "own_wrappers:Drops, on published 2x2x2: fails with KeyError: 'displacement'"),
        (
            "Silent",
            "own_wrappers:Silent, FitnessNoise, on published 2x2x2: Silent doesn't say whether "
            "two evaluations",
        ),
        ("Breaks", "fails with RuntimeError: no luck"),
        ("Exits", "fails with SystemExit: 3"),
        ("Gone", "module own_wrappers has no class or function 'Gone'"),
    ],
)
def test_a_wrapper_of_ones_own_that_breaks_is_named(name, message, tmp_path, monkeypatch):
    (tmp_path / "own_wrappers.py").write_text(WRAPPERS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "own_wrappers", raising=False)
    around = "" if name == "Drops" else '[[wrappers]]\nname = "FitnessNoise"\nsigma = 0.1\n'
    with pytest.raises(UsageError) as caught:
        experiment_of(tmp_path, f'{EXAMPLE}[[wrappers]]\nname = "own_wrappers:{name}"\n{around}')
    assert message in str(caught.value)


def test_a_file_that_cannot_be_read_says_why(tmp_path):
    with pytest.raises(UsageError, match=r"none\.toml: No such file"):
        read(tmp_path / "none.toml")
    with pytest.raises(UsageError, match="Is a directory"):
        read(tmp_path)
    (tmp_path / "latin.toml").write_bytes(b"# \xe4\n")
    with pytest.raises(UsageError, match="utf-8"):
        read(tmp_path / "latin.toml")
