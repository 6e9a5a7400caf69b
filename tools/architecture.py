"""Draw the layers of the packages, docs/architecture.svg, from the imports of their modules.

Usage: python tools/architecture.py [--check]

A component is a module, or a folder of modules, of one of the packages. It is one layer above the
highest component of its package that it imports. With --check nothing is written; the exit status
is 1 if the committed picture does not match the imports.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PICTURE = ROOT / "docs" / "architecture.svg"

#: Every package with its folder and colour, from the bottom up.
PACKAGES = {
    "softvox_gym": ("src", "#cfe3f5"),
    "softvox_search": ("search", "#d5efd8"),
    "softvox_view": ("view", "#f6e3c9"),
}

#: Sizes in pixels, and the boxes in a row.
WIDTH, HEIGHT, GAP, PER_ROW = 132, 26, 8, 6


def components(package: str) -> dict[str, list[Path]]:
    """Return the modules of every component of a package, by the component's name."""
    folder = ROOT / PACKAGES[package][0] / package
    found: dict[str, list[Path]] = {}
    for path in sorted(folder.rglob("*.py")):
        first = path.relative_to(folder).parts[0]
        found.setdefault(first.removesuffix(".py"), []).append(path)
    return found


def imports(path: Path) -> Iterator[tuple[str, str]]:
    """Yield the components that a module imports, each with its package."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            names = [node.module or ""]
            if node.module in PACKAGES:  # a component, or what __init__ exports
                names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        for name in names:
            package, _, rest = name.partition(".")
            if package in PACKAGES:
                component = rest.partition(".")[0]
                yield package, component if component in components_of(package) else "__init__"


@cache
def components_of(package: str) -> frozenset[str]:
    """Return the names of a package's components."""
    return frozenset(
        [*components(package), "_engine"] if package == "softvox_gym" else components(package)
    )


def layers(package: str) -> list[list[str]]:
    """Return the components of a package layer by layer, from the bottom.

    Raises
    ------
    ValueError
        If components import each other in a circle; the message names them.
    """
    needs = {
        component: {
            other
            for path in paths
            for owner, other in imports(path)
            if owner == package and other not in (component, "_engine")
        }
        for component, paths in components(package).items()
    }
    built: list[list[str]] = []
    left = dict(needs)
    while left:
        done = {component for layer in built for component in layer}
        ready = sorted(component for component, others in left.items() if others <= done)
        if not ready:
            raise ValueError(f"{package}: these import each other: {', '.join(sorted(left))}")
        built.append(ready)
        for component in ready:
            del left[component]
    return built


def drawn() -> str:
    """Return the picture as SVG."""
    rows: list[tuple[str, str, list[str]]] = []
    for package in reversed(PACKAGES):
        for layer in reversed(layers(package)):
            for begin in range(0, len(layer), PER_ROW):
                rows.append((package, PACKAGES[package][1], layer[begin : begin + PER_ROW]))
    rows.append(("csrc", "#e3dcef", ["engine", "batching", "body", "isa", "kernel"]))
    step = HEIGHT + GAP
    width, height = 120 + PER_ROW * (WIDTH + GAP), step * len(rows) + GAP
    shapes = []
    before = ""
    for i, (package, colour, names) in enumerate(rows):
        y = GAP + i * step
        if package != before:
            shapes.append(f'<text x="{GAP}" y="{y + 17}" font-weight="bold">{package}</text>')
            if before:
                shapes.append(f'<path d="M0 {y - 4}H{width}" stroke="#999"/>')
        before = package
        for k, name in enumerate(names):
            x = 120 + k * (WIDTH + GAP)
            shapes.append(
                f'<rect x="{x}" y="{y}" width="{WIDTH}" height="{HEIGHT}" rx="4" fill="{colour}" '
                f'stroke="#555"/><text x="{x + WIDTH // 2}" y="{y + 17}" '
                f'text-anchor="middle">{name.strip("_")}</text>'
            )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" '
        'font-family="sans-serif" font-size="12">\n'
        f'<rect width="{width}" height="{height}" fill="white"/>\n'
        + "\n".join(shapes)
        + "\n</svg>\n"
    )


def main() -> int:
    """Write the picture, or compare the committed one with the imports."""
    if "--check" in sys.argv[1:]:
        return int(not PICTURE.exists() or PICTURE.read_text(encoding="utf-8") != drawn())
    PICTURE.write_text(drawn(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
