"""Refuses an output folder that holds files of somebody else, whose names a command might replace."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from gear.dataset.disk_errors import explained
from gear.dataset.guarded_paths import owned
from gear.dataset.layout import GEAR
from gear.values.errors import DatasetError

SHOWN = 80
"""Largest number of characters of a file's name in the message."""


def check_own(root: Path, marker: str, is_ours: Callable[[Path], bool], what: str) -> None:
    """Checks that a folder is new, empty, or holds an earlier output of the same command, before it is written.

    A command writes its marker first, so that a run that is killed leaves one. Hidden files and gear's own scratch
    folder do not count; files that somebody adds to a finished output stay.

    Args:
        root: the folder; it may be missing.
        marker: name of the file by which an output is recognised.
        is_ours: tells of a file of that name whether the command wrote it.
        what: what the command writes, in the plural, for the message.

    Raises:
        DatasetError: the folder holds other files or a link, or cannot be read.
    """
    with explained(root):
        if not root.exists():
            return
        there = sorted(path.name for path in root.iterdir() if path.name != GEAR and not path.name.startswith("."))
        if not there:
            return
        path = owned(root, marker)
        if path.is_file() and is_ours(path):
            return
        for name in there:
            owned(root, name)
    shown = (marker if marker in there else there[0])[:SHOWN]
    raise DatasetError(root, f"holds files that are no {what} of gear's, such as {shown!r}; use another --out")
