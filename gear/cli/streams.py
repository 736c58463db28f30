"""Settings of the output streams: how unsupported characters are written, and how wide a line may be."""

from __future__ import annotations

import io
import shutil
import sys
import textwrap

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


def wrapped(line: str) -> str:
    """Wraps a line at the line width (see `line_width`); further lines are indented by 4 more characters.

    Words that are longer than a line, such as addresses and paths, stay whole.

    Args:
        line: text without line breaks; its leading blanks are kept.
    """
    indent = " " * (len(line) - len(line.lstrip()) + 4)
    return textwrap.fill(line, line_width(), subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)


def folded(text: str) -> str:
    """Wraps the sentences in a text, such as the notes below a table, at the line width; tables stay as they are.

    Args:
        text: lines of any length.
    """
    return "\n".join(
        wrapped(line) if len(line) > line_width() and "  " not in line.strip() else line for line in text.split("\n")
    )
