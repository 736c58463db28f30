"""Finds the file and the line that cause an error of MuJoCo.

A world is composed of many files, and MuJoCo's error for the whole world names neither a file nor a line in it.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from gear.values.errors import TownError
from gear.world.assets.mjspec import read_spec

_LINE = re.compile(r",? line \d+\b")


def without_breaks(error: BaseException) -> str:
    """The message of an error as one line, without line breaks.

    Args:
        error: the error.
    """
    return " ".join(str(error).split())


def compile_problem(path: Path) -> str:
    """MuJoCo's error message for a single MJCF file; "" if the file compiles.

    Args:
        path: path of the file.
    """
    try:
        read_spec(path).compile()
    except ValueError as error:
        return without_breaks(error)
    return ""


def compile_error(error: ValueError, files: Sequence[Path]) -> TownError:
    """Makes the error for a world that MuJoCo cannot compile; it names the faulty MJCF file.

    Args:
        error: MuJoCo's error for the world.
        files: the files of the world. The error names the faulty file, or the first file if each file compiles alone.
    """
    for path in files:
        if problem := compile_problem(path):
            return TownError(path, f"MuJoCo cannot compile it: {problem}")
    # Line numbers would be those of the composed text, which the user does not have.
    return TownError(files[0], f"MuJoCo cannot compile it: {_LINE.sub('', without_breaks(error))}")
