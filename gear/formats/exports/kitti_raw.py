"""Export to the layout of KITTI's raw data: pictures, laser scans and inertial measurements (OXTS) of each sequence."""

from __future__ import annotations

import datetime
from collections.abc import Iterator, Sequence

from gear.contracts.tasks import Sidecar
from gear.formats.driving.ego_motion import EgoMotion
from gear.formats.driving.oxts import DESCRIPTION, calibration_files, oxts_lines, timestamps
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

FOLDERS = {"left": "image_02", "right": "image_03"}


@explained_content
def kitti_raw_tree(splits: Sequence[ExportSplit], read: Read, _options: NoOptions) -> Tree:
    """The files of the driving sequences of a dataset in the layout of KITTI's raw data (synchronised and
    rectified).

    A sequence is a drive `<date>/<date>_drive_<number>_sync` with `image_02`, `image_03` (of a stereo dataset),
    `velodyne_points` (if the dataset has laser scans) and `oxts`. Each split has a date of its own, with its three
    calibration files, because splits may have different cameras. The dates follow each other, from the earliest date on
    which a split was created.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        _options: not used; the layout has no options.

    Raises:
        DatasetError: the dataset has no driving sequence.
    """
    driving = driving_splits(splits, "kitti-raw")
    first_day = min(datetime.date.fromisoformat(split.info.created) for split in driving)
    for later, split in enumerate(driving):
        day = first_day + datetime.timedelta(days=later)
        date = f"{day:%Y_%m_%d}"
        for number, sequence in enumerate(sequences_of(split), start=1):
            if number == 1:
                calibration = calibration_of(sequence[0].record)
                for name, data in calibration_files(calibration).items():
                    yield f"{date}/{name}", data
            folder = f"{date}/{date}_drive_{number:04d}_sync"
            for path, data in _drive(split, sequence, day, read):
                yield f"{folder}/{path}", data


def _drive(
    split: ExportSplit, sequence: Sequence[Sidecar], day: datetime.date, read: Read
) -> Iterator[tuple[str, bytes]]:
    """The files of one drive, by path relative to its folder."""
    motion = EgoMotion.of(records_of(sequence))
    times = timestamps(day, motion.times_s)
    sensors = {"oxts"}
    for sidecar, line in zip(sequence, oxts_lines(motion), strict=True):
        name = f"data/{sidecar.record.frame:010d}"
        for camera, path in pictures_of(split, sidecar.record).items():
            sensors.add(FOLDERS[camera])
            yield f"{FOLDERS[camera]}/{name}.png", read(path)
        if SCAN in sidecar.auxiliary:
            sensors.add("velodyne_points")
            yield f"velodyne_points/{name}.bin", read(sidecar.auxiliary[SCAN].path)
        yield f"oxts/{name}.txt", f"{line}\n".encode()
    for sensor in sorted(sensors):
        yield f"{sensor}/timestamps.txt", times
    yield "oxts/dataformat.txt", DESCRIPTION.encode()


LAYOUT = Layout(
    tasks=TASKS,
    summary="KITTI raw: drives with image_02, image_03, velodyne_points, oxts, and calib_*.txt; of driving sequences",
    tree=kitti_raw_tree,
)
