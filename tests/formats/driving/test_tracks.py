"""Lines of tracking benchmarks, read by the definitions of their development kits."""

from __future__ import annotations

import configparser

import pytest

from gear.formats.driving.tracks import (
    format_tracking_calibration,
    kitti_sequence_map,
    kitti_track_line,
    mot_line,
    mot_sequence_info,
    truncation_level,
)
from gear.formats.kitti_object import Calibration, KittiLabel, dont_care, format_calibration, parse_calibration
from gear.values.geometry import Intrinsics

CAR = KittiLabel(
    type="Car", truncated=0.3, occluded=2, alpha_rad=-0.5, box_px=(1.25, 2.0, 30.0, 12.5), height_m=1.5, width_m=1.8,
    length_m=4.2, location_m=(-1.0, 1.65, 12.0), rotation_y_rad=0.25,
)  # fmt: skip


def test_a_line_of_kitti_tracking_has_17_fields() -> None:
    fields = kitti_track_line(7, 12, CAR).split(" ")
    assert fields[:5] == ["7", "12", "Car", "1", "2"], "frame, track, type, and integer truncation and occlusion"
    assert [float(field) for field in fields[5:]] == [-0.5, 1.25, 2, 30, 12.5, 1.5, 1.8, 4.2, -1, 1.65, 12, 0.25]
    ignored = kitti_track_line(7, 12, dont_care((1.0, 2.0, 3.0, 4.0))).split(" ")
    assert ignored[:3] == ["7", "-1", "DontCare"] and len(ignored) == 17


def test_truncation_has_three_levels() -> None:
    assert [truncation_level(share) for share in (0.0, 0.009, 0.01, 0.49, 0.5, 1.0)] == [0, 0, 1, 1, 2, 2]


def test_the_calibration_says_the_same_as_that_of_the_object_benchmark() -> None:
    calibration = Calibration(intrinsics=Intrinsics(32, 16, 16.0), baseline_m=0.5)
    known = parse_calibration(format_calibration(calibration).decode())
    lines = format_tracking_calibration(calibration).decode().splitlines()
    values = {line.split()[0]: [float(field) for field in line.split()[1:]] for line in lines}
    names = {"R_rect": "R0_rect", "Tr_velo_cam": "Tr_velo_to_cam", "Tr_imu_velo": "Tr_imu_to_velo"}
    assert list(values) == ["P0:", "P1:", "P2:", "P3:", *names]
    for name, numbers in values.items():
        assert numbers == known[names.get(name, name.rstrip(":"))].reshape(-1).tolist()


def test_the_sequence_map_counts_frames() -> None:
    assert kitti_sequence_map([5, 105]).decode() == "0000 empty 000000 000005\n0001 empty 000000 000105\n"


def test_a_line_of_the_motchallenge_counts_from_one() -> None:
    line = mot_line(0, 3, (0.0, 10.0, 5.5, 30.0), 1, 0.25, is_evaluated=True)
    assert [float(field) for field in line.split(",")] == [1, 3, 1, 11, 5.5, 20, 1, 1, 0.25]
    assert mot_line(0, 3, (0.0, 10.0, 5.5, 30.0), 1, 0.25, is_evaluated=False).split(",")[6] == "0"


def test_sequence_info_is_an_ini_file() -> None:
    read = configparser.ConfigParser()
    read.read_string(mot_sequence_info("gear-01", 105, 0.1, (1333, 800)).decode())
    section = read["Sequence"]
    assert section["name"] == "gear-01" and section.getint("seqLength") == 105
    assert section.getfloat("frameRate") == pytest.approx(10)
    assert (section.getint("imWidth"), section.getint("imHeight"), section["imExt"]) == (1333, 800, ".png")
