"""Finds the processor cores and the memory that this process may use, within the limits of containers and batch
systems, and the processor time that processes have used.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from pathlib import Path

_CONTROL_GROUPS = Path("/sys/fs/cgroup")


def cores() -> int:
    """Number of processor cores that this process may use.

    The result is the number of cores in the process's affinity, or the rounded-up quota of its control group if that is
    smaller. A container with a quota of 1.5 cores, for example, sees all cores of its machine but may use only 2.
    """
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return max(1, min([allowed, *(math.ceil(quota) for quota in _quotas())]))


def free_memory_bytes() -> int | None:
    """Bytes of memory that this process can still use; None if the system does not report them.

    The result is the memory that Linux reports as available, or what the process's control groups have left if that is
    less.
    """
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        available = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:"))
    except (OSError, ValueError, IndexError, StopIteration):
        return None
    return max(0, min([available, *_memory_left()]))


def processor_time_s(session: int) -> float:
    """Processor time in seconds that the processes of a session have used, and the ended children that they waited for.

    Args:
        session: id of the session, which is the id of the process that began it.

    Returns:
        The processor time; 0 if the system does not report it.
    """
    ticks = 0
    for path in Path("/proc").glob("[0-9]*/stat"):
        # The name of the program, in parentheses, may contain blanks and parentheses.
        fields = " ".join(_lines(path)).rpartition(")")[2].split()
        if len(fields) > 14 and fields[3] == str(session):
            ticks += sum(int(field) for field in fields[11:15])
    return ticks / os.sysconf("SC_CLK_TCK") if ticks else 0.0


def _quotas() -> Iterator[float]:
    """Cores that each control group above this process allows, in versions 2 and 1 of their interface."""
    for folder in _groups(""):
        words = _words(folder / "cpu.max")
        if len(words) == 2 and words[0] != "max":
            yield int(words[0]) / int(words[1])
    for folder in _groups("cpu"):
        quota, period = (_number(folder / f"cpu.cfs_{name}_us") for name in ("quota", "period"))
        if quota is not None and quota > 0 and period:
            yield quota / period


def _memory_left() -> Iterator[int]:
    """Bytes that each control group above this process has left; cached pages of files count as left."""
    for folder, limit_name, usage_name in (
        *((folder, "memory.max", "memory.current") for folder in _groups("")),
        *((folder, "memory.limit_in_bytes", "memory.usage_in_bytes") for folder in _groups("memory")),
    ):
        limit, usage = _number(folder / limit_name), _number(folder / usage_name)
        if limit is not None and usage is not None:
            statistics = dict(line.split() for line in _lines(folder / "memory.stat") if len(line.split()) == 2)
            yield limit - usage + int(statistics.get("inactive_file", 0))


def _groups(controller: str) -> Iterator[Path]:
    """Folders of the control groups that hold this process, from its own up to the root.

    Args:
        controller: of version 1 of the interface, or "" for version 2, which has one tree.
    """
    for line in _lines(Path("/proc/self/cgroup")):
        _, controllers, path = (*line.split(":", 2), "", "")[:3]
        if controller not in controllers.split(","):
            continue
        top = _CONTROL_GROUPS / controller
        own = top / path.strip("/")
        # A container sees its own group as the root of the tree, whatever the path says.
        folders = [own, *own.parents] if own.is_dir() else [top]
        yield from (folder for folder in folders if folder.is_relative_to(top))


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="ascii").splitlines()
    except (OSError, ValueError):
        return []


def _words(path: Path) -> list[str]:
    return " ".join(_lines(path)).split()


def _number(path: Path) -> int | None:
    words = _words(path)
    return int(words[0]) if words and words[0].lstrip("-").isdecimal() else None
