"""The examples in the docstrings of the environments' pages do what they show."""

import doctest
from importlib import import_module

import pytest


@pytest.mark.parametrize(
    ("module", "examples"),
    [
        ("softvox_gym.envs.single", 1),
        ("softvox_gym.trials.trial", 1),
        ("softvox_gym.envs.vector", 1),
        ("softvox_gym.envs.control", 2),
        ("softvox_gym.envs.growth", 2),
        ("softvox_gym.trials.comparison", 1),
        ("softvox_gym.wrappers", 5),
        ("softvox_gym.wrappers.vector", 1),
        ("softvox_gym.trials.track_files", 1),
        ("softvox_search.transfer.next", 1),
        ("softvox_gym.design", 3),
        ("softvox_gym.build.plans", 1),
        ("softvox_gym.build.bills", 1),
    ],
)
def test_the_examples_do_what_they_show(module, examples):
    tests = [test for test in doctest.DocTestFinder().find(import_module(module)) if test.examples]
    assert len(tests) == examples
    assert [doctest.DocTestRunner().run(test).failed for test in tests] == [0] * examples
