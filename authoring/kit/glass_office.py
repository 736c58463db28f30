"""The office tower with a curtain wall: reflective panes, mullions, spandrels, a stone-clad base."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from authoring.kit.cores import core
from authoring.kit.facade import Facade, Opening, facades
from authoring.kit.parts import Sink
from authoring.kit.roofs import flat_roof, roof_machinery
from authoring.materials.atlas import LOBBY_PANES, door_rect, shop_rect

FLOOR_M = 3.7
LOBBY_M = 5.2
LOBBY_DEEP_M = 1.1
PANE_M = 1.5
PANES_PER_TILE = 8
CORNER_M = 1.3
FLOORS_PER_TILE = 4


def glass_office(
    sink: Sink, width_m: float, depth_m: float, floors: int, sides: Sequence[str], *, rng: np.random.Generator
) -> None:
    """Adds an office tower with a curtain wall; the sides without a street are of glass, too, but without mullions."""
    frame = str(rng.choice(["anthracite", "aluminium", "black_paint"]))
    deep = float(rng.choice([0.06, 0.12, 0.25]))
    top_m = LOBBY_M + (floors - 1) * FLOOR_M
    shift = int(rng.integers(PANES_PER_TILE))
    for side, facade in facades(sink, width_m, depth_m).items():
        _panes(facade, floors, shift)
        if side in sides:
            _mullions(facade, floors, top_m, frame, deep)
            _lobby(facade, frame, main=side == sides[0])
        else:
            facade.wall("ashlar", 0.0, 0.0, facade.width_m, LOBBY_M)
        facade.box(frame, (0.0, facade.width_m), (LOBBY_M - 0.25, LOBBY_M + 0.15), (0.0, 0.18))
    core(sink, width_m, depth_m, top_m, ground_m=LOBBY_M, deep_m=LOBBY_DEEP_M + 0.1)
    flat_roof(sink, width_m, depth_m, top_m, wall="metal_panel", coping=frame, parapet_m=1.1)
    half_w, half_d = width_m * 0.28, depth_m * 0.25
    sink.tiled_box("metal_panel", (-half_w, -half_d, top_m), (half_w, half_d, top_m + 3.0), tile_m=2.0, skip="z")
    roof_machinery(sink, width_m, depth_m, top_m, rng=rng)


def _panes(facade: Facade, floors: int, shift: int) -> None:
    """Adds one quadrilateral per floor; its texture coordinates count panes and floors, so that the texture's panes
    meet the mullions.
    """
    count = max(1, round(facade.width_m / PANE_M))
    u0, u1 = shift / PANES_PER_TILE, (shift + count) / PANES_PER_TILE
    for floor in range(floors - 1):
        low = LOBBY_M + floor * FLOOR_M
        corners = [
            facade.at(0, low),
            facade.at(facade.width_m, low),
            facade.at(facade.width_m, low + FLOOR_M),
            facade.at(0, low + FLOOR_M),
        ]
        v0 = (floor % FLOORS_PER_TILE) / FLOORS_PER_TILE
        v1 = v0 + 1 / FLOORS_PER_TILE
        facade.sink.polygon("curtain_wall", corners, [(u0, v0), (u1, v0), (u1, v1), (u0, v1)])


def _mullions(facade: Facade, floors: int, top_m: float, frame: str, deep: float) -> None:
    count = max(1, round(facade.width_m / PANE_M))
    pitch = facade.width_m / count
    for index in range(count + 1):
        u = index * pitch
        facade.box(frame, (max(u - 0.03, 0.0), min(u + 0.03, facade.width_m)), (LOBBY_M, top_m), (0.0, deep), skip="bu")
    for floor in range(1, floors):
        v = LOBBY_M + floor * FLOOR_M
        facade.box(frame, (0.0, facade.width_m), (v - 0.05, v + 0.05), (0.0, deep * 0.8), skip="blr")


def _lobby(facade: Facade, frame: str, *, main: bool) -> None:
    width = facade.width_m
    count = max(2, round(width / 4.5))
    pitch = width / count
    holes = []
    for index in range(count):
        # Two deep recesses must not meet behind the corner's pier.
        left = CORNER_M if index == 0 else 0.35
        right = CORNER_M if index == count - 1 else 0.35
        hole = Opening(index * pitch + left, 0.0, (index + 1) * pitch - right, LOBBY_M - 0.6)
        facade.reveal("limestone", hole, LOBBY_DEEP_M, skip="s")
        holes.append(hole)
        if main and index == count // 2:
            middle = (hole.u0 + hole.u1) / 2
            facade.picture("shop_fronts", door_rect("glass_double"), middle - 1.2, 0.0, middle + 1.2, 2.7, d_m=-1.05)
            facade.box(frame, (hole.u0, hole.u1), (2.72, 2.95), (-LOBBY_DEEP_M, 0.9))
        facade.picture(
            "shop_fronts",
            shop_rect(LOBBY_PANES[index % len(LOBBY_PANES)]),
            hole.u0,
            0.0,
            hole.u1,
            hole.v1,
            d_m=-LOBBY_DEEP_M,
        )
        for u in np.linspace(hole.u0, hole.u1, 4):
            facade.box(frame, (u - 0.03, u + 0.03), (0.0, hole.v1), (-LOBBY_DEEP_M, -1.0), skip="but")
    facade.wall("ashlar", 0.0, 0.0, width, LOBBY_M, holes)
