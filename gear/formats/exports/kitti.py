"""KITTI object detection as the benchmark itself is laid out: one `training` pool with lists of ids."""

from __future__ import annotations

from collections.abc import Sequence

from gear.formats.exports.layout import ExportSplit, Layout, NoOptions, Read, Tree

FOLDERS = (("image_2", "png"), ("image_3", "png"), ("calib", "txt"), ("label_2", "txt"))


def kitti_tree(splits: Sequence[ExportSplit], read: Read, _options: NoOptions) -> Tree:
    """The files of the new tree, from a stereo3d dataset.

    Ids run from 0 through all splits in the order given, so that `ImageSets/<split>.txt` tells them apart in one pool.
    `ImageSets/trainval.txt` joins `train` and `val` where both are there.

    Args:
        splits: what to put into the pool.
        read: the bytes of a file of the dataset, by relative path.
    """
    lists: dict[str, list[str]] = {}
    number = 0
    for split in splits:
        names = lists.setdefault(split.info.split, [])
        for sidecar in split.sidecars:
            name = f"{number:06d}"
            for folder, suffix in FOLDERS:
                source = f"{split.info.split}/{folder}/{sidecar.record.index:06d}.{suffix}"
                yield f"training/{folder}/{name}.{suffix}", read(source)
            names.append(name)
            number += 1
    if "train" in lists and "val" in lists:
        lists["trainval"] = sorted(lists["train"] + lists["val"])
    for split_name, names in lists.items():
        yield f"ImageSets/{split_name}.txt", "".join(f"{name}\n" for name in names).encode()


LAYOUT = Layout(tasks=("stereo3d",), summary="KITTI object: one training/ pool, ImageSets/", tree=kitti_tree)
