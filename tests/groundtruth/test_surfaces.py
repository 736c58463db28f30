import math

import numpy as np
import pytest

from gear.camera.effects import Lens
from gear.camera.effects.lens import undistorted
from gear.formats import rle
from gear.groundtruth.silhouettes import clip_near
from gear.groundtruth.surfaces import observe_surfaces
from gear.testing.synthetic import behind_lens, synthetic_frame
from gear.testing.things import CAR, Part, Thing, board
from gear.values.geometry import Intrinsics
from gear.values.ground_truth import SurfaceTruth
from gear.values.rig import CameraMount, Rig

RIG = Rig(cameras=(CameraMount(name="left", width_px=612, height_px=306),))


def observe(things: list[Thing]) -> tuple[SurfaceTruth, np.ndarray]:
    frame, record = synthetic_frame(RIG, things)
    view = frame.views["left"]
    (truth,) = observe_surfaces(view, frame.geoms, record)
    face = np.isin(view.geom_id, np.flatnonzero(frame.geoms.surface_index == 0))
    return truth, face


def test_a_board_ahead() -> None:
    truth, face = observe([board(20.0)])
    assert truth.name == "surface_0" and truth.camera == "left"
    assert truth.corners_px is not None and truth.image_from_unit is not None
    # 18.5 m ahead of the camera at focal length 306: 7.4 m x 3.7 m, its middle 0.35 m above the camera.
    x, y = 7.4 / 2 * 306 / 18.5, 3.7 / 2 * 306 / 18.5
    middle = 152.5 - 0.35 * 306 / 18.5
    expected = [(305.5 - x, middle - y), (305.5 + x, middle - y), (305.5 + x, middle + y), (305.5 - x, middle + y)]
    np.testing.assert_allclose(truth.corners_px, expected, atol=1e-5)
    assert truth.visible_px == face.sum()
    assert truth.visible_fraction == pytest.approx(1.0, abs=0.02)
    np.testing.assert_array_equal(rle.decode(truth.mask_rle, 306, 612), face)
    assert truth.distance_m == pytest.approx(math.hypot(18.5, 0.35))
    assert truth.incidence_deg == pytest.approx(math.degrees(math.atan2(0.35, 18.5)))


def test_the_homography_takes_the_patch_to_the_picture() -> None:
    truth, face = observe([board(15.0, 4.0)])
    assert truth.image_from_unit is not None and truth.corners_px is not None
    homography = np.array(truth.image_from_unit).reshape(3, 3)
    for (u, v), corner in zip(((0, 0), (1, 0), (1, 1), (0, 1)), truth.corners_px, strict=True):
        x, y, w = homography @ [u, v, 1]
        assert (x / w, y / w) == pytest.approx(corner, abs=1e-4)
    # Every pixel of the face comes from inside the patch, every other one from outside.
    rows, columns = np.nonzero(face)
    unit = np.linalg.inv(homography) @ [columns, rows, np.ones(len(rows))]
    unit = unit[:2] / unit[2]
    assert unit.min() > -1e-3 and unit.max() < 1 + 1e-3


def test_occluders_take_from_the_visible_share() -> None:
    car = Thing(parts=CAR, position_m=(9.0, 0.0, 0.0), object_id=2, role="npc")
    clear, _ = observe([board(20.0)])
    covered, face = observe([board(20.0), car])
    assert covered.visible_px == face.sum() < clear.visible_px
    assert covered.visible_fraction == pytest.approx(covered.visible_px / clear.visible_px, abs=0.02)
    assert covered.corners_px == clear.corners_px


def test_a_board_half_outside_says_so() -> None:
    truth, _ = observe([board(9.0, 7.5)])
    assert truth.corners_px is not None and truth.corners_px[0][0] < 0
    assert 0.3 < truth.visible_fraction < 0.7


def test_a_board_behind_has_no_corners() -> None:
    truth, _ = observe([board(-15.0)])
    assert truth.corners_px is None and truth.image_from_unit is None
    assert truth.visible_px == 0 and truth.visible_fraction == 0.0
    assert truth.incidence_deg > 90


@pytest.mark.parametrize("yaw_rad", [1.3, math.pi / 2, 1.8])
def test_of_a_board_beside_the_camera_the_share_is_of_what_the_near_plane_leaves(yaw_rad: float) -> None:
    beside = Thing(parts=board(0.0).parts, position_m=(3.0, 2.0, 0.0), yaw_rad=yaw_rad)
    truth, face = observe([beside])
    assert truth.corners_px is None and truth.visible_px == face.sum() > 1000
    camera_from_surface = np.array(truth.camera_from_surface).reshape(4, 4)
    halves = np.array([[-3.7, -1.85, 0, 1], [3.7, -1.85, 0, 1], [3.7, 1.85, 0, 1], [-3.7, 1.85, 0, 1]])
    corners_m = (halves @ camera_from_surface.T)[:, :3]
    pixels = Intrinsics(612, 306, 306.0).project(clip_near(corners_m[[[0, 1, 2], [0, 2, 3]]]))
    area_px2 = sum(abs(np.linalg.det([b - a, c - a])) / 2 for a, b, c in pixels)
    assert truth.visible_fraction == pytest.approx(truth.visible_px / area_px2, rel=5e-3)


def test_a_surface_rides_on_its_actor() -> None:
    body = Part(label="truck", centre_m=(0.0, 0.0, 1.8), size_m=(8.0, 2.5, 3.6))
    face = Part(label="truck", centre_m=(-4.01, 0.0, 1.8), size_m=(0.02, 2.2, 2.4), surface=0)
    truck = Thing(parts=(body, face), position_m=(16.0, -1.0, 0.0), yaw_rad=0.2, object_id=5, role="carrier")
    truth, seen = observe([truck])
    assert truth.corners_px is not None
    rows, columns = np.nonzero(seen)
    xs, ys = [c[0] for c in truth.corners_px], [c[1] for c in truth.corners_px]
    assert (columns.min(), columns.max()) == pytest.approx((min(xs), max(xs)), abs=1)
    assert (rows.min(), rows.max()) == pytest.approx((min(ys), max(ys)), abs=1)


@pytest.mark.parametrize("k1", [-0.3, 0.3])
def test_behind_a_lens_the_visible_share_is_of_the_bent_face(k1: float) -> None:
    car = Thing(parts=CAR, position_m=(9.0, 2.0, 0.0), object_id=2, role="npc")
    truths = []
    for things in ([board(18.0, 5.0)], [board(18.0, 5.0), car]):
        frame, record = synthetic_frame(RIG, things)
        frame = behind_lens(frame, Lens(k1=k1))
        truths += observe_surfaces(frame.views["left"], frame.geoms, record)
    clear, covered = truths
    assert clear.visible_fraction == pytest.approx(1.0, abs=0.02)
    assert covered.visible_px < 0.9 * clear.visible_px
    assert covered.visible_fraction == pytest.approx(covered.visible_px / clear.visible_px, abs=0.02)


@pytest.mark.parametrize("k1", [-0.3, 0.3])
def test_behind_a_lens_the_face_is_as_large_as_its_curved_edges_enclose(k1: float) -> None:
    """Counted on a sixteenth of a pixel, each place led back through the lens and onto the face."""
    car = Thing(parts=CAR, position_m=(9.0, 2.0, 0.0), object_id=2, role="npc")
    frame, record = synthetic_frame(RIG, [board(13.0, 3.0), car])
    frame, lens = behind_lens(frame, Lens(k1=k1)), Lens(k1=k1)
    camera = frame.views["left"].camera
    (truth,) = observe_surfaces(frame.views["left"], frame.geoms, record)
    assert camera.lens is not None and truth.image_from_unit is not None and truth.visible_fraction < 0.95
    x, y = np.meshgrid(np.arange(40, 400, 0.25) - 305.875, np.arange(30, 276, 0.25) - 152.875)
    seen = undistorted(lens, np.stack([x, y], axis=-1) / camera.lens.focal_px) * camera.focal_px + [305.5, 152.5]
    homography = np.linalg.inv(np.array(truth.image_from_unit).reshape(3, 3))
    u, v, w = np.moveaxis(np.concatenate([seen, np.ones((*x.shape, 1))], axis=-1) @ homography.T, -1, 0)
    area_px2 = ((u > 0) & (u < w) & (v > 0) & (v < w)).sum() / 16
    assert truth.visible_px / truth.visible_fraction == pytest.approx(area_px2, rel=1e-3)
