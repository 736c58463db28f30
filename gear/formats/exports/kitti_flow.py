"""Export to the layout of KITTI's optical flow benchmark: pairs of pictures with their flow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

import numpy as np

from gear.contracts.tasks import Sidecar
from gear.formats.driving.flow_png import ACTORS, FLOW, VISIBLE, decode_flow, encode_flow
from gear.formats.driving.oxts import calibration_files
from gear.formats.exports.layout import ExportSplit, Layout, NoOptions, Read, Tree
from gear.formats.exports.sequences import (
    TASKS,
    calibration_of,
    driving_splits,
    explained_content,
    pictures_of,
    sequences_of,
)
from gear.formats.png import decode_plain, encode_labels
from gear.values.errors import DatasetError
from gear.values.frames import UInt8Image, UInt16Image

FOLDERS = {"left": "image_2", "right": "image_3"}


@explained_content
def kitti_flow_tree(splits: Sequence[ExportSplit], read: Read, _options: NoOptions) -> Tree:
    """The files of the driving sequences of a dataset in the layout of KITTI's optical flow benchmark of 2015.

    Two neighbouring frames are a pair, with one number: `image_2/<number>_10.png`, `image_2/<number>_11.png`,
    `flow_occ/<number>_10.png` (all points), `flow_noc/<number>_10.png` (only points that the second picture shows),
    `obj_map/<number>_10.png` (0 for the background, 1, 2, ... for the road users) and `calib_cam_to_cam/<number>.txt`;
    stereo datasets have `image_3`, too. Splits whose first word is `test` are written to the folder `testing`, all
    other splits to `training`; in each of the two folders, pairs count from 0. The benchmark keeps the flow of
    `testing` secret; the export has it.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        _options: not used; the layout has no options.

    Raises:
        DatasetError: the dataset has no driving sequence, or was collected without flow.
    """
    numbers = {"training": 0, "testing": 0}
    for split in driving_splits(splits, "kitti-flow"):
        pool = "testing" if split.info.split.partition("_")[0] == "test" else "training"
        for sequence in sequences_of(split):
            for first, second in pairwise(sequence):
                for path, data in _pair(split, first, second, read):
                    yield f"{pool}/{path.format(number=f'{numbers[pool]:06d}')}", data
                numbers[pool] += 1


def _pair(split: ExportSplit, first: Sidecar, second: Sidecar, read: Read) -> Iterator[tuple[str, bytes]]:
    """The files of one pair, by path relative to the pool, with `{number}` for the number of the pair.

    Raises:
        DatasetError: the first frame has no flow.
    """
    camera = first.record.cameras[0].name
    try:
        files = [first.auxiliary[key.format(camera=camera)].path for key in (FLOW, VISIBLE, ACTORS)]
    except KeyError as error:
        problem = "has no optical flow; collect it with --set flow=true (into another --out, or with --force)"
        raise DatasetError(f"split {split.info.split}", problem) from error
    for name, path in pictures_of(split, first.record).items():
        yield f"{FOLDERS[name]}/{{number}}_10.png", read(path)
        yield f"{FOLDERS[name]}/{{number}}_11.png", read(pictures_of(split, second.record)[name])
    whole = read(files[0])
    yield "flow_occ/{number}_10.png", whole
    yield "flow_noc/{number}_10.png", encode_flow(decode_flow(whole), decode_plain(read(files[1])) > 0)
    yield "obj_map/{number}_10.png", encode_labels(object_map(decode_plain(read(files[2]))))
    calibration = calibration_files(calibration_of(first.record))
    yield "calib_cam_to_cam/{number}.txt", calibration["calib_cam_to_cam.txt"]


def object_map(actor_id: UInt16Image) -> UInt8Image:
    """(H, W) uint8 numbers of the road users in a picture, in the order of their ids, from 1; 0 is the background.

    From the 255th road user on, all have the number 255: the benchmark only separates them from the background.

    Args:
        actor_id: (H, W) id of the road user at each pixel; 0 for the background.
    """
    ids = np.unique(actor_id[actor_id > 0])
    numbers = np.minimum(np.searchsorted(ids, actor_id) + 1, 255)
    return np.where(actor_id > 0, numbers, 0).astype(np.uint8)


LAYOUT = Layout(
    tasks=TASKS,
    summary="KITTI flow: image_2 pairs, flow_occ, flow_noc, obj_map; of driving sequences with flow=true",
    tree=kitti_flow_tree,
)
