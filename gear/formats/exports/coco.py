"""COCO as the benchmark itself is laid out: pictures by split, one annotation file for each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from gear.formats.exports.layout import ExportSplit, Layout, Read, Tree, check_range


@dataclass(frozen=True, slots=True, kw_only=True)
class CocoOptions:
    """Options of the layout.

    Attributes:
        year: stands behind the split in the names of folders and files, as in `train2017`; 0 for no year.
    """

    year: int = 2017

    def __post_init__(self) -> None:
        check_range("year", self.year, 0, 9999)


def coco_tree(splits: Sequence[ExportSplit], read: Read, options: CocoOptions) -> Tree:
    """`<split><year>/` with the pictures and `annotations/instances_<split><year>.json`, from a detect2d dataset.

    The annotation file has the same bytes as the dataset's. Each annotation has an additional key `gear` (object,
    visibility, distance), which COCO's tools do not read.

    Args:
        splits: of the dataset.
        read: the bytes of a file of the dataset, by relative path.
        options: of the layout.
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
