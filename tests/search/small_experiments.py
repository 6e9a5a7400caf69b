"""Small experiments, one's own searchers in a module beside them, and how they are run here."""

from softvox_search.experiment import compare as comparing
from softvox_search.experiment.compare import compare
from softvox_search.experiment.environments import Environments
from softvox_search.experiment.pool import done
from softvox_search.experiment.schema import read

SMALL = """\
seeds = 3
entropy = 1
[budget]
unique = 60
[[searchers]]
name = "exhaustive"
seeds = 1
[[searchers]]
name = "random"
[[searchers]]
name = "random_with_replacement"
label = "with"
budget = { unique = 20, evaluations = 30 }
"""

NOISY = """\
seeds = 2
entropy = 2
levels = [0, 1]
[budget]
unique = 24
[[wrappers]]
name = "Resample"
n = 2
[[policies]]
name = "naive"
[[policies]]
name = "mean"
running_mean = true
[[searchers]]
name = "random_with_replacement"
"""

#: A searcher that takes its time, and one that breaks on a seed that draws high.
OWN = """\
import os
import signal
import time

import numpy as np

from softvox_search.protocol import SearcherBase


class Slow(SearcherBase):
    def __init__(self, space, rng, *, seconds=0.02):
        super().__init__(space, rng)
        self.seconds = seconds

    def ask(self, n=None):
        time.sleep(self.seconds)
        return self.rng.integers(0, 6561, 10)


class Fails(SearcherBase):
    def __init__(self, space, rng, *, how="raises"):
        super().__init__(space, rng)
        self.how = how

    def ask(self, n=None):
        if self.rng.random() > 0.5 and not os.path.exists("mended"):
            if self.how == "dies":
                os.kill(os.getpid(), signal.SIGKILL)
            if self.how == "exits":
                raise SystemExit(3)
            if self.how == "illegal":
                return [[0, 1, 2, 3, 0, 0, 0, 0]]
            raise RuntimeError("no luck\\nat all")
        return np.arange(20)


def climb(evaluate, space, rng, *, width=1):
    best = space.random(1, rng)
    value = evaluate(best)
    while True:
        new = best.copy()
        new[0, rng.integers(space.sites, size=width)] = rng.integers(3, size=width)
        if (told := evaluate(new)) >= value:
            best, value = new, told
"""

COMMAND = "softvox compare exp.toml"


def experiment_of(folder, text):
    path = folder / "exp.toml"
    path.write_text(text, encoding="utf-8")
    return read(path)


class Here:
    """Does runs in this process, in place of `do_all`; counts those that it is given."""

    def __init__(self):
        self.runs = []

    def __call__(self, tasks, *, workers):
        environments = Environments()
        for task in tasks:
            self.runs.append(task[1])
            yield done(task, environments)

    @property
    def names(self):
        return [(run.searcher.label, run.problem.physics, run.seed) for run in self.runs]


def run_here(experiment, folder, **options):
    """Run an experiment in this process: the outcome, what was said, and which runs were done."""
    said, here = [], Here()
    folder.mkdir(exist_ok=True)
    before, comparing.do_all = comparing.do_all, here
    try:
        outcome = compare(
            experiment,
            folder,
            command=COMMAND,
            say=said.append,
            **{"progress": lambda *_: None, **options},
        )
    finally:
        comparing.do_all = before
    return outcome, said, here


def results(folder):
    """Return the contents of a folder of results, without its manifest."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "manifest.json"
    }


#: A transfer method that recommends what does not exist.
BROKEN_METHOD = """\
from softvox_search.transfer import Method


class Nonsense(Method):
    def ask(self):
        return 7

    def recommend(self):
        return 6561
"""
