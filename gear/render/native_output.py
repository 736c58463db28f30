"""Removes known informational messages of native libraries from stdout and stderr."""

from __future__ import annotations

import ctypes
import os
import re
import sys
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

_CHATTER = re.compile(
    r"Using 'soft' CircularBuffer|FEngine |Backend feature level|Vulkan device driver|Selected physical device"
    # Printed if small frames follow each other faster than Filament measures them.
    r"|FrameInfo's circular queue is full"
    # Printed with a stack trace if a large world needs more handles than Filament's pool has; it then uses the heap.
    r"|^PanicLog$|in allocateHandleSlow|HandleAllocator arena is full|^#\d+\s+\S+\s+0x[0-9a-f]+\s|^#\d+\s.*unknown"
)


@contextmanager
def native_output(descriptors: tuple[int, ...] = (1, 2)) -> Iterator[list[str]]:
    """Context in which the output of native code to stdout and stderr is caught, at the level of file descriptors.

    Args:
        descriptors: file descriptors that are caught; 1 is stdout, 2 is stderr.

    Yields:
        A list. When the context ends, it contains the known informational lines; all other lines are written to their
        original stream.
    """
    chatter: list[str] = []
    _flush()
    with ExitStack() as files:
        kept = [(fd, os.dup(fd), files.enter_context(tempfile.TemporaryFile())) for fd in descriptors]
        try:
            for fd, _, file in kept:
                os.dup2(file.fileno(), fd)
            yield chatter
        finally:
            _flush()
            for fd, original, file in kept:
                os.dup2(original, fd)
                os.close(original)
                file.seek(0)
                for line in file.read().splitlines(keepends=True):
                    text = line.decode("utf-8", "replace")
                    if _CHATTER.search(text.strip()):
                        chatter.append(text.strip())
                    elif text.strip():
                        os.write(fd, line)


def _flush() -> None:
    """Flushes Python's buffers and C's buffers; C holds printed text back if stdout is not a terminal."""
    sys.stdout.flush()
    sys.stderr.flush()
    ctypes.CDLL(None).fflush(None)
