"""KITTI raw data: a drive for each sequence, a date for each split."""

from __future__ import annotations

from dataclasses import replace

from gear.formats.exports.kitti_raw import kitti_raw_tree
from gear.formats.exports.layout import NoOptions
from tests.formats.driving.drives import circle, split_with


def test_each_sequence_is_a_drive() -> None:
    records = (*circle(3, is_stereo=True), *circle(2, sequence=1, start=3, is_stereo=True))
    splits = [split_with(records, "stereo3d"), split_with(circle(2), "stereo3d", split="video_night")]
    files = dict(kitti_raw_tree(splits, str.encode, NoOptions()))
    drive = "2022_01_01/2022_01_01_drive_0002_sync"
    assert files[f"{drive}/image_03/data/0000000001.png"] == b"video/image_3/000004.png"
    assert len(files[f"{drive}/oxts/data/0000000001.txt"].split()) == 30
    assert files[f"{drive}/oxts/timestamps.txt"] == files[f"{drive}/image_02/timestamps.txt"]
    assert files[f"{drive}/oxts/timestamps.txt"].count(b"\n") == 2
    assert {path.split("/")[0] for path in files} == {"2022_01_01", "2022_01_02"}, "splits may have other cameras"
    assert "2022_01_02/calib_cam_to_cam.txt" in files
    assert not any("velodyne" in path for path in files), "there are no scans"


def test_no_two_splits_have_the_same_date() -> None:
    splits = [split_with(circle(2), "depth", split=name) for name in ("video_b", "video_a")]
    dates = ("2022-01-02", "2022-01-01")
    dated = [replace(one, info=replace(one.info, created=date)) for one, date in zip(splits, dates, strict=True)]
    files = dict(kitti_raw_tree(dated, str.encode, NoOptions()))
    pictures = {path.split("/")[0]: data.decode().split("/")[1] for path, data in files.items() if ".png" in path}
    assert pictures == {"2022_01_01": "video_b", "2022_01_02": "video_a"}
