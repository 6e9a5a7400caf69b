"""The README's example of one's own optimiser, run as a new user would."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from cli_process import softvox

README = Path(__file__).parents[2] / "README.md"


def python_blocks():
    return re.findall(r"^```python\n(.*?)^```", README.read_text(encoding="utf-8"), re.M | re.S)


@pytest.fixture
def folder(tmp_path):
    (mine,) = (block for block in python_blocks() if "class Mutants" in block)
    (tmp_path / "mine.py").write_text(mine, encoding="utf-8")
    return tmp_path


def test_ones_own_optimisers_take_a_dozen_lines(folder):
    lines = (folder / "mine.py").read_text(encoding="utf-8").splitlines()
    code = [line for line in lines if line.strip() and not line.strip().startswith('"""')]
    assert len(code) <= 12


@pytest.mark.parametrize("name", ["Mutants", "anneal"])
def test_ones_own_optimiser_runs(name, folder):
    done = softvox("search", "--searcher", f"mine:{name}", "--budget", "300", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "regret" in done.stdout
    assert list(folder.glob("*.png"))


@pytest.mark.parametrize("name", ["Mutants", "anneal"])
def test_ones_own_optimiser_can_be_trusted(name, folder):
    code = "import mine, softvox_search; softvox_search.check(mine.Mutants)"
    assert code in README.read_text(encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-c", code.replace("Mutants", name)],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr


def test_ones_own_optimisers_are_compared(folder):
    (folder / "mine.toml").write_text(
        'seeds = 2\nentropy = 1\n[budget]\nunique = 100\n[[searchers]]\nname = "mine:Mutants"\n'
        '[[searchers]]\nname = "mine:anneal"\n'
    )
    done = softvox("compare", "mine.toml", "--no-report", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "4 of 4 runs done" in done.stdout


def test_the_other_examples_run(tmp_path):
    others = [block for block in python_blocks() if "class Mutants" not in block]
    assert len(others) >= 3
    script = tmp_path / "readme.py"
    script.write_text("\n".join(others), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, script],
        cwd=tmp_path,
        env={**os.environ, "PYTHONWARNINGS": "error"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "[4.66 4.65]" in done.stdout
