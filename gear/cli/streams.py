"""The terminal's streams: their encoding, and how wide a line may be."""

from __future__ import annotations

import io
import shutil
import sys

from gear.measuring.text_table import WIDTH


def prepare_streams() -> None:
    """Lets stdout and stderr take every character: those that their encoding lacks are written as `\\xe4`, `\\u2026`.

    A terminal in ASCII or Latin-1 would otherwise end a command with a UnicodeEncodeError after its work was done.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def line_width() -> int:
    """Characters a line of a table may have: the terminal's (or `COLUMNS`), 100 where the output is no terminal."""
    return max(shutil.get_terminal_size((WIDTH, 24)).columns, 60)
