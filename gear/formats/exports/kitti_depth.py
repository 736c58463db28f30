"""Export to the layout of KITTI's depth benchmark: drives (recordings) with pictures and annotated depth, and cropped
pictures as in the benchmark's development kit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from gear.formats.exports.layout import ExportSplit, Layout, NoOptions, Read, Tree
from gear.formats.kitti_depth import intrinsics_text
from gear.formats.png import decode_plain, decode_rgb, encode_labels, encode_rgb
from gear.values.scene import SceneRecord

CROP_WIDTH_PX, CROP_HEIGHT_PX = 1216, 352


def kitti_depth_tree(splits: Sequence[ExportSplit], read: Read, _options: NoOptions) -> Tree:
    """The files of a depth dataset in the layout of KITTI's depth benchmark, as pairs of path and bytes.

    Pictures are written to `<date>/<drive>/image_02/data/`. Depth, in units of 1/256 m, is written to
    `train|val/<drive>/proj_depth/groundtruth/image_02/`. The split `train` is written to `train`, all other splits to
    `val`. A split of single pictures is one drive; a split of sequences has one drive per sequence.

    Splits other than `train` are also written to `val_selection_cropped` if their pictures are large enough: cropped to
    1216 x 352, with adapted intrinsics. The export has no laser scans.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        _options: not used; the layout has no options.
    """
    drives: dict[tuple[str, int], int] = {}
    for split in splits:
        info = split.info
        pool = "train" if info.split == "train" else "val"
        is_driving = any(sidecar.record.frame > 0 for sidecar in split.sidecars)
        pairs = []
        for sidecar in split.sidecars:
            record = sidecar.record
            key = (info.split, record.sequence if is_driving else 0)
            date = info.created.replace("-", "_")
            drive = f"{date}_drive_{drives.setdefault(key, len(drives) + 1):04d}_sync"
            frame = record.frame if is_driving else record.index
            image = read(f"leftImg8bit/{info.split}/rgb_{record.index:04d}.png")
            depth = read(f"gtFine/{info.split}/rgb_{record.index:04d}.png")
            image_path = f"{date}/{drive}/image_02/data/{frame:010d}.png"
            depth_path = f"{pool}/{drive}/proj_depth/groundtruth/image_02/{frame:010d}.png"
            yield image_path, image
            yield depth_path, depth
            pairs.append(f"/{image_path} /{depth_path}\n")
            if pool == "val":
                yield from _selection(record, drive, frame, image, depth)
        yield f"filenames/{info.split}.txt", "".join(pairs).encode()


def _selection(record: SceneRecord, drive: str, frame: int, image: bytes, depth: bytes) -> Tree:
    """Yields the cropped picture, depth and intrinsics of a sample: the benchmark's crop is at the bottom in the
    middle.
    """
    camera = record.cameras[0]
    top, left = camera.height_px - CROP_HEIGHT_PX, (camera.width_px - CROP_WIDTH_PX) // 2
    if top < 0 or left < 0:
        return
    rows, columns = slice(top, top + CROP_HEIGHT_PX), slice(left, left + CROP_WIDTH_PX)
    folder, middle = "val_selection_cropped", f"{frame:010d}_image_02"
    yield f"{folder}/image/{drive}_image_{middle}.png", encode_rgb(decode_rgb(image)[rows, columns])
    yield (
        f"{folder}/groundtruth_depth/{drive}_groundtruth_depth_{middle}.png",
        encode_labels(decode_plain(depth)[rows, columns]),
    )
    matrix = camera.intrinsics.matrix - np.array([[0, 0, left], [0, 0, top], [0, 0, 0]])
    yield f"{folder}/intrinsics/{drive}_image_{middle}.txt", intrinsics_text(matrix)


LAYOUT = Layout(
    tasks=("depth",),
    summary="KITTI depth: drives, proj_depth, val_selection_cropped for the devkit",
    tree=kitti_depth_tree,
)
