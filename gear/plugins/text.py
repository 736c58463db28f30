"""A plugin's words made safe to print: one line, no control characters, of bounded length."""

from __future__ import annotations

LONGEST = 200
"""Characters of a plugin's text that a message quotes."""


def printable(text: str, longest: int = LONGEST) -> str:
    """The text in one line with control characters, such as terminal escapes, spelt out; cut at `longest` characters.

    What a terminal's encoding lacks is not looked at here: that depends on where the text is printed.
    """
    safe = "".join(char if char.isprintable() else char.encode("unicode_escape").decode() for char in text[:longest])
    return safe if len(text) <= longest else f"{safe[:longest]}…"


def one_line(error: BaseException) -> str:
    """An exception as one printable line: the name of its type and the first line of its text.

    An exception whose own text cannot be had is named by its type alone.
    """
    name = printable(type(error).__name__)
    try:
        lines = str(error).strip().splitlines()
    except BaseException as problem:  # a stranger's __str__ may raise anything
        return f"{name} (whose text cannot be had: {printable(type(problem).__name__)})"
    return f"{name}: {printable(lines[0])}" if lines else name
