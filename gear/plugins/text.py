"""Makes texts of plugins, and of files from other people, safe to print: one line, no control characters, limited
length.
"""

from __future__ import annotations

LONGEST = 200
"""Largest number of characters of a plugin's text in a message."""

LONGEST_LINE = 2000
"""Largest number of characters of a whole line that contains text of a file, such as a path in a dataset."""


def printable(text: str, longest: int = LONGEST) -> str:
    """Returns a text as one line; control characters, such as terminal escapes, are escaped.

    Characters that the terminal's encoding lacks are not replaced here, since they depend on where the text is printed.

    Args:
        text: the text, which may come from a plugin or a file.
        longest: largest number of characters that are taken of it; a longer text ends with `…`.
    """
    safe = "".join(char if char.isprintable() else char.encode("unicode_escape").decode() for char in text[:longest])
    return safe if len(text) <= longest else f"{safe[:longest]}…"


def one_line(error: BaseException) -> str:
    """Returns an exception as one printable line: the name of its type and the first line of its text.

    If the text of the exception cannot be computed, only its type is named.

    Args:
        error: the exception, which may come from a plugin.
    """
    name = type_name(error)
    try:
        lines = str.strip(str(error)).splitlines()
    except BaseException as problem:  # a stranger's __str__ may raise anything
        return f"{name} (whose text cannot be had: {type_name(problem)})"
    return f"{name}: {printable(lines[0])}" if lines else name


def type_name(value: object) -> str:
    """Returns the name of the type of a plugin's value as printable text; no code of the plugin runs.

    Args:
        value: the value; a metaclass of its type may compute `__name__`, and raise anything.
    """
    return printable(str(type.__dict__["__name__"].__get__(type(value))))
