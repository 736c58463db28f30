"""The street as wet ground mirrors it: where a ray from a puddle comes to, seen from the camera below."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from gear.camera.reflection import Reflection, beyond_mirror, mirror_camera
from gear.camera.water import Water
from gear.contracts.rendering import RawView
from gear.values.frames import LINEAR_FULL_SCALE
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, RigidTransform
from gear.values.scene import CameraRecord, Pose
from tests.pinhole import rays

SIZE = (96, 160)
WALL_M = 20.0
HEIGHT_M = 0.25


def turned(axis: int, degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    rotation = np.eye(3)
    others = [i for i in range(3) if i != axis]
    rotation[np.ix_(others, others)] = [[c, -s], [s, c]]
    return rotation


def camera(*, pitch_deg: float = 0.0, roll_deg: float = 0.0, yaw_deg: float = 7.0) -> CameraRecord:
    """Looks east, 1.6 m above the ground."""
    rotation = turned(2, yaw_deg) @ turned(1, pitch_deg) @ turned(0, roll_deg) @ CAMERA_FROM_ACTOR_AXES.T
    pose = RigidTransform.from_parts("world", "camera", rotation, (1.0, -2.0, HEIGHT_M + 1.6))
    return CameraRecord(
        name="c", width_px=SIZE[1], height_px=SIZE[0], focal_px=90.0, world_from_camera=Pose.from_transform(pose)
    )


def painted(at_m: np.ndarray) -> np.ndarray:
    """(..., 3) colour of the wall x = `WALL_M` at places in it: no two are alike, not even mirrored."""
    y, z = at_m[..., 1], at_m[..., 2]
    return np.stack([0.5 + y / 80, 0.2 + np.clip(z, -20, 60) / 80, 0.3 + 0.2 * np.sin(y / 9) * np.cos(z / 7)], axis=-1)


def hits(looking: CameraRecord) -> np.ndarray:
    """(H, W, 3) where rays meet the wall."""
    from_m = looking.world_from_camera_transform.translation_m
    towards = rays(looking)
    return from_m + towards * ((WALL_M - from_m[0]) / towards[..., :1])


def from_below(below: CameraRecord, light: np.ndarray, depth_m: np.ndarray) -> Reflection:
    steps = np.round(light * LINEAR_FULL_SCALE).astype(np.uint16)
    view = RawView(linear_rgb=steps, depth_m=depth_m.astype(np.float32), geom_id=np.zeros(depth_m.shape, np.int32))
    return Reflection.of(view, below, HEIGHT_M)


def seen_from_below(looking: CameraRecord) -> Reflection:
    """The painted wall, which reaches down to below the ground, and is hidden by nothing there."""
    below = mirror_camera(looking, HEIGHT_M)
    assert below is not None
    depth_m = np.full((below.height_px, below.width_px), np.nan)
    return from_below(below, painted(hits(below)), depth_m)


LOOKS = [{}, {"pitch_deg": 12.0}, {"pitch_deg": -6.0, "roll_deg": 5.0}, {"yaw_deg": -20.0, "roll_deg": -3.0}]


@pytest.mark.parametrize("look", LOOKS)
def test_a_mirrored_ray_shows_what_it_comes_to(look: dict[str, float]) -> None:
    looking = camera(**look)
    towards = rays(looking).reshape(-1, 3)
    from_m = looking.world_from_camera_transform.translation_m
    down = towards[:, 2] < -0.02
    ground_m = from_m + towards * ((HEIGHT_M - from_m[2]) / np.where(down, towards[:, 2], -1))[:, None]
    down &= ground_m[:, 0] < WALL_M
    mirrored, ground_m = towards[down] * (1, 1, -1), ground_m[down]
    expected = painted(ground_m + mirrored * ((WALL_M - ground_m[:, :1]) / mirrored[:, :1]))
    reflection = seen_from_below(looking)
    east, north, up = mirrored.T.astype(np.float32)
    found = reflection.at(reflection.sharp, east, north, up)
    error = np.abs(found[:, :3] - expected)
    assert (found[:, 3] == 1).all()
    assert down.sum() > 2000 and error.max() < 0.004
    for wrong in (expected[:, ::-1], painted(ground_m * (1, -1, 1))):
        assert np.abs(found[:, :3] - wrong).max() > 0.1


def test_damp_ground_draws_things_out_along_the_view_and_keeps_their_light() -> None:
    looking = camera(yaw_deg=0.0)
    below = mirror_camera(looking, HEIGHT_M)
    assert below is not None
    light = np.zeros((below.height_px, below.width_px, 3))
    light[below.height_px // 2, below.width_px // 2] = 1
    soft = from_below(below, light, np.full(light.shape[:2], np.nan)).soft[..., 0]
    rows, columns = np.nonzero(soft > 0.1 * soft.max())
    assert np.ptp(rows) > 2 * np.ptp(columns)
    assert soft.sum() == pytest.approx(1, abs=0.02)


def test_who_sees_no_ground_sees_nothing_mirrored() -> None:
    assert mirror_camera(camera(pitch_deg=60.0), HEIGHT_M) is None
    assert mirror_camera(camera(), HEIGHT_M + 1.7) is None


def ground_depth(looking: CameraRecord, height_m: float = HEIGHT_M) -> np.ndarray:
    up = rays(looking)[..., 2]
    drop_m = height_m - looking.world_from_camera_transform.translation_m[2]
    return np.where(up < -0.02, drop_m / np.minimum(up, -0.02), np.nan).astype(np.float32)


def wet(share: float, film: float) -> Water:
    return Water(town="x", share=share, ripples=0.0, film=film, mirrored=np.full((8, 16, 3), 0.5, np.float32))


def test_puddles_and_damp_ground_mirror_more_at_a_grazing_angle() -> None:
    looking = camera()
    depth, black = ground_depth(looking), np.zeros((*SIZE, 3), np.uint16)
    is_open = ~np.isnan(depth)
    reflection = seen_from_below(looking)
    puddled, damp = (
        wet(*water).apply(black, depth, is_open, looking, reflection).mean(axis=(1, 2)) for water in ((1.1, 0), (0, 1))
    )
    far, near = slice(52, 56), slice(88, 96)
    assert puddled[far].mean() > 4 * puddled[near].mean() > 0
    assert damp[far].mean() > 3 * damp[near].mean() > 0
    assert puddled[far].mean() > 1.5 * damp[far].mean()


def test_ground_at_another_height_mirrors_the_sky_alone() -> None:
    looking = camera()
    high, reflection = ground_depth(looking, HEIGHT_M + 0.8), seen_from_below(looking)
    grey = np.full((*SIZE, 3), 300, np.uint16)
    is_open = ~np.isnan(high)
    with_street, without = (wet(0.4, 0.0).apply(grey, high, is_open, looking, seen) for seen in (reflection, None))
    assert np.array_equal(with_street, without) and not np.array_equal(without, grey)
    damp = wet(0.0, 1.0).apply(grey, high, is_open, looking, reflection)
    flat = wet(0.0, 1.0).apply(grey, ground_depth(looking), is_open, looking, reflection)
    assert (damp[is_open] >= grey[is_open]).all() and (damp > grey).mean() > 0.2, "the sky is brighter"
    assert not np.array_equal(damp, flat)


def test_water_is_linear_in_what_lies_below_it() -> None:
    looking = camera()
    depth = ground_depth(looking)
    is_open = ~np.isnan(depth)
    reflection = seen_from_below(looking)

    def laid(level: int) -> np.ndarray:
        frame = np.full((*SIZE, 3), level, np.uint16)
        return wet(0.4, 0.7).apply(frame, depth, is_open, looking, reflection).astype(float)

    assert np.abs(laid(500) - (laid(0) + laid(1000)) / 2).max() <= 1


def test_what_is_mirrored_lies_at_the_same_places_whatever_the_pictures_size() -> None:
    small, large = (replace(camera(), width_px=160 * k, height_px=96 * k, focal_px=90.0 * k) for k in (1, 4))
    for looking in (small, large):
        reflection = seen_from_below(looking)
        direction = np.array([[0.9, 0.2, 0.3]], np.float32)
        from_m = np.array([1.0, -2.0, HEIGHT_M - 1.6])
        expected = painted(from_m + direction[0] * (WALL_M - 1) / 0.9)
        assert np.abs(reflection.at(reflection.sharp, *direction.T)[0, :3] - expected).max() < 0.004


def test_what_lies_under_the_mirror_hides_it_and_the_sky_is_mirrored_instead() -> None:
    """As on a flyover, whose deck is no ground: its underside is before whatever a mirror on top of it would show."""
    looking = camera()
    below = mirror_camera(looking, HEIGHT_M)
    assert below is not None
    rise, low_m = rays(below)[..., 2], below.world_from_camera.position_m[2]
    deck_m = np.where(rise > 0.01, (HEIGHT_M - 0.3 - low_m) / np.maximum(rise, 0.01), np.nan)
    depth, grey = ground_depth(looking), np.full((*SIZE, 3), 300, np.uint16)
    is_open = depth < 30
    covered = from_below(below, painted(hits(below)), deck_m)
    puddled = [wet(0.4, 0.0).apply(grey, depth, is_open, looking, seen) for seen in (covered, None)]
    assert np.array_equal(*puddled)
    damp = wet(0.0, 1.0).apply(grey, depth, is_open, looking, covered)[60:].astype(float)
    assert (damp > 300)[is_open[60:]].all(), "brighter: `mirrored` is half of full scale everywhere"


SIZES = [(1920, 1080, 90.0), (3840, 2160, 90.0), (1024, 1024, 120.0), (1242, 375, 81.0), (640, 384, 60.0)]


@pytest.mark.parametrize(("width_px", "height_px", "hfov_deg"), SIZES)
@pytest.mark.parametrize("look", [*LOOKS, {"roll_deg": 90.0}, {"pitch_deg": -30.0}])
def test_the_look_from_below_covers_all_that_the_ground_mirrors(
    width_px: int, height_px: int, hfov_deg: float, look: dict[str, float]
) -> None:
    focal_px = width_px / 2 / np.tan(np.radians(hfov_deg) / 2)
    looking = replace(camera(**look), width_px=width_px, height_px=height_px, focal_px=focal_px)
    below = mirror_camera(looking, HEIGHT_M)
    assert below is not None
    towards = rays(looking)[:: height_px // 90, :: width_px // 90].reshape(-1, 3)
    towards = np.concatenate([towards, rays(looking)[[0, 0, -1, -1], [0, -1, 0, -1]]])
    mirrored = towards[towards[:, 2] < 0] * (1, 1, -1) @ below.world_from_camera_transform.rotation
    places = mirrored[:, :2] / mirrored[:, 2:] * below.focal_px
    assert (mirrored[:, 2] > 0).all()
    assert (np.abs(places) <= (np.array([below.width_px, below.height_px]) - 1) / 2).all()
    assert (below.width_px % 32, below.height_px % 32) == (0, 0)


def test_sizes_do_not_hang_on_the_last_digit_of_a_pose() -> None:
    sizes = set()
    for yaw_deg in np.linspace(0, 360, 97):
        below = mirror_camera(replace(camera(yaw_deg=float(yaw_deg)), width_px=1536, height_px=768, focal_px=768), 0.0)
        assert below is not None
        sizes.add((below.width_px, below.height_px))
    assert len(sizes) == 1


def test_air_lies_between_the_mirror_and_what_it_shows_alone() -> None:
    looking = camera(yaw_deg=0.0)
    below = mirror_camera(looking, HEIGHT_M)
    assert below is not None
    towards = rays(below)
    low_m = below.world_from_camera_transform.translation_m
    wall_m = (WALL_M - low_m[0]) / towards[..., 0]
    beyond_m, there = beyond_mirror(wall_m.astype(np.float32), below, HEIGHT_M)
    climbs = towards[..., 2] > 0.02
    leg_m = (HEIGHT_M - low_m[2]) / towards[..., 2]
    expected = np.maximum(wall_m - leg_m, 0)[climbs]
    assert np.abs(beyond_m[climbs] - expected).max() < 1e-3 and expected.max() > 10
    assert there.world_from_camera.position_m[2] == HEIGHT_M
    assert np.isnan(beyond_mirror(np.full_like(beyond_m, np.nan), below, HEIGHT_M)[0]).all()
