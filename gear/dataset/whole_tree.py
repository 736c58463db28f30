"""Writes a new folder atomically: it is filled under a hidden name in the same parent folder and renamed at the end."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

from gear.dataset.files import explained, sync_folder
from gear.dataset.guarded_paths import empty_tree, owned, refuse_links, remove_tree
from gear.dataset.locks import exclusive_lock
from gear.values.errors import DatasetError


def check_target(target: Path, command: str) -> None:
    """Checks that a new folder can be created at a path; an empty folder may exist there.

    Args:
        target: absolute path of the folder.
        command: verb for the message, such as `export`.

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
    """The path of the hidden folder next to `target` that is filled first.

    Args:
        target: absolute path of the new folder.
        command: name of the command, which is part of the hidden folder's name.

    Raises:
        DatasetError: the hidden folder is a link, or contains one.
    """
    unfinished = _hidden(target, command)
    refuse_links(unfinished, with_hidden=True)
    return unfinished


@contextlib.contextmanager
def whole_tree(target: Path, command: str, *, is_kept: bool = False, is_continued: bool = True) -> Iterator[Path]:
    """A context that yields a hidden folder to fill, and renames it to `target` when the context ends without an
    error.

    After an error the hidden folder is deleted. If the process is killed, the hidden folder remains, and the same
    command can continue with it. A command that does not continue begins with an empty folder, so that no file of a
    killed run becomes a part of the result.

    Args:
        target: absolute path of the new folder; it must be empty or missing.
        command: name of the command, such as `export`, for messages and for the hidden folder's name.
        is_kept: whether the hidden folder also remains after Ctrl-C.
        is_continued: whether files of a killed run are kept; otherwise they are deleted first.

    Raises:
        DatasetError: the target is not empty or cannot be replaced, the hidden folder contains a link or is used by
            another run, or a file cannot be written.
    """
    check_target(target, command)
    unfinished = unfinished_place(target, command) if is_continued else _hidden(target, command)
    with exclusive_lock(unfinished):
        try:
            if not is_continued:
                empty_tree(unfinished.parent, unfinished.name)
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


def _hidden(target: Path, command: str) -> Path:
    return owned(target.parent, f".{target.name}.gear-{command}")
