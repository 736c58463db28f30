"""Export to the layout of KITTI's object detection benchmark: one pool `training` with lists of ids."""

from __future__ import annotations

from collections.abc import Sequence

from gear.formats.exports.layout import ExportSplit, Layout, NoOptions, Read, Tree

FOLDERS = (("image_2", "png"), ("image_3", "png"), ("calib", "txt"), ("label_2", "txt"))


def kitti_tree(splits: Sequence[ExportSplit], read: Read, _options: NoOptions) -> Tree:
    """The files of the exported tree, from a stereo3d dataset.

    Ids count from 0 over all splits in the given order, and `ImageSets/<split>.txt` lists those of each split.
    `ImageSets/trainval.txt` lists those of `train` and `val`, if both exist.

    Args:
        splits: the splits of the pool.
        read: returns the bytes of a file of the dataset, by relative path.
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
