"""What wet ground mirrors, seen from below: what rays from puddles come to, and never a patch."""

from __future__ import annotations

import numpy as np
import pytest

from gear.render.registry import RENDERERS, open_renderer
from gear.testing.tiny_town import SMALL_RIG, build_tiny_world
from gear.testing.town_facts import VISIBLE_GROUPS, Rays
from gear.values.labels import GROUND_CODES
from gear.values.scene import ActorRecord, Pose, SceneRecord
from gear.world.weather.air import camera_pipeline
from gear.world.weather.mirror_view import render_mirror_view
from gear.world.weather.night import night_of
from gear.world.weather.presets import PRESETS
from gear.world.world import World
from tests.pinhole import rays

EGO = Pose(position_m=(10.0, -1.75, 0.0), quat_wxyz=(0.9990482, 0.0, 0.0, 0.0436194))
WET = PRESETS["WetNoon"]


def record(world: World) -> SceneRecord:
    """A van ahead on the other lane, seen a little askew."""
    ego = ActorRecord(id=1, asset="car_saloon", role="ego", world_from_actor=EGO)
    van = ActorRecord(id=2, asset="van_small", role="npc", world_from_actor=Pose(position_m=(22.0, 1.75, 0.0)))
    return SceneRecord(
        town="tiny", scene=world.scene_name, split="test", seed=0, index=0, sequence=0, frame=0, time_s=0.0,
        weather=WET, actors=(ego, van), surfaces=world.surface_records(),
        cameras=SMALL_RIG.place(EGO.transform("world", "ego")),
    )  # fmt: skip


@pytest.mark.parametrize("name", RENDERERS)
def test_the_look_from_below_is_where_mirrored_rays_come_to(name: str) -> None:
    world = build_tiny_world()
    shot = record(world)
    placed = world.place(shot)
    pipeline = camera_pipeline(WET, name, "tiny", shapes=world.shapes)
    renderer = open_renderer(name, world.model, quality="fast")
    try:
        (above,) = renderer.render(placed.stage, shot.cameras)
        (below,) = render_mirror_view(world, renderer, placed, shot, pipeline)
        (again,) = renderer.render(placed.stage, shot.cameras)
    finally:
        renderer.close()
    assert below is not None
    assert np.array_equal(above.linear_rgb, again.linear_rgb) and np.array_equal(above.geom_id, again.geom_id)
    seen, low = below
    eye, cast = shot.cameras[0], Rays(world.model, placed.stage.data, VISIBLE_GROUPS)
    from_m, towards = eye.world_from_camera_transform.translation_m, rays(eye)
    rotation, low_m = low.world_from_camera_transform.rotation, low.world_from_camera_transform.translation_m
    is_ground = np.append(np.isin(placed.geoms.label_code, GROUND_CODES), False)
    agreed, hit = [], []
    road = np.argwhere(above.geom_id == world.model.geom("main_road").id)
    for row, column in road[np.random.default_rng(0).permutation(len(road))[:400]]:
        at_m = from_m + towards[row, column] * above.depth_m[row, column]
        _, geom = cast.first_hit(at_m + np.array((0, 0, 1e-3)), towards[row, column] * (1, 1, -1))
        if geom >= 0 and is_ground[geom]:
            continue
        across, down, ahead = rotation.T @ (at_m - low_m)
        place = (
            round(down / ahead * low.focal_px + (low.height_px - 1) / 2),
            round(across / ahead * low.focal_px + (low.width_px - 1) / 2),
        )
        agreed.append(seen.geom_id[place] == geom)
        hit.append(geom)
    assert len(agreed) > 300 and len(set(hit)) > 5, "the road mirrors many things"
    assert np.mean(agreed) > 0.97
    assert not is_ground[seen.geom_id].any()


def test_what_is_mirrored_does_not_know_the_patch() -> None:
    world = build_tiny_world("board")
    shot = record(world)
    pipeline = camera_pipeline(WET, "classic", "tiny", shapes=world.shapes)
    renderer = open_renderer("classic", world.model, quality="fast")
    (face,) = [surface.name for surface in shot.surfaces]
    looks = []
    try:
        for shown in ("white", "black"):
            placed = world.place(shot, {face: shown})
            (raw,) = renderer.render(placed.stage, shot.cameras)
            (below,) = render_mirror_view(world, renderer, placed, shot, pipeline)
            reflection = pipeline.reflection(below, shot)
            view = pipeline.view(raw, shot.cameras[0], shot, placed.geoms, reflection=reflection)
            looks.append((raw, below, view))
    finally:
        renderer.close()
    (white, white_below, white_view), (black, black_below, black_view) = looks
    assert white_below is not None and black_below is not None
    assert np.array_equal(white_below[0].linear_rgb, black_below[0].linear_rgb)
    touched = (white.linear_rgb != black.linear_rgb).any(axis=-1)
    changed = (white_view.linear_rgb != black_view.linear_rgb).any(axis=-1)
    assert touched.any() and not (changed & ~touched).any()


def test_there_is_no_mirror_view_on_dry_ground_or_at_night() -> None:
    world = build_tiny_world("no_billboard")
    shot = record(world)
    dry = camera_pipeline(PRESETS["ClearNoon"], "classic", "tiny")
    assert dry.mirror_camera(shot.cameras[0], shot) is None
    assert camera_pipeline(WET, "classic", "tiny").mirror_camera(shot.cameras[0], shot) is not None
    dark = PRESETS["WetNight"]
    night = night_of(build_tiny_world("no_billboard", dark), dark, "classic")
    assert night is not None
    assert camera_pipeline(dark, "classic", "tiny", night=night).mirror_camera(shot.cameras[0], shot) is None
