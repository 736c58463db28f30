"""Reads files whose paths come from users or data, and refuses everything but regular files.

On a device, a FIFO or a socket, `open` or `read` could wait for ever or fill the memory. A file of 40 GB could also
fill the memory; it may need no space on the disk.
"""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path

from gear.values.machine import free_memory_bytes

LARGE_BYTES = 256 * 1024**2
"""Size above which a file is compared with the free memory before it is read."""

KINDS = (
    (stat.S_ISDIR, "folder"),
    (stat.S_ISFIFO, "FIFO"),
    (stat.S_ISCHR, "character device"),
    (stat.S_ISBLK, "block device"),
    (stat.S_ISSOCK, "socket"),
)


class NotAFileError(OSError):
    """Error for an existing path that is no regular file. Code that handles `OSError` handles it as well."""

    def __init__(self, path: Path, kind: str) -> None:
        """Makes the error.

        Args:
            path: the path.
            kind: what it is: `folder`, `device`, ….
        """
        number = errno.EISDIR if kind == "folder" else errno.EINVAL
        super().__init__(number, f"is a {kind}; a file was asked for", str(path))


class FileTooLargeError(OSError):
    """Error for a file that does not fit into the free memory. Code that handles `OSError` handles it as well."""

    def __init__(self, path: Path, size_bytes: int) -> None:
        """Makes the error.

        Args:
            path: the file.
            size_bytes: its size.
        """
        super().__init__(errno.EFBIG, f"has {size_bytes / 1024**3:.1f} GiB, more than the free memory", str(path))


def check_regular(path: str | Path) -> Path:
    """Checks that a path is a regular file, or a link to a regular file, and returns the path.

    Args:
        path: the path.

    Raises:
        NotAFileError: the path is a folder, a device, a FIFO or a socket.
        OSError: the path does not exist or cannot be reached.
    """
    checked = Path(path)
    _refuse_other_kinds(checked, checked.stat().st_mode)
    return checked


def read_regular(path: str | Path, *, most_bytes: int | None = None) -> bytes:
    """Reads the bytes of a regular file.

    Args:
        path: the file, or a link to a file.
        most_bytes: largest number of bytes to read; None for all.

    Raises:
        NotAFileError: the path is a folder, a device, a FIFO or a socket.
        FileTooLargeError: the file is larger than the free memory.
        OSError: the path does not exist or cannot be read.
    """
    checked = check_regular(path)  # before it is opened: opening some devices has effects
    descriptor = os.open(checked, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
    with os.fdopen(descriptor, "rb") as stream:
        status = os.fstat(descriptor)
        _refuse_other_kinds(checked, status.st_mode)  # another file may have taken its place
        if most_bytes is None and status.st_size > LARGE_BYTES:
            free = free_memory_bytes()
            if free is not None and status.st_size > free:
                raise FileTooLargeError(checked, status.st_size)
        # A file whose size the system calls 0, as those in /proc, is read to its end.
        return stream.read() if most_bytes is None or status.st_size < most_bytes else stream.read(most_bytes)


def _refuse_other_kinds(path: Path, mode: int) -> None:
    for is_kind, name in KINDS:
        if is_kind(mode):
            raise NotAFileError(path, name)
