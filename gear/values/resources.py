"""Locates gear's data folders: inside the package when gear is installed, next to the package in a checkout of the
repository.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path


@cache
def data_dir(name: str) -> Path:
    """The path of one of gear's data folders.

    An installed wheel holds the folder as `gear/data/<name>`; a checkout of the repository holds it as `<name>`.

    Args:
        name: `mjcf` or `configs`.

    Raises:
        FileNotFoundError: the installation is incomplete.
    """
    package = Path(__file__).resolve().parents[1]
    for folder in (package / "data" / name, package.parent / name):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"gear's data folder {name!r} is missing next to {package}; install gear again")
