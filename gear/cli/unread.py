"""What is printed where nobody reads it, or no disk takes it."""

from __future__ import annotations

import os
import sys


def print_no_more() -> None:
    """Drops what is still to be printed, where it can no more be: Python tries once more at its end."""
    try:
        sys.stdout.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
