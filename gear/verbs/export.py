"""A finished dataset in another layout."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from gear.dataset.files import clear_scratch, explained, inside, read_bytes, write_whole
from gear.dataset.store import plan_of, splits_of
from gear.formats.exports import SplitRecords, layouts
from gear.opening import open_dataset
from gear.values.errors import DatasetError, UnknownNameError


def export(
    dataset: str | Path,
    *,
    layout: str,
    out: str | Path,
    progress: Callable[[int, int], None] | None = None,
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
        DatasetError: the layout is another task's, a split is not finished, or `out` holds something.
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
    for written, (relative, data) in enumerate(tree, start=1):
        write_whole(target, relative, data)
        if progress is not None:
            progress(written, 0)
    clear_scratch(target)
    return sum(len(split.records) for split in splits)
