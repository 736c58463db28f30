"""Notes on samples that could not be made: JSON files in `gear/<split>/failed` with error, traceback, number of
attempts and a hash of their own content.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from gear.contracts.executors import Outcome
from gear.dataset.files import write_whole
from gear.dataset.guarded_paths import owned, remove_empty_folders, remove_files
from gear.dataset.layout import failed_path, split_folder
from gear.dataset.sealed_json import sealed_json


def failures_folder(split: str) -> str:
    """The folder of a split's notes on failed samples, relative to the dataset's root."""
    return f"{split_folder(split)}/failed"


def note_failure(root: Path, split: str, outcome: Outcome, tries: int) -> None:
    """Writes the note on a sample that could not be made.

    Args:
        root: root of the dataset.
        split: name of the split.
        outcome: outcome of the sample, with its index, error and traceback.
        tries: number of attempts that the run made.

    Raises:
        DatasetError: the note cannot be written.
    """
    trace = outcome.trace.encode(errors="backslashreplace").decode()
    note = {"index": outcome.index, "tries": tries, "error": outcome.error, "traceback": trace.splitlines()}
    write_whole(root, failed_path(split, outcome.index), sealed_json(note))


def noted_failures(root: Path, split: str) -> set[int]:
    """The indices of the samples that have a note, because an earlier run could not make them.

    Args:
        root: root folder of the dataset.
        split: name of the split.

    Raises:
        DatasetError: the folder of the notes is a link.
    """
    folder = owned(root, failures_folder(split))
    return {int(path.stem) for path in folder.glob("*.json") if path.stem.isdecimal()} if folder.is_dir() else set()


def clear_failures(root: Path, split: str, indices: Iterable[int] | None = None) -> None:
    """Removes notes on failed samples, and the folder of notes if it is empty.

    Args:
        root: root of the dataset.
        split: name of the split.
        indices: indices of the samples whose notes are removed; None removes all notes.

    Raises:
        DatasetError: a note is a link, or cannot be deleted.
    """
    chosen = noted_failures(root, split) if indices is None else indices
    remove_files(root, [failed_path(split, index) for index in chosen])
    remove_empty_folders(root, failures_folder(split))
