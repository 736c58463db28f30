"""Cameras inside the ego car are refused."""

from __future__ import annotations

import numpy as np
import pytest

from gear.testing.tiny_town import SMALL_RIG
from gear.values.errors import PlacementError
from gear.values.frames import Shape
from gear.values.rig import CameraMount, Rig
from gear.world.camera_position import check_outside, enclosed_share

CORNERS = np.array([(x, y, z) for x in (-2.0, 2.0) for y in (-0.9, 0.9) for z in (0.2, 1.5)])
FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4],
     [1, 5, 7], [1, 7, 3]],
    np.int32,
)  # fmt: skip
BOX = Shape(
    vertices_m=CORNERS,
    faces=FACES,
    face_label_code=np.zeros(12, np.uint8),
    box_centre_m=np.array([0.0, 0.0, 0.85]),
    box_size_m=np.array([4.0, 1.8, 1.3]),
)


def test_rays_from_inside_end_at_the_shape() -> None:
    assert enclosed_share(BOX, np.array([0.5, 0.1, 0.9])) == 1.0
    assert enclosed_share(BOX, np.array([0.5, 0.1, 1.6])) == 0.0
    open_top = Shape(
        vertices_m=BOX.vertices_m, faces=FACES[:10], face_label_code=BOX.face_label_code[:10],
        box_centre_m=BOX.box_centre_m, box_size_m=BOX.box_size_m,
    )  # fmt: skip
    # A cube's face seen from its middle is a sixth of the sphere; this one is flatter and seen from near the top.
    assert 0.5 < enclosed_share(open_top, np.array([0.0, 0.0, 1.3])) < 0.8


@pytest.mark.filterwarnings("error")
def test_faces_without_an_area_are_hit_by_no_ray() -> None:
    thin = np.array([[0, 1, 1], [0, 7, 7], [3, 4, 4]], np.int32)
    shape = Shape(
        vertices_m=BOX.vertices_m, faces=np.concatenate([FACES, thin]), face_label_code=np.zeros(15, np.uint8),
        box_centre_m=BOX.box_centre_m, box_size_m=BOX.box_size_m,
    )  # fmt: skip
    assert enclosed_share(shape, np.array([0.5, 0.1, 0.9])) == 1.0


def test_a_camera_inside_is_refused_with_its_position() -> None:
    def rig(x: float, z: float) -> Rig:
        return Rig(cameras=(CameraMount(name="rgb", width_px=64, height_px=32, position_m=(x, 0.0, z)),))

    check_outside(rig(1.5, 1.65), BOX, "s")
    check_outside(SMALL_RIG, BOX, "s")
    with pytest.raises(PlacementError, match=r"camera 'rgb' at \[-1, 0, 1\] m is inside the ego car.*position_m"):
        check_outside(rig(-1.0, 1.0), BOX, "s")
