"""The camera pipeline as a whole."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gear.camera.air import Air
from gear.camera.effects import CameraEffects
from gear.camera.effects.lens import Lens
from gear.camera.pipeline import CameraPipeline
from gear.camera.rain import Rain
from gear.camera.response import LINEAR_FULL_SCALE, Response
from gear.camera.water import Water
from gear.contracts.rendering import RawView
from gear.testing.synthetic import synthetic_frame
from gear.testing.tiny_town import SMALL_RIG

DRY = CameraPipeline(
    response=Response(),
    air=Air(fogs=(), clear_per_m=np.zeros(3), ring=np.zeros((4, 3))),
    water=Water(town="t", share=0.0, ripples=0.0, mirrored=np.zeros((2, 4, 3), np.float32)),
    rain=Rain(intensity=0.0, wind_world_mps=(0.0, 0.0, 0.0), light=np.ones(3)),
    effects=CameraEffects(),
)
LENS = replace(DRY, effects=CameraEffects(lens=Lens(k1=-0.1)))


def test_a_dry_weather_without_effects_changes_only_the_response() -> None:
    frame, record = synthetic_frame(SMALL_RIG)
    given = next(iter(frame.views.values()))
    raw = RawView(linear_rgb=given.linear_rgb, depth_m=given.depth_m, geom_id=given.geom_id)
    view = DRY.view(raw, given.camera, record, frame.geoms)
    np.testing.assert_array_equal(view.linear_rgb, given.linear_rgb)
    np.testing.assert_array_equal(view.rgb, DRY.response.apply(given.linear_rgb))
    np.testing.assert_array_equal(view.depth_m, given.depth_m)
    assert view.linear_rgb.max() <= LINEAR_FULL_SCALE


def test_a_lens_moves_colour_depth_and_ids_and_is_recorded() -> None:
    frame, record = synthetic_frame(SMALL_RIG)
    given = next(iter(frame.views.values()))
    raw = RawView(linear_rgb=given.linear_rgb, depth_m=given.depth_m, geom_id=given.geom_id)
    seen = LENS.with_effects(record)
    assert DRY.with_effects(record) is record
    assert all(camera.lens is not None for camera in seen.cameras)
    view = LENS.view(raw, seen.cameras[0], seen, frame.geoms)
    assert (view.geom_id != given.geom_id).any()
    assert (np.isnan(view.depth_m) == (view.geom_id < 0)).all()


def test_only_wet_ground_by_day_needs_a_mirror_camera() -> None:
    _, record = synthetic_frame(SMALL_RIG)
    camera = record.cameras[0]
    assert DRY.mirror_camera(camera, record) is None
    assert DRY.reflection(None, record) is None
    for water in (replace(DRY.water, share=0.5), replace(DRY.water, film=0.5)):
        found = replace(DRY, water=water).mirror_camera(camera, record)
        assert found is not None
        height_m = record.ego.world_from_actor.position_m[2]
        above_m = camera.world_from_camera.position_m[2] - height_m
        assert found.world_from_camera.position_m[2] == pytest.approx(height_m - above_m)
