"""The number of usable processor cores."""

from __future__ import annotations

import os


def cores() -> int:
    """Number of cores that this process may use; containers and batch systems may allow fewer than the machine has."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
