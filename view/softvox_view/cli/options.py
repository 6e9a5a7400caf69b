"""Options that several commands have."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path


def add_results(parser: ArgumentParser, what_for: str) -> None:
    """Add --results, folders that `softvox compare` has written."""
    parser.add_argument(
        "--results",
        type=Path,
        action="append",
        default=[],
        metavar="DIR",
        help=f"a folder of softvox compare, {what_for}; may be given several times",
    )
