"""Temporary files: their folder, the locks of their writers, and the removal of files that killed runs left.

A file is written in `gear/scratch` under a unique name and renamed when it is complete. While a process writes the
file, it holds a lock on it. The system releases the lock when the process is killed, also in another container and, on
most network file systems, on another machine. If a file is removed while it is written, the writer cannot rename it and
writes it again, so no data are lost.
"""

from __future__ import annotations

import contextlib
import os
import platform
import secrets
import stat
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from gear.dataset.guarded_paths import opened_parent

if sys.platform != "win32":
    import fcntl

SCRATCH = "gear/scratch"
"""Folder of temporary files; other programs that read the dataset's format do not search it."""

SUFFIX = ".part"
"""Suffix of temporary files whose writers hold a lock; earlier versions of gear used neither suffix nor lock."""

OLD_S = 3600.0
"""Seconds since the last write after which a temporary file counts as abandoned, if neither a lock nor a process number
shows whether its writer is alive.
"""

NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC


@contextlib.contextmanager
def half_written(folder: int, data: bytes) -> Iterator[str]:
    """A context that writes and syncs a temporary file in an open folder, and yields its name.

    The caller renames the file inside the context. If an error is raised, the file is removed.

    Args:
        folder: descriptor of the open folder.
        data: content of the file.

    Yields:
        The name of the file in the folder.

    Raises:
        OSError: a file cannot be written.
    """
    name = unique_name() + SUFFIX
    descriptor = os.open(name, NEW, 0o666, dir_fd=folder)
    try:
        with os.fdopen(descriptor, "wb") as stream:
            lock_of(descriptor)
            stream.write(data)
            stream.flush()
            os.fsync(descriptor)
            yield name
    except BaseException:  # Ctrl-C, too
        with contextlib.suppress(OSError):
            os.unlink(name, dir_fd=folder)
        raise


def clear_scratch(root: Path) -> None:
    """Removes the temporary files of killed runs, and the folders `gear/scratch` and `gear` if they are empty.

    Files that other runs or threads are writing are kept.

    Args:
        root: folder of the dataset.

    Raises:
        DatasetError: the folder of temporary files, or `gear`, is a link.
    """
    with contextlib.suppress(OSError), opened_parent(root, f"{SCRATCH}/x") as (folder, _):
        for name in os.listdir(folder):  # noqa: PTH208 (a folder descriptor)
            with contextlib.suppress(OSError):  # another run clears, too
                if _is_abandoned(folder, name):
                    os.unlink(name, dir_fd=folder)
    for relative in (SCRATCH, "gear"):
        with contextlib.suppress(OSError), opened_parent(root, relative) as (folder, name):
            os.rmdir(name, dir_fd=folder)


def _is_abandoned(folder: int, name: str) -> bool:
    """Whether the writer of a file has ended.

    Raises:
        OSError: the file is missing, or cannot be opened.
    """
    status = os.stat(name, dir_fd=folder, follow_symlinks=False)
    if not stat.S_ISREG(status.st_mode):
        return False
    descriptor = os.open(name, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, dir_fd=folder)
    try:
        is_free = lock_of(descriptor)
    finally:
        os.close(descriptor)
    if is_free is False:
        return False
    if is_free and name.endswith(SUFFIX):
        return True
    alive = is_alive(name)
    return time.time() - status.st_mtime > OLD_S if alive is None else not alive


def lock_of(descriptor: int) -> bool | None:
    """Tries to lock an open file for this process alone, without waiting.

    Args:
        descriptor: descriptor of the open file; closing it releases the lock.

    Returns:
        True if the file is locked now; False if another process or thread holds the lock; None if the file system has
        no locks.
    """
    if sys.platform == "win32":
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return None
    return True


def is_alive(name: str) -> bool | None:
    """Whether the process whose number is part of a temporary file's name is still running.

    Returns:
        False for the current process as well; None if the name has no process number or is of another machine.
    """
    host, _, number = name.rpartition("-")[0].rpartition("-")
    if not number.isdecimal():
        return None
    if host != _host():
        return None if host else False
    if int(number) == os.getpid():
        return False
    try:
        os.kill(int(number), 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):
        return True
    return True


def unique_name() -> str:
    """A unique name for a temporary file or a claim: host name, process number and random digits, separated by `-`."""
    return f"{_host()}-{os.getpid()}-{secrets.token_hex(8)}"


def _host() -> str:
    return platform.node().replace("/", "_")
