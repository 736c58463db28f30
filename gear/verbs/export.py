"""`gear.export`: writes a finished dataset in the layout of another tool, such as COCO or YOLO."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from gear.config.dump import to_plain
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.tasks import Sidecar
from gear.dataset.checks.exported_files import LISTED, export_list
from gear.dataset.files import inside, read_bytes, sha256, write_whole
from gear.dataset.free_space import check_free_space, tree_bytes
from gear.dataset.guarded_paths import owned, remove_empty_folders, remove_files
from gear.dataset.layout import GEAR, sidecar_path
from gear.dataset.reading import Dataset, check_hash
from gear.dataset.remote.folder import RemoteFolder, is_address, local_path
from gear.dataset.remote.tree import write_remote_tree
from gear.dataset.store import check_output, plan_of, splits_of
from gear.dataset.whole_tree import check_target, unfinished_place, whole_tree
from gear.formats.exports.layout import ExportSplit, Layout, Tree
from gear.formats.exports.registry import find_layout
from gear.plugins.build import NO_OPTIONS
from gear.plugins.datasets import open_dataset
from gear.reporting.display import displayed
from gear.values.errors import DatasetError
from gear.values.lazy_sequence import LazySequence
from gear.values.progress import Callbacks, Progress
from gear.values.serial import Json

FIRST = 3
"""Number of samples from whose exported files the size of an export is estimated."""


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
        out: folder of the exported files; must be empty or new. The hidden file `.gear-export.json` in it lists all
            files with their hashes, with which `gear verify` checks them. An address of fsspec, such as
            `s3://bucket/folder`, is filled directly; the file `gear-export.json`, the same list, is written last.
        settings: `KEY=VALUE` texts for the layout's options.
        progress: shows a progress bar.
        on_progress: called after every file with the number of samples of which a file was read, and of all samples.

    Returns:
        Number of exported samples.

    Raises:
        UnknownNameError: there is no such layout.
        ConfigError: the layout has no such option, or the option has no such value.
        GearError: the layout needs a package that is not installed, or the disk is too small.
        DatasetError: the layout is for another task, a split is not finished, `out` is not empty, or a file cannot be
            written.
    """
    chosen = find_layout(layout)
    options = read_node(chosen.options, with_overrides(NO_OPTIONS, settings), "options")
    with displayed(Callbacks.of(on_progress=on_progress), "export", progress=progress) as callbacks:
        callbacks.part("reading the manifests")
        source = _Source.of(Path(dataset), layout, chosen)
        tree = chosen.tree(source.splits, source.read, options)
        facts: dict[str, Json] = {"layout": layout, "options": to_plain(options), "splits": source.keys}
        if isinstance(out, str) and is_address(out):
            write_remote_tree(RemoteFolder(out), tree, facts, lambda: callbacks.on_progress(*source.counts()))
        else:
            _write_folder(source, tree, facts, local_path(out).resolve(), callbacks.on_progress)
    return source.counts()[1]


@dataclass(slots=True, kw_only=True)
class _Source:
    """The dataset that is exported.

    Attributes:
        root: its folder.
        splits: its splits.
        hashes: the SHA-256 of its files by path.
        keys: what identifies the splits, by name.
        samples_of: the split and the index of the sample to which a file belongs, by path.
        begun: splits and indices of the samples of which a file was read.
    """

    root: Path
    splits: list[ExportSplit] = field(default_factory=list)
    hashes: dict[str, str] = field(default_factory=dict)
    keys: dict[str, Json] = field(default_factory=dict)
    samples_of: dict[str, tuple[str, int]] = field(default_factory=dict)
    begun: set[tuple[str, int]] = field(default_factory=set)

    @classmethod
    def of(cls, root: Path, layout: str, chosen: Layout) -> _Source:
        """Opens the splits of the dataset `root`.

        Raises:
            DatasetError: the layout `chosen`, whose name is `layout`, is for another task, or a split is not finished.
        """
        source = cls(root=root)
        for name in splits_of(root):
            task = plan_of(root, name).task["name"]
            if chosen.tasks and task not in chosen.tasks:
                problem = f"is a {task} dataset; the layout {layout!r} is for {' and '.join(chosen.tasks)}"
                raise DatasetError(root, problem)
            opened = open_dataset(root, name)
            source.splits.append(_split_of(opened, task))
            source.hashes |= _hashes(opened.manifest)
            source.keys[name] = {"content_key": opened.plan.content_key, "samples": len(opened)}
            for index, sample in enumerate(opened.manifest["samples"]):
                source.samples_of |= dict.fromkeys(sample["files"], (name, index))
        return source

    def read(self, path: str) -> bytes:
        """Reads the file `path` of the dataset, relative to its root, and checks its hash.

        Raises:
            DatasetError: the file is missing or was changed.
        """
        if path in self.samples_of:
            self.begun.add(self.samples_of[path])
        return check_hash(self.root, path, self.hashes.get(path, ""))

    def counts(self) -> tuple[int, int]:
        """The number of samples of which a file was read, and the number of all samples."""
        return len(self.begun), sum(len(split.sidecars) for split in self.splits)


def _write_folder(source: _Source, tree: Tree, facts: dict[str, Json], target: Path, on_progress: Progress) -> None:
    """Writes an export into a new folder.

    Raises:
        GearError: the disk is too small.
        DatasetError: the folder is not empty, two samples would be in one file, or a file cannot be written.
    """
    check_target(target, "export")
    unfinished = unfinished_place(target, "export")
    check_output(unfinished, "delete it, or use another --out")
    there = tree_bytes(unfinished)
    _check_disk(target, _size_of(source.root, source.hashes) - there)
    with whole_tree(target, "export"):
        _write_tree(unfinished, _measured(source, tree, target, there, on_progress), facts)


def _measured(source: _Source, tree: Tree, target: Path, there: int, on_progress: Progress) -> Tree:
    """Yields the files of an export and reports progress; from the first samples, the size of all files is estimated.

    Raises:
        GearError: the disk is too small.
    """
    size, is_measured = 0, False
    for path, data in tree:
        yield path, data
        size += len(data)
        begun, total = source.counts()
        if not is_measured and begun > FIRST:
            is_measured = True
            _check_disk(target, size / begun * total - max(size, there))
        on_progress(begun, total)


def _check_disk(target: Path, needed: float) -> None:
    check_free_space(target, needed, what="the exported files need", advice="give --out on another disk")


@dataclass(frozen=True, slots=True)
class _Sidecars(LazySequence[Sidecar]):
    """The sidecars (JSON metadata of the samples) of a split; each file is read when it is accessed."""

    opened: Dataset[Any]

    def __len__(self) -> int:
        return len(self.opened)

    def item(self, index: int) -> Sidecar:
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


def _write_tree(root: Path, tree: Tree, facts: dict[str, Json]) -> None:
    """Writes the missing files of an export, and the list of all files with their hashes; deletes other files that an
    earlier, interrupted export wrote.

    Raises:
        DatasetError: two samples would be in one file, or a file cannot be written.
    """
    written: dict[str, Json] = {}
    for relative, data in tree:
        if relative in written:
            raise DatasetError(root, f"two samples of the dataset have the same name {relative!r} in this layout")
        path = owned(root, relative)
        if not (path.is_file() and read_bytes(path) == data):
            write_whole(root, relative, data)
        written[relative] = {"bytes": len(data), "sha256": sha256(data)}
    there = [path.relative_to(root).as_posix() for path in root.rglob("*") if path.is_symlink() or not path.is_dir()]
    remove_files(root, [relative for relative in there if relative not in written])
    write_whole(root, LISTED, export_list(facts, written))
    for folder in root.iterdir():
        if folder.is_dir() and not folder.is_symlink():
            remove_empty_folders(root, folder.name)
