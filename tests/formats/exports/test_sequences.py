"""Driving sequences of a dataset, and their pictures and calibration."""

from __future__ import annotations

import pytest

from gear.formats.exports.sequences import calibration_of, driving_splits, pictures_of, records_of, sequences_of
from gear.values.errors import DatasetError
from tests.formats.driving.drives import circle, split_with


def test_splits_of_single_pictures_are_left_out() -> None:
    drive = split_with((*circle(3), *circle(3, sequence=1, start=3)), "depth")
    single = split_with((*circle(1), *circle(1, sequence=1, start=1)), "depth", split="train")
    assert driving_splits([single, drive], "kitti-raw") == [drive]
    with pytest.raises(DatasetError, match=r"split train: has single pictures only.*'kitti-raw'.*--split video"):
        driving_splits([single], "kitti-raw")


def test_sequences_stay_together() -> None:
    split = split_with((*circle(3), *circle(2, sequence=1, start=3)), "depth")
    found = [[record.index for record in records_of(sequence)] for sequence in sequences_of(split)]
    assert found == [[0, 1, 2], [3, 4]]


def test_pictures_lie_where_the_tasks_write_them() -> None:
    record = circle(2, start=7)[1]
    left = {task: pictures_of(split_with((record,), task), record)["left"] for task in ("detect2d", "depth", "semseg")}
    assert left["detect2d"] == "images/video/rgb_0008.png" and left["depth"] == "leftImg8bit/video/rgb_0008.png"
    assert left["semseg"].startswith("leftImg8bit/video/") and left["semseg"].endswith("000000_000001_leftImg8bit.png")
    stereo = pictures_of(split_with((record,), "stereo3d"), record)
    assert stereo == {"left": "video/image_2/000008.png", "right": "video/image_3/000008.png"}


def test_the_baseline_is_that_of_the_record() -> None:
    assert calibration_of(circle(1, is_stereo=True)[0]).baseline_m == pytest.approx(0.54)
    assert calibration_of(circle(1)[0]).baseline_m == 0.0
