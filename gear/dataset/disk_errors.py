"""Turns disk errors, such as a full disk, into one line with advice for the user."""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator
from pathlib import Path

from gear.values.errors import DatasetError

HINTS = {
    errno.ENOSPC: "the disk is full; free some space and run the same command again, finished samples are kept",
    errno.EDQUOT: "the quota is used up; finished samples are kept",
    errno.EROFS: "the file system is read-only; choose another --out",
    errno.EACCES: "no permission to write there; choose another --out",
    errno.EPERM: "no permission to write there; choose another --out",
    errno.ENOTDIR: "a file is where a folder should be; choose another --out",
    errno.EISDIR: "a folder is where a file should be; choose another --out",
    errno.EEXIST: "a file is where a folder should be; choose another --out",
}
"""Advice for the user by error number of the system."""

SYSTEM_LIMITS = {errno.EMFILE, errno.ENFILE, errno.ENOMEM}
"""Error numbers about limits of the machine (memory, open files), which the command line explains instead."""


@contextlib.contextmanager
def explained(path: Path) -> Iterator[None]:
    """A context that turns an `OSError`, such as a full disk or a read-only folder, into one line with advice.

    Args:
        path: path for the message.

    Raises:
        DatasetError: an `OSError` was raised, other than one about the machine's limits (memory, open files).
    """
    try:
        yield
    except OSError as error:
        if error.errno in SYSTEM_LIMITS:
            raise
        raise DatasetError(path, HINTS.get(error.errno or 0, error.strerror or str(error))) from error
