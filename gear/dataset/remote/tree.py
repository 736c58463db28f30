"""Writes an exported tree to an address of fsspec, such as `s3://bucket/folder`."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path, PurePosixPath

from gear.dataset.checks.exported_files import AT_ADDRESS, export_list
from gear.dataset.files import sha256, write_whole
from gear.dataset.json_text import dump_json
from gear.dataset.remote.folder import RemoteFolder
from gear.values.errors import DatasetError
from gear.values.serial import Json

BEGUN = "gear-export.begun.json"
"""Name of the file that is written first and removed at the end. It names the exported data, so that the same export
can continue in the folder.
"""

INDEXES = frozenset({".json", ".txt", ".yaml", ".yml", ".csv", ".md"})
"""Suffixes of the files that are written after all others, because readers find the others by them."""


def write_remote_tree(
    folder: RemoteFolder, tree: Iterable[tuple[str, bytes]], facts: dict[str, Json], on_file: Callable[[], None]
) -> None:
    """Writes the files of an export: pictures first, text files after them, and `gear-export.json` last.

    Args:
        folder: the folder at the address; it must be empty, or hold an interrupted export of the same data.
        tree: paths and bytes of the files.
        facts: layout, options and data of the export.
        on_file: called after every file.

    Raises:
        DatasetError: the folder holds anything else, two files have the same path, or a file cannot be written.
    """
    begun = dump_json(facts)
    names = folder.names()
    if names and (AT_ADDRESS in names or folder.read(BEGUN) != begun):
        raise DatasetError(folder.address, "is not empty; export into a new folder")
    folder.write(BEGUN, begun)
    files: dict[str, Json] = {}
    late: list[str] = []
    with tempfile.TemporaryDirectory(prefix="gear-export-") as name:
        spool = Path(name)
        for relative, data in tree:
            if relative in files:
                problem = f"two samples of the dataset have the same name {relative!r} in this layout"
                raise DatasetError(folder.address, problem)
            files[relative] = {"bytes": len(data), "sha256": sha256(data)}
            if PurePosixPath(relative).suffix.lower() in INDEXES:
                write_whole(spool, f"{len(late)}", data)
                late.append(relative)
                continue
            folder.write(relative, data)
            on_file()
        for number, relative in enumerate(late):
            folder.write(relative, (spool / str(number)).read_bytes())
            on_file()
    folder.write(AT_ADDRESS, export_list(facts, files))
    folder.remove(BEGUN)
