"""The terminal's streams: their encoding, and the width of their lines."""

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
    """Largest width of a line in characters: that of the terminal (or `COLUMNS`); 100 if the output is not
    a terminal.
    """
    return max(shutil.get_terminal_size((WIDTH, 24)).columns, 60)
