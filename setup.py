"""Settings that pyproject.toml cannot express: the engine's build, and the README's links."""

import re
from pathlib import Path

from setuptools import setup

HOME = "https://github.com/softvox-gym/softvox-gym"

# A registry shows the README alone, so its relative links must lead to the repository.
readme = Path("README.md").read_text(encoding="utf-8")
readme = re.sub(r'(!\[[^]]*\]\(|src=")(?!https:)', rf"\1{HOME}/raw/main/", readme)
readme = re.sub(r"(\]\()(?!https:|#)", rf"\1{HOME}/blob/main/", readme)

setup(
    cffi_modules=["csrc/binding.py:builder"],
    long_description=readme,
    long_description_content_type="text/markdown",
)
