"""Threads of workers: each gets its share of the cores, unless the user has set a number of threads."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator

from gear.values.machine import cores

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "LP_NUM_THREADS")
"""Environment variables by which torch, NumPy and Mesa's software rasteriser choose their number of threads. Without
them every worker starts one for each core, and the workers wait for each other."""


def share_of(workers: int) -> int | None:
    """Number of threads of each of `workers` workers on this machine: an equal share of the cores. None for one worker,
    which takes all cores.
    """
    return max(1, cores() // workers) if workers > 1 else None


def thread_variables(threads: int) -> dict[str, str]:
    """The environment variables by which numerical libraries of a worker use `threads` threads; those that the user has
    set keep their values.
    """
    return {name: os.environ.get(name, str(threads)) for name in THREADS}


@contextlib.contextmanager
def threads_set(threads: int | None) -> Iterator[None]:
    """A context in which started processes inherit a number of threads by environment variables; variables that the
    user has set keep their values.

    Args:
        threads: number of threads of each process; None changes nothing.
    """
    added = {} if threads is None else thread_variables(threads)
    added = {name: value for name, value in added.items() if name not in os.environ}
    os.environ.update(added)
    try:
        yield
    finally:
        for name in added:
            os.environ.pop(name, None)
