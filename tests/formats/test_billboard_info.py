"""What `camera_billboard_info.json` makes the original loaders compute; their arithmetic is done again here."""

import json
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from gear.formats.billboard_info import billboard_info, world_from_board, xyzrpy
from gear.formats.jsontext import dump
from gear.groundtruth.surfaces import observe_surfaces
from gear.plugins.build import build_task
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import Thing, board
from gear.values.geometry import RigidTransform
from gear.values.rig import CameraMount, Rig
from gear.values.scene import Pose

PATCH_PX, M_PER_PX, LEFT_M, TOP_M = (300, 150), 7.4 / 300, 3.6, 1.85
RIG = Rig(
    cameras=(
        CameraMount(name="left", width_px=1224, height_px=370),
        CameraMount(name="right", width_px=1224, height_px=370, position_m=(1.5, -0.54, 1.65)),
    )
)


def world_from(pose: list[float]) -> np.ndarray:
    x, y, z, _, _, yaw = pose
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0, x], [s, c, 0, y], [0, 0, 1, z], [0, 0, 0, 1]])


def loader_pixels(camera: list[float], billboard: list[float], params: dict[str, Any], pixels: list[Any]) -> np.ndarray:
    """Where the loaders paste pixels of the patch: yaw only, the picture's middle at half its size."""
    board_m = [[0.0, LEFT_M - M_PER_PX * u, TOP_M - M_PER_PX * v, 1.0] for u, v in pixels]
    axes = np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1.0]])
    points = axes @ np.linalg.inv(world_from(camera)) @ world_from(billboard) @ np.array(board_m).T
    f = params["focal"]
    return np.stack(
        [f * points[0] / points[2] + params["width"] / 2, f * points[1] / points[2] + params["height"] / 2], axis=1
    )


def test_the_published_test_vector_of_the_loaders() -> None:
    camera = [0, -8, 1.65, 0, 0, math.radians(-190)]
    billboard = [-25, -4, 2, -math.pi / 2, 0, math.radians(-200)]
    params = {"width": 1224, "height": 370, "focal": 612.0}
    found = loader_pixels(camera, billboard, params, [(0, 0), (299, 0), (299, 149), (0, 149)])
    expected = [(518.87, 133.10), (694.30, 130.40), (694.30, 221.62), (518.87, 219.81)]
    np.testing.assert_allclose(found, expected, atol=0.006)


@pytest.mark.parametrize("yaw_rad", [0.0, 2.0, -1.1])
@pytest.mark.parametrize("camera", ["left", "right"])
def test_the_loaders_paste_the_patch_where_the_board_is(yaw_rad: float, camera: str) -> None:
    world_from_ego = RigidTransform.from_yaw("world", "ego", (31.0, -7.0, 0.0), yaw_rad)
    turned = Thing(parts=board(20.0).parts, position_m=(20.0, 3.0, 0.0), yaw_rad=0.25)
    frame, record = synthetic_frame(RIG, [turned], world_from_ego=world_from_ego)
    info = billboard_info([record], task="3dod", patch_label="none", reference="left", second="right")
    (entry,) = info["camera_billboard_positions"]
    pose = entry["camera_xyzrpy" if camera == "left" else "camera_dx_xyzrpy"]
    pasted = loader_pixels(
        pose, entry["billboard_xyzrpy"], info["camera_params"], [(0, 0), (300, 0), (300, 150), (0, 150)]
    )
    (truth,) = observe_surfaces(frame.views[camera], frame.geoms, record)
    # The loaders' pixels are half a pixel off from index pixels, by their own principal point.
    np.testing.assert_allclose(pasted - 0.5, truth.corners_px, atol=0.01)
    assert info["info"]["level"] is True


LOADER_CROPS = {"depth": (1216, 352)}
"""Width and height that PatchAttackTool's loaders cut out: the middle columns and the lowest rows."""

FOCAL_FROM_FOV = ("3dod", "depth")
"""Tasks whose loaders compute the focal length from the field of view and the width of what they cut."""


def loaders_error_px(task: str, **options: Any) -> float:
    """How far the corners of the patch lie from where PatchAttackTool puts them, at most, in a task's pictures."""
    spec, _ = build_task(task)
    rig = spec.build(spec.config(**options)).rig()
    small = Rig(cameras=tuple(replace(mount, width_px=32, height_px=16) for mount in rig.cameras))
    world_from_ego = RigidTransform.from_yaw("world", "ego", (31.0, -7.0, 0.0), 0.7)
    turned = Thing(parts=board(20.0).parts, position_m=(20.0, 3.0, 0.0), yaw_rad=0.25)
    _, record = synthetic_frame(small, [turned], world_from_ego=world_from_ego)
    record = replace(record, cameras=tuple(rig.place(world_from_ego)))
    name, camera = spec.original_name, record.cameras[0]
    info = json.loads(dump(billboard_info([record], task=name, patch_label="none", reference=camera.name)))
    (entry,), params = info["camera_billboard_positions"], info["camera_params"]
    width, height = LOADER_CROPS.get(name, (params["width"], params["height"]))
    left, top = (params["width"] - width) / 2, params["height"] - height
    focal = width / (2 * math.tan(params["fov"] / 2)) if name in FOCAL_FROM_FOV else params["focal"]
    seen = {"width": width, "height": height, "focal": focal}
    corners = [(0, 0), (300, 0), (300, 150), (0, 150)]
    pasted = np.add(loader_pixels(entry["camera_xyzrpy"], entry["billboard_xyzrpy"], seen, corners), (left, top))
    (surface,) = record.surfaces
    x, y = surface.width_m / 2, surface.height_m / 2
    corners_m = record.world_from_surface(surface).apply([[-x, -y, 0], [x, -y, 0], [x, y, 0], [-x, y, 0]])
    true = camera.intrinsics.project(camera.world_from_camera_transform.inverse().apply(corners_m))
    # The loaders' pixels are half a pixel off from index pixels, by their own principal point.
    return float(np.abs(pasted - 0.5 - true).max())


@pytest.mark.parametrize("task", ["semseg", "detect2d", "stereo3d", "depth"])
def test_the_loaders_paste_the_patch_right_in_every_tasks_default_pictures(task: str) -> None:
    assert loaders_error_px(task) < 0.01


def test_pictures_of_another_size_are_cut_by_the_loader_for_depth() -> None:
    """CARLA-GeAR's own 1224 x 370: the loader takes the middle of the lowest 352 rows for the camera's axis."""
    assert 8 < loaders_error_px("depth", width_px=1224, height_px=370) < 11


def test_the_boards_frame_looks_into_the_board() -> None:
    _, record = synthetic_frame(RIG, [board(20.0)])
    placed = world_from_board(record, 0)
    np.testing.assert_allclose(placed.rotation, np.eye(3), atol=1e-9)
    # 0.1 m to the left of the face's middle; the ego car looks along +x, so left is +y.
    np.testing.assert_allclose(placed.translation_m, [20.0, 0.1, 2.0], atol=1e-9)


def test_entries_without_boards_hold_zeros_where_loaders_read() -> None:
    _, record = synthetic_frame(RIG, [])
    info = billboard_info([record], task="ss", patch_label="none", reference="left")
    (entry,) = info["camera_billboard_positions"]
    assert info["info"]["num_billboards"] == 0
    assert entry["billboard_xyzrpy"] == [0.0] * 6
    assert entry["billboard2_xyzrpy"] == [None] * 6
    assert entry["camera_dx_xyzrpy"] == entry["camera_xyzrpy"]


def test_two_boards_have_two_poses() -> None:
    _, record = synthetic_frame(RIG, [board(20.0, 6.0), board(20.0, -6.0, surface=1)])
    (entry,) = billboard_info([record], task="ss", patch_label="p", reference="left")["camera_billboard_positions"]
    assert entry["billboard_xyzrpy"][:2] == pytest.approx([20.0, 6.1])
    assert entry["billboard2_xyzrpy"][:2] == pytest.approx([20.0, -5.9])


@pytest.mark.parametrize(("label", "is_patched", "kind"), [("none", False, "none"), ("random", True, "random"),
                                                           ("mine-1a2b3c4d", True, "adversarial")])  # fmt: skip
def test_the_patch_is_named(label: str, is_patched: bool, kind: str) -> None:
    _, record = synthetic_frame(RIG, [board(20.0)])
    info = billboard_info([record], task="ss", patch_label=label, reference="left")
    assert info["info"]["is_patched"] is is_patched and info["info"]["patch_type"] == kind
    assert info["info"]["patch_folder"] == (label if is_patched else None)
    assert info["camera_params"] == pytest.approx({"height": 370, "width": 1224, "fov": math.pi / 2, "focal": 612.0})
    assert info["patch_mask_corners"] == {}


def test_a_tilted_camera_is_marked() -> None:
    rig = Rig(cameras=(CameraMount(name="left", width_px=320, height_px=160, pitch_deg=3.0),))
    _, record = synthetic_frame(rig, [board(20.0)])
    info = billboard_info([record], task="ss", patch_label="none", reference="left")
    assert info["info"]["level"] is False
    pose = info["camera_billboard_positions"][0]["camera_xyzrpy"]
    assert pose[4] == pytest.approx(math.radians(3.0)), "pitch is positive downwards in a frame with z up"


def test_one_tilted_record_marks_the_split() -> None:
    level, tilted = (
        synthetic_frame(Rig(cameras=(CameraMount(name="left", width_px=320, height_px=160, pitch_deg=p),)), [])[1]
        for p in (0.0, 3.0)
    )
    for records in ([level, tilted], [tilted, level]):
        info = billboard_info(records, task="ss", patch_label="none", reference="left")
        assert info["info"]["level"] is False
        assert [entry["id"] for entry in info["camera_billboard_positions"]] == [0, 1]


def test_a_tilted_board_is_marked() -> None:
    _, record = synthetic_frame(RIG, [board(20.0)])
    (surface,) = record.surfaces
    placed = surface.parent_from_surface.transform("world", "surface")
    lean = Rotation.from_euler("x", 2.0, degrees=True).as_matrix()
    leaning = RigidTransform.from_parts("world", "surface", placed.rotation @ lean, placed.translation_m)
    tilted = replace(surface, parent_from_surface=Pose.from_transform(leaning))
    for surfaces, level in (((surface,), True), ((tilted,), False), ((surface, tilted), False)):
        info = billboard_info([replace(record, surfaces=surfaces)], task="ss", patch_label="none", reference="left")
        assert info["info"]["level"] is level


def test_every_board_has_a_pose_of_its_own() -> None:
    boards = [board(20.0, left_m, surface=number) for number, left_m in enumerate((9.0, 0.0, -9.0, -18.0))]
    _, record = synthetic_frame(RIG, boards)
    info = billboard_info([record], task="ss", patch_label="none", reference="left")
    (entry,) = info["camera_billboard_positions"]
    poses = [entry[f"billboard{name}_xyzrpy"][:2] for name in ("", "2", "3", "4")]
    assert poses == [pytest.approx([20.0, left_m + 0.1]) for left_m in (9.0, 0.0, -9.0, -18.0)]
    assert info["info"]["num_billboards"] == 4


def test_a_split_without_records_is_empty() -> None:
    info = billboard_info([], task="ss", patch_label="none", reference="left")
    assert info["info"]["num_billboards"] == 0 and info["info"]["level"] is True
    assert info["camera_params"] == {} and info["camera_billboard_positions"] == []


@given(st.floats(-3.1, 3.1), st.floats(-1.5, 1.5), st.floats(-3.1, 3.1))
def test_angles_come_back(roll_rad: float, pitch_rad: float, yaw_rad: float) -> None:
    """As Rz(yaw) Ry(pitch) Rx(roll)."""
    rotation = Rotation.from_euler("ZYX", [yaw_rad, pitch_rad, roll_rad]).as_matrix()
    found = xyzrpy(RigidTransform.from_parts("world", "x", rotation, (1, 2, 3)))
    assert found == pytest.approx((1, 2, 3, roll_rad, pitch_rad, yaw_rad), abs=1e-6)
