"""The number of workers that fits this machine: `--workers auto`."""

from __future__ import annotations

from typing import Literal

from gear.values.machine import cores, free_memory_bytes

WORKER_BYTES = 1_500_000_000
"""Memory that a worker is given. The worlds of gear's own towns need about 1.2 GB at 2048 x 1024."""

Workers = int | Literal["auto"]


def fitting_workers(workers: Workers) -> int:
    """The number of workers: as given, or one for each core that has enough memory; at least 1.

    Args:
        workers: a number, or `auto`.
    """
    if workers != "auto":
        return workers
    free = free_memory_bytes()
    by_memory = cores() if free is None else free // WORKER_BYTES
    return max(1, min(cores(), by_memory))
