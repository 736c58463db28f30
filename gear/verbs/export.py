"""A finished dataset in another layout."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from gear.dataset.files import inside, read_bytes, write_whole
from gear.dataset.free_space import check_free_space
from gear.dataset.guarded_paths import owned, remove_empty_folders, remove_files
from gear.dataset.reading import check_hash
from gear.dataset.store import check_output, plan_of, splits_of
from gear.dataset.whole_tree import check_target, unfinished_place, whole_tree
from gear.formats.exports import SplitRecords, layouts
from gear.plugins.datasets import open_dataset
from gear.reporting.display import displayed
from gear.values.errors import DatasetError, UnknownNameError
from gear.values.progress import Callbacks, Progress


def export(
    dataset: str | Path,
    *,
    layout: str,
    out: str | Path,
    progress: bool = False,
    on_progress: Progress | None = None,
) -> int:
    """Writes all splits of a dataset as another layout's tree.

    The tree is written into a hidden folder beside its place and renamed when it is whole. An export that fails deletes
    that folder; after one that was killed, the same command takes up what is there.

    Args:
        dataset: root of a dataset whose splits are finished.
        layout: one of `gear.formats.exports.layouts()`.
        out: folder of the new tree; must be empty or new.
        progress: shows a progress bar.
        on_progress: called after every file with (files so far, 0): their number is not known before.

    Returns:
        How many samples the tree holds.

    Raises:
        UnknownNameError: there is no such layout.
        DatasetError: the layout is another task's, a split is not finished, `out` holds something, or the disk refuses.
    """
    known = layouts()
    if layout not in known:
        raise UnknownNameError("layout", layout, known)
    source, target = Path(dataset), Path(out).resolve()
    splits: list[SplitRecords] = []
    hashes: dict[str, str] = {}
    auxiliary: set[str] = set()
    for name in splits_of(source):
        plan = plan_of(source, name)
        if plan.task["name"] != known[layout].task:
            raise DatasetError(
                source, f"is a {plan.task['name']} dataset; the layout {layout!r} is for {known[layout].task}"
            )
        opened = open_dataset(source, name)
        sidecars = [opened.sidecar(index) for index in range(len(opened))]
        records = tuple(sidecar.record for sidecar in sidecars)
        for sidecar in sidecars:
            hashes |= sidecar.files
            auxiliary |= {one.path for one in sidecar.auxiliary.values()}
        splits.append(SplitRecords(info=plan.info, records=records))
    tree = known[layout].tree(splits, lambda path: check_hash(source, path, hashes.get(path, "")))
    check_target(target, "export")
    check_free_space(
        target,
        sum(inside(source, path).stat().st_size for path in hashes.keys() - auxiliary),
        what="the exported files need",
        advice="give --out on another disk",
    )
    check_output(unfinished_place(target, "export"), "delete it, or use another --out")
    with (
        whole_tree(target, "export") as unfinished,
        displayed(Callbacks.of(on_progress=on_progress), "export", progress=progress, unit="file") as shown,
    ):
        _write_tree(unfinished, tree, shown.on_progress)
    return sum(len(split.records) for split in splits)


def _write_tree(root: Path, tree: Iterable[tuple[str, bytes]], on_progress: Progress) -> None:
    """Writes what is missing of a tree, and deletes what an earlier export, that was killed, left of another one."""
    written: set[str] = set()
    for relative, data in tree:
        path = owned(root, relative)
        if not (path.is_file() and read_bytes(path) == data):
            write_whole(root, relative, data)
        written.add(relative)
        on_progress(len(written), 0)
    there = [path.relative_to(root).as_posix() for path in root.rglob("*") if not path.is_dir()]
    remove_files(root, [relative for relative in there if relative not in written])
    for folder in root.iterdir():
        if folder.is_dir():
            remove_empty_folders(root, folder.name)
