"""However the engine is built, it gives the same bits and leaves the user's process alone."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent

#: Imports softvox_gym over the engine that the first argument names.
CHECK = """
import importlib.util, sys
spec = importlib.util.spec_from_file_location("softvox_gym._engine", sys.argv[1])
sys.modules[spec.name] = module = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
import numpy as np
from softvox_gym import simulate, verify
from softvox_gym.manifest import digest
assert float("1e-310") * float("0.5") > 0, "subnormal numbers are flushed to zero"
assert digest(simulate(np.arange(6561)).displacement) == verify.GOLDEN
"""


def test_fast_math_in_cflags_changes_neither_the_bits_nor_the_arithmetic_of_the_process(tmp_path):
    command = [sys.executable, "setup.py", "-q", "build_ext"]
    folders = ["--build-lib", str(tmp_path / "lib"), "--build-temp", str(tmp_path / "temp")]
    flags = {"CFLAGS": "-Ofast -ffast-math -funsafe-math-optimizations"}
    subprocess.run([*command, *folders], cwd=ROOT, env={**os.environ, **flags}, check=True)
    (engine,) = (tmp_path / "lib" / "softvox_gym").glob("_engine*")
    subprocess.run([sys.executable, "-c", CHECK, str(engine)], check=True)
