"""What MuJoCo has against a file, in its own words and with the file's own lines.

A world is composed of many files, and of what MuJoCo says of the whole neither the file nor the line is anybody's.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from gear.values.errors import TownError
from gear.world.assets.mjspec import read_spec

_LINE = re.compile(r",? line \d+\b")


def without_breaks(error: BaseException) -> str:
    """What an error says, without line breaks."""
    return " ".join(str(error).split())


def compile_problem(path: Path) -> str:
    """What stock MuJoCo has against a file alone; empty where it compiles it."""
    try:
        read_spec(path).compile()
    except ValueError as error:
        return without_breaks(error)
    return ""


def compile_error(error: ValueError, files: Sequence[Path]) -> TownError:
    """The error for a world that MuJoCo cannot compile.

    Args:
        error: what it says of the whole.
        files: what the world was composed of; the first one is named where each is fine alone.
    """
    for path in files:
        if said := compile_problem(path):
            return TownError(path, f"MuJoCo cannot compile it: {said}")
    # The lines are those of a text that nobody has.
    return TownError(files[0], f"MuJoCo cannot compile it: {_LINE.sub('', without_breaks(error))}")
