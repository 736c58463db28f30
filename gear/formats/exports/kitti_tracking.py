"""Export to the layout of KITTI's tracking benchmark: sequences with pictures, tracks, calibration and OXTS."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gear.contracts.tasks import Sidecar
from gear.formats.driving.ego_motion import EgoMotion
from gear.formats.driving.oxts import oxts_lines
from gear.formats.driving.tracks import format_tracking_calibration, kitti_sequence_map, kitti_track_line
from gear.formats.exports.layout import ExportSplit, Layout, NoOptions, Read, Tree
from gear.formats.exports.sequences import (
    calibration_of,
    driving_splits,
    explained_content,
    pictures_of,
    records_of,
    sequences_of,
)
from gear.formats.kitti_object import SCAN, parse_labels
from gear.values.errors import DatasetError

FOLDERS = {"left": "image_02", "right": "image_03"}
MAPS = {"training": "evaluate_tracking.seqmap.training", "testing": "evaluate_tracking.seqmap.test"}


@explained_content
def kitti_tracking_tree(splits: Sequence[ExportSplit], read: Read, _options: NoOptions) -> Tree:
    """The files of the driving sequences of a stereo3d dataset in the layout of KITTI's tracking benchmark.

    Splits whose first word is `test` are written to the folder `testing`, all other splits to `training`; in each of
    the two folders, sequences count from 0 through all splits. A folder has `image_02/<sequence>/%06d.png`, `image_03`,
    `velodyne` (if the dataset has laser scans), and for each sequence a file `label_02/<sequence>.txt`, `calib` and
    `oxts`. A track id is the object's id in gear, and the same in all frames. `evaluate_tracking.seqmap.<…>` lists the
    sequences for the evaluation. The benchmark keeps the labels of `testing` secret; the export has them.

    Args:
        splits: the finished splits of the dataset.
        read: function that returns the bytes of a file of the dataset, by path relative to its root.
        _options: not used; the layout has no options.

    Raises:
        DatasetError: the dataset has no driving sequence, or a label file does not fit its sidecar.
    """
    lengths: dict[str, list[int]] = {}
    for split in driving_splits(splits, "kitti-tracking"):
        pool = "testing" if split.info.split.partition("_")[0] == "test" else "training"
        counted = lengths.setdefault(pool, [])
        for sequence in sequences_of(split):
            for path, data in _sequence(split, sequence, f"{len(counted):04d}", read):
                yield f"{pool}/{path}", data
            counted.append(len(sequence))
    for pool, counted in lengths.items():
        yield f"{pool}/{MAPS[pool]}", kitti_sequence_map(counted)


def _sequence(split: ExportSplit, sequence: Sequence[Sidecar], name: str, read: Read) -> Iterator[tuple[str, bytes]]:
    """The files of one sequence, by path relative to the pool."""
    labels: list[str] = []
    for sidecar in sequence:
        frame = sidecar.record.frame
        for camera, path in pictures_of(split, sidecar.record).items():
            yield f"{FOLDERS[camera]}/{name}/{frame:06d}.png", read(path)
        if SCAN in sidecar.auxiliary:
            yield f"velodyne/{name}/{frame:06d}.bin", read(sidecar.auxiliary[SCAN].path)
        labels += _labels(sidecar, f"{split.info.split}/label_2/{sidecar.record.index:06d}.txt", read)
    records = records_of(sequence)
    yield f"label_02/{name}.txt", "".join(f"{line}\n" for line in labels).encode()
    yield f"calib/{name}.txt", format_tracking_calibration(calibration_of(records[0]))
    yield f"oxts/{name}.txt", "".join(f"{line}\n" for line in oxts_lines(EgoMotion.of(records))).encode()


def _labels(sidecar: Sidecar, path: str, read: Read) -> list[str]:
    """The lines of one frame. The objects of the sidecar have the order of the lines in the label file.

    Raises:
        DatasetError: the sidecar has another number of objects than the label file has lines.
    """
    labels = parse_labels(read(path).decode())
    objects = sidecar.facts["objects"]
    if len(objects) != len(labels):
        raise DatasetError(
            path, f"has {len(labels)} lines, its sidecar {len(objects)} objects; collect the split again"
        )
    return [
        kitti_track_line(sidecar.record.frame, int(thing["object_id"]), label)
        for thing, label in zip(objects, labels, strict=True)
    ]


LAYOUT = Layout(
    tasks=("stereo3d",),
    summary="KITTI tracking: image_02, image_03, label_02 with track ids, calib, oxts; of driving sequences",
    tree=kitti_tracking_tree,
)
