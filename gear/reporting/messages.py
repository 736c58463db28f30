"""Formats error messages so that each of them is printed as one line."""

from __future__ import annotations

import re

LONGEST = 200
"""Largest number of characters of a quoted value in a message; longer values are cut."""

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
_QUOTED = re.compile(f"'[^']{{{LONGEST + 1},}}'|\"[^\"]{{{LONGEST + 1},}}\"")
_WORD = re.compile(rf"((?:^|[\s=/])[^\s=/'\"]{{{LONGEST}}})[^\s=/'\"]{{60,}}")
"""A value without quotes, or a part of a path, of more than 255 characters, the longest name that a file can have."""


def one_line(error: object) -> str:
    """Returns the text of an error without line breaks and control characters; quoted values longer than 200
    characters are cut, and so are words longer than any name of a file.
    """
    text = " ".join(str(error).split("\n"))
    text = _QUOTED.sub(lambda found: f"{found[0][: LONGEST + 1]}…{found[0][0]}", text)
    text = _WORD.sub(lambda found: f"{found[1]}…", text)
    return _CONTROL.sub(lambda found: repr(found[0])[1:-1], text)
