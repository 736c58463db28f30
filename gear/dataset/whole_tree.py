"""Writes a new folder atomically: it is filled under a hidden name in the same parent folder, and then renamed."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from gear.dataset.files import explained, sync_folder
from gear.dataset.guarded_paths import owned, refuse_links, remove_tree
from gear.dataset.locks import alone_at_work
from gear.values.errors import DatasetError


def check_target(target: Path, command: str) -> None:
    """Checks that a folder is empty or new and can be replaced by a new one.

    Args:
        target: absolute path of the folder.
        command: the verb in the message, such as `export`.

    Raises:
        DatasetError: the folder is not empty, is a mount point, or is the current folder.
    """
    with explained(target):
        if target.exists() and any(target.iterdir()):
            raise DatasetError(target, f"is not empty; {command} into a new folder")
    if target.is_mount() or target == Path.cwd():
        kind = "a mounted file system" if target.is_mount() else "the current folder"
        raise DatasetError(target, f"is {kind}; {command} into a new folder in it")


def unfinished_place(target: Path, command: str) -> Path:
    """Path of the hidden folder, next to `target`, that is filled first; checked for links.

    Raises:
        DatasetError: it is a link, or holds one.
    """
    unfinished = owned(target.parent, f".{target.name}.gear-{command}")
    refuse_links(unfinished)
    return unfinished


@contextlib.contextmanager
def whole_tree(target: Path, command: str, *, is_kept: bool = False) -> Iterator[Path]:
    """Yields the hidden folder to fill, and renames it to `target` when the block ends without an error.

    After an error the hidden folder is deleted. After the process was killed it stays, for the same command to use.

    Args:
        target: as of `check_target`.
        command: as of `check_target`.
        is_kept: whether the hidden folder also stays after Ctrl-C.

    Raises:
        DatasetError: as `check_target` and `unfinished_place`, another run is filling it, or a file cannot be written.
    """
    check_target(target, command)
    unfinished = unfinished_place(target, command)
    with alone_at_work(unfinished):
        try:
            yield unfinished
            with explained(target):
                check_target(target, command)  # another command may have written there
                unfinished.replace(target)
                sync_folder(target.parent)
        except BaseException as error:  # Ctrl-C, too
            if isinstance(error, Exception) or not is_kept:
                with contextlib.suppress(DatasetError):
                    remove_tree(unfinished.parent, unfinished.name)
            raise
