"""Settings of the output streams: how unsupported characters are written, and how wide a line may be."""

from __future__ import annotations

import contextlib
import io
import os
import shutil
import sys
import textwrap

from gear.measuring.text_table import WIDTH

STANDARD = {"stdin": 0, "stdout": 1, "stderr": 2}
"""Numbers of the standard streams, by their names in `sys`."""

LAST_STANDARD = max(STANDARD.values())


def prepare_streams() -> None:
    r"""Makes stdout and stderr accept every character; unsupported ones become `\xe4` or `\u2026`.

    Otherwise a terminal in ASCII or Latin-1 would end a command with a UnicodeEncodeError after its work is finished.
    Streams that the caller has closed, as in `gear ... >&-`, are replaced by ones that read and keep nothing.
    """
    _open_closed_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def _open_closed_streams() -> None:
    """Opens the null device in place of closed standard streams.

    Python sets a closed stream to None. The next file that is opened, such as a picture, would get its number, and with
    it all messages of native libraries.
    """
    with contextlib.suppress(OSError):  # no descriptor is left, so that none of the first three is
        while (descriptor := os.open(os.devnull, os.O_RDWR)) <= LAST_STANDARD:
            os.set_inheritable(descriptor, True)
        os.close(descriptor)
    for name, number in STANDARD.items():
        if getattr(sys, name) is None:
            setattr(sys, name, open(number, "r" if number == 0 else "w", encoding="utf-8", closefd=False))  # noqa: SIM115


def complain(line: str) -> None:
    """Prints a line on stderr; nothing is printed where stderr cannot be written, such as on a full disk.

    Args:
        line: text without a newline.
    """
    with contextlib.suppress(OSError):
        print(line, file=sys.stderr, flush=True)


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
