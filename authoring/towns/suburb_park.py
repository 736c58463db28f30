"""The suburb's park: lawns, a path around a pond, a playground, trees."""

from __future__ import annotations

import numpy as np
from shapely.geometry import Point, Polygon, box  # type: ignore[import-untyped]
from shapely.geometry.base import BaseGeometry  # type: ignore[import-untyped]
from shapely.ops import unary_union  # type: ignore[import-untyped]

from authoring import kit
from authoring.kit import gardens
from authoring.towns import solids
from authoring.towns.collision import Solid, level_box
from authoring.towns.furniture import Furnisher
from authoring.towns.props import Props
from authoring.towns.regions import KERB_M, Regions

PATH_M = 2.4
POND = (84.0, -84.0)
PLAY = (52.0, -116.0)
WATER_DROP_M = 0.28
TREES = 46
ISLAND_WALL_M = 14.3


def park_ground(regions: Regions, corners: tuple[tuple[float, float], ...]) -> Polygon:
    """What the park takes of the inside of its block."""
    inside = next(piece for piece in regions.interiors if piece.contains(Point(*POND)))
    return inside.intersection(Polygon(corners))


def build_park(
    props: Props, furnisher: Furnisher, ground: Polygon, views: BaseGeometry, rng: np.random.Generator
) -> None:
    """Build the park on its ground."""
    sink = props.sink
    angle = np.linspace(0, 2 * np.pi, 41)[:-1]
    radius = 1 + 0.16 * np.sin(2 * angle + 0.6) + 0.1 * np.sin(3 * angle + 2.0)
    shore = np.array(POND) + np.stack([17 * radius * np.cos(angle), 10.5 * radius * np.sin(angle)], 1)
    pond = Polygon(shore)
    rim = pond.buffer(0.45)
    inner = ground.buffer(-7.0).simplify(0.5)
    loop = inner.buffer(-4.0).buffer(4.0).exterior.buffer(PATH_M / 2)
    around = pond.buffer(4.2).exterior.buffer(PATH_M / 2)
    spokes = unary_union(
        [box(POND[0] - 1.2, -40.0, POND[0] + 1.2, POND[1] + 12.0), box(POND[0] + 14, POND[1] - 1.2, 170, POND[1] + 1.2)]
    )
    sand = Point(*PLAY).buffer(10.5)
    tracks = unary_union([loop, around, spokes]).intersection(ground).difference(unary_union([rim.buffer(0.1), sand]))
    solids.flat(sink, ground.difference(unary_union([tracks, rim, sand])), KERB_M, "grass", "terrain")
    solids.flat(sink, tracks, KERB_M, "concrete", "sidewalk")
    solids.flat(sink, sand, KERB_M, "soil", "terrain")
    solids.flat(sink, rim.difference(pond), KERB_M, "cobbles", "ground")
    solids.flat(sink, pond, KERB_M - WATER_DROP_M, "water", "ground")
    edge = np.asarray(pond.exterior.coords)[:, :2]
    edge = edge if not pond.exterior.is_ccw else edge[::-1]
    solids.wall(sink, edge[::-1], KERB_M - WATER_DROP_M - 0.05, KERB_M, "cobbles", "ground")
    props.put("playground", gardens.playground(), *PLAY, KERB_M, 0.5, radius_m=7.5, high_m=2.4)
    for turn in (0.4, 1.9, 3.6, 5.0):
        x, y = POND[0] + 26.0 * np.cos(turn), POND[1] + 19.0 * np.sin(turn)
        yaw = float(np.arctan2(POND[1] - y, POND[0] - x) + np.pi / 2)
        props.put("bench", kit.bench(style="wood"), float(x), float(y), KERB_M, yaw, radius_m=0.9, high_m=0.8)
    for x, y in ((PLAY[0] - 11.5, PLAY[1] + 3), (PLAY[0] + 4.0, PLAY[1] + 11.8)):
        yaw = float(np.arctan2(PLAY[1] - y, PLAY[0] - x) + np.pi / 2)
        props.put("bench", kit.bench(style="wood"), x, y, KERB_M, yaw, radius_m=0.9, high_m=0.8)
    keep = unary_union([tracks.buffer(1.0), rim.buffer(1.0), sand.buffer(1.0), views])
    room = ground.buffer(-2.0)
    x0, y0, x1, y1 = ground.bounds
    planted = 0
    for _ in range(900):
        x, y = float(rng.uniform(x0, x1)), float(rng.uniform(y0, y1))
        free = room.contains(Point(x, y)) and not keep.contains(Point(x, y)) and props.is_free(x, y, 4.0)
        if planted < TREES and free:
            furnisher.plant(x, y, KERB_M, kind=int(rng.integers(20)), always=True, simple=planted % 3 == 0)
            planted += 1


def build_island(
    props: Props, furnisher: Furnisher, regions: Regions, views: BaseGeometry, rng: np.random.Generator
) -> None:
    """The green in the middle of the circus: trees around a bed of flowers, held by a low wall."""
    around = np.linspace(0, 2 * np.pi, 37)
    rim = ISLAND_WALL_M * np.stack([np.cos(around), np.sin(around)], 1)
    section = [(-0.17, 0.0), (-0.17, 0.5), (0.17, 0.5), (0.17, 0.0)]
    solids.sweep(props.sink, rim, KERB_M, section, "brick_red", "wall")
    for index in range(14):
        turn = index * 2 * np.pi / 14 + 0.2
        reach = 13.0 if index % 2 else 9.0
        x, y = float(reach * np.cos(turn)), float(reach * np.sin(turn))
        if not views.contains(Point(x, y)):
            furnisher.plant(x, y, KERB_M, kind=2 + 2 * (index % 2), always=True)
    for index in range(6):
        turn = index * np.pi / 3 + 0.5
        x, y = float(15.2 * np.cos(turn)), float(15.2 * np.sin(turn))
        if not views.contains(Point(x, y)):
            parts = kit.planter("round", rng)
            props.put("planter_round", parts, x, y, KERB_M, turn, radius_m=0.6, high_m=0.8)


def board_solids(boards: tuple[tuple[float, float, float], ...]) -> list[Solid]:
    """Level ground under every board."""
    found = []
    for index, (x, y, facing) in enumerate(boards):
        cos, sin = np.cos(np.radians(facing)), np.sin(np.radians(facing))
        turn = np.array([[cos, sin], [-sin, cos]])
        corners = np.array([(-2.5, -4.5), (2.5, -4.5), (2.5, 4.5), (-2.5, 4.5)]) @ turn + (x, y)
        found.append(level_box(f"ground.board_{index}", Polygon(corners), KERB_M))
    return found
