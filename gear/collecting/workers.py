"""The number of parallel workers that fits this machine, for `--workers auto`."""

from __future__ import annotations

from typing import Literal

from gear.values.machine import cores, free_memory_bytes

WORKER_BYTES = 1_500_000_000
"""Bytes of memory that one worker is assumed to need; gear's own towns need about 1.2 GB at 2048 x 1024 pixels."""

Workers = int | Literal["auto"]


def fitting_workers(workers: Workers) -> int:
    """The number of parallel workers; at least 1.

    Args:
        workers: the number itself, or `auto` for one worker per core, limited by the free memory.
    """
    if workers != "auto":
        return workers
    free = free_memory_bytes()
    by_memory = cores() if free is None else free // WORKER_BYTES
    return max(1, min(cores(), by_memory))
