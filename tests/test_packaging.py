"""What pyproject.toml says of the package agrees with itself."""

import re
import tomllib
from importlib.metadata import metadata
from pathlib import Path

PROJECT = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text())["project"]
EXTRAS = PROJECT["optional-dependencies"]

#: Extras of those who work on the package.
OWN = {"browser-test", "docs", "lint", "package", "test", "wasm"}


def test_the_extra_all_holds_all_that_a_user_may_want():
    (held,) = (re.fullmatch(r"softvox-gym\[(.*)\]", name)[1] for name in EXTRAS["all"])
    assert sorted(held.split(",")) == sorted(set(EXTRAS) - OWN - {"all"})


def test_the_classifiers_begin_with_the_lowest_python():
    prefix = "Programming Language :: Python :: 3."
    versions = [
        int(name.removeprefix(prefix))
        for name in PROJECT["classifiers"]
        if re.fullmatch(rf"{re.escape(prefix)}\d+", name)
    ]
    assert PROJECT["requires-python"] == f">=3.{versions[0]}"
    assert versions == list(range(versions[0], versions[-1] + 1))


def test_the_recipe_for_conda_asks_for_what_the_package_does():
    recipe = (Path(__file__).parent.parent / "recipe" / "meta.yaml").read_text(encoding="utf-8")
    run = re.search(r"  run:\n((?:    - .*\n)+)", recipe)[1]
    asked = [line.removeprefix("    - ").replace(" ", "") for line in run.splitlines()]
    assert sorted(asked) == sorted(
        [f"python{PROJECT['requires-python']}", *PROJECT["dependencies"]]
    )
    assert f"home: {PROJECT['urls']['Homepage']}\n" in recipe


def test_the_description_that_ships_has_links_that_hold_anywhere():
    links = re.findall(r'(?:\]\(|src=")([^)"]+)', metadata("softvox-gym")["Description"])
    assert any(link.endswith(".gif") for link in links)
    assert [link for link in links if not link.startswith(("https://", "#"))] == []
