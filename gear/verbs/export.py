"""`gear.export`: writes a finished dataset in the layout of another tool, such as COCO or YOLO."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

from gear.config.dump import to_plain
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.tasks import Sidecar
from gear.dataset.files import inside, read_bytes, write_whole
from gear.dataset.free_space import check_free_space
from gear.dataset.guarded_paths import owned, remove_empty_folders, remove_files
from gear.dataset.layout import GEAR, sidecar_path
from gear.dataset.reading import Dataset, check_hash
from gear.dataset.remote.folder import RemoteFolder, is_address, local_path
from gear.dataset.remote.tree import write_remote_tree
from gear.dataset.store import check_output, plan_of, splits_of
from gear.dataset.whole_tree import check_target, unfinished_place, whole_tree
from gear.formats.exports.layout import ExportSplit
from gear.formats.exports.registry import find_layout
from gear.plugins.build import NO_OPTIONS
from gear.plugins.datasets import open_dataset
from gear.reporting.display import displayed
from gear.values.errors import DatasetError
from gear.values.progress import Callbacks, Progress
from gear.values.serial import Json


def export(
    dataset: str | Path,
    *,
    layout: str,
    out: str | Path,
    settings: Iterable[str] = (),
    progress: bool = False,
    on_progress: Progress | None = None,
) -> int:
    """Writes all splits of a dataset in the layout of another tool, such as COCO or YOLO.

    The files are written into a hidden folder next to `out`, which is renamed when it is complete. If the export fails,
    the hidden folder is deleted. If the process is killed, the same command continues with the existing files.

    Args:
        dataset: root of a dataset whose splits are finished.
        layout: name of a layout, such as `coco`.
        out: folder of the exported files; must be empty or new. An address of fsspec, such as `s3://bucket/folder`, is
            filled directly; the file `gear-export.json`, which lists all other files, is written last.
        settings: `KEY=VALUE` texts for the layout's options.
        progress: shows a progress bar.
        on_progress: called after every file with (number of written files, 0); 0 means that the number of all files
            is unknown.

    Returns:
        Number of exported samples.

    Raises:
        UnknownNameError: there is no such layout.
        ConfigError: the layout has no such option, or the option has no such value.
        GearError: the layout needs a package that is not installed.
        DatasetError: the layout is for another task, a split is not finished, `out` is not empty, or a file cannot be
            written.
    """
    chosen = find_layout(layout)
    options = read_node(chosen.options, with_overrides(NO_OPTIONS, settings, flag="--set"), "options")
    source = Path(dataset)
    splits: list[ExportSplit] = []
    hashes: dict[str, str] = {}
    keys: dict[str, Json] = {}
    for name in splits_of(source):
        task = plan_of(source, name).task["name"]
        if chosen.tasks and task not in chosen.tasks:
            problem = f"is a {task} dataset; the layout {layout!r} is for {' and '.join(chosen.tasks)}"
            raise DatasetError(source, problem)
        opened = open_dataset(source, name)
        splits.append(_split_of(opened, task))
        hashes |= _hashes(opened.manifest)
        keys[name] = {"content_key": opened.plan.content_key, "samples": len(opened)}
    tree = chosen.tree(splits, lambda path: check_hash(source, path, hashes.get(path, "")), options)
    samples = sum(len(split.sidecars) for split in splits)
    callbacks = Callbacks.of(on_progress=on_progress)
    if isinstance(out, str) and is_address(out):
        facts: dict[str, Json] = {"layout": layout, "options": to_plain(options), "splits": keys}
        with displayed(callbacks, "export", progress=progress, unit="file") as shown:
            write_remote_tree(RemoteFolder(out), tree, facts, shown.on_progress)
        return samples
    target = local_path(out).resolve()
    check_target(target, "export")
    unfinished = unfinished_place(target, "export")
    check_output(unfinished, "delete it, or use another --out")
    check_free_space(
        target,
        _size_of(source, hashes) - _size_of_tree(unfinished),
        what="the exported files need",
        advice="give --out on another disk",
    )
    with (
        whole_tree(target, "export"),
        displayed(callbacks, "export", progress=progress, unit="file") as shown,
    ):
        _write_tree(unfinished, tree, shown.on_progress)
    return samples


@dataclass(frozen=True, slots=True)
class _Sidecars(Sequence[Sidecar]):
    """The sidecars (JSON metadata of the samples) of a split; each file is read when it is accessed."""

    opened: Dataset[Any]

    def __len__(self) -> int:
        return len(self.opened)

    @overload
    def __getitem__(self, index: int) -> Sidecar: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Sidecar]: ...
    def __getitem__(self, index: int | slice) -> Sidecar | Sequence[Sidecar]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        return self.opened.sidecar(index)


def _split_of(opened: Dataset[Any], task: str) -> ExportSplit:
    """Returns the data of a split that a layout needs: metadata, sidecars and manifest."""
    info = opened.plan.info
    paths = [sidecar_path(info.split, index) for index in range(len(opened))]
    return ExportSplit(info=info, task=task, sidecars=_Sidecars(opened), sidecar_paths=paths, manifest=opened.manifest)


def _hashes(manifest: Json) -> dict[str, str]:
    """Returns the SHA-256 of every file that a manifest lists, by path."""
    hashes: dict[str, str] = {**manifest["indexes"], **manifest.get("sidecars", {})}
    for sample in manifest["samples"]:
        hashes |= sample["files"]
    return hashes


def _size_of(root: Path, files: Iterable[str]) -> int:
    """Returns the size in bytes of the existing files, without gear's internal files such as sidecars and probes."""
    paths = [inside(root, path) for path in files if not path.startswith(f"{GEAR}/")]
    return sum(path.stat().st_size for path in paths if path.is_file())


def _size_of_tree(root: Path) -> int:
    """Bytes of the files that an export that was killed has left, which holds no link; they are kept or replaced."""
    return sum(path.stat().st_size for path in root.rglob("*") if path.is_file())


def _write_tree(root: Path, tree: Iterable[tuple[str, bytes]], on_progress: Progress) -> None:
    """Writes the missing files of an export, and deletes other files that an earlier, interrupted export wrote.

    Raises:
        DatasetError: two samples would be in one file, or a file cannot be written.
    """
    written: set[str] = set()
    for relative, data in tree:
        if relative in written:
            raise DatasetError(root, f"two samples of the dataset have the same name {relative!r} in this layout")
        path = owned(root, relative)
        if not (path.is_file() and read_bytes(path) == data):
            write_whole(root, relative, data)
        written.add(relative)
        on_progress(len(written), 0)
    there = [path.relative_to(root).as_posix() for path in root.rglob("*") if path.is_symlink() or not path.is_dir()]
    remove_files(root, [relative for relative in there if relative not in written])
    for folder in root.iterdir():
        if folder.is_dir() and not folder.is_symlink():
            remove_empty_folders(root, folder.name)
