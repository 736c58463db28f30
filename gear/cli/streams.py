"""Settings of the output streams: how unsupported characters are written, and how wide a line may be."""

from __future__ import annotations

import io
import shutil
import sys

from gear.measuring.text_table import WIDTH


def prepare_streams() -> None:
    r"""Makes stdout and stderr accept every character; unsupported ones become `\xe4` or `\u2026`.

    Otherwise a terminal in ASCII or Latin-1 would end a command with a UnicodeEncodeError after its work is finished.
    """
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def line_width() -> int:
    """Returns the largest line width in characters: at least 60, the width of the terminal (or `COLUMNS`), or 100
    if the output is not a terminal.
    """
    return max(shutil.get_terminal_size((WIDTH, 24)).columns, 60)
