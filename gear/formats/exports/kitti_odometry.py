"""Export to the layout of KITTI's odometry benchmark: pictures, calibration, times and poses of each sequence."""

from __future__ import annotations

from collections.abc import Sequence

from gear.formats.driving.ego_motion import poses_from_first
from gear.formats.driving.kitti_poses import format_odometry_calibration, format_poses, format_times
from gear.formats.exports.layout import ExportSplit, Layout, NoOptions, Read, Tree
from gear.formats.exports.sequences import (
    TASKS,
    calibration_of,
    driving_splits,
    explained_content,
    pictures_of,
    records_of,
    sequences_of,
)
from gear.formats.kitti_object import SCAN

FOLDERS = {"left": "image_2", "right": "image_3"}


@explained_content
def kitti_odometry_tree(splits: Sequence[ExportSplit], read: Read, _options: NoOptions) -> Tree:
    """The files of the driving sequences of a dataset in the layout of KITTI's odometry benchmark.

    A sequence has `sequences/<number>/{image_2,image_3}/%06d.png`, `calib.txt`, `times.txt`, and `velodyne/%06d.bin` if
    the dataset has laser scans. `poses/<number>.txt` has one line per frame, the pose of the left camera in the frame
    of its first pose. Sequences are numbered through all splits. Datasets of one camera have no `image_3`.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        _options: not used; the layout has no options.

    Raises:
        DatasetError: the dataset has no driving sequence.
    """
    sequences = (
        (split, sequence) for split in driving_splits(splits, "kitti-odometry") for sequence in sequences_of(split)
    )
    for number, (split, sequence) in enumerate(sequences):
        folder, records = f"sequences/{number:02d}", records_of(sequence)
        for sidecar in sequence:
            name = f"{sidecar.record.frame:06d}"
            for camera, path in pictures_of(split, sidecar.record).items():
                yield f"{folder}/{FOLDERS[camera]}/{name}.png", read(path)
            if SCAN in sidecar.auxiliary:
                yield f"{folder}/velodyne/{name}.bin", read(sidecar.auxiliary[SCAN].path)
        yield f"{folder}/calib.txt", format_odometry_calibration(calibration_of(records[0]))
        yield f"{folder}/times.txt", format_times([record.time_s for record in records])
        yield f"poses/{number:02d}.txt", format_poses(poses_from_first(records))


LAYOUT = Layout(
    tasks=TASKS,
    summary="KITTI odometry: sequences/00/{image_2,image_3,calib.txt,times.txt}, poses/00.txt; of driving sequences",
    tree=kitti_odometry_tree,
)
