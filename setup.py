"""What pyproject.toml cannot say: how the engine is built, and where the README's links lead."""

import re
from pathlib import Path

from setuptools import setup

HOME = "https://github.com/softvox-gym/softvox-gym"

# A registry shows the README alone, so that its relative links lead into the repository there.
readme = Path("README.md").read_text(encoding="utf-8")
readme = re.sub(r'(!\[[^]]*\]\(|src=")(?!https:)', rf"\1{HOME}/raw/main/", readme)
readme = re.sub(r"(\]\()(?!https:|#)", rf"\1{HOME}/blob/main/", readme)

setup(
    cffi_modules=["csrc/binding.py:builder"],
    long_description=readme,
    long_description_content_type="text/markdown",
)
