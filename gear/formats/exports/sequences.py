"""Shared by the layouts of driving sequences: the sequences of a dataset, and their pictures and calibration."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import wraps
from itertools import groupby, pairwise
from typing import TypeVar

from gear.contracts.tasks import Sidecar
from gear.formats.cityscapes import paths as cityscapes_paths
from gear.formats.exports.layout import ExportSplit, Read, Tree
from gear.formats.kitti_object import Calibration
from gear.values.errors import DatasetError
from gear.values.scene import SceneRecord

TASKS = ("detect2d", "semseg", "stereo3d", "depth")
"""Tasks whose pictures `pictures_of` finds."""

IMPOSSIBLE = (LookupError, TypeError, ValueError, ArithmeticError, AttributeError)
"""Errors that impossible values of metadata cause."""

LONGEST = 200
"""Largest number of characters of such an error in a message."""

Options = TypeVar("Options")


def driving_splits(splits: Sequence[ExportSplit], layout: str) -> list[ExportSplit]:
    """The splits that consist of driving sequences; splits of single pictures are left out.

    Args:
        splits: the finished splits of the dataset.
        layout: name of the layout that needs sequences, for the error message.

    Raises:
        DatasetError: the dataset has no driving sequence.
    """
    driving = [split for split in splits if len(split.sidecars) > 1 and split.sidecars[1].record.frame == 1]
    if not driving:
        names = ", ".join(split.info.split for split in splits)
        problem = f"has single pictures only; the layout {layout!r} is for driving sequences (collect --split video)"
        raise DatasetError(f"split {names}", problem)
    return driving


def sequences_of(split: ExportSplit) -> Iterator[list[Sidecar]]:
    """The sidecars of each sequence of a split, in order of time.

    Args:
        split: the split.

    Raises:
        DatasetError: a sequence has fewer than two frames, its frames do not count from 0, or its times do not
            increase.
    """
    for number, group in groupby(split.sidecars, key=lambda sidecar: sidecar.record.sequence):
        sequence = list(group)
        frames = [sidecar.record.frame for sidecar in sequence]
        times_s = [sidecar.record.time_s for sidecar in sequence]
        if len(sequence) < 2:
            problem = "has one frame only; a driving sequence has at least two"
        elif frames != list(range(len(sequence))):
            problem = f"has frames that do not count from 0 to {len(sequence) - 1}"
        elif not all(before < after for before, after in pairwise(times_s)):
            problem = "has frames whose times do not increase"
        else:
            yield sequence
            continue
        raise DatasetError(f"split {split.info.split}", f"sequence {number} {problem}")


def explained_content(
    tree: Callable[[Sequence[ExportSplit], Read, Options], Tree],
) -> Callable[[Sequence[ExportSplit], Read, Options], Tree]:
    """Makes a function of a layout report impossible content of sidecars and label files in one line.

    The files of a dataset may come from another person. The functions of layouts read the metadata of a task (`facts`),
    which nothing has checked before.

    Args:
        tree: function that yields the files of a layout.

    Returns:
        A function with the arguments of `tree` that raises `DatasetError` in place of the errors in `IMPOSSIBLE`.
    """

    @wraps(tree)
    def explained(splits: Sequence[ExportSplit], read: Read, options: Options) -> Tree:
        try:
            yield from tree(splits, read, options)
        except IMPOSSIBLE as error:
            names = ", ".join(split.info.split for split in splits)
            problem = f"holds impossible values ({repr(error)[:LONGEST]}); collect the split again"
            raise DatasetError(f"split {names}", problem) from error

    return explained


def records_of(sequence: Sequence[Sidecar]) -> list[SceneRecord]:
    """The scene records of a sequence, in order of time.

    Args:
        sequence: sidecars (JSON files of the samples) of the sequence.
    """
    return [sidecar.record for sidecar in sequence]


def pictures_of(split: ExportSplit, record: SceneRecord) -> Mapping[str, str]:
    """The paths of the left picture and, in a stereo dataset, of the right picture of a sample, by camera name.

    The paths are relative to the root of the dataset; the task of the split is one of `TASKS`.

    Args:
        split: the split to which the sample belongs.
        record: scene record of the sample.
    """
    name, index = split.info.split, record.index
    match split.task:
        case "stereo3d":
            return {"left": f"{name}/image_2/{index:06d}.png", "right": f"{name}/image_3/{index:06d}.png"}
        case "detect2d":
            return {"left": f"images/{name}/rgb_{index:04d}.png"}
        case "depth":
            return {"left": f"leftImg8bit/{name}/rgb_{index:04d}.png"}
        case _:
            return {"left": cityscapes_paths(split.info.town, name, record.sequence, record.frame).image}


def calibration_of(record: SceneRecord) -> Calibration:
    """The calibration of a sample's cameras; with one camera, the baseline is 0.

    Args:
        record: scene record of the sample.
    """
    left = record.cameras[0]
    right_m = 0.0
    if len(record.cameras) > 1:
        left_from_world = left.world_from_camera_transform.inverse()
        offset_m = left_from_world.apply(record.cameras[1].world_from_camera.position_m)
        right_m = round(float(offset_m[0]), 6)
    return Calibration(intrinsics=left.intrinsics, baseline_m=right_m)
