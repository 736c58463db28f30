"""Export to the layout of the Cityscapes benchmark, with train ids, in the splits `train`, `val` and `test`."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from gear.formats.cityscapes import LABELS, Paths, city_name, paths
from gear.formats.exports.layout import ExportSplit, Layout, NoOptions, Read, Tree
from gear.formats.label_png import encode_label_map
from gear.formats.png import decode_plain

SPLITS = ("train", "val", "test")
"""The splits of the benchmark. torchvision refuses other names, and the benchmark evaluates the files of `val` only."""

TRAIN_IDS = np.array([label.train_id for label in LABELS], dtype=np.uint8)
"""(34,) uint8 train id of each label, by label id: 0 to 18, and 255 for labels that are not evaluated."""


def cityscapes_tree(splits: Sequence[ExportSplit], read: Read, _options: NoOptions) -> Tree:
    """The files of a semseg dataset in the Cityscapes layout, and one file `_gtFine_labelTrainIds.png` per sample.

    A split is written to the benchmark's split that its first word names: `val_night` becomes `val`. A split whose
    first word is no split of the benchmark also becomes `val`. A split that is not called exactly `train`, `val` or
    `test` gets its own city name, so no two splits share a city.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        _options: not used; the layout has no options.
    """
    for split in splits:
        info = split.info
        pool = next((name for name in SPLITS if name == info.split.partition("_")[0]), "val")
        city = city_name(info.town if pool == info.split else f"{info.town}{info.split}")
        for sidecar in split.sidecars:
            record = sidecar.record
            there = paths(info.town, info.split, record.sequence, record.frame)
            name = f"{city}_{record.sequence:06d}_{record.frame:06d}"
            for path, data in _files(there, sidecar.files, read):
                kind, suffix = path.partition("/")[0], re.sub(r"^[^_]*_\d+_\d+_", "", path.rpartition("/")[2])
                yield f"{kind}/{pool}/{city}/{name}_{suffix}", data


def _files(there: Paths, known: Mapping[str, str], read: Read) -> Tree:
    """The files of one sample under the dataset's own paths, and its train ids."""
    labels = read(there.label_ids)
    for path in (there.image, there.label_ids, there.instance_ids, there.colour, there.polygons, there.camera):
        if path in known:  # a dataset may have no polygons
            yield path, labels if path == there.label_ids else read(path)
    train_ids = TRAIN_IDS[decode_plain(labels)]
    yield there.label_ids.replace("_labelIds.png", "_labelTrainIds.png"), encode_label_map(train_ids)


LAYOUT = Layout(
    tasks=("semseg",),
    summary="Cityscapes: leftImg8bit, gtFine with labelTrainIds, camera; splits train, val, test",
    tree=cityscapes_tree,
)
