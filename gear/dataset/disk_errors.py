"""Errors of the disk as one line for the user."""

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
"""Advice by error number."""

SYSTEM_LIMITS = {errno.EMFILE, errno.ENFILE, errno.ENOMEM}
"""Limits of the machine, not of the disk: the command line explains them."""


@contextlib.contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turns a full disk, a read-only folder and similar errors of writing into one line.

    Raises:
        DatasetError: an `OSError` came up inside.
    """
    try:
        yield
    except OSError as error:
        if error.errno in SYSTEM_LIMITS:
            raise
        raise DatasetError(path, HINTS.get(error.errno or 0, error.strerror or str(error))) from error
