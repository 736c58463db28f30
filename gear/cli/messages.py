"""Formats error messages as one line."""

from __future__ import annotations

import re

LONGEST = 200
"""Largest length of a quoted value in a message, in characters."""

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
_QUOTED = re.compile(f"'[^']{{{LONGEST + 1},}}'|\"[^\"]{{{LONGEST + 1},}}\"")


def one_line(error: object) -> str:
    """The text of an error without line breaks and control characters; quoted values longer than 200 characters
    are cut.
    """
    text = " ".join(str(error).split("\n"))
    text = _QUOTED.sub(lambda found: f"{found[0][: LONGEST + 1]}…{found[0][0]}", text)
    return _CONTROL.sub(lambda found: repr(found[0])[1:-1], text)
