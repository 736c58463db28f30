"""Fog and haze: what a wall at a known distance loses, analytically; linear; blind to the picture."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gear.camera.air import SKY_DISTANCE_M, Air, Fog
from gear.values.frames import LINEAR_FULL_SCALE
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, RigidTransform
from gear.values.rig import CameraMount, Rig
from gear.values.scene import CameraRecord, Pose

WIDTH, HEIGHT, FOCAL_PX = 64, 40, 40.0


def camera(height_m: float = 1.6, yaw_deg: float = 0.0) -> CameraRecord:
    world_from_ego = RigidTransform.from_yaw("world", "ego", (3.0, -2.0, height_m), math.radians(yaw_deg))
    mount = RigidTransform.from_parts("ego", "camera", CAMERA_FROM_ACTOR_AXES.T, (0, 0, 0))
    return CameraRecord(
        name="c", width_px=WIDTH, height_px=HEIGHT, focal_px=FOCAL_PX,
        world_from_camera=Pose.from_transform(world_from_ego @ mount),
    )  # fmt: skip


def air(**changes: Any) -> Air:
    fog = {"per_m": 0.02, "from_m": 0.0, "thinning_per_m": 0.0}
    fog |= {name.removeprefix("fog_"): changes.pop(name) for name in list(changes) if name.startswith("fog_")}
    values: dict[str, object] = {"fogs": (Fog(**fog),), "clear_per_m": np.zeros(3), "ring": np.full((8, 3), 0.5)}
    return Air(**(values | changes))  # type: ignore[arg-type]


def wall(depth_m: float) -> np.ndarray:
    return np.full((HEIGHT, WIDTH), depth_m, np.float32)


def ray_lengths(depth_m: float) -> np.ndarray:
    x = (np.arange(WIDTH) - (WIDTH - 1) / 2) / FOCAL_PX
    y = (np.arange(HEIGHT) - (HEIGHT - 1) / 2)[:, None] / FOCAL_PX
    return np.asarray(depth_m * np.sqrt(1 + x * x + y * y))


def test_a_wall_dims_with_the_length_of_the_ray_and_from_where_the_fog_begins() -> None:
    through = air(fog_from_m=12.0).transmittance(wall(30.0), camera())
    expected = np.exp(-0.02 * np.maximum(ray_lengths(30.0) - 12.0, 0))
    np.testing.assert_allclose(through[..., 1], expected, rtol=2e-5)
    assert through[0, 0, 0] < through[HEIGHT // 2, WIDTH // 2, 0]
    assert (air(fog_from_m=90.0).transmittance(wall(30.0), camera()) == 1).all()


def test_clear_air_attenuates_each_channel_and_not_the_sky() -> None:
    clear = air(fog_per_m=0.0, clear_per_m=np.array([0.001, 0.002, 0.004]))
    depth = wall(100.0)
    depth[:5] = np.nan
    through = clear.transmittance(depth, camera())
    expected = np.exp(-ray_lengths(100.0)[5:, :, None] * np.array([0.001, 0.002, 0.004]))
    np.testing.assert_allclose(through[5:], expected, rtol=2e-5)
    assert (through[:5] == 1).all()


@given(thinning=st.floats(0.0, 0.4), height_m=st.floats(0.2, 30.0), depth_m=st.floats(1.0, 300.0))
def test_thinning_fog_adds_up_along_the_ray(thinning: float, height_m: float, depth_m: float) -> None:
    through = air(fog_thinning_per_m=thinning, fog_from_m=0.5).transmittance(wall(depth_m), camera(height_m))
    row, column = 3, 50  # looks up
    towards = np.array([(column - (WIDTH - 1) / 2) / FOCAL_PX, (row - (HEIGHT - 1) / 2) / FOCAL_PX])
    length = depth_m * math.sqrt(1 + towards @ towards)
    rise = -towards[1] / math.sqrt(1 + towards @ towards)
    steps = np.linspace(0.5, max(length, 0.5), 20001)
    density = np.exp(-thinning * (height_m + rise * steps))
    tau = 0.02 * np.trapezoid(density, steps)
    assert through[row, column, 0] == pytest.approx(math.exp(-tau), rel=4e-3, abs=1e-6)


@pytest.mark.parametrize(("pitch_deg", "roll_deg"), [(20.0, 0.0), (-15.0, 0.0), (5.0, 30.0), (0.0, -90.0)])
def test_rays_of_a_tilted_camera_climb_as_the_world_has_it(pitch_deg: float, roll_deg: float) -> None:
    mount = CameraMount(name="c", width_px=WIDTH, height_px=HEIGHT, hfov_deg=2 * math.degrees(math.atan(0.8)),
                        position_m=(0, 0, 40.0), yaw_deg=33.0, pitch_deg=pitch_deg, roll_deg=roll_deg)  # fmt: skip
    ego = RigidTransform.from_yaw("world", "ego", (0, 0, 0), 0.0)
    (tilted,) = Rig(cameras=(mount,)).place(ego)
    through = air(fog_thinning_per_m=0.05).transmittance(wall(20.0), tilted)[..., 0]
    for row, column in ((3, 5), (3, 60), (36, 5), (36, 60), (20, 32)):
        point_m = tilted.intrinsics.unproject([column, row], 20.0)
        end_m = tilted.world_from_camera_transform.apply(point_m)
        heights_m = np.linspace(40.0, end_m[2], 20001)
        tau = 0.02 * np.exp(-0.05 * heights_m).mean() * np.linalg.norm(point_m)
        assert -math.log(through[row, column]) == pytest.approx(tau, rel=1e-3)


def test_the_sky_sees_all_of_the_fog_above() -> None:
    sky = wall(np.nan)
    through = air(fog_thinning_per_m=0.05).transmittance(sky, camera())
    assert through[0].min() > through[HEIGHT // 2 - 2].max(), "higher up there is less of it"
    towards = (0 - (HEIGHT - 1) / 2) / FOCAL_PX
    centre = (WIDTH - 1) / 2 / FOCAL_PX
    rise = -towards / math.sqrt(1 + towards**2 + centre**2)
    tau = 0.02 * math.exp(-0.05 * 1.6) / (0.05 * rise)
    assert through[0, 0, 0] == pytest.approx(math.exp(-tau), rel=1e-3)
    endless = air(fog_per_m=1 / SKY_DISTANCE_M).transmittance(sky, camera())
    np.testing.assert_allclose(endless, math.exp(-1), rtol=1e-5)


@pytest.mark.parametrize("thinning", [100.0, 1e4])
def test_a_fog_that_lies_far_below_the_camera_is_finite(thinning: float) -> None:
    climb = ((HEIGHT - 1) / 2 - np.arange(HEIGHT)) / FOCAL_PX
    depth = wall(30.0)
    depth[climb < 0] = np.minimum(30.0, 1.6 / -climb[climb < 0])[:, None]
    through = air(fog_per_m=5.0, fog_thinning_per_m=thinning).transmittance(depth, camera())[..., 0]
    assert np.isfinite(through).all() and (through[climb > 0] == 1).all()
    # Rays that end on the ground meet all of the fog, the more of it the less steep they are.
    ends = climb * 30 < -1.6
    steep = -climb[ends, None] / ray_lengths(1.0)[ends]
    np.testing.assert_allclose(np.log(through[ends]), -5.0 / thinning / steep, rtol=2e-3, atol=1e-6)


def test_the_veil_is_linear_and_blind_to_the_picture() -> None:
    rng = np.random.default_rng(3)
    depth = rng.uniform(2, 200, (HEIGHT, WIDTH)).astype(np.float32)
    thick = air(ring=np.linspace(0.2, 0.9, 24).reshape(8, 3))
    black, white = np.zeros((HEIGHT, WIDTH, 3), np.uint16), np.full((HEIGHT, WIDTH, 3), LINEAR_FULL_SCALE, np.uint16)
    patch = rng.integers(0, LINEAR_FULL_SCALE + 1, black.shape).astype(np.uint16)
    b, w, p = (thick.apply(picture, depth, camera()).astype(float) for picture in (black, white, patch))
    assert np.abs(p - (b + patch / LINEAR_FULL_SCALE * (w - b))).max() <= 1.5
    changed = patch.copy()
    changed[10:20, 30:40] = 0
    differs = (thick.apply(changed, depth, camera()) != thick.apply(patch, depth, camera())).any(axis=-1)
    assert differs[10:20, 30:40].mean() > 0.8
    differs[10:20, 30:40] = False
    assert not differs.any()


def test_thick_fog_shows_the_light_of_its_direction() -> None:
    ring = np.zeros((72, 3))
    ring[12:25] = (1.0, 0.5, 0.0)  # 30 degrees to each side of north
    thick = air(fog_per_m=5.0, ring=ring)
    frame = np.full((HEIGHT, WIDTH, 3), 300, np.uint16)
    middle = (HEIGHT // 2, WIDTH // 2)
    north, east = (thick.apply(frame, wall(50.0), camera(yaw_deg=yaw))[middle] for yaw in (90, 0))
    np.testing.assert_allclose(north, np.array([1.0, 0.5, 0.0]) * LINEAR_FULL_SCALE, atol=2)
    assert (east == 0).all()
    left = thick.apply(frame, wall(50.0), camera(yaw_deg=45))[HEIGHT // 2]
    assert left[:20].mean() > left[-20:].mean() + 50, "north lies to the left of north-east"


def test_the_light_of_the_air_turns_with_the_azimuth_of_every_pixel() -> None:
    azimuth_rad = np.arange(72) * 2 * np.pi / 72
    ring = np.stack([0.5 + 0.4 * np.cos(azimuth_rad), 0.5 + 0.4 * np.sin(azimuth_rad), azimuth_rad * 0], axis=1)
    seen = air(fog_per_m=5.0, ring=ring).apply(
        np.zeros((HEIGHT, WIDTH, 3), np.uint16), wall(50.0), camera(yaw_deg=30.0)
    )  # fmt: skip
    x = (np.arange(WIDTH) - (WIDTH - 1) / 2) / FOCAL_PX
    turned = math.radians(30) - np.arctan(x)
    wanted = (0.5 + 0.4 * np.stack([np.cos(turned), np.sin(turned)], axis=1)) * LINEAR_FULL_SCALE
    inner = slice(8, WIDTH - 8)  # it is worked out on a grid of 16 pixels
    for row in (10, 20, 30):
        np.testing.assert_allclose(seen[row, inner, :2], wanted[inner], atol=12)


def test_clear_air_without_fog_changes_nothing() -> None:
    frame = np.random.default_rng(1).integers(0, 1021, (HEIGHT, WIDTH, 3)).astype(np.uint16)
    assert np.array_equal(air(fog_per_m=0.0).apply(frame, wall(80.0), camera()), frame)


def test_two_fogs_take_their_shares_one_after_the_other() -> None:
    low, high = (Fog(per_m=0.02, from_m=start, thinning_per_m=thin) for start, thin in ((5.0, 0.05), (0.75, 0.007)))
    depth = wall(60.0)
    both = air(fogs=(low, high)).transmittance(depth, camera())
    each = [air(fogs=(fog,)).transmittance(depth, camera()) for fog in (low, high)]
    np.testing.assert_allclose(both, each[0] * each[1], rtol=1e-6)
    assert np.array_equal(air(fogs=()).transmittance(depth, camera()), np.ones_like(both))
