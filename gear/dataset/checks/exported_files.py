"""The list of an export's files with their hashes: written last, and compared with the files by `gear verify`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path

from gear.dataset.checks.verification import Finding
from gear.dataset.files import inside
from gear.dataset.hashing import file_hash, in_threads
from gear.dataset.sealed_json import load_sealed, sealed_json
from gear.values.errors import DatasetError
from gear.values.progress import Progress
from gear.values.serial import Json

LISTED = ".gear-export.json"
"""Name of the list in an exported folder. It is hidden, because readers of some layouts list the folder."""

AT_ADDRESS = "gear-export.json"
"""Name of the list at an address, where a tree without it is not complete."""

AGAIN = "export the dataset again into a new folder"
"""What to do with a damaged export."""

FORMAT = {"format": "gear-export", "version": 1}


def export_list(facts: Mapping[str, Json], files: Mapping[str, Json]) -> bytes:
    """The content of the list of an export.

    Args:
        facts: layout, options and data of the export.
        files: `bytes` and `sha256` of each file, by path.
    """
    return sealed_json({**FORMAT, **facts, "files": dict(files)})


def list_of_export(root: Path) -> Path | None:
    """The list of an exported folder; None if there is none.

    Args:
        root: the folder.
    """
    return next((path for name in (LISTED, AT_ADDRESS) if (path := root / name).is_file()), None)


def check_export(root: Path, listed: Path, on_progress: Progress) -> tuple[int, list[Finding]]:
    """Compares the files of an export with its list. Files that are not in the list, such as caches of other tools, are
    not reported.

    Args:
        root: the exported folder.
        listed: its list.
        on_progress: called after every file with the numbers of checked and of all files.

    Returns:
        The number of files in the list, and the files that are damaged or missing.

    Raises:
        DatasetError: the list is damaged.
    """
    try:
        files = load_sealed(listed)["files"]
        expected = sorted((str(path), int(one["bytes"]), str(one["sha256"])) for path, one in files.items())
    except DatasetError as error:
        raise DatasetError(listed, f"{error.problem.partition(';')[0]}; {AGAIN}") from error
    except (LookupError, TypeError, ValueError, AttributeError) as error:
        raise DatasetError(listed, f"lists no files with sizes and hashes; {AGAIN}") from error
    findings = []
    for done, problem in enumerate(in_threads(partial(_problem, root), expected), 1):
        if problem is not None:
            findings.append(problem)
        on_progress(done, len(expected))
    return len(expected), findings


def _problem(root: Path, entry: tuple[str, int, str]) -> Finding | None:
    path, size, digest = entry
    try:
        there = inside(root, path)
        if not there.is_file():
            return Finding(path=path, problem="missing")
        is_same = there.stat().st_size == size and file_hash(there) == digest
    except (DatasetError, OSError):  # a link that leads elsewhere, a file that cannot be read
        is_same = False
    return None if is_same else Finding(path=path, problem="damaged")
