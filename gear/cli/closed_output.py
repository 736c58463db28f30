"""Handles standard output that cannot be written: a closed pipe, or a full disk."""

from __future__ import annotations

import os
import sys


def discard_output() -> None:
    """Discards the rest of stdout's buffer. Otherwise the interpreter would try to write it again at its exit."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
