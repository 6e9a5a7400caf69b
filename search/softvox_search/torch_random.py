"""PyTorch with a run's own random state, for libraries that build on it."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Any

import numpy as np

from softvox_search.global_random import GlobalRandom, library


def quiet_library(name: str) -> Any:
    """Import an optional library as `library` does, without its warnings.

    Raises
    ------
    ImportError
        If it is not installed; the message names what to install.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return library(name)


@contextmanager
def own_torch(rng: np.random.Generator) -> Iterator[Any]:
    """Yield PyTorch, seeded by a generator: in double precision, on one thread, and silent.

    Afterwards its state and that of the global generators are restored. Not for threads.

    Parameters
    ----------
    rng : numpy.random.Generator
        The generator of the run; draws the seeds.

    Yields
    ------
    module
        ``torch``.
    """
    torch = quiet_library("torch")
    seed = int(rng.integers(2**63))
    threads, dtype = torch.get_num_threads(), torch.get_default_dtype()
    with (
        GlobalRandom(rng).swapped_in(),
        torch.random.fork_rng(devices=[]),
        torch.enable_grad(),
        warnings.catch_warnings(),
        redirect_stdout(io.StringIO()),
    ):
        warnings.simplefilter("ignore")
        torch.default_generator.manual_seed(seed)  # torch.manual_seed seeds other devices as well
        torch.set_num_threads(1)
        torch.set_default_dtype(torch.float64)
        try:
            yield torch
        finally:
            torch.set_num_threads(threads)
            torch.set_default_dtype(dtype)
