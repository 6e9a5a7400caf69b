"""Evaluations split into chunks for the workers of a cluster, and merged again."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from math import ceil
from typing import Any

import numpy as np
from numpy.typing import NDArray

from softvox_gym.noise import Jakobi
from softvox_gym.realities import Reality
from softvox_gym.simulation import Frames, Result

#: Voxels times steps of a chunk, which takes a second or two; splitting and sending take a few
#: hundredths of that (benchmarks/cluster.csv).
CHUNK_WORK = 1e8

#: Most chunks of one evaluation; with more, many workers would wait for the scheduler.
MOST_CHUNKS = 4000

#: `softvox_gym.evaluate`, which is in a layer above this module, and its result.
Evaluate = Callable[..., Any]
Evaluation = Any


def evaluate_on(
    client: Any,
    evaluate: Evaluate,
    stack: NDArray[np.uint8],
    generators: Sequence[np.random.Generator],
    *,
    reality: Reality,
    trials: int,
    threads: int | None,
    **options: Any,
) -> Evaluation:
    """Evaluate on a cluster; `softvox_gym.evaluate` has checked the arguments.

    There is a generator per design, or none if nothing is drawn. Their final states are those after
    a local evaluation.

    Parameters
    ----------
    client : object
        An object with `submit(function, *arguments, pure=False)`, which returns a future, and
        `gather`, which returns the results of a list of futures; such as `distributed.Client`.

    Raises
    ------
    TypeError, ValueError
        If the client lacks a method, or designs share a generator, so could not draw in turn.
    RuntimeError
        If a worker's engine gives other bits than this process's.
    """
    if not all(callable(getattr(client, name, None)) for name in ("submit", "gather")):
        raise TypeError(
            f"client must have submit and gather, like distributed.Client, got {client!r}"
        )
    if len({id(rng.bit_generator) for rng in generators}) < len(generators):
        raise ValueError("seed must be a different generator for every design if client is given")
    options |= {"physics": reality, "trials": trials, "threads": threads or 1}
    order, chunks = _chunks(stack, reality, trials if generators else 1)
    futures = [
        client.submit(
            _evaluated,
            evaluate,
            _probe(evaluate),
            stack[own],
            [generators[i] for i in own if generators],
            options,
            pure=False,
        )
        for own in chunks
    ]
    parts = client.gather(futures)
    for own, (_, states) in zip(chunks, parts, strict=True):
        for i, state in zip(own, states, strict=False):
            generators[i].bit_generator.state = state
    return _joined([evaluation for evaluation, _ in parts], np.argsort(order), stack)


def _chunks(
    stack: NDArray[np.uint8], reality: Reality, trials: int
) -> tuple[NDArray[np.int64], list[NDArray[np.int64]]]:
    """Return an order of the designs, and that order split into chunks of equal work.

    Designs with the same body plan are together, because the engine simulates them together.
    """
    physics = reality.of_parts(reality.physics)
    voxels = np.maximum(np.count_nonzero(stack, axis=(1, 2, 3)), 1) * reality.resolution**3
    work = voxels * trials * (float(physics.duration) / float(physics.time_step))
    plans = np.packbits(stack.reshape(len(stack), -1) > 0, axis=1)
    order = np.lexsort(plans.T[::-1])
    done = np.cumsum(work[order])
    count = min(ceil(done[-1] / CHUNK_WORK), MOST_CHUNKS)
    cuts = np.searchsorted(done, done[-1] * np.arange(1, count) / count)
    return order, [chunk for chunk in np.split(order, cuts) if len(chunk)]


@cache
def _probe(evaluate: Evaluate) -> bytes:
    """Return the bits of some designs under noise, from this process's engine and NumPy."""
    tried = evaluate(np.arange(40, 3**8, 410), perturbations=[Jakobi(2.0)], seed=0, threads=1)
    return np.asarray(tried.displacement).tobytes()


def _evaluated(
    evaluate: Evaluate,
    probe: bytes,
    stack: NDArray[np.uint8],
    generators: list[np.random.Generator],
    options: dict[str, Any],
) -> tuple[Evaluation, list[Any]]:
    """Evaluate a chunk on a worker; also return the states of the generators."""
    if _probe(evaluate) != probe:
        raise RuntimeError(
            "a worker's engine, or its NumPy, gives other bits than the client's; install the same "
            "versions on both"
        )
    evaluation = evaluate(stack, seed=generators or None, **options)
    return evaluation, [rng.bit_generator.state for rng in generators]


def _joined(
    parts: Sequence[Evaluation], places: NDArray[np.int64], stack: NDArray[np.uint8]
) -> Evaluation:
    """Return parts as one evaluation; places has the index of each design in the joined parts."""
    columns = _columns(parts, ("fitness", "displacement", "track", "steps", "energy"), places)
    results = [part.result for part in parts if part.result is not None]
    k = sum(map(len, results)) // len(stack)
    rows = (places[:, np.newaxis] * k + np.arange(k)).ravel()
    result = _result(results, rows).of(np.repeat(stack, k, axis=0), parts[0].lattice)
    return replace(parts[0], designs=stack, result=result, **columns)


def _result(parts: Sequence[Result], rows: NDArray[np.int64]) -> Result:
    """Return the simulations as one, with rows in another order."""
    columns = _columns(
        parts, ("designs", "diverged", "displacement", "start", "end", "steps", "energy"), rows
    )
    own: Any = {
        name: np.concatenate([part.physics.per_design[name] for part in parts])[rows]
        for name in parts[0].physics.per_design
    }
    physics = replace(parts[0].physics, **own)
    track = _padded([part.track for part in parts])[rows]
    stays = ~columns["designs"].any(axis=(1, 2, 3)) & ~columns["diverged"]
    track[stays] = 0.0  # also past the end of a shorter part
    frames = [part.frames for part in parts if part.frames is not None]
    made = None
    if frames:
        step = max((one.step for one in frames), key=len)
        time_step = np.broadcast_to(physics.time_step, len(rows))
        made = Frames(
            step=step,
            time=np.multiply.outer(time_step, step),
            **{
                name: _padded([getattr(one, name) for one in frames])[rows]
                for name in ("position", "quaternion", "edge")
            },
        )
    return Result(physics=physics, track=track, frames=made, **columns)


def _columns(parts: Sequence[Any], names: Sequence[str], rows: NDArray[np.int64]) -> Any:
    """Return the named arrays of all parts, joined and reordered, except those that are None."""
    return {
        name: np.concatenate([getattr(part, name) for part in parts])[rows]
        for name in names
        if getattr(parts[0], name) is not None
    }


def _padded(parts: Sequence[Any]) -> Any:
    """Return arrays of shape (n, k, ...) joined, padded with NaN to the largest k."""
    longest = max(part.shape[1] for part in parts)
    return np.concatenate(
        [
            np.pad(
                part,
                [(0, 0), (0, longest - part.shape[1])] + [(0, 0)] * (part.ndim - 2),
                constant_values=np.nan,
            )
            for part in parts
        ]
    )
