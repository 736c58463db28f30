"""Ids and depth against ray casts and against the other renderer."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
import pytest

from gear.contracts.rendering import Renderer, Stage
from gear.render import RENDERERS, open_renderer
from gear.values.geometry import RigidTransform
from gear.values.rig import CameraMount, Rig
from gear.values.scene import CameraRecord
from tests.render.conftest import camera, geom

DEPTH_TOLERANCE = 1e-5


def cast_rays(stage: Stage, record: CameraRecord) -> tuple[np.ndarray, np.ndarray]:
    """Ids and planar depth by MuJoCo's own ray casts through the pixels' centres."""
    columns, rows = np.meshgrid(np.arange(record.width_px), np.arange(record.height_px))
    pixels = np.stack([columns, rows], axis=-1).reshape(-1, 2)
    world_from_camera = record.world_from_camera_transform
    rays = record.intrinsics.unproject(pixels, np.ones(len(pixels))) @ world_from_camera.rotation.T
    groups = np.array([1, 1, 1, 0, 0, 0], np.uint8)
    ids, depth = np.full(len(pixels), -1), np.full(len(pixels), np.nan)
    hit = np.zeros(1, np.int32)
    for index, ray in enumerate(rays):
        distance = mujoco.mj_ray(stage.model, stage.data, world_from_camera.translation_m, ray, groups, 1, -1, hit)
        if distance >= 0:
            ids[index], depth[index] = hit[0], distance
    shape = (record.height_px, record.width_px)
    return ids.reshape(shape), depth.reshape(shape)


def agreement(ids: np.ndarray, depth: np.ndarray, expected_ids: np.ndarray, expected_depth: np.ndarray) -> float:
    """Share of pixels with the same id and, but for rounding, the same depth."""
    same_depth = np.abs(depth / expected_depth - 1) < DEPTH_TOLERANCE
    return float(((ids == expected_ids) & (same_depth | (np.isnan(depth) & np.isnan(expected_depth)))).mean())


@pytest.fixture(scope="module")
def rays(model: mujoco.MjModel) -> tuple[np.ndarray, np.ndarray]:
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return cast_rays(Stage(model=model, data=data), camera())


def test_ids_and_depth_are_those_of_rays_through_pixel_centres(
    renderer: Renderer, stage: Stage, rays: tuple[np.ndarray, np.ndarray]
) -> None:
    (view,) = renderer.render(stage, (camera(),), colour=False)
    assert view.linear_rgb is None
    assert view.geom_id.dtype == np.int32 and view.depth_m.dtype == np.float32
    assert agreement(view.geom_id, view.depth_m, *rays) > 0.995


@pytest.mark.parametrize(
    "pinhole",
    [
        {"principal_px": (50.0, 62.5)},
        {"principal_px": (110.0, 30.0), "focal_y_px": 130.0},
    ],
)
def test_pinholes_of_any_principal_point_and_focal_lengths_that_are_rolled(
    renderer: Renderer, stage: Stage, pinhole: dict[str, Any]
) -> None:
    mount = CameraMount(
        name="front", width_px=160, height_px=96, hfov_deg=80, position_m=(0, 0, 1.6), roll_deg=25, **pinhole
    )
    rig = Rig(cameras=(mount,))
    (record,) = rig.place(RigidTransform.from_yaw("world", "ego", (0, 0.3, 0), math.radians(4)))
    (view,) = renderer.render(stage, (record,))
    assert agreement(view.geom_id, view.depth_m, *cast_rays(stage, record)) > 0.995
    # The sky is drawn by rays of its own: beside a silhouette it meets the scene, and colour is where its geom is.
    assert view.linear_rgb is not None
    car = view.geom_id == geom(stage.model, "car")
    assert car.sum() > 30
    red = view.linear_rgb[car].astype(float).mean(axis=0)
    assert red[0] > 2 * red[1]


def test_a_wrong_picture_would_be_noticed(
    renderer: Renderer, stage: Stage, rays: tuple[np.ndarray, np.ndarray]
) -> None:
    (view,) = renderer.render(stage, (camera(),), colour=False)
    for spoil in (np.fliplr, np.flipud, lambda a: np.roll(a, 1, axis=0), lambda a: np.roll(a, 1, axis=1)):
        assert agreement(spoil(view.geom_id), spoil(view.depth_m), *rays) < 0.9
    half_a_pixel = camera(yaw_deg=4.0 + 0.2)
    (moved,) = renderer.render(stage, (half_a_pixel,), colour=False)
    assert agreement(moved.geom_id, moved.depth_m, *rays) < 0.9


def test_nothing_is_minus_one_and_nan(renderer: Renderer, stage: Stage) -> None:
    (view,) = renderer.render(stage, (camera(),), colour=False)
    assert np.array_equal(view.geom_id < 0, np.isnan(view.depth_m))
    assert 0.1 < (view.geom_id < 0).mean() < 0.6


def test_collision_geoms_are_not_rendered(renderer: Renderer, stage: Stage) -> None:
    (view,) = renderer.render(stage, (camera(),))
    assert geom(stage.model, "felt") not in view.geom_id
    assert set(np.unique(view.geom_id)) == {-1} | {
        geom(stage.model, name) for name in ("road", "wall", "kiosk", "post", "face", "car")
    }


def test_all_renderers_see_the_same(model: mujoco.MjModel, stage: Stage) -> None:
    views = []
    for name in RENDERERS:
        opened = open_renderer(name, model, quality="fast")
        try:
            views += opened.render(stage, (camera(320, 120),), colour=False)
        finally:
            opened.close()
    first, *others = views
    for other in others:
        assert agreement(first.geom_id, first.depth_m, other.geom_id, other.depth_m) > 0.997


def test_moved_bodies_are_where_they_were_moved(renderer: Renderer, model: mujoco.MjModel) -> None:
    data = mujoco.MjData(model)
    data.mocap_pos[0] = (20.0, -4.0, 0.7)
    mujoco.mj_forward(model, data)
    stage = Stage(model=model, data=data)
    (view,) = renderer.render(stage, (camera(),), colour=False)
    assert agreement(view.geom_id, view.depth_m, *cast_rays(stage, camera())) > 0.995


def test_colour_lies_where_its_geom_is(renderer: Renderer, stage: Stage) -> None:
    face = geom(stage.model, "face")
    frames = []
    for value in (0, 255):
        faces = {face: np.full((32, 64, 3), value, np.uint8)}
        (view,) = renderer.render(Stage(model=stage.model, data=stage.data, faces=faces), (camera(320, 192),))
        assert view.linear_rgb is not None
        frames.append(view.linear_rgb.astype(int).sum(axis=-1))
    gain, seen = frames[1] - frames[0], view.geom_id == face
    changed = gain > np.median(gain[seen]) / 2

    def overlap(mask: np.ndarray) -> float:
        return float((mask & seen).sum() / (mask | seen).sum())

    assert overlap(changed) > 0.97
    shifted = [overlap(np.roll(changed, shift, axis)) for shift in (-1, 1) for axis in (0, 1)]
    assert max(shifted) < overlap(changed) - 0.005
    assert overlap(np.fliplr(changed)) < 0.8 and overlap(np.flipud(changed)) < 0.3
