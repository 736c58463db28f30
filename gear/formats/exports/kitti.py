"""Export to the layout of KITTI's object detection benchmark: folders `training` and `testing`, and lists of sample
ids.
"""

from __future__ import annotations

from collections.abc import Sequence

from gear.formats.exports.layout import ExportSplit, Layout, NoOptions, Read, Tree
from gear.formats.kitti_object import SCAN, dont_care, format_labels

FOLDERS = (("image_2", "png"), ("image_3", "png"), ("calib", "txt"), ("label_2", "txt"))
LISTS = ("train", "val", "trainval", "test")
"""Names of the id lists that converters of other tools read. A list is empty if the dataset has no such split."""


def kitti_tree(splits: Sequence[ExportSplit], read: Read, _options: NoOptions) -> Tree:
    """The files of a stereo3d dataset in the layout of KITTI's object benchmark, as pairs of path and bytes.

    Splits whose first word is `test` are written to the folder `testing`, all other splits to `training`. In each of
    the two folders, ids count from 0 through all splits; `ImageSets/<split>.txt` lists the ids of a split.
    `ImageSets/trainval.txt` joins `train`, `val` and a split `trainval`. `velodyne` exists if the dataset has laser
    scans (`scans: true` in the configuration). The benchmark keeps the labels of `testing` secret; the export has them
    in `testing/label_2`.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        _options: not used; the layout has no options.
    """
    lists: dict[str, list[str]] = {name: [] for name in LISTS}
    numbers = {"training": 0, "testing": 0}
    for split in splits:
        pool = "testing" if split.info.split.partition("_")[0] == "test" else "training"
        names = lists.setdefault(split.info.split, [])
        for sidecar in split.sidecars:
            name = f"{numbers[pool]:06d}"
            for folder, suffix in FOLDERS:
                source = f"{split.info.split}/{folder}/{sidecar.record.index:06d}.{suffix}"
                data = read(source)
                yield f"{pool}/{folder}/{name}.{suffix}", labels_of(data) if folder == "label_2" else data
            if SCAN in sidecar.auxiliary:
                yield f"{pool}/velodyne/{name}.bin", read(sidecar.auxiliary[SCAN].path)
            names.append(name)
            numbers[pool] += 1
    lists["trainval"] = sorted(lists["trainval"] + lists["train"] + lists["val"])
    for split_name, names in lists.items():
        yield f"ImageSets/{split_name}.txt", "".join(f"{name}\n" for name in names).encode()


def labels_of(data: bytes) -> bytes:
    """A KITTI label file in the form that common converters accept: `DontCare` lines last, and never empty.

    MMDetection3D counts the lines that are not `DontCare` and takes that many lines from the top of the file, so
    `DontCare` lines must come last. OpenPCDet fails on an empty file; such a file gets one `DontCare` region of area 0,
    which has no effect on the evaluation.

    Args:
        data: bytes of a KITTI label file.
    """
    lines = data.decode().splitlines(keepends=True)
    lines.sort(key=lambda line: line.startswith("DontCare"))
    return "".join(lines).encode() or format_labels([dont_care((0.0, 0.0, 0.0, 0.0))])


LAYOUT = Layout(tasks=("stereo3d",), summary="KITTI object: training/, testing/, ImageSets/", tree=kitti_tree)
