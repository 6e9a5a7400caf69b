"""Compare the engine's seatings, instruction sets and pauses on random batches.

    python tools/fuzz.py [--count 20000] [--seed 0] [--isa NAME]

Every batch has a random lattice, designs from sparse to full, a physics from tame to wild, and
perhaps phases and strain cycle by cycle. It is simulated with a design per lane, with one body
across the lanes, as the planner chooses, and in pieces that are saved and restored on another
seating. All must give the same bits, also in tracks, frames and statuses. The pump's work is
compared too, except in pieces, which can't measure it. All NaNs count as equal.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from dataclasses import replace
from typing import Any

import numpy as np

from softvox_gym import Physics, engine
from softvox_gym.simulation import prepared

STEPS = 250


def random_batch(rng: np.random.Generator) -> engine.Batch:
    """Draw designs, a physics and an actuation."""
    shape = tuple(rng.integers(1, 6, 3)) if rng.random() < 0.9 else tuple(rng.integers(1, 11, 3))
    n = int(rng.integers(1, 12)) if np.prod(shape) < 100 else int(rng.integers(1, 4))
    filled = rng.choice([0.2, 0.5, 0.67, 0.9, 1.0])
    designs = np.where(rng.random((n, *shape)) < filled, rng.integers(1, 3, (n, *shape)), 0)
    if rng.random() < 0.3:  # copies, as under noise
        designs[:] = designs[0]
    each: Any = n if rng.random() < 0.4 else None
    wild = rng.random() < 0.3

    def between(low: float, high: float) -> Any:
        return np.exp(rng.uniform(np.log(low), np.log(high), each))

    physics = replace(
        Physics.published(),
        youngs_modulus=between(1e3, 1e8) if wild else between(3e6, 3e7),
        density=between(1e5, 1e7),
        poisson_ratio=rng.uniform(-0.2, 0.5),
        friction_static=rng.uniform(0, 2),
        friction_kinetic=rng.uniform(0, 1),
        shear_strength=float(rng.choice([0, 3000])),
        gravity=rng.normal([0, 0, -9.81], 2, 3) if rng.random() < 0.5 else 0.0,
        damping_global=rng.uniform(0, 0.02),
        damping_link=between(0.01, 1),
        damping_ground=rng.uniform(0, 1.5),
        strain=rng.uniform(0, 3) if wild else rng.uniform(0, 0.5),
        settle_time=0.0,
        frequency_hz=1e-6,  # replaced when the step is known
        time_step_fraction=rng.uniform(0.3, 0.9),
    )
    step = np.asarray(physics.time_step)
    physics = replace(
        physics,
        settle_time=float(np.min(step)) * rng.integers(0, STEPS // 2),
        frequency_hz=rng.uniform(0.5, 6) / (STEPS * step),
        duration=STEPS * step,
    )
    most = np.max(np.asarray(physics.strain))
    kinds = ["hold", "clamp", *(["expand_and_contract"] if most < 0.9 else [])]
    physics = replace(physics, actuation=str(rng.choice(kinds)))
    phase = rng.choice(rng.uniform(0, 1, rng.integers(1, 20)), designs.shape)
    strain = rng.uniform(0, 0.5, (n, rng.integers(1, 4), *shape))
    batch = prepared(
        designs,
        physics,
        strain if rng.random() < 0.4 else None,
        phase if rng.random() < 0.5 else None,
        track=int(rng.integers(0, 4)),
        frames=int(rng.choice([0, 20])),
    )[2]
    batch = replace(batch, energy=True)
    if rng.random() < 0.2:  # beyond Physics' bounds: one diverges among others that do not
        batch.parameters["damping_link"][rng.integers(n)] = rng.uniform(1, 8)
        batch.strain[rng.integers(n)] = rng.choice([5.0, 1e3, np.nan])
    return batch


def differing(output: engine.Output, expected: engine.Output) -> list[str]:
    """Return the names of the arrays that differ in a bit, NaN equal to NaN."""
    names = []
    for name, theirs in vars(expected).items():
        ours = getattr(output, name)
        if theirs.dtype.kind == "f":
            ours, theirs = (np.where(np.isnan(values), np.nan, values) for values in (ours, theirs))
        if ours.tobytes() != theirs.tobytes():
            names.append(name)
    return names


def in_pieces(batch: engine.Batch, rng: np.random.Generator, isa: str) -> engine.Output:
    """Simulate in pieces, each restored from the state saved by the last, on a random seating."""
    kept: dict[str, Any] | None = None
    output: engine.Output | None = None
    while True:
        seating = str(rng.choice(["by_time", "all_apart", "all_across"]))
        paused = engine.PausedRun(batch, threads=1, isa=isa, seating=seating)
        if kept is not None and output is not None:
            for name, values in vars(output).items():
                getattr(paused.output, name)[:] = values
            paused.resume(kept)
        paused.advance(None, int(rng.integers(1, STEPS)))
        kept, output = paused.state(*engine.STATE), paused.output
        if not np.any(kept["clock"][:, 4] == 0):
            return output


def main() -> int:
    """Draw and compare batches; return 1 if anything differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=20_000, help="random batches (20000)")
    parser.add_argument("--seed", type=int, default=0, help="of the first batch (0)")
    parser.add_argument("--isa", choices=engine.isa_names(), help="one for all; else at random")
    options = parser.parse_args()
    warnings.simplefilter("ignore")
    diverged = designs = 0
    for seed in range(options.seed, options.seed + options.count):
        rng = np.random.default_rng(seed)
        batch = random_batch(rng)
        isa = options.isa or str(rng.choice(engine.isa_names()))
        expected = engine.run(batch, threads=1, isa="portable", seating="all_apart")
        diverged += int(np.count_nonzero(expected.status))
        designs += len(expected.status)
        outputs = {
            seating: engine.run(batch, threads=1, isa=isa, seating=seating)
            for seating in ("all_apart", "all_across", "by_time")
        }
        pieces = in_pieces(replace(batch, energy=False), rng, isa)
        outputs["in_pieces"] = replace(pieces, energy=expected.energy)
        for how, output in outputs.items():
            if names := differing(output, expected):
                print(f"seed {seed}, {isa}, {how}: {', '.join(names)} differ", file=sys.stderr)
                return 1
    print(f"{options.count} batches of {designs} designs, {diverged} diverged: the same bits")
    return 0


if __name__ == "__main__":
    sys.exit(main())
