"""Export to the layout of KITTI's object detection benchmark: pools `training` and `testing`, and lists of ids."""

from __future__ import annotations

from collections.abc import Sequence

from gear.formats.exports.layout import ExportSplit, Layout, NoOptions, Read, Tree
from gear.formats.kitti_object import SCAN, dont_care, format_labels

FOLDERS = (("image_2", "png"), ("image_3", "png"), ("calib", "txt"), ("label_2", "txt"))
LISTS = ("train", "val", "trainval", "test")
"""Lists of ids that converters of other tools read, empty where the dataset has no such split."""


def kitti_tree(splits: Sequence[ExportSplit], read: Read, _options: NoOptions) -> Tree:
    """The files of the exported tree, from a stereo3d dataset.

    Splits whose first word is `test` are the pool `testing`, all others the pool `training`. In each pool ids run from
    0 through the splits in the order given, so that `ImageSets/<split>.txt` tells them apart. `ImageSets/trainval.txt`
    joins `train` and `val`. `velodyne` is there if the dataset has laser scans (`scans: true` of a collection). The
    benchmark keeps the labels of `testing` secret; here they are in `testing/label_2`.

    Args:
        splits: the splits of the dataset.
        read: returns the bytes of a file of the dataset, by relative path.
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
    lists["trainval"] = sorted(lists["train"] + lists["val"])
    for split_name, names in lists.items():
        yield f"ImageSets/{split_name}.txt", "".join(f"{name}\n" for name in names).encode()


def labels_of(data: bytes) -> bytes:
    """A label file as stock converters need it, which the benchmark's own files are.

    MMDetection3D takes the first lines for the objects, as many as are not `DontCare`, so that `DontCare` lines come
    last. OpenPCDet fails on a file without a line; it gets a `DontCare` region without area, which excuses nothing.
    """
    lines = data.decode().splitlines(keepends=True)
    lines.sort(key=lambda line: line.startswith("DontCare"))
    return "".join(lines).encode() or format_labels([dont_care((0.0, 0.0, 0.0, 0.0))])


LAYOUT = Layout(tasks=("stereo3d",), summary="KITTI object: training/, testing/, ImageSets/", tree=kitti_tree)
