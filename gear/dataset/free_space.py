"""Checks that a disk has enough free space for the files of a job."""

from __future__ import annotations

import shutil
from pathlib import Path

from gear.values.errors import GearError

UNITS = ("bytes", "kB", "MB", "GB", "TB", "PB")


def free_bytes(folder: Path) -> int:
    """The number of free bytes on the disk of a folder; the folder need not exist yet."""
    existing = next(path for path in (folder, *folder.resolve().parents) if path.exists())
    return shutil.disk_usage(existing).free


def check_free_space(folder: Path, needed: float, *, what: str, advice: str) -> None:
    """Checks that the files of a job fit on its disk.

    Args:
        folder: folder into which the job writes.
        needed: approximate number of bytes that the job will write.
        what: subject and verb of the message, such as "200 samples need".
        advice: what the user can do, besides choosing another disk.

    Raises:
        GearError: fewer bytes are free.
    """
    free = free_bytes(folder)
    if needed > free:
        raise GearError(f"{folder}: {what} about {size_text(needed)}, and {size_text(free)} are free there; {advice}")


def size_text(size: float) -> str:
    """Formats `size`, a number of bytes, as text in powers of 1000, such as `3.2 GB`."""
    power = 0
    while size >= 999.5 and power < len(UNITS) - 1:
        size, power = size / 1000, power + 1
    return f"{size:.0f} {UNITS[power]}" if power == 0 or size >= 99.5 else f"{size:.2g} {UNITS[power]}"


def tree_bytes(folder: Path) -> int:
    """The number of bytes of the files in a folder without links, such as one that a killed run has left."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
