"""Shadows of lamps: where light stops, held against rays and against what geometry says."""

from __future__ import annotations

import math

import numpy as np
import pytest

from gear.camera.lamp_shadows import STANDING, Casters, LampShadow, LampShadows
from gear.camera.lamps import Lamps, globe_beam
from gear.camera.shadow_map import BORDER, LampFrame, Layout, ShadowMap, add_occluder, first_hits
from gear.values.frames import Shape
from gear.values.geometry import RigidTransform
from gear.values.scene import ActorRecord, Pose, SceneRecord, Weather

DOWN = np.array([0.0, 0.0, -1.0])
LAMP_M = np.array([0.0, 0.0, 8.0])


def box(centre_m: tuple[float, float, float], size_m: tuple[float, float, float]) -> np.ndarray:
    """(12, 3, 3) triangles, seen from outside."""
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * np.array(size_m) / 2 + centre_m
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [three for a, b, c, d in quads for three in ((a, b, c), (a, c, d))]
    return corners[np.array(faces)].astype(np.float32)


def shape(corners_m: np.ndarray) -> Shape:
    vertices = corners_m.reshape(-1, 3).astype(np.float64)
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return Shape(
        vertices_m=vertices,
        faces=np.arange(len(vertices), dtype=np.int32).reshape(-1, 3),
        face_label_code=np.zeros(len(corners_m), np.uint8),
        box_centre_m=(low + high) / 2,
        box_size_m=high - low,
    )


def record(*actors: ActorRecord) -> SceneRecord:
    return SceneRecord(
        town="t", scene="s", split="test", seed=1, index=0, sequence=0, frame=0, time_s=0.0,
        weather=Weather(name="x", sun_altitude_deg=-90), actors=actors, surfaces=(), cameras=(),
    )  # fmt: skip


def walker(x_m: float, y_m: float = 0.0) -> ActorRecord:
    pose = RigidTransform.from_yaw("world", "actor", (x_m, y_m, 0.0), 0.0)
    return ActorRecord(id=2, asset="walker", role="pedestrian", world_from_actor=Pose.from_transform(pose))


def one_lamp(place_m: np.ndarray = LAMP_M, axis: np.ndarray = DOWN) -> Lamps:
    return Lamps(
        position_m=place_m[None], axis=axis[None], intensity=np.ones(1), colour=(1.0, 1.0, 1.0), beam=globe_beam,
        reach_m=30.0, up_m=1.0, down_m=10.0,
    )  # fmt: skip


def shadow(town: LampShadows, scene: SceneRecord, lamps: Lamps | None = None, *, stands: bool = True) -> LampShadow:
    return LampShadow(scene=town.scene(scene), kind="k", index=0, lamps=lamps or one_lamp(), stands=stands)


def left(
    one: LampShadow,
    places_m: np.ndarray,
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0),
    lamp_m: np.ndarray = LAMP_M,
) -> np.ndarray:
    """Shares of light that (N, 3) places get."""
    away = (places_m - lamp_m).astype(np.float32).T
    away_m = np.linalg.norm(away, axis=0)
    unit = away / away_m
    facing = -(np.array(normal, np.float32) @ unit)
    light = np.ones((1, len(places_m)), np.float32)
    x, y, z = (part[None] for part in unit)
    one.attenuate(light, (x, y, z), away_m[None], facing[None], np.full_like(light, normal[2]))
    return light[0]


def along_x(*x_m: float, y_m: float = 0.0, z_m: float = 0.0) -> np.ndarray:
    return np.array([(x, y_m, z_m) for x in x_m], float)


NOTHING = Casters.of(np.zeros((0, 3, 3), np.float32))
WALKER = {"walker": shape(box((0.0, 0.0, 0.9), (0.3, 0.5, 1.8)))}


@pytest.mark.parametrize("seed", range(4))
def test_light_ends_where_rays_first_meet_something(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = [box(tuple(rng.uniform((-12, -12, 0), (12, 12, 6))), tuple(rng.uniform(0.6, 5, 3))) for _ in range(12)]
    corners = np.concatenate([one for one in boxes if np.abs(one - LAMP_M).max(axis=2).min() > 2])
    axis = DOWN + rng.uniform(-0.3, 0.3, 3)
    lamp_frame = LampFrame.of(LAMP_M, axis, STANDING)
    stop_m = first_hits(corners, lamp_frame)
    row, column = (rng.integers(4, STANDING.cells - 4, 3000) for _ in range(2))
    rays = lamp_frame.directions(column, row).astype(float)
    before = rays @ (axis / np.linalg.norm(axis)) > 0.05
    row, column, rays = row[before], column[before], rays[before]
    np.testing.assert_allclose(lamp_frame.places(rays.T.astype(np.float32)), [column, row], atol=2e-3)
    expected = np.min([hits(triangle.astype(float), LAMP_M, rays) for triangle in corners], axis=0)
    found = stop_m[row, column]
    open_way = np.isinf(expected)
    same = np.where(open_way, np.isinf(found), np.abs(found - np.where(open_way, 0, expected)) < 0.02)
    # What is painted reaches half a cell over its outline.
    assert np.isfinite(expected).mean() > 0.1
    assert same.mean() > 0.97


def hits(triangle: np.ndarray, eye_m: np.ndarray, rays: np.ndarray) -> np.ndarray:
    """(N,) distances at which rays meet a triangle (Moeller and Trumbore 1997)."""
    a, b, c = triangle
    p = np.cross(rays, c - a)
    scale = p @ (b - a)
    with np.errstate(divide="ignore", invalid="ignore"):
        u = p @ (eye_m - a) / scale
        q = np.cross(eye_m - a, b - a)
        v = rays @ q / scale
        t = (c - a) @ q / scale
        return np.where((u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0) & (scale > 0), t, np.inf)


def test_a_wall_takes_the_light_of_what_lies_behind_it_and_of_nothing_before_it() -> None:
    town = LampShadows(casters=Casters.of(box((6.0, 0.0, 2.0), (0.2, 30.0, 4.0))), shapes={})
    one = shadow(town, record())
    # A wall of 4 m at 6 m from below a lamp of 8 m: its shadow ends at 12 m.
    before, behind, beyond = along_x(2, 4, 5.5), along_x(6.6, 8, 10, 11.5), along_x(12.8, 14, 20)
    np.testing.assert_allclose(left(one, before), 1)
    np.testing.assert_allclose(left(one, behind), 0)
    np.testing.assert_allclose(left(one, beyond), 1)
    edge = left(one, along_x(*np.linspace(11.5, 12.8, 40)))
    assert (np.diff(edge) >= -1e-6).all() and ((edge > 0.1) & (edge < 0.9)).any(), "soft, and never back"


def test_a_lit_wall_casts_no_shadow_on_itself() -> None:
    town = LampShadows(casters=Casters.of(box((3.0, 0.0, 6.0), (0.4, 60.0, 12.0))), shapes={})
    one = shadow(town, record())
    y, z = (grid.reshape(-1) for grid in np.meshgrid(np.linspace(-24, 24, 97), np.linspace(0.1, 7.5, 23)))
    places = np.stack([np.full(len(y), 2.8), y, z], axis=1)
    lit = left(one, places, normal=(-1.0, 0.0, 0.0))
    assert lit.min() == 1


def test_shadows_of_road_users_start_at_their_feet_and_do_not_fall_on_themselves() -> None:
    town = LampShadows(casters=NOTHING, shapes=WALKER)
    one = shadow(town, record(walker(6.0)))
    # 1.8 m high, 6 m from below a lamp of 8 m: to 6.15 + 6.15 * 1.8 / 6.2 = 7.94 m.
    np.testing.assert_allclose(left(one, along_x(5.0, 5.6)), 1)
    np.testing.assert_allclose(left(one, along_x(6.5, 7.0, 7.6)), 0)
    np.testing.assert_allclose(left(one, along_x(8.3, 9.0, 12.0)), 1)
    np.testing.assert_allclose(left(one, along_x(7.0, 7.4, y_m=0.75)), 1)
    np.testing.assert_allclose(left(one, along_x(7.0, 7.4, y_m=0.15)), 0)
    assert left(one, along_x(6.25)).max() < 0.5, "near the soles"
    front = np.array([(5.85, y, z) for y in (-0.2, 0, 0.2) for z in np.linspace(0.05, 1.75, 12)])
    np.testing.assert_allclose(left(one, front, normal=(-1.0, 0.0, 0.0)), 1)
    top = np.array([(x, y, 1.8) for x in (5.9, 6.0, 6.1) for y in (-0.2, 0, 0.2)])
    np.testing.assert_allclose(left(one, top), 1)


def test_what_stands_is_looked_at_once_and_road_users_leave_no_trace() -> None:
    town = LampShadows(casters=Casters.of(box((-6.0, 0.0, 1.0), (0.2, 4.0, 2.0))), shapes=WALKER)
    places = along_x(-7.6, -7.0, 5.0, 6.5, 7.0)
    empty = left(shadow(town, record()), places)
    busy = left(shadow(town, record(walker(6.0))), places)
    again = left(shadow(town, record()), places)
    np.testing.assert_array_equal(empty, [0, 0, 1, 1, 1])
    np.testing.assert_array_equal(busy, [0, 0, 1, 0, 0])
    np.testing.assert_array_equal(again, empty)


def test_headlamps_cast_shadows_of_other_road_users_only() -> None:
    head_m = np.array([0.0, 0.0, 0.65])
    head = one_lamp(head_m, np.array([1.0, 0.0, 0.0]))
    own_car = ActorRecord(
        id=1, asset="car", role="ego",
        world_from_actor=Pose(position_m=(-2.0, 0.6, 0.0), quat_wxyz=(1.0, 0.0, 0.0, 0.0)),
    )  # fmt: skip
    shapes = WALKER | {"car": shape(box((0.0, 0.0, 0.9), (4.0, 1.8, 1.2)))}
    town = LampShadows(casters=Casters.of(box((4.0, 3.0, 1.0), (0.2, 1.0, 2.0))), shapes=shapes)
    one = shadow(town, record(own_car, walker(9.0)), head, stands=False)
    wall = np.array([(20.0, y, 0.6) for y in (-2.0, -0.3, 0.0, 0.3, 2.0, 15.0)])
    np.testing.assert_allclose(left(one, wall, (-1.0, 0.0, 0.0), head_m), [1, 0, 0, 0, 1, 1])


def test_a_lamp_is_not_in_its_own_way() -> None:
    housing = box((0.0, 0.0, 8.2), (0.7, 0.3, 0.3))
    one = shadow(LampShadows(casters=Casters.of(housing), shapes={}), record())
    np.testing.assert_allclose(left(one, along_x(-9, -3, 0, 3, 9)), 1)


def test_nothing_is_stopped_behind_a_lamp_or_outside_of_its_map() -> None:
    lamp_frame = LampFrame.of(LAMP_M, np.array([1.0, 0.0, 0.0]), Layout(cells=64, zoom=2.0))
    stop_m = lamp_frame.layout.empty()
    stop_m[BORDER:-BORDER, BORDER:-BORDER] = 3.0
    one = ShadowMap(lamp_frame=lamp_frame, stop_m=stop_m)
    angle = np.radians([0, 30, 45, 100, 180, 260])
    unit = np.stack([np.cos(angle), np.sin(angle), np.zeros(6)]).astype(np.float32)
    flat = np.ones(6, np.float32)
    np.testing.assert_array_equal(one.through(unit, 9 * flat, flat, 0 * flat), [0, 0, 0, 1, 1, 1])
    np.testing.assert_array_equal(one.through(unit, 2 * flat, flat, 0 * flat), 1)


def test_sparse_points_near_a_lamp_have_no_holes_between_them() -> None:
    lamp_frame = LampFrame.of(LAMP_M, DOWN, STANDING)
    stop_m = lamp_frame.layout.empty()
    x, y = (grid.reshape(-1) for grid in np.meshgrid(*[np.arange(-0.6, 0.61, 0.07)] * 2))
    add_occluder(stop_m, np.stack([x, y, np.full(len(x), 5.5)], axis=1).astype(np.float32), 0.07, lamp_frame)
    places = along_x(*np.linspace(-1.2, 1.2, 50), y_m=0.3)
    away = (places - LAMP_M).astype(np.float32).T
    away_m = np.linalg.norm(away, axis=0)
    through = ShadowMap(lamp_frame=lamp_frame, stop_m=stop_m).through(
        away / away_m, away_m, -away[2] / away_m, np.ones(50, np.float32)
    )
    np.testing.assert_array_equal(through, 0)


@pytest.mark.parametrize("seed", range(3))
def test_what_is_near_is_all_that_is_within_reach(seed: int) -> None:
    rng = np.random.default_rng(seed)
    middle = rng.uniform(-80, 80, (4000, 1, 3))
    corners = (middle + rng.normal(0, 1, (4000, 3, 3)) * rng.choice([0.2, 1, 12], (4000, 1, 1))).astype(np.float32)
    place_m = rng.uniform(-40, 40, 3).astype(np.float32)
    found = {one.tobytes() for one in Casters.of(corners).near(place_m, 25.0)}
    within = np.linalg.norm(corners - place_m, axis=2).min(axis=1) < 25.0
    assert within.any() and {one.tobytes() for one in corners[within]} <= found
    assert len(found) < 0.5 * len(corners)


def test_views_of_one_scene_share_its_maps_and_another_scene_has_its_own() -> None:
    town = LampShadows(casters=NOTHING, shapes=WALKER)
    first, second = record(walker(6.0)), record(walker(-6.0))
    scene = town.scene(first)
    assert town.scene(first) is scene
    one = scene.map("k", 0, one_lamp(), stands=True)
    assert town.scene(first).map("k", 0, one_lamp(), stands=True) is one
    other = town.scene(second).map("k", 0, one_lamp(), stands=True)
    assert not np.array_equal(other.stop_m, one.stop_m)
    np.testing.assert_array_equal(
        town.scene(record(walker(6.0))).map("k", 0, one_lamp(), stands=True).stop_m, one.stop_m
    )


def test_layouts_say_how_far_they_reach() -> None:
    assert Layout(cells=256, zoom=1.0).half_angle_rad > math.pi / 2
    wide = Layout(cells=64, zoom=2.2)
    lamp_frame = LampFrame.of(LAMP_M, DOWN, wide)
    corner = lamp_frame.directions(np.array([0]), np.array([0]))[0]
    assert math.acos(corner @ DOWN) == pytest.approx(wide.half_angle_rad, rel=0.03)
