"""How fast the engine moves one robot and many, beside the engine of commit 7a6b028.

    python benchmarks/bodies.py [--repeat 5] [--only CASE] [--append]

builds that engine from the git history, and runs both by turns, each in a process of its own, on
one thread: the same designs, physics and steps, and the same bits of the result, or it stops. A row
has the processor seconds of both, their ratio within one turn, and the target, which is one for
AVX-512 (SOFTVOX_ISA chooses an instruction set). Robots of 20x20x20 and more also tell the memory
that they take. --append adds the rows to benchmarks/bodies.csv, and writes benchmarks/growth.csv,
the cost of a voxel-step by the size of the robot, and docs/growth.png anew. It is never a test: a
missed target is told, and nothing more.

Robots have every site filled ("full", digits 1 and 2 in equal shares) or two thirds of them
("random", digits 0, 1 and 2 in equal shares), shuffled by a fixed seed, under published physics.
From 10x10x10 on the run is shorter, and without settling: robots are pumped from its first step, so
that they move, and lists of candidates for contacts are made anew; half a cycle costs as much per
step as a whole run does.
"""

from __future__ import annotations

import argparse
import csv
import io
import itertools
import os
import pickle
import subprocess
import sys
import tarfile
import tempfile
import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from engine import append, provenance, rounded
from numpy.typing import NDArray

from softvox_gym import Lattice, engine
from softvox_gym.files import write_file

HERE = Path(__file__).resolve().parent
ROWS, GROWTH, PICTURE = HERE / "bodies.csv", HERE / "growth.csv", HERE.parent / "docs/growth.png"
OLD = "7a6b028"
OLD_NEEDS = ("csrc", "src", "search", "view", "setup.py", "setup.cfg", "pyproject.toml")
FEWEST, ENOUGH_SECONDS = 3, 6.0  # turns; where a case takes longer, no more than these

#: Voxel-steps per processor second of the authors' engine, on 2x2x2 robots (README, Limits).
AUTHORS = 2.0e6

#: Seconds of the pumped runs of large robots, by the side of the lattice.
PUMPED = {10: 0.5, 14: 0.25, 20: 0.125, 28: 0.125, 40: 0.125}
SIDES = (2, 3, 4, 6, *PUMPED)
OLD_SIDES = SIDES[:7]  # beyond them the old engine takes minutes, then more memory than there is
MEMORY_SIDES = SIDES[6:]

#: What AVX-512 should reach: a ratio of at least, or seconds of at most.
TARGETS = {
    "6453": 2.2,
    "2x2x2 full": 3.0,
    "6x6x6 full": 5.0,
    "10x10x10 full": 9.0,
    "20x20x20 full": 30.0,
    "20x20x20 random": 12.0,
    "8 of 20x20x20 random": 25.0,
    "256 designs": 0.97,  # not slower, but for noise
    "landscape": 0.97,
}
MOST_SECONDS = {"gym.make and step, 6453": 3.5e-3}
MOST_BYTES = 1000  # per voxel of the largest

COLUMNS = ("case", "voxels", "old_s", "new_s", "ratio", "target", "voxel_steps_per_s")
#: The columns that are printed, in what units, under what heads.
SHOWN = (
    ("old_s", 1e3, "ms", "old"),
    ("new_s", 1e3, "ms", "new"),
    ("ratio", 1, "x", "ratio"),
    ("voxel_steps_per_s", 1e-6, "M/s", "voxel-steps"),
)


@dataclass(frozen=True, kw_only=True)
class Case:
    """Work for both engines, or for the new one alone: a function of worker.py, its arguments."""

    name: str
    what: str = "simulating"
    work: dict[str, Any]
    times: int = 1
    voxels: int = 0
    has_old: bool = True
    #: Of a point of the growth: the side of the lattice, full or random, and how many designs.
    growth: tuple[int, str, int] | None = None


def robots(side: int, filling: str, count: int = 1) -> NDArray[np.uint8]:
    """Return designs by a fixed seed, shape (count, side, side, side)."""
    rng, sites = np.random.default_rng(0), np.arange(side**3)
    kinds = sites % 3 if filling == "random" else 1 + sites % 2
    rows = [rng.permuted(kinds) for _ in range(count)]
    return np.array(rows, np.uint8).reshape(count, side, side, side)


def simulation(name: str, designs: NDArray[np.uint8], **more: Any) -> Case:
    """Return the case of simulating some designs under published physics, with changes."""
    work = {
        "designs": designs,
        "physics": more.pop("physics", {}),
        "phase": more.pop("phase", None),
    }
    return Case(name=name, work=work, voxels=int(np.count_nonzero(designs)), **more)


def bodies() -> Iterator[Case]:
    """Yield robots of all sizes, alone, and the smaller ones by eight too: the growth."""
    for side in SIDES:
        physics = {"settle_time": 0.0, "duration": PUMPED[side]} if side in PUMPED else {}
        for count in (1, 8) if side <= 10 else (1,):
            for filling in ("full", "random"):
                yield simulation(
                    f"{'8 of ' if count > 1 else ''}{side}x{side}x{side} {filling}",
                    robots(side, filling, count),
                    physics=physics,
                    times=max(1, 160 // side**3),
                    has_old=side in OLD_SIDES,
                    growth=(side, filling, count),
                )


def cases() -> list[Case]:
    """Return all cases."""
    lattice = Lattice()
    best, everything = (
        lattice.to_stack(lattice.digits(numbers)) for numbers in (np.array([6453]), np.arange(3**8))
    )
    rng = np.random.default_rng(0)
    batch = rng.integers(0, 3, (256, 2, 2, 2)).astype(np.uint8)
    phase = rng.integers(0, 2, batch.shape) / 2
    brief = {"settle_time": 0.0, "duration": 0.02}
    action = lattice.to_rows(best)[0].tolist()
    return [
        simulation("6453", best, times=20),
        *bodies(),
        simulation("8 of 20x20x20 random", robots(20, "random", 8), physics=brief),
        simulation("256 designs", batch),
        simulation("256 designs, phases 0 and 1/2", batch, phase=phase),
        simulation("landscape", everything),
        Case(name="gym.make", what="making", work={}, times=50),
        Case(name="gym.make and step, 6453", what="stepping", work={"action": action}, times=20),
    ]


class Worker:
    """An engine that answers from a process of its own."""

    def __init__(self, name: str, path: Path | None = None) -> None:
        search = {"PYTHONPATH": str(path)} if path else {}
        self.name = name
        self.process = subprocess.Popen(
            [sys.executable, HERE / "worker.py"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, **search},
        )
        file = Path(self._answer())
        if path and path not in file.parents:
            sys.exit(f"the {name} engine should come from {path}, but Python finds {file}")

    def __enter__(self) -> Worker:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.communicate()

    def ask(self, how: str, case: Case, **more: int) -> dict[str, Any]:
        """Return a case timed or remembered; raise MemoryError where it does not fit."""
        assert self.process.stdin
        pickle.dump((how, case.what, case.work, more), self.process.stdin)
        self.process.stdin.flush()
        answer: dict[str, Any] | Exception = self._answer()
        if isinstance(answer, MemoryError):
            raise answer
        if isinstance(answer, Exception):
            sys.exit(f"the {self.name} engine failed: {type(answer).__name__}: {answer}")
        return answer

    def _answer(self) -> Any:
        assert self.process.stdout
        try:
            return pickle.load(self.process.stdout)
        except EOFError:
            sys.exit(f"the {self.name} engine's process ended with code {self.process.wait()}")


def output(command: list[str], *, folder: Path, otherwise: str) -> bytes:
    """Return what a command prints, or leave with its last words."""
    try:
        return subprocess.run(command, cwd=folder, capture_output=True, check=True).stdout
    except FileNotFoundError:
        sys.exit(f"{otherwise}: there is no {command[0]}")
    except subprocess.CalledProcessError as error:
        words = error.stderr.decode(errors="replace").strip().splitlines()[-5:]
        sys.exit("\n".join([f"{otherwise}:", *words]))


def old_engine(folder: Path) -> Path:
    """Build the old engine in a folder, and return where Python finds it."""
    files = output(
        ["git", "archive", "--format=tar", OLD, *OLD_NEEDS],
        folder=HERE.parent,
        otherwise=f"the engine of commit {OLD} comes from the git history, with git",
    )
    with tarfile.open(fileobj=io.BytesIO(files)) as archive:
        archive.extractall(folder, filter="data")
    build = [sys.executable, "setup.py", "--quiet", "build_ext", "--inplace"]
    output(build, folder=folder, otherwise=f"the engine of commit {OLD} can't be built")
    return folder / "src"


def measure(case: Case, new: Worker, old: Worker, repeat: int) -> dict[str, Any]:
    """Return a row: what both engines take, medians over the turns, the ratio within one."""
    news: list[float] = []
    olds: list[float] = []
    end = time.monotonic() + ENOUGH_SECONDS
    while len(news) < repeat and (len(news) < FEWEST or time.monotonic() < end):
        before = old.ask("timed", case, times=case.times) if case.has_old else None
        answer = new.ask("timed", case, times=case.times)
        if before and before["bits"] != answer["bits"]:
            sys.exit(f"{case.name}: the results of the two engines differ in their bits")
        olds += [before["cpu"]] if before else []
        news.append(answer["cpu"])
    row: dict[str, Any] = {**dict.fromkeys(COLUMNS, ""), "case": case.name, "new_s": median(news)}
    if olds:
        row |= {"old_s": median(olds), "ratio": median(np.divide(olds, news).tolist())}
    if case.voxels:
        present = np.count_nonzero(case.work["designs"], axis=(1, 2, 3))
        voxel_steps = int((present * answer["steps"]).sum())
        row |= {"voxels": case.voxels, "voxel_steps_per_s": voxel_steps / row["new_s"]}
    if case.name in TARGETS:
        row["target"] = f"ratio >= {TARGETS[case.name]}"
    if case.name in MOST_SECONDS:
        row["target"] = f"new_s <= {MOST_SECONDS[case.name]}"
    return row


def show(row: dict[str, Any], isa: str) -> None:
    """Print a row; targets are for AVX-512."""
    name, told = row["case"], ""
    for key, factor, unit, _ in SHOWN:
        told += f"{f'{row[key] * factor:,.2f} {unit}' if row[key] else '':>13}"
    if row["target"] and isa == "avx512":
        is_met = (
            row["ratio"] >= TARGETS[name] if name in TARGETS else row["new_s"] <= MOST_SECONDS[name]
        )
        told += f"  {row['target']}: {'met' if is_met else 'MISSED'}"
    print(f"{name:30}{told.rstrip()}", flush=True)


def point(case: Case, row: dict[str, Any]) -> dict[str, Any]:
    """Return a row of the growth: nanoseconds of CPU per voxel-step, and bytes per voxel."""
    assert case.growth
    side, filling, designs = case.growth
    ns = 1e9 / row["voxel_steps_per_s"]
    made: dict[str, Any] = {"side": side, "filling": filling, "designs": designs}
    made |= {"voxels": case.voxels // designs, "new_ns": ns, "old_ns": ""}
    made |= {"asked_bytes": "", "used_bytes": ""}
    if row["old_s"]:
        made["old_ns"] = ns * row["old_s"] / row["new_s"]
    if side in MEMORY_SIDES:
        with Worker("new") as fresh:  # a process remembers the most that it ever held
            memory = fresh.ask("remembered", case)
        made |= {f"{key}_bytes": value / case.voxels for key, value in memory.items()}
        told = f"{made['asked_bytes']:,.0f} bytes a voxel asked for, {made['used_bytes']:,.0f} used"
        if (side, filling) == (SIDES[-1], "full"):
            is_met = made["asked_bytes"] < MOST_BYTES
            told += f"  asked_bytes < {MOST_BYTES}: {'met' if is_met else 'MISSED'}"
        print(f"{'':32}{told}", flush=True)
    return made


def draw(points: list[dict[str, Any]]) -> None:
    """Draw the growth: this engine, the old one dotted, and the authors'."""
    from softvox_search.report import style

    with style.style():
        made = style.figure(7, 4.6)
        axes = made.subplots()
        handles = []
        for i, (designs, filling) in enumerate(itertools.product((1, 8), ("full", "random"))):
            mine = [p for p in points if (p["filling"], int(p["designs"])) == (filling, designs)]
            look: Any = {"color": style.COLOURS[i], "marker": style.MARKERS[i], "markersize": 4}
            for key, dashes in (("new_ns", "-"), ("old_ns", ":")):
                at = [(float(p["voxels"]), float(p[key])) for p in mine if p[key] != ""]
                axes.plot([x for x, _ in at], [y for _, y in at], dashes, **look)
            label = f"{filling}, {'one robot' if designs == 1 else 'eight robots'}"
            handles.append(style.line(label, **look))
        axes.axhline(1e9 / AUTHORS, color=style.INK, linestyle="--")
        handles += [
            style.line(f"the engine of commit {OLD}", color=style.INK, linestyle=":"),
            style.line("the authors' engine", color=style.INK, linestyle="--"),
        ]
        axes.set(xscale="log", yscale="log", xlabel="voxels of a robot")
        axes.set_ylabel("CPU per voxel and step, ns")
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_formatter("{x:,.0f}")
        axes.legend(handles=handles)
        write_file(PICTURE, style.encoded(made), force=True)


def arguments() -> argparse.Namespace:
    """Return the options of the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    about = f"turns, of which the median (5); {FEWEST} at most where a case takes long"
    parser.add_argument("--repeat", type=int, default=5, help=about)
    about = "only cases with this in their names; the growth is not written"
    parser.add_argument("--only", metavar="CASE", default="", help=about)
    about = "add the rows to bodies.csv; write growth.csv and docs/growth.png"
    parser.add_argument("--append", action="store_true", help=about)
    parser.add_argument("--draw", action="store_true", help="only draw growth.csv anew")
    options = parser.parse_args()
    chosen = [case.name for case in cases() if options.only in case.name]
    if options.repeat < 1:
        parser.error("--repeat must be at least 1")
    if not chosen:
        parser.error("no such case; there are: " + "; ".join(case.name for case in cases()))
    return options


def main() -> None:
    """Measure, print, and append where asked."""
    options = arguments()
    if options.draw:
        if not GROWTH.exists():
            sys.exit(f"there is no {GROWTH.name} yet: --append writes it")
        with GROWTH.open(newline="", encoding="utf-8") as file:
            draw(list(csv.DictReader(file)))
        return
    try:
        isa = engine.isa_name()
    except ValueError as error:
        sys.exit(str(error))
    where = provenance(isa)  # before a table that is written makes the checkout dirty
    where = {key: where[key] for key in ("date", "commit", "cpu", "isa")}
    rows, points = [], []
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory())).resolve()
        old = stack.enter_context(Worker("old", old_engine(folder)))
        new = stack.enter_context(Worker("new"))
        print(f"{'CPU, ' + isa:30}" + "".join(f"{head:>13}" for *_, head in SHOWN))
        for case in cases():
            if options.only not in case.name:
                continue
            try:
                rows.append(measure(case, new, old, options.repeat))
                show(rows[-1], isa)
                points += [point(case, rows[-1])] if case.growth else []
            except MemoryError as error:
                print(f"{case.name:30}  skipped, it does not fit: {error}", flush=True)
    if not options.append:
        return
    for row in rows:
        append(ROWS, where | rounded(row))
    if not options.only:
        GROWTH.unlink(missing_ok=True)
        for made in points:
            append(GROWTH, where | rounded(made))
        draw(points)


if __name__ == "__main__":
    main()
