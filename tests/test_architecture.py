"""Data flows one way: the engine, softvox_gym, softvox_search, softvox_view."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import softvox_gym
import softvox_search
import softvox_view

#: A package imports those before it only.
PACKAGES = (softvox_gym, softvox_search, softvox_view)
NAMES = [package.__name__ for package in PACKAGES]
MODULES = [
    (package.__name__, path)
    for package in PACKAGES
    for path in sorted(Path(package.__file__).parent.rglob("*.py"))
]


def imported_by(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            yield node.module or ""
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


@pytest.mark.parametrize("package", NAMES)
def test_a_package_imports_only_those_before_it(package):
    later = NAMES[NAMES.index(package) + 1 :]
    for path in (path for name, path in MODULES if name == package):
        for name in imported_by(path):
            assert name.split(".")[0] not in later, f"{path} imports {name}"


def test_the_page_shows_the_components_as_they_are():
    """Fails too where components of a package import each other in a circle."""
    tool = Path(__file__).parents[1] / "tools" / "architecture.py"
    done = subprocess.run([sys.executable, tool, "--check"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr or "draw it anew: python tools/architecture.py"


@pytest.mark.parametrize("module", ["softvox_gym", "softvox_gym.cli", "softvox_search"])
def test_importing_the_package_loads_no_heavy_library(module):
    code = f"import sys, {module}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert not loaded & {"deap", "pandas", "matplotlib", "torch", "jax", "scipy", "ribs", "pyarrow"}


def test_the_citation_names_the_packages_version():
    citation = Path(__file__).parent.parent / "CITATION.cff"
    assert f"\nversion: {softvox_gym.__version__}\n" in citation.read_text(encoding="utf-8")
