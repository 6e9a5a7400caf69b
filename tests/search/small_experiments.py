"""Small experiments, and one's own searchers in a module beside them."""

SMALL = """\
seeds = 3
entropy = 1
[budget]
unique = 60
[[searchers]]
name = "exhaustive"
seeds = 1
reason = "it draws nothing"
[[searchers]]
name = "random"
[[searchers]]
name = "random_with_replacement"
label = "with"
budget = { unique = 20, evaluations = 30 }
reason = "a test"
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
    def __init__(self, rng, *, seconds=0.02):
        super().__init__(rng)
        self.seconds = seconds

    def ask(self, n=None):
        time.sleep(self.seconds)
        return self.rng.integers(0, 6561, 10)


class Fails(SearcherBase):
    def __init__(self, rng, *, how="raises"):
        super().__init__(rng)
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
"""


def results(folder):
    """Return the contents of a folder of results, without its manifest."""
    return {
        str(path.relative_to(folder)): path.read_bytes()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "manifest.json"
    }
