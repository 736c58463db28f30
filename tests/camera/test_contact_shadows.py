"""Ground under and beside road users: analytic boxes, and what the shade must leave alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from gear.camera.contact_shadows import DISPLAY_POWER, MOST_HIDDEN, OUTLINE, ContactShadows, SkyOcclusion
from gear.values.frames import Shape
from gear.values.geometry import RigidTransform
from gear.values.scene import ActorRecord, CameraRecord, Pose, SceneRecord, Weather

LOW, HIGH = (-2.0, -0.9, 0.3), (2.0, 0.9, 1.5)
SIZE = (320, 160)
EYE_M = 1.6


def box(low: Sequence[float], high: Sequence[float]) -> Shape:
    """An asset that is one box."""
    ends = np.array([low, high])
    vertices = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], dtype=np.int32)
    return Shape(
        vertices_m=vertices,
        faces=faces,
        face_label_code=np.full(len(faces), 25, np.uint8),
        box_centre_m=ends.mean(axis=0),
        box_size_m=ends[1] - ends[0],
    )


def share_by_rays(low: Sequence[float], high: Sequence[float], x_m: float, y_m: float) -> float:
    """What a box hides, by rays through the sky from one place: slabs, no shadows and no grid."""
    rng = np.random.default_rng(3)
    square, turn = rng.random(40_000), 2 * np.pi * rng.random(40_000)
    rays = np.stack([np.sqrt(square) * np.cos(turn), np.sqrt(square) * np.sin(turn), np.sqrt(1 - square)])
    near, far = np.zeros(rays.shape[1]), np.full(rays.shape[1], np.inf)
    for axis, start in enumerate((x_m, y_m, 0.0)):
        ends = [(side[axis] - start) / rays[axis] for side in (low, high)]
        near, far = np.maximum(near, np.minimum(*ends)), np.minimum(far, np.maximum(*ends))
    return float((near < far).mean())


def share_at(sky: SkyOcclusion, x_m: float, y_m: float) -> float:
    """Of the nearest cell."""
    rows, columns = sky.share.shape
    place = round(y_m * sky.cells_per_m) + rows // 2, round(x_m * sky.cells_per_m) + columns // 2
    return float(sky.share[place])


@pytest.mark.parametrize(
    ("x_m", "y_m"), [(0, 0), (1.2, 0.4), (0, 0.6), (-1.9, -0.8), (0, 1.2), (0, -1.5), (2.4, 0), (-3.0, 0.5)]
)
def test_a_box_hides_what_rays_say(x_m: float, y_m: float) -> None:
    assert share_at(SkyOcclusion.of(box(LOW, HIGH)), x_m, y_m) == pytest.approx(
        share_by_rays(LOW, HIGH, x_m, y_m), abs=0.06
    )


def test_what_hides_little_fades_out_at_the_border() -> None:
    share = SkyOcclusion.of(box(LOW, HIGH)).share
    assert max(share[0].max(), share[-1].max(), share[:, 0].max(), share[:, -1].max()) == 0
    assert share.max() > 0.9


def test_small_assets_have_finer_cells() -> None:
    person, car = SkyOcclusion.of(box((-0.2, -0.2, 0.0), (0.2, 0.2, 1.7))), SkyOcclusion.of(box(LOW, HIGH))
    assert person.cells_per_m > car.cells_per_m


def camera() -> CameraRecord:
    """Looks east from the origin."""
    world_from_camera = RigidTransform.from_parts("world", "camera", [[0, 0, 1], [-1, 0, 0], [0, -1, 0]], [0, 0, EYE_M])
    return CameraRecord(
        name="rgb",
        width_px=SIZE[0],
        height_px=SIZE[1],
        focal_px=160.0,
        world_from_camera=Pose.from_transform(world_from_camera),
    )


def plane_depth_m(height_m: float = 0.0) -> np.ndarray:
    """(H, W) planar z of level ground, NaN in the sky."""
    down = (np.arange(SIZE[1]) + 0.5 - SIZE[1] / 2) / 160.0
    with np.errstate(divide="ignore"):
        z = np.where(down > 0, (EYE_M - height_m) / down, np.nan)
    return np.repeat(z[:, None], SIZE[0], axis=1).astype(np.float32)


def scene(x_m: float, y_m: float = 0.0, yaw_rad: float = 0.0) -> SceneRecord:
    """One actor, ahead to the east."""
    pose = Pose.from_transform(RigidTransform.from_yaw("world", "actor", [x_m, y_m, 0.0], yaw_rad))
    return SceneRecord(
        town="t",
        scene="s",
        split="test",
        seed=0,
        index=0,
        sequence=0,
        frame=0,
        time_s=0.0,
        weather=Weather(name="w"),
        actors=(ActorRecord(id=1, asset="thing", role="npc", world_from_actor=pose),),
        surfaces=(),
        cameras=(camera(),),
    )


def shade(even_share: float = 1.0, is_display: bool = False, low=LOW, high=HIGH) -> ContactShadows:  # type: ignore[no-untyped-def]
    return ContactShadows(shapes={"thing": box(low, high)}, even_share=even_share, is_display=is_display)


def pixel_of(x_m: float, y_m: float) -> tuple[int, int]:
    """Row and column of a place on the ground."""
    return int(SIZE[1] / 2 + 160 * EYE_M / x_m), int(SIZE[0] / 2 - 160 * y_m / x_m)


def left_of(shading: ContactShadows, record: SceneRecord, depth_m: np.ndarray | None = None) -> np.ndarray:
    depth_m = plane_depth_m() if depth_m is None else depth_m
    left = shading.factors(depth_m, np.isfinite(depth_m), camera(), record)
    assert left is not None
    return left


def test_the_ground_under_it_is_dark_and_what_is_far_is_as_it_was() -> None:
    left = left_of(shade(), scene(8.0))
    assert left[pixel_of(8.0, 0.0)] < 0.15
    assert 0.4 < left[pixel_of(8.0, 1.3)] < 0.95
    assert left[pixel_of(8.0, 6.0)] == 1
    assert (left[: SIZE[1] // 2] == 1).all()
    assert left.min() >= 1 - MOST_HIDDEN - 1e-6


def test_it_lies_where_the_asset_is_and_turns_with_it() -> None:
    tail = {"low": (-3.0, 0.2, 0.3), "high": (0.0, 0.9, 1.5)}  # behind and to the left of its origin only
    ahead = left_of(shade(**tail), scene(9.0))
    assert ahead[pixel_of(7.5, 0.55)] < 0.3 and ahead[pixel_of(7.5, -1.0)] > 0.8 and ahead[pixel_of(10.5, 0.55)] > 0.8
    turned = left_of(shade(**tail), scene(9.0, yaw_rad=np.pi / 2))  # its left is west, its tail is south
    assert turned[pixel_of(8.45, -1.5)] < 0.3 and turned[pixel_of(8.45, 1.5)] > 0.8


def test_beside_it_the_sun_may_shine() -> None:
    overcast, clear = (left_of(shade(even_share=share), scene(8.0)) for share in (1.0, 0.3))
    under, beside = pixel_of(8.0, 0.0), pixel_of(8.0, 1.3)
    assert clear[under] == pytest.approx(overcast[under], abs=0.01)
    assert 1 - clear[beside] == pytest.approx(0.65 * (1 - overcast[beside]), rel=0.02)


def test_ground_of_another_level_is_not_shaded() -> None:
    kerb = left_of(shade(), scene(8.0), plane_depth_m(0.15))
    assert kerb.min() < 0.5
    assert (left_of(shade(), scene(8.0), plane_depth_m(-0.6)) == 1).all()


def test_only_ground_is_shaded_and_half_of_its_outline() -> None:
    depth_m, record = plane_depth_m(), scene(8.0)
    is_ground = np.isfinite(depth_m)
    row, column = pixel_of(8.0, 0.0)
    is_ground[row - 3 : row + 4, column - 3 : column + 4] = False
    whole, left = left_of(shade(), record), shade().factors(depth_m, is_ground, camera(), record)
    assert left is not None
    assert left[row, column] == 1
    assert left[row, column - 3] == pytest.approx(1 - OUTLINE * (1 - whole[row, column - 4]), abs=0.02)


@pytest.mark.parametrize("x_m", [-9.0, 900.0])
def test_what_no_camera_sees_costs_nothing(x_m: float) -> None:
    depth_m = plane_depth_m()
    frame = np.full((*depth_m.shape, 3), 500, np.uint16)
    assert shade().apply(frame, depth_m, np.isfinite(depth_m), camera(), scene(x_m)) is frame


def test_the_ego_car_shades_what_is_before_its_bumper() -> None:
    left = left_of(shade(), scene(0.5))
    row, column = SIZE[1] - 1, SIZE[0] // 2
    assert left[row, column] < 0.9
    assert np.isfinite(left).all()


def test_frames_stay_linear() -> None:
    depth_m, record = plane_depth_m(), scene(8.0)
    rng = np.random.default_rng(0)
    one, other = (rng.integers(0, 20_000, (*depth_m.shape, 3)).astype(np.uint16) for _ in range(2))
    laid = [
        shade().apply(f, depth_m, np.isfinite(depth_m), camera(), record).astype(int) for f in (one, other, one + other)
    ]
    assert np.abs(laid[0] + laid[1] - laid[2]).max() <= 1
    left = left_of(shade(), record)
    assert np.abs(laid[0] - one * left[..., None]).max() <= 0.5 + 1e-2


def test_display_values_are_shaded_by_a_root() -> None:
    light, display = left_of(shade(), scene(8.0)), left_of(shade(is_display=True), scene(8.0))
    ground = pixel_of(8.0, 0.0)
    assert display[ground] == pytest.approx(light[ground] ** DISPLAY_POWER, rel=1e-5)


def test_assets_without_a_shape_shade_nothing() -> None:
    depth_m, record = plane_depth_m(), scene(8.0)
    unknown = replace(record, actors=(replace(record.actors[0], asset="ghost"),))
    assert shade().factors(depth_m, np.isfinite(depth_m), camera(), unknown) is None
