import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gear.formats.kitti_object import (
    Calibration,
    KittiLabel,
    clip_box,
    dont_care,
    format_calibration,
    format_label,
    format_labels,
    from_edge_pixels,
    label_corners,
    occlusion_level,
    parse_calibration,
    parse_label,
    parse_labels,
    read_baseline_m,
    split_lists,
    truncation,
)
from gear.values.geometry import Intrinsics

PINHOLE = Intrinsics(1224, 370, 612.0)
number = st.floats(-500, 1500).map(lambda v: round(v, 2) + 0.0)
angle = st.floats(-math.pi, math.pi).map(lambda v: round(v, 2) + 0.0)
labels = st.builds(
    KittiLabel,
    type=st.sampled_from(["Car", "Van", "Truck", "Pedestrian", "Cyclist", "Misc"]),
    truncated=st.floats(0, 1).map(lambda v: round(v, 2)),
    occluded=st.integers(0, 3),
    alpha_rad=angle,
    box_px=st.tuples(number, number, number, number),
    height_m=number,
    width_m=number,
    length_m=number,
    location_m=st.tuples(number, number, number),
    rotation_y_rad=angle,
    score=st.none() | st.floats(0, 1).map(lambda v: round(v, 4)),
)


@given(st.lists(labels, max_size=5))
def test_lines_parse_back(several: list[KittiLabel]) -> None:
    text = format_labels(several).decode()
    assert list(parse_labels(text)) == several


@given(labels)
def test_lines_have_the_benchmarks_form(label: KittiLabel) -> None:
    line = format_label(label)
    fields = line.split(" ")
    assert len(fields) == (15 if label.score is None else 16)
    assert re.fullmatch(r"[0-3]", fields[2]), "occluded is an integer"
    assert all(re.fullmatch(r"-?\d+\.\d\d", field) for field in (fields[1], *fields[3:15]))
    assert "-0.00" not in fields


def test_no_field_is_a_negative_nought() -> None:
    """The devkit reads it; a comparison of files does not."""
    label = replace(parse_label("Car" + " 0" * 14), alpha_rad=-0.004, location_m=(-0.001, -0.006, 0.0))
    assert format_label(label) == "Car 0.00 0 0.00 0.00 0.00 0.00 0.00 0.00 0.00 0.00 0.00 -0.01 0.00 0.00"


def test_dont_care_is_the_benchmarks_own_line() -> None:
    line = format_label(dont_care((503.89, 169.71, 590.61, 190.13)))
    assert line == "DontCare -1 -1 -10 503.89 169.71 590.61 190.13 -1 -1 -1 -1000 -1000 -1000 -10"
    assert parse_label(line) == dont_care((503.89, 169.71, 590.61, 190.13))


@pytest.mark.parametrize("line", ["Car 0 0", "Tank" + " 0" * 14, "Car" + " x" * 14])
def test_bad_lines_are_refused(line: str) -> None:
    with pytest.raises(ValueError, match=r"fields|type|float"):
        parse_label(line)


def test_corners_project_into_the_published_box() -> None:
    ry = -0.7854
    label = KittiLabel(type="Car", truncated=0, occluded=0, alpha_rad=0, box_px=(0, 0, 0, 0), height_m=1.5, width_m=1.8,
                       length_m=4.2, location_m=(1.794, 1.650, 14.892), rotation_y_rad=ry)  # fmt: skip
    corners = label_corners(label)
    assert (corners[:4, 1] == 1.65).all() and (corners[4:, 1] == pytest.approx(0.15))
    # Front corners come first on the object's right and left; the front looks along (cos ry, 0, -sin ry).
    front = corners[[0, 1, 4, 5]].mean(axis=0) - corners[[2, 3, 6, 7]].mean(axis=0)
    np.testing.assert_allclose(front / 4.2, [math.cos(ry), 0, -math.sin(ry)], atol=1e-9)
    pixels = PINHOLE.project(corners)
    box = (*pixels.min(axis=0), *pixels.max(axis=0))
    assert box == pytest.approx((597.25, 189.90, 763.74, 263.57), abs=0.03)


def test_calibration_has_seven_lines_in_order() -> None:
    text = format_calibration(Calibration(intrinsics=PINHOLE, baseline_m=0.54)).decode()
    lines = text.splitlines()
    names = ["P0", "P1", "P2", "P3", "R0_rect", "Tr_velo_to_cam", "Tr_imu_to_velo"]
    assert [line.split(":")[0] for line in lines] == names
    assert all(line == line.rstrip() and "  " not in line for line in lines)
    assert "-0.0" not in text.replace("e-", "e")
    matrices = parse_calibration(text)
    assert matrices["P3"][0, 3] == pytest.approx(-330.48)
    assert matrices["P2"][0, 3] == 0 and (matrices["P0"] == matrices["P2"]).all()
    assert (matrices["P1"] == matrices["P3"]).all()
    assert matrices["P2"][:, :3] == pytest.approx(np.array([[612, 0, 611.5], [0, 612, 184.5], [0, 0, 1]]))
    assert read_baseline_m(matrices) == pytest.approx(0.54)


def test_the_chain_from_the_scanner_ends_in_the_picture() -> None:
    matrices = parse_calibration(format_calibration(Calibration(intrinsics=PINHOLE, baseline_m=0.54)).decode())
    ahead_left_up = np.array([10.0, 2.0, 1.0, 1.0])
    camera = matrices["R0_rect"] @ matrices["Tr_velo_to_cam"] @ ahead_left_up
    assert camera == pytest.approx([-2.0, -1.0, 10.0])
    for name, offset in (("P2", 0.0), ("P3", 0.54)):
        x, y, w = matrices[name] @ [*camera, 1.0]
        assert (x / w, y / w) == pytest.approx((611.5 + 612 * (-2 - offset) / 10, 184.5 - 61.2))


def test_boxes_are_clipped_to_index_pixels() -> None:
    assert clip_box((-5.0, -6.0, 1300.0, 400.0), PINHOLE) == (0.0, 0.0, 1223.0, 369.0)
    assert clip_box((5.0, 6.0, 7.0, 9.0), PINHOLE) == (5.0, 6.0, 7.0, 9.0)
    for outside in ((-50.0, 10.0, -5.0, 20.0), (1224.0, 10.0, 1300.0, 20.0), (5.0, -9.0, 9.0, -1.0), (5, 370, 9, 400)):
        assert clip_box(outside, PINHOLE) is None


def test_truncation_is_the_share_of_the_box_outside() -> None:
    box = (-100.0, 0.0, 100.0, 100.0)
    clipped = clip_box(box, PINHOLE)
    assert clipped is not None
    assert truncation(box, clipped) == pytest.approx(0.5)
    assert truncation((-100.0, -300.0, 100.0, 100.0), (0.0, 0.0, 100.0, 100.0)) == pytest.approx(7 / 8)
    assert truncation((3.0, 4.0, 3.0, 9.0), (3.0, 4.0, 3.0, 9.0)) == 0.0, "a box without an area lies nowhere else"


@pytest.mark.parametrize(
    ("visible", "level"), [(1.0, 0), (0.8, 0), (0.79, 1), (0.5, 1), (0.49, 2), (0.1, 2), (0.09, 3), (0.0, 3)]
)
def test_occlusion_levels(visible: float, level: int) -> None:
    assert occlusion_level(visible) == level


def test_boxes_in_edge_pixels_become_boxes_in_index_pixels_inside_the_picture() -> None:
    """A mask of columns 3 to 7 has the edges 3 and 8, half a pixel outside the outermost centres."""
    width, height = PINHOLE.width_px, PINHOLE.height_px
    assert from_edge_pixels((3.0, 4.0, 8.0, 9.25), PINHOLE) == (2.5, 3.5, 7.5, 8.75)
    assert from_edge_pixels((0.0, 0.0, width, height), PINHOLE) == (0.0, 0.0, width - 1, height - 1)


def test_lists_end_as_their_readers_want() -> None:
    files = split_lists("val", ["000000", "000001"])
    assert files == {"ImageSets/val.txt": b"000000\n000001\n", "splits/val.txt": b"000000\n000001"}
