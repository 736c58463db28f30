"""The encoding of the terminal's streams, and the width of their lines."""

from __future__ import annotations

import io
import shutil
import sys

from gear.measuring.text_table import WIDTH


def prepare_streams() -> None:
    r"""Makes stdout and stderr accept every character; those that the encoding lacks are written as `\xe4` or `\u2026`.

    Otherwise a terminal in ASCII or Latin-1 would end a command with a UnicodeEncodeError after its work is finished.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def line_width() -> int:
    """Largest width of a line in characters: that of the terminal (or `COLUMNS`), or 100 if the output is not a
    terminal.
    """
    return max(shutil.get_terminal_size((WIDTH, 24)).columns, 60)
