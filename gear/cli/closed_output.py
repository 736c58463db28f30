"""Handles a standard output that cannot be written because the pipe is closed or the disk is full."""

from __future__ import annotations

import os
import sys


def discard_output() -> None:
    """Discards the text that is still in the buffer of stdout, because the interpreter would try to write it again
    at exit and fail.
    """
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
