"""Checks that a disk has room for the files of a job."""

from __future__ import annotations

import shutil
from pathlib import Path

from gear.values.errors import GearError

UNITS = ("bytes", "kB", "MB", "GB", "TB", "PB")


def free_bytes(folder: Path) -> int:
    """Bytes that are free on the disk of a folder, which need not exist yet."""
    existing = next(path for path in (folder, *folder.resolve().parents) if path.exists())
    return shutil.disk_usage(existing).free


def check_free_space(folder: Path, needed: float, *, what: str, advice: str) -> None:
    """Refuses a job that does not fit its disk.

    Args:
        folder: where the job writes.
        needed: bytes that it will write, about.
        what: the subject of the message, with its verb: "200 samples need".
        advice: what the user can do, besides choosing another disk.

    Raises:
        GearError: fewer bytes are free.
    """
    free = free_bytes(folder)
    if needed > free:
        raise GearError(f"{folder}: {what} about {size_text(needed)}, and {size_text(free)} are free there; {advice}")


def size_text(size: float) -> str:
    """A size as text, in powers of 1000: `3.2 GB`."""
    power = 0
    while size >= 999.5 and power < len(UNITS) - 1:
        size, power = size / 1000, power + 1
    return f"{size:.0f} {UNITS[power]}" if power == 0 or size >= 99.5 else f"{size:.2g} {UNITS[power]}"
