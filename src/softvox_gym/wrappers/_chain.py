"""What the wrappers ask of the chain of environments that they are put around."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from softvox_gym.bench import Bench


def bench_of(env: Any, wrapper: str) -> Bench:
    """Return the bench of the environment in a chain's middle.

    Raises
    ------
    TypeError
        Where that is no environment of this package.
    """
    bench = getattr(env.unwrapped, "bench", None)
    if not isinstance(bench, Bench):
        raise TypeError(
            f"{wrapper} works on this package's environments, got {env.unwrapped}; put it around "
            "the single environments before they are made one, gym.make_vec(..., wrappers=[...])"
            if hasattr(env, "num_envs")
            else f"{wrapper} works on this package's environments, got {env.unwrapped}"
        )
    return bench


def disturbable_bench_of(env: Any, wrapper: str) -> Bench:
    """Return the bench of an environment whose physics can be disturbed.

    Raises
    ------
    TypeError, ValueError
        Where it is none of ours, or answers from the table.
    """
    bench = bench_of(env, wrapper)
    if not bench.can_be_disturbed:
        raise ValueError(
            f"{wrapper} can't disturb what is answered from a table; make SoftVox2x2x2-v0 instead"
        )
    return bench


def chain(env: Any) -> Iterator[Any]:
    """Yield an environment and those inside, outermost first."""
    while env is not None:
        yield env
        inner = getattr(env, "env", None)
        env = inner if inner is not None else next(iter(getattr(env, "envs", ())), None)


def is_noisy(env: Any) -> bool:
    """Return whether two steps of one design may differ.

    Our wrappers say so, and any other wrapper that has a true attribute `is_noisy`.
    """
    return any(getattr(link, "is_noisy", False) for link in chain(env))


def silent(env: Any) -> Any | None:
    """Return the outermost wrapper from elsewhere that doesn't say whether it is noisy, if any.

    Those of Gymnasium and of this package are known.
    """
    for link in chain(env):
        package = type(link).__module__.partition(".")[0]
        if package not in ("gymnasium", "softvox_gym") and not hasattr(link, "is_noisy"):
            return link
    return None
