"""Exports: a finished dataset in another layout, file by file."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from gear.contracts.tasks import SplitInfo
from gear.values.scene import SceneRecord

Read = Callable[[str], bytes]
"""The bytes of a file of the dataset, by path relative to its root."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SplitRecords:
    """One finished split.

    Attributes:
        info: as it was written with.
        records: of its samples, in order of index.
    """

    info: SplitInfo
    records: tuple[SceneRecord, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """A layout to export to.

    Attributes:
        task: name of the task whose datasets it takes.
        summary: one line.
        tree: relative paths and bytes of the new tree, from splits and a way to read the old one.
    """

    task: str
    summary: str
    tree: Callable[[Sequence[SplitRecords], Read], Iterator[tuple[str, bytes]]]


def layouts() -> dict[str, Layout]:
    """What gear can export to, by name."""
    from gear.formats.export_kitti import kitti_tree
    from gear.formats.export_kitti_depth import kitti_depth_tree

    return {
        "kitti": Layout(
            task="stereo3d",
            summary="KITTI object: one training/ pool, ImageSets/",
            tree=kitti_tree,
        ),
        "kitti-depth": Layout(
            task="depth",
            summary="KITTI depth: drives, proj_depth, val_selection_cropped for the devkit",
            tree=kitti_depth_tree,
        ),
    }
