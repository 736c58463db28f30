"""Lamps at night: what they light, what glows, and that all of it is linear and the same every time."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from gear.camera.glow import LampGlare, LitWindows
from gear.camera.lamp_shadows import Casters, LampShadows
from gear.camera.lamps import Headlamps, Lamps, headlamps, low_beam, street_beam
from gear.camera.lamps_in_view import LampsInView
from gear.camera.light_sources import INSIDE_LIGHT
from gear.camera.night import Night, NightLight
from gear.camera.normals import strips_of
from gear.contracts.rendering import RawView
from gear.values.frames import LINEAR_FULL_SCALE, GeomTable
from gear.values.geometry import CAMERA_FROM_ACTOR_AXES, RigidTransform
from gear.values.labels import LABEL_BY_NAME
from gear.values.scene import ActorRecord, CameraRecord, Pose, SceneRecord, SurfaceRecord, Weather

SIZE, FOCAL_PX, EYE_M = (96, 160), 90.0, 1.6
WALL_M = 30.0
ROAD, WALL = 0, 1


def camera(yaw_rad: float = 0.0, x_m: float = 0.0, y_m: float = 0.0) -> CameraRecord:
    turn = RigidTransform.from_yaw("world", "actor", (x_m, y_m, EYE_M), yaw_rad).rotation
    pose = RigidTransform.from_parts("world", "camera", turn @ CAMERA_FROM_ACTOR_AXES.T, (x_m, y_m, EYE_M))
    return CameraRecord(
        name="c", width_px=SIZE[1], height_px=SIZE[0], focal_px=FOCAL_PX, world_from_camera=Pose.from_transform(pose)
    )


def street() -> tuple[np.ndarray, np.ndarray]:
    """Planar z and ids of a level road before a wall of 6 m, under the sky, for the camera at the origin."""
    rows = ((np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2) / FOCAL_PX)[:, None].repeat(SIZE[1], axis=1)
    with np.errstate(divide="ignore"):
        road_m = np.where(rows > 0, EYE_M / rows, np.inf)
    depth_m = np.minimum(road_m, WALL_M)
    geom_id = np.where(road_m <= WALL_M, ROAD, WALL)
    sky = EYE_M - rows * WALL_M > 6.0
    return np.where(sky, np.nan, depth_m).astype(np.float32), np.where(sky, -1, geom_id).astype(np.int32)


def record(*actors: ActorRecord, surfaces: tuple[SurfaceRecord, ...] = ()) -> SceneRecord:
    ego = ActorRecord(
        id=1,
        asset="cart",
        role="ego",
        world_from_actor=Pose(position_m=(-1.0, 0.0, 0.0), quat_wxyz=(1.0, 0.0, 0.0, 0.0)),
    )
    return SceneRecord(
        town="t", scene="s", split="test", seed=1, index=0, sequence=0, frame=0, time_s=0.0,
        weather=Weather(name="x", sun_altitude_deg=-90), actors=(ego, *actors), surfaces=surfaces, cameras=(camera(),),
    )  # fmt: skip


def lamps(*places_m: tuple[float, float, float], intensity: float = 20.0) -> Lamps:
    return Lamps(
        position_m=np.array(places_m, float).reshape(-1, 3),
        axis=np.tile([0.0, 0.0, -1.0], (len(places_m), 1)),
        intensity=np.full(len(places_m), intensity),
        colour=(1.0, 0.8, 0.5),
        beam=street_beam,
        reach_m=30.0,
        up_m=0.1,
        down_m=15.0,
    )


NO_WINDOWS = LitWindows(
    corners_m=np.zeros((0, 4, 3)),
    normal=np.zeros((0, 3)),
    geom_id=np.zeros(0, np.int32),
    gain=np.zeros((0, 3), np.float32),
    light=np.zeros((0, 3), np.float32),
)


def night(*places_m: tuple[float, float, float], **changes: object) -> Night:
    plain = Night(
        level=0.05,
        sky_level=0.2,
        lit=0.95,
        even=np.array([[0.9, 0.9, 1.0], [0.6, 0.6, 0.7], [0.2, 0.2, 0.2]]),
        lamps={"street": lamps(*places_m)},
        windows=NO_WINDOWS,
        vehicles={},
        wetness=0.0,
        is_signal=np.zeros(2, bool),
        is_lens=np.zeros(2, bool),
        is_pane=np.zeros(2, bool),
        is_display=False,
    )
    return replace(plain, **changes)  # type: ignore[arg-type]


def geoms(**changes: object) -> GeomTable:
    codes = np.array([LABEL_BY_NAME["road"].code, LABEL_BY_NAME["building"].code], np.uint8)
    table = GeomTable(label_code=codes, object_id=np.full(2, -1, np.int32), surface_index=np.full(2, -1, np.int16))
    return replace(table, **changes)  # type: ignore[arg-type]


def light_of(one: Night, scene: SceneRecord | None = None, table: GeomTable | None = None) -> NightLight:
    depth_m, geom_id = street()
    truth = RawView(linear_rgb=None, depth_m=depth_m, geom_id=geom_id)
    return one.light(truth, camera(), scene or record(), table or geoms())


def test_slants_are_those_of_the_road_and_the_wall() -> None:
    depth_m, geom_id = street()
    strips = list(strips_of(depth_m, camera(yaw_rad=0.3)))
    normal = np.concatenate([strip.normal for strip in strips], axis=1)
    towards = [-math.cos(0.3), -math.sin(0.3), 0.0]
    crease = np.flatnonzero(geom_id[:, 0] == ROAD)[0]
    for ids, expected in ((ROAD, [0, 0, 1]), (WALL, towards)):
        rows = np.flatnonzero((geom_id[:, 0] == ids) & (abs(np.arange(SIZE[0]) - crease) > 1))
        np.testing.assert_allclose(
            np.moveaxis(normal[:, rows], 0, 2), np.broadcast_to(expected, (len(rows), SIZE[1], 3)), atol=2e-3
        )
    assert not normal[:, geom_id < 0].any()
    assert np.isfinite(np.concatenate([strip.position_m for strip in strips], axis=1)).all()


def test_paint_some_millimetres_thick_lies_as_flat_as_its_road() -> None:
    rows = ((np.arange(SIZE[0]) + 0.5 - SIZE[0] / 2) / FOCAL_PX)[:, None].repeat(SIZE[1], axis=1)
    columns = (np.arange(SIZE[1]) + 0.5 - SIZE[1] / 2) / FOCAL_PX
    seen = rows > 0.08
    road_m = EYE_M / np.where(seen, rows, 1)
    # A stripe that runs aslant over the road, 5 mm above it.
    is_paint = np.abs(0.4 * road_m - columns * road_m - 2.0) < 0.15
    depth_m = np.where(seen, np.where(is_paint, (EYE_M - 0.005) / np.where(seen, rows, 1), road_m), np.nan)
    up = np.concatenate([strip.normal[2] for strip in strips_of(depth_m.astype(np.float32), camera())])
    assert is_paint[seen].sum() > 100
    assert (up[seen] > 0.9999).mean() > 0.997


def test_the_road_gets_what_the_inverse_square_says() -> None:
    place = (12.0, 1.0, 8.0)
    shared = light_of(night(place)).share
    depth_m, geom_id = street()
    row, column = 66, 90
    assert geom_id[row, column] == ROAD
    z = depth_m[row, column]
    x_m, y_m = z, -(column + 0.5 - SIZE[1] / 2) / FOCAL_PX * z
    away = np.array([x_m, y_m, 0.0]) - place
    square = away @ away
    cosine = -away[2] / math.sqrt(square)
    beam = min(3.5 * cosine, 1) * (1 + 1.6 * (1 - cosine**2))
    expected = 20.0 * beam * cosine / square * (1 - (square / 30**2) ** 2) ** 2
    np.testing.assert_allclose(
        shared[row, column], 0.05 + 0.95 * expected * np.array([1, 0.8, 0.5]) / [0.9, 0.9, 1.0], rtol=4e-3
    )


def test_darkness_and_the_sky_keep_their_levels_and_walls_that_face_away_stay_dark() -> None:
    dark = light_of(night())
    _, geom_id = street()
    np.testing.assert_allclose(dark.share[geom_id >= 0], 0.05, rtol=1e-3)
    np.testing.assert_allclose(dark.share[geom_id < 0], 0.2, rtol=1e-3)
    assert not dark.glow.any() and dark.streaks is None
    behind = light_of(night((WALL_M + 2, 0.0, 5.0)))
    np.testing.assert_allclose(behind.share[geom_id == WALL], 0.05, rtol=1e-3)


@pytest.mark.parametrize("seed", range(12))
def test_nothing_is_lost_at_the_edges_of_what_a_lamp_may_light(seed: int) -> None:
    rng = np.random.default_rng(seed)
    depth_m, _ = street()
    eye = camera(yaw_rad=rng.uniform(-3, 3), x_m=rng.uniform(-20, 20), y_m=rng.uniform(-20, 20))
    places = tuple(tuple(rng.uniform((-40, -40, 3), (60, 40, 9))) for _ in range(6))
    spots = LampsInView.of(lamps(*places), eye)
    everywhere = replace(spots, boxes=np.tile([0, SIZE[1], 0, SIZE[0]], (6, 1)))
    for strip in strips_of(depth_m, eye):
        found, all_of_it = spots.light(strip), everywhere.light(strip)
        assert all_of_it is not None
        low = strip.position_m[2] + EYE_M < np.array(places)[:, 2].min()
        np.testing.assert_allclose((0 if found is None else found) * low, all_of_it * low, atol=1e-6)


def test_frames_stay_linear_and_the_same() -> None:
    light = light_of(night((14.0, 0.0, 8.0)))
    rng = np.random.default_rng(3)
    black, white = np.zeros((*SIZE, 3), np.uint16), np.full((*SIZE, 3), 90, np.uint16)
    weight = rng.random((*SIZE, 3))
    mixed = np.round(weight * white).astype(np.uint16)
    shown = [light.apply(frame).astype(float) for frame in (black, white, mixed)]
    clear = shown[1] < LINEAR_FULL_SCALE
    assert clear.mean() > 0.95, "all but the lamp itself"
    assert np.abs(shown[0] + weight * (shown[1] - shown[0]) - shown[2])[clear].max() < 2.5
    assert abs(np.mean((shown[2] - mixed * light.share - light.glow)[clear])) < 0.05, "the grain is right on average"
    np.testing.assert_array_equal(light.apply(mixed), light.apply(mixed))


def test_an_object_in_the_light_of_a_lamp_casts_a_shadow_only_behind_it() -> None:
    place = (6.0, 0.0, 8.0)
    # A board across the road, with its middle 3 m above the ground.
    board = np.array([[(8, -4, 1), (8, -4, 5), (8, 4, 5)], [(8, -4, 1), (8, 4, 5), (8, 4, 1)]], np.float32)
    free = light_of(night(place)).share.astype(float)
    stopped = light_of(night(place, shadows=LampShadows(casters=Casters.of(board), shapes={}))).share.astype(float)
    depth_m, geom_id = street()
    column = SIZE[1] // 2
    x_m = depth_m[:, column]
    # Its lower edge is 7 m below the lamp, its upper one 3 m: from 8.3 to 11.3 m the road is in its shadow.
    in_shadow = (geom_id[:, column] == ROAD) & (x_m > 8.6) & (x_m < 10.9)
    in_light = (geom_id[:, column] == ROAD) & ((x_m < 7.9) | (x_m > 12.0))
    assert in_shadow.sum() >= 3 and in_light.sum() > 10
    np.testing.assert_allclose(stopped[in_shadow, column], 0.05, rtol=1e-2)
    np.testing.assert_array_equal(stopped[in_light, column], free[in_light, column])
    assert (stopped <= free).all()


def test_lit_panes_are_seen_where_they_are_and_only_from_outside() -> None:
    y, z = (-3.0, 2.0), (1.0, 4.0)
    corners = np.array([[[WALL_M, y[1], z[0]], [WALL_M, y[0], z[0]], [WALL_M, y[0], z[1]], [WALL_M, y[1], z[1]]]])
    windows = replace(
        NO_WINDOWS, corners_m=corners, normal=np.array([[-1.0, 0, 0]]), geom_id=np.array([WALL], np.int32),
        gain=np.full((1, 3), 2.0, np.float32), light=np.full((1, 3), 0.1, np.float32),
    )  # fmt: skip
    depth_m, geom_id = street()
    seen = windows.seen(geom_id, depth_m, camera())
    rows, columns = np.nonzero(seen == 0)
    left, right = (SIZE[1] / 2 - FOCAL_PX * value / WALL_M for value in (y[1], y[0]))
    top, bottom = (SIZE[0] / 2 + FOCAL_PX * (EYE_M - value) / WALL_M for value in (z[1], z[0]))
    assert abs(columns.min() - left) <= 1 and abs(columns.max() + 1 - right) <= 1
    assert abs(rows.min() - top) <= 1 and abs(rows.max() + 1 - bottom) <= 1
    assert (windows.seen(geom_id, depth_m, camera(yaw_rad=math.pi)) < 0).all()
    assert (replace(windows, normal=-windows.normal).seen(geom_id, depth_m, camera()) < 0).all()
    assert (windows.seen(np.full_like(geom_id, ROAD), depth_m, camera()) < 0).all(), "something else stands before it"
    assert (windows.seen(geom_id, depth_m - 4, camera()) < 0).all(), "another house of the same geom stands before it"
    lit = light_of(night(windows=windows))
    assert lit.share[rows[0], columns[0]] == pytest.approx(0.05 + 0.95 * 2, rel=1e-3)
    assert lit.glow[rows[0], columns[0]] == pytest.approx(0.95 * 0.1 * LINEAR_FULL_SCALE, rel=1e-3)


def test_a_lamp_shines_at_the_camera_unless_something_hides_it() -> None:
    depth_m, _ = street()
    one = lamps((20.0, 2.0, 5.0), (WALL_M + 5, 0.0, 4.0))
    shine = LampGlare.of(one, camera(), 0.1, depth_m)
    assert len(shine.strength) == 1
    spot = shine.spots(SIZE)
    row, column = np.unravel_index(np.argmax(spot), SIZE)
    assert (row, column) == pytest.approx(
        (SIZE[0] / 2 - 0.5 - FOCAL_PX * 3.4 / 20, SIZE[1] / 2 - 0.5 - FOCAL_PX * 0.1), abs=1
    )
    mirrored = shine.streaks(camera(), 0.0)
    row, column = np.unravel_index(np.argmax(mirrored), SIZE)
    assert (row, column) == pytest.approx(
        (SIZE[0] / 2 - 0.5 + FOCAL_PX * 6.6 / 20, SIZE[1] / 2 - 0.5 - FOCAL_PX * 0.1), abs=1
    )


def test_wet_roads_mirror_lamps_and_walls_do_not() -> None:
    place = (20.0, 2.0, 5.0)
    _, geom_id = street()
    wet = light_of(night(place, wetness=1.0))
    assert wet.streaks is not None
    assert wet.streaks[geom_id == ROAD].max() > 5 and not wet.streaks[geom_id != ROAD].any()
    frame = np.full((*SIZE, 3), 10, np.uint16)
    assert (wet.apply_reflections(frame) >= frame).all() and wet.apply_reflections(frame).max() > 14
    assert light_of(night(place)).apply_reflections(frame) is frame


def test_only_those_that_drive_have_their_lamps_on() -> None:
    vehicles = {"cart": Headlamps(front_m=2.0, half_gauge_m=0.6), "moped": Headlamps(front_m=0.8, half_gauge_m=0.0)}
    place = Pose(position_m=(30.0, 3.0, 0.0), quat_wxyz=(0.0, 0.0, 0.0, 1.0))
    others = [
        ActorRecord(id=2, asset="cart", role="parked", world_from_actor=place),
        ActorRecord(id=3, asset="moped", role="npc", world_from_actor=place),
        ActorRecord(id=4, asset="walker", role="pedestrian", world_from_actor=place),
    ]
    found = headlamps(record(*others), vehicles)
    np.testing.assert_allclose(found.position_m, [(1.0, -0.6, 0.65), (1.0, 0.6, 0.65), (29.2, 3.0, 0.65)], atol=1e-9)
    np.testing.assert_allclose(found.axis, [(1, 0, 0), (1, 0, 0), (-1, 0, 0)], atol=1e-9)
    assert len(headlamps(record(), {}).intensity) == 0
    ahead, above, below = (low_beam(*(np.float32([value]) for value in (1.0, 0.0, up))) for up in (-0.02, 0.2, -0.05))
    assert ahead > 0.9 and below > 0.8 and above < 0.05, "the beam is cut off at the height of the lamp"


def test_driving_vehicles_have_white_front_and_red_rear_lights_and_parked_ones_none() -> None:
    vehicles = {"van": Headlamps(front_m=2.0, half_gauge_m=0.6)}
    _, geom_id = street()
    table = geoms(object_id=np.array([-1, 2], np.int32))
    for role, yaw, away_m, expected in (
        ("npc", 0.0, 1.8, "red"),
        ("npc", math.pi, 1.8, "white"),
        ("npc", 0.0, 0.4, "dark"),
        ("npc", math.pi, 0.4, "dark"),
        ("parked", math.pi, 1.8, "dark"),
    ):
        pose = RigidTransform.from_yaw("world", "actor", (WALL_M + away_m, 0.0, 0.0), yaw)
        van = ActorRecord(id=2, asset="van", role=role, world_from_actor=Pose.from_transform(pose))  # type: ignore[arg-type]
        one = night(vehicles=vehicles, is_lens=np.array([False, True]))
        red, _, blue = light_of(one, record(van), table).glow[geom_id == WALL][0] / LINEAR_FULL_SCALE
        shown = "dark" if red < 0.1 else "red" if blue < 0.1 * red else "white"
        assert shown == expected


def test_buses_that_drive_are_lit_inside() -> None:
    vehicles = {"bus": Headlamps(front_m=6.0, half_gauge_m=0.9)}
    _, geom_id = street()
    table = geoms(object_id=np.array([-1, 2], np.int32))
    one = night(vehicles=vehicles, is_pane=np.array([False, True]))
    for role, lit in (("npc", True), ("parked", False)):
        # It drives away, so that its own lamps are not seen.
        pose = RigidTransform.from_yaw("world", "actor", (WALL_M + 7, 0.0, 0.0), 0.0)
        bus = ActorRecord(id=2, asset="bus", role=role, world_from_actor=Pose.from_transform(pose))  # type: ignore[arg-type]
        shares = light_of(one, record(bus), table).share[geom_id == WALL]
        if lit:
            white = 0.95 * np.array(INSIDE_LIGHT) + one.level * one.even[1]
            np.testing.assert_allclose(shares * one.even[1], np.broadcast_to(white, shares.shape), rtol=5e-3)
        else:
            np.testing.assert_allclose(shares, one.level, rtol=1e-2)


def test_standing_boards_are_lit_from_above_and_those_on_trucks_are_not() -> None:
    _, geom_id = street()
    table = geoms(surface_index=np.array([-1, 0], np.int16))
    face = RigidTransform.from_parts(
        "world", "surface", np.array([[0, 0, 1], [-1, 0, 0], [0, -1, 0.0]]), (WALL_M, 0, 3.0)
    )
    board = SurfaceRecord(
        name="surface_0", asset="billboard", actor_id=None, parent_from_surface=Pose.from_transform(face),
        width_m=20.0, height_m=6.0,
    )  # fmt: skip
    shares = light_of(night(), record(surfaces=(board,)), table).share
    column = shares[:, SIZE[1] // 2, 0][geom_id[:, SIZE[1] // 2] == WALL]
    assert (column > 0.2).all() and (np.diff(column) < 0).all()
    truck = ActorRecord(
        id=2, asset="truck", role="carrier", world_from_actor=Pose(position_m=(0, 0, 0), quat_wxyz=(1.0, 0, 0, 0))
    )
    carried = light_of(night(), record(truck, surfaces=(replace(board, actor_id=2),)), table).share
    np.testing.assert_allclose(carried[geom_id == WALL], 0.05, rtol=1e-3)


def test_signals_keep_their_light_and_display_values_are_bent() -> None:
    _, geom_id = street()
    signal = light_of(night(is_signal=np.array([False, True]))).share
    np.testing.assert_allclose(signal[geom_id == WALL], 0.05 + 0.95 * 0.9, rtol=1e-3)
    np.testing.assert_allclose(light_of(night(is_display=True)).share[geom_id == ROAD], 0.05 ** (1 / 2.2), rtol=1e-3)
