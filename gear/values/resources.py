"""Folders of gear's data: inside the package when it is installed, next to the package in a checkout."""

from __future__ import annotations

from functools import cache
from pathlib import Path


@cache
def data_dir(name: str) -> Path:
    """The path of one of gear's data folders.

    Args:
        name: `mjcf` or `configs`.

    An installed wheel carries it as `gear/data/<name>`; in a checkout it is `<name>` at the top.

    Raises:
        FileNotFoundError: the installation is incomplete.
    """
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "data" / name, package.parent / name):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"gear's data folder {name!r} is missing next to {package}; install gear again")
