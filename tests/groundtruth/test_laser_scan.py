import numpy as np
import pytest

from gear.groundtruth.laser_scan import (
    BEAMS,
    CY_PX,
    FIRINGS,
    FOCAL_PX,
    HEIGHT_PX,
    VELODYNE_FROM_CAMERA,
    VIEWS,
    WIDTH_PX,
    scan_cameras,
    scan_points,
)
from gear.values.geometry import RigidTransform
from gear.values.rig import CameraMount, Rig

HEIGHT_M = 1.65


def plane_depth(number: int, normal: np.ndarray, offset_m: float) -> np.ndarray:
    """Depth of the plane `normal · p = offset` in one view, by its pinhole; the scanner is the origin of p."""
    reference, camera = cameras(number)
    rows, columns = np.mgrid[:HEIGHT_PX, :WIDTH_PX]
    rays = np.stack([(columns - (WIDTH_PX - 1) / 2) / FOCAL_PX, (rows - CY_PX) / FOCAL_PX, np.ones(rows.shape)], -1)
    turned = reference.rotation.T @ camera.rotation
    towards = rays @ (VELODYNE_FROM_CAMERA @ turned).T @ normal
    with np.errstate(divide="ignore"):
        depth_m = offset_m / towards
    return np.where(depth_m > 0, depth_m, np.nan).astype(np.float32)


def cameras(number: int) -> tuple[RigidTransform, RigidTransform]:
    rig = Rig(cameras=(CameraMount(name="left", width_px=64, height_px=32),))
    (reference,) = rig.place(RigidTransform.from_yaw("world", "ego", (3.0, -2.0, 0.0), 0.6))
    found = scan_cameras(reference)
    assert len(found) == VIEWS and found[number].intrinsics.height_px == HEIGHT_PX
    return reference.world_from_camera_transform, found[number].world_from_camera_transform


def ground() -> np.ndarray:
    return scan_points([plane_depth(number, np.array([0.0, 0.0, 1.0]), -HEIGHT_M) for number in range(VIEWS)])


def test_the_ground_is_flat_rings() -> None:
    points = ground()
    assert points.dtype == np.float32 and points.shape[1] == 4
    assert points[:, 2] == pytest.approx(-HEIGHT_M, abs=1e-4)
    ranges = np.linalg.norm(points[:, :3], axis=1)
    assert ranges.max() <= 120 and ranges.min() == pytest.approx(HEIGHT_M / np.sin(np.radians(24.9)), rel=0.01)
    # A ring is a beam: all that look down by more than what 120 m take.
    down = np.radians(np.linspace(2.0, -24.9, BEAMS))
    whole = (HEIGHT_M / np.sin(np.maximum(-down, 1e-9)) < 118).sum()
    assert len(points) >= whole * FIRINGS
    last = np.arcsin(points[-FIRINGS:, 2] / ranges[-FIRINGS:])
    assert np.degrees(last) == pytest.approx(-24.9, abs=0.05)


def test_azimuths_run_once_around_from_ahead_to_the_left() -> None:
    ring = ground()[-FIRINGS:]
    azimuth = np.degrees(np.unwrap(np.arctan2(ring[:, 1], ring[:, 0])))
    assert azimuth == pytest.approx(np.arange(FIRINGS) * 360 / FIRINGS, abs=0.05)


def test_intensity_is_the_cosine_at_the_surface() -> None:
    ring = ground()[-FIRINGS:]
    assert ring[:, 3] == pytest.approx(np.sin(np.radians(24.9)), abs=0.01)


@pytest.mark.parametrize(
    ("normal", "axis", "sign"),
    [((1, 0, 0), 0, 1), ((0, 1, 0), 1, 1), ((-1, 0, 0), 0, -1), ((0, -1, 0), 1, -1)],
    ids=["ahead", "left", "behind", "right"],
)
def test_a_wall_stands_where_it_is(normal: tuple[int, int, int], axis: int, sign: int) -> None:
    points = scan_points([plane_depth(number, np.array(normal, float), 20.0) for number in range(VIEWS)])
    assert points[:, axis] == pytest.approx(sign * 20.0, abs=1e-3)
    assert len(points) > BEAMS * FIRINGS / 3
    nearest = np.linalg.norm(points[:, :3], axis=1).argmin()
    assert points[nearest, 3] == pytest.approx(1.0, abs=1e-3)


def test_nothing_and_what_is_too_near_or_too_far_gives_no_point() -> None:
    for depth_m in (np.nan, 0.4, 130.0):
        views = [np.full((HEIGHT_PX, WIDTH_PX), depth_m, np.float32)] * VIEWS
        assert scan_points(views).shape == (0, 4)
