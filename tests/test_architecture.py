"""Data flows one way: a module imports only those before it."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import softvox_gym

FOLDER = Path(softvox_gym.__file__).parent

#: Floors from the engine up. Modules of one floor may import those of lower floors only.
FLOORS = [
    {"_engine"},
    {"engine", "design", "physics", "rendering", "files", "progress", "aggregates", "portable"},
    {"replay"},
    {"simulation", "conditions"},
    {"outcome", "noise"},
    {"table"},
    {"bench"},
    {"env"},
    {"vector_env"},
    {"wrappers"},
    {"noisy"},
    {"__init__"},
    {"manifest"},
    {"exhaustive", "verify", "analysis"},
    {"cli"},
    {"__main__"},
]


def module_of(path):
    return path.relative_to(FOLDER).with_suffix("").parts[0]


def imported_by(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("softvox_gym"):
            inner = (node.module or "").split(".")[1:2]
            yield from inner or [alias.name for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name.split(".") for alias in node.names]
            yield from (name[1] for name in names if name[0] == "softvox_gym" and len(name) > 1)


def floor_of(module):
    # A name that is no module is one that the package itself exports.
    return next(
        (i for i, floor in enumerate(FLOORS) if module in floor),
        next(i for i, floor in enumerate(FLOORS) if "__init__" in floor),
    )


@pytest.mark.parametrize("path", sorted(FOLDER.rglob("*.py")), ids=lambda path: path.stem)
def test_a_module_imports_only_lower_floors(path):
    module = module_of(path)
    assert any(module in floor for floor in FLOORS), f"{module} stands on no floor"
    for other in imported_by(path):
        assert other == module or floor_of(other) < floor_of(module), f"{module} imports {other}"


@pytest.mark.parametrize("path", sorted(FOLDER.rglob("*.py")), ids=lambda path: path.stem)
def test_the_simulator_knows_nothing_of_searches_and_views(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = []
        if isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        packages = {name.split(".")[0] for name in names}
        assert not packages & {"softvox_search", "softvox_view"}


@pytest.mark.parametrize("module", ["softvox_gym", "softvox_gym.cli", "softvox_search"])
def test_importing_the_package_loads_no_heavy_library(module):
    code = f"import sys, {module}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name.split(".")[0] for name in done.stdout.split()}
    assert not loaded & {"deap", "pandas", "matplotlib", "torch", "jax", "scipy", "ribs", "pyarrow"}


def test_the_citation_names_the_packages_version():
    citation = Path(__file__).parent.parent / "CITATION.cff"
    assert f"\nversion: {softvox_gym.__version__}\n" in citation.read_text(encoding="utf-8")
