"""Error messages for exhausted limits of the machine: memory, open files and processes."""

from __future__ import annotations

import errno
from collections.abc import Iterator

OPEN_FILES = "too many open files; raise the limit (`ulimit -n 4096`) or use fewer --workers, and run the command again"
SYSTEM_FILES = "all programs of this machine together have too many files open; close some, and run the command again"
MEMORY = "the memory is used up; use fewer --workers or smaller pictures or batches, and run the command again"
THREADS = "no further thread or process can be started; raise the limit (`ulimit -u`) or use fewer --workers"

LINES = {errno.EMFILE: OPEN_FILES, errno.ENFILE: SYSTEM_FILES, errno.ENOMEM: MEMORY}

SAID = {
    "Too many open files in system": SYSTEM_FILES,
    "Too many open files": OPEN_FILES,
    "Cannot allocate memory": MEMORY,
    "can't allocate memory": MEMORY,
    "Insufficient memory": MEMORY,
    "out of memory": MEMORY,
    "can't start new thread": THREADS,
}
"""Messages that gear prints for an exhausted limit, by the text of the library's error."""


def limit_reached(error: BaseException) -> str | None:
    """Returns a one-line message about the exhausted limit that an error, or the cause of the error, reports; None
    if no limit is the reason.
    """
    for one in _chain(error):
        if isinstance(one, OSError) and one.errno in LINES:
            return LINES[one.errno]
        if isinstance(one, MemoryError):
            return MEMORY
        if isinstance(one, (ImportError, RuntimeError)) or type(one).__module__.partition(".")[0] == "cv2":
            for words, line in SAID.items():
                if words.casefold() in str(one).casefold():
                    return line
    return None


def _chain(error: BaseException | None) -> Iterator[BaseException]:
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__
