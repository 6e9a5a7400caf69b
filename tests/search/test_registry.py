"""A name leads to its searcher, and a wrong one to a message that helps."""

import subprocess
import sys

import numpy as np
import pytest

from softvox_search import registry
from softvox_search.protocol import Searcher

OWN = """
import numpy as np
from softvox_search.protocol import SearcherBase

class Mine(SearcherBase):
    def __init__(self, space, rng, *, size=4):
        super().__init__(space, rng)
        self.size = size

    def ask(self, n=None):
        return self.space.random(self.size, self.rng)

class Anything(Mine):
    def __init__(self, space, rng, **options):
        super().__init__(space, rng, size=sum(options.values()))

class Empty(SearcherBase):
    def __init__(self, space, rng):
        raise AssertionError("must not be made")

class Delegates:
    def __init__(self, space, rng):
        self.inner = Mine(space, rng)

    def __getattr__(self, name):
        return getattr(self.inner, name)

class Half:
    def __init__(self, space, rng):
        pass

    def ask(self, n=None):
        return []

NUMBER = 3
"""


@pytest.fixture
def rng():
    return np.random.default_rng(0)


@pytest.fixture
def own(tmp_path, monkeypatch):
    (tmp_path / "own_searchers.py").write_text(OWN)
    (tmp_path / "needs_more.py").write_text("import a_library_that_is_missing")
    monkeypatch.syspath_prepend(tmp_path)


@pytest.mark.parametrize("name", registry.SEARCHERS)
def test_every_name_makes_a_searcher(name, rng):
    assert isinstance(registry.make(name, rng), Searcher)


def test_a_name_may_stand_for_options(rng):
    first = registry.make("exhaustive", rng).ask(5)
    shuffled = registry.make("exhaustive_shuffled", rng).ask(5)
    assert (first != shuffled).any()


def test_options_reach_the_searcher(rng):
    assert len(registry.make("random", rng, batch=7).ask()) == 7


def test_importing_the_registry_loads_no_optional_library():
    code = "import sys, softvox_search.registry, softvox_search.conformance; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert not loaded & {"deap", "ribs", "optuna", "nevergrad", "cmaes", "pandas", "scipy"}


def test_an_unknown_name_is_answered_with_the_valid_ones_and_the_nearest(rng):
    with pytest.raises(ValueError, match="did you mean 'afpo'") as caught:
        registry.make("apfo", rng)
    assert all(name in str(caught.value) for name in registry.SEARCHERS)
    with pytest.raises(ValueError, match="the searchers are: exhaustive") as caught:
        registry.make("xyzzy", rng)
    assert "did you mean" not in str(caught.value)


def test_an_unknown_option_is_answered_with_the_valid_ones(rng):
    with pytest.raises(ValueError, match="random has no option 'size'; its options are: batch"):
        registry.make("random", rng, size=3)
    with pytest.raises(ValueError, match="has no option 'shuffled'"):
        registry.make("exhaustive_shuffled", rng, shuffled=False)
    with pytest.raises(ValueError, match="its options are: none"):
        registry.make("tpe", rng, size=3)


def test_a_name_that_is_no_string_is_refused(rng):
    with pytest.raises(TypeError, match="must be a name"):
        registry.make(3, rng)


@pytest.mark.usefixtures("own")
def test_ones_own_class_is_made_by_where_it_is(rng):
    assert len(registry.make("own_searchers:Mine", rng, size=3).ask()) == 3
    assert registry.options_of("own_searchers:Mine") == {"size": 4}
    with pytest.raises(ValueError, match="its options are: size"):
        registry.make("own_searchers:Mine", rng, bulk=3)


@pytest.mark.usefixtures("own")
def test_a_class_that_takes_any_option_gets_it(rng):
    assert registry.options_of("own_searchers:Anything") is None
    assert len(registry.make("own_searchers:Anything", rng, a=1, b=2).ask()) == 3


@pytest.mark.usefixtures("own")
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("own_searchers:Nobody", "has no class or function 'Nobody'"),
        ("own_searchers:NUMBER", "has no class or function 'NUMBER'"),
        ("own_searchers:", "has no class or function ''"),
        ("nowhere.at_all:Mine", "no module 'nowhere'; is its folder on PYTHONPATH"),
        ("own_searchers.deeper:Mine", "no module 'own_searchers.deeper'"),
        (":Mine", "must be 'package.module:name'"),
        (".relative:Mine", "must be 'package.module:name'"),
    ],
)
def test_a_place_without_a_class_is_refused_with_the_reason(name, message, rng):
    with pytest.raises(ValueError, match=message):
        registry.make(name, rng)


@pytest.mark.usefixtures("own")
def test_a_library_that_ones_own_module_misses_is_named(rng):
    with pytest.raises(ModuleNotFoundError, match="a_library_that_is_missing"):
        registry.make("needs_more:Mine", rng)


@pytest.mark.usefixtures("own")
def test_it_is_refused_before_it_is_made(rng):
    with pytest.raises(TypeError, match="searcher own_searchers:Empty lacks ask; see"):
        registry.make("own_searchers:Empty", rng)
    for without in ("numpy:ndarray", "builtins:map"):  # which has no signature
        with pytest.raises(TypeError, match=f"searcher {without} lacks ask, tell"):
            registry.make(without, rng)


@pytest.mark.usefixtures("own")
def test_a_class_may_leave_its_methods_to_another(rng):
    assert len(registry.make("own_searchers:Delegates", rng).ask()) == 4


@pytest.mark.usefixtures("own")
def test_a_class_that_is_no_searcher_is_told_what_it_lacks(rng):
    with pytest.raises(TypeError, match="lacks tell, recommend; see"):
        registry.make("own_searchers:Half", rng)
