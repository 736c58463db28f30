"""The 3D stage on cars whose boxes, corner and pictures are known exactly."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from gear.formats.kitti_object import Calibration, clip_box
from gear.groundtruth.boxes import Box3d, project_box
from gear.networks.stereo.alignment import Pair, align
from gear.networks.stereo.box_solver import Measured, solve_box
from gear.networks.stereo.object_surface import depth_of_box
from gear.networks.stereo.rcnn_losses import ground_corners
from gear.values.geometry import Array, Intrinsics, wrap_angle_rad

CALIBRATION = Calibration(intrinsics=Intrinsics.from_hfov(1224, 370, math.radians(90)), baseline_m=0.54)


def car(x_m: float, z_m: float, rotation_y_rad: float) -> Box3d:
    return Box3d(
        height_m=1.5,
        width_m=1.7,
        length_m=4.2,
        bottom_m=(x_m, 1.65, z_m),
        rotation_y_rad=wrap_angle_rad(rotation_y_rad),
    )


def measure(box: Box3d) -> Measured:
    """What a perfect network would say."""
    lens = CALIBRATION.intrinsics
    pair = []
    for right_m in (0.0, CALIBRATION.baseline_m):
        projected = project_box(box.corners_m - (right_m, 0.0, 0.0), lens)
        clipped = clip_box(projected, lens) if projected else None
        assert clipped is not None
        pair.append(clipped)
    corners = ground_corners(box)
    corner = int(corners[:, 2].argmin())
    return Measured(
        left_px=pair[0],
        right_sides_px=(pair[1][0], pair[1][2]),
        corner=corner,
        corner_px=float(lens.project(corners[corner])[0]),
        borders_px=(pair[0][0], pair[0][2]),
        width_m=box.width_m,
        height_m=box.height_m,
        length_m=box.length_m,
        alpha_rad=box.alpha_rad,
    )


def off_m(found: Box3d | None, box: Box3d) -> float:
    assert found is not None
    return math.dist(found.bottom_m, box.bottom_m)


@pytest.mark.parametrize("x_m", [-6.0, -1.0, 2.5])
@pytest.mark.parametrize("z_m", [9.0, 16.0, 35.0])
@pytest.mark.parametrize("rotation_y_rad", [-2.6, -1.9, -1.2, -0.5, 0.4, 1.1, 1.9, 2.8])
def test_exact_measurements_give_the_box_back(x_m: float, z_m: float, rotation_y_rad: float) -> None:
    box = car(x_m, z_m, rotation_y_rad)
    found = solve_box(measure(box), CALIBRATION)
    assert off_m(found, box) < 0.01
    assert found is not None
    assert abs(wrap_angle_rad(found.rotation_y_rad - box.rotation_y_rad)) < 0.005


def test_a_car_straight_ahead_is_found() -> None:
    """Seen from behind, no corner lies between the sides: the measured one is a side itself."""
    box = car(0.0, 14.0, -math.pi / 2)
    found = solve_box(measure(box), CALIBRATION)
    assert off_m(found, box) < 0.02


def test_a_known_depth_is_kept() -> None:
    """Position and direction then follow from the left picture alone, whatever the right one says."""
    box = car(2.0, 15.0, -1.0)
    measured = replace(measure(box), right_sides_px=(5.0, 9.0))
    found = solve_box(measured, CALIBRATION, depth_m=15.0)
    assert off_m(found, box) < 0.01 and found is not None and found.bottom_m[2] == 15.0


def test_a_car_that_the_picture_cuts_is_placed_by_its_angle() -> None:
    """Its left side lies outside; the corner is not asked."""
    box = car(-6.5, 8.0, -1.3)
    measured = measure(box)
    assert measured.left_px[0] == 0
    found = solve_box(replace(measured, corner_px=600.0), CALIBRATION)
    assert off_m(found, box) < 0.05


def test_a_pixel_of_error_is_a_small_error() -> None:
    """Half a pixel of disparity at 12 m would be 2 % of the depth; the box's height holds against it."""
    box = car(1.0, 12.0, -0.8)
    measured = measure(box)
    left, top, right, bottom = measured.left_px
    found = solve_box(replace(measured, left_px=(left + 0.5, top - 0.5, right + 0.5, bottom)), CALIBRATION)
    assert 0.001 < off_m(found, box) < 0.25


@pytest.mark.parametrize(
    "change",
    [
        {"borders_px": (600.0, 602.0)},
        {"left_px": (600.0, 180.0, 606.0, 220.0)},
        {"right_sides_px": (700.0, 800.0)},
    ],
)
def test_what_cannot_be_solved_is_nothing(change: dict[str, tuple[float, ...]]) -> None:
    measured = measure(car(0.5, 12.0, -1.0))
    assert solve_box(replace(measured, **change), CALIBRATION) is None  # type: ignore[arg-type]


def test_rays_enter_the_box_where_its_faces_are() -> None:
    """A box head-on: its near face is half its length before its middle; beside it the rays miss."""
    box = Box3d(height_m=2.0, width_m=2.0, length_m=4.0, bottom_m=(0.0, 1.0, 10.0), rotation_y_rad=-math.pi / 2)
    rays = np.array([[0.0, 0.0, 1.0], [0.1, 0.0, 1.0], [0.3, 0.0, 1.0], [0.0, 0.2, 1.0]])
    assert depth_of_box(box, rays) == pytest.approx([8.0, 8.0, math.nan, math.nan], nan_ok=True)


def textured(box: Box3d, scale: float) -> Pair:
    """A pair that shows the box, painted all over, before a background at 60 m."""
    width, height = round(1224 * scale), round(370 * scale)
    u, v = np.meshgrid(np.arange(width), np.arange(height))
    pixels = (np.stack([u, v], axis=-1) + 0.5) / scale - 0.5
    lens = CALIBRATION.intrinsics
    rays = lens.unproject(pixels, np.ones(pixels.shape[:2])).reshape(-1, 3)
    pictures = []
    for right_m in (0.0, CALIBRATION.baseline_m):
        x, y, z = box.bottom_m
        depth_m = depth_of_box(replace(box, bottom_m=(x - right_m, y, z)), rays)
        points = rays * np.where(np.isfinite(depth_m), depth_m, 60.0)[:, None] + (right_m, 0.0, 0.0)
        pictures.append(torch.from_numpy(paint(points).reshape(height, width, 3)).permute(2, 0, 1)[None].float())
    return Pair(left=pictures[0], right=pictures[1], scale=scale)


def paint(points_m: Array) -> Array:
    """Smooth colours of places, without repetition within a car's length."""
    frequencies = np.array([[2.1, 3.3, 1.7], [0.9, 2.3, 2.9], [3.1, 0.7, 1.3]])
    return np.asarray(127 + 60 * np.sin(points_m @ frequencies.T) + 60 * np.sin(0.37 * points_m @ frequencies))


@pytest.mark.parametrize("rotation_y_rad", [-math.pi / 2, -0.9, 0.1])
@pytest.mark.parametrize("error_m", [-2.3, 0.8, 4.0])
def test_pictures_give_the_depth_back(rotation_y_rad: float, error_m: float) -> None:
    """From a guess that is metres off, to the step of the fine search."""
    box = car(1.5, 13.0, rotation_y_rad)
    pair = textured(box, 2.0)
    x, y, z = box.bottom_m
    guess = replace(box, bottom_m=(x * (z + error_m) / z, y * (z + error_m) / z, z + error_m))
    # The guess has its surface where the true one is seen, as a box solved from the left picture has.
    scaled = (z + error_m) / z
    guess = replace(guess, height_m=1.5 * scaled, width_m=1.7 * scaled, length_m=4.2 * scaled)
    found = align(pair, guess, measure(box), CALIBRATION)
    exact = align(pair, box, measure(box), CALIBRATION)
    assert exact == pytest.approx(13.0, abs=0.051)
    assert found == pytest.approx(13.0, abs=0.4 + 0.1 * abs(error_m))


def test_nothing_to_look_at_is_said() -> None:
    box = car(1.5, 13.0, -1.0)
    pair = textured(box, 1.0)
    measured = replace(measure(box), borders_px=(20.0, 60.0))
    assert align(pair, box, measured, CALIBRATION) is None
