"""Export to the layout of the COCO benchmark: a folder of pictures and an annotation file for each split."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gear.formats.exports.layout import ExportSplit, Layout, Read, Tree, check_range


@dataclass(frozen=True, slots=True, kw_only=True)
class CocoOptions:
    """Options of the export to COCO's layout.

    Attributes:
        year: number that follows the split in the names of folders and files, as in `train2017`; 0 for no year.
    """

    year: int = 2017

    def __post_init__(self) -> None:
        check_range("year", self.year, 0, 9999)


def coco_tree(splits: Sequence[ExportSplit], read: Read, options: CocoOptions) -> Tree:
    """The files of a detect2d dataset in COCO's layout, as pairs of path and bytes.

    The pictures lie in `<split><year>/`, the annotations in `annotations/instances_<split><year>.json`. The annotation
    file is copied unchanged. Each annotation has an additional key `gear` (object, visibility, distance), which COCO's
    tools ignore.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        options: options of this layout.
    """
    year = str(options.year) if options.year else ""
    for split in splits:
        name = split.info.split
        for sidecar in split.sidecars:
            picture = f"rgb_{sidecar.record.index:04d}.png"
            yield f"{name}{year}/{picture}", read(f"images/{name}/{picture}")
        yield f"annotations/instances_{name}{year}.json", read(f"annotations/instances_{name}.json")


LAYOUT = Layout(
    tasks=("detect2d",),
    summary="COCO: <split>2017/, annotations/instances_<split>2017.json",
    tree=coco_tree,
    options=CocoOptions,
)
