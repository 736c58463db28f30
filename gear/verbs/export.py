"""A finished dataset in another layout."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path

from gear.dataset.files import clear_scratch, explained, inside, read_bytes, write_whole
from gear.dataset.store import plan_of, splits_of
from gear.formats.exports import SplitRecords, layouts
from gear.plugins.datasets import open_dataset
from gear.values.errors import DatasetError, UnknownNameError
from gear.values.progress import Progress


def export(
    dataset: str | Path,
    *,
    layout: str,
    out: str | Path,
    on_progress: Progress | None = None,
) -> int:
    """Writes all splits of a dataset as another layout's tree.

    Args:
        dataset: root of a dataset whose splits are finished.
        layout: one of `gear.formats.exports.layouts()`.
        out: folder of the new tree; must be empty or new.
        progress: told after every file, with (files so far, 0): their number is not known before.

    Returns:
        How many samples the tree holds.

    Raises:
        UnknownNameError: there is no such layout.
        DatasetError: the layout is another task's, a split is not finished, or `out` holds something. An export that
            is stopped takes back what it wrote: half a tree looks like a whole one, and the next try needs the room.
    """
    known = layouts()
    if layout not in known:
        raise UnknownNameError("layout", layout, known)
    source, target = Path(dataset), Path(out)
    splits: list[SplitRecords] = []
    for name in splits_of(source):
        plan = plan_of(source, name)
        if plan.task["name"] != known[layout].task:
            raise DatasetError(
                source, f"is a {plan.task['name']} dataset; the layout {layout!r} is for {known[layout].task}"
            )
        opened = open_dataset(source, name)
        records = tuple(opened.sidecar(i).record for i in range(len(opened)))
        splits.append(SplitRecords(info=plan.info, records=records))
    with explained(target):
        if target.exists() and any(target.iterdir()):
            raise DatasetError(target, "is not empty; export into a new folder")
        target.mkdir(parents=True, exist_ok=True)
    tree = known[layout].tree(splits, lambda path: read_bytes(inside(source, path)))
    written: list[str] = []
    try:
        for relative, data in tree:
            written.append(relative)
            write_whole(target, relative, data)
            if on_progress is not None:
                on_progress(len(written), 0)
    except BaseException:  # Ctrl-C, too
        _take_back(target, written)
        raise
    clear_scratch(target)
    return sum(len(split.records) for split in splits)


def _take_back(target: Path, written: Sequence[str]) -> None:
    """Removes the files of a tree, and all folders in it that are empty then."""
    with contextlib.suppress(OSError, DatasetError):
        for relative in written:
            inside(target, relative).unlink(missing_ok=True)
        clear_scratch(target)
        for folder in sorted((path for path in target.rglob("*") if path.is_dir()), reverse=True):
            if not any(folder.iterdir()):
                folder.rmdir()
