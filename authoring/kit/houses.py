"""Houses of a suburb: detached, in rows and pairs, and simple ones for large distances."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from authoring.kit.facade import Facade, Opening, facades
from authoring.kit.house_details import bay_window, front_door, garage_door, porch, wall_box
from authoring.kit.house_roofs import chimney, gable, hip
from authoring.kit.openings import WindowStyle, window
from authoring.kit.parts import Part, Sink, place
from authoring.materials.atlas import window_rect

FLOOR_M = 2.65
BASE_M = 0.3
GARAGE_M = (3.3, 6.0, 2.55)
LOOKS = (
    ("brick_red", "tile_roof_brown", "white_paint"),
    ("brick_buff", "tile_roof", "white_paint"),
    ("brick_brown", "slate_roof", "cream_paint"),
    ("plaster_white", "tile_roof", "brown_paint"),
    ("plaster_cream", "tile_roof", "white_paint"),
    ("plaster_white", "slate_roof", "anthracite"),
    ("plaster_ochre", "tile_roof_brown", "white_paint"),
    ("brick_red", "slate_roof", "white_paint"),
    ("plaster_cream", "tile_roof_grey", "dark_green"),
    ("plaster_grey", "tile_roof_grey", "white_paint"),
    ("brick_buff", "tile_roof_grey", "white_paint"),
)
FAR_WALLS = ("plaster_white", "plaster_cream", "brick_red", "brick_buff", "plaster_ochre")
FAR_ROOFS = ("tile_roof", "tile_roof_brown", "tile_roof_grey", "slate_roof")


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """The materials of one house.

    Attributes:
        wall, upper: tiling materials of the ground floor and of the storeys above it.
        tiles: material of the roof.
        trim: swatch of frames, boards and posts.
        window: style of its windows.
    """

    wall: str
    upper: str
    tiles: str
    trim: str
    window: WindowStyle


def look(rng: np.random.Generator) -> Look:
    """Draws materials of walls, roof and windows that match."""
    wall, tiles, trim = LOOKS[int(rng.integers(len(LOOKS)))]
    upper = wall
    if wall.startswith("brick") and rng.random() < 0.35:
        upper = str(rng.choice(["plaster_white", "plaster_cream"]))
    kind = str(rng.choice(["casement", "casement", "sash", "modern"]))
    frame = trim if trim in ("white_paint", "cream_paint", "anthracite") else "white_paint"
    style = WindowStyle(
        kind=kind,
        width_m=float(rng.uniform(1.25, 1.6)),
        height_m=1.3,
        sill_m=0.85,
        recess_m=0.1,
        reveal=frame,
        lintel="limestone" if wall.startswith("brick") and rng.random() < 0.5 else None,
        ledge="white_paint" if frame != "anthracite" else "concrete_light",
        shutters=str(rng.choice(["dark_green", "dark_blue", "brown_paint"]))
        if wall.startswith("plaster") and rng.random() < 0.35
        else None,
    )
    return Look(wall=wall, upper=upper, tiles=tiles, trim=frame, window=style)


def detached(
    width_m: float,
    depth_m: float,
    floors: int,
    rng: np.random.Generator,
    *,
    roof: str = "gable",
    garage: str = "",
) -> list[Part]:
    """Makes a detached house that faces -y; its main body is centred at the origin.

    Args:
        width_m: width of the main body along x, metres.
        depth_m: depth along y, metres.
        floors: number of storeys, 1 to 3.
        rng: random generator of materials and details.
        roof: `gable` (ridge along the street), `cross` (gable to the street), `hip`.
        garage: `left`, `right` (as seen from the street) or none: a wing 3.3 m wide beside the main body.
    """
    sink, made = Sink("building"), look(rng)
    top = BASE_M + floors * FLOOR_M
    walls = facades(sink, width_m, depth_m)
    left_door = garage == "left" or (garage == "" and bool(rng.random() < 0.5))
    door_u = width_m * (0.25 if left_door else 0.75)
    if width_m > 9 and rng.random() < 0.4:
        door_u = width_m / 2
    _front(walls["front"], made, door_u, floors, top, roofed=floors > 1 or roof == "cross", rng=rng)
    for side in ("left", "right", "back"):
        _other(walls[side], made, floors, top, back=side == "back", attached=side == garage, rng=rng)
    rise = depth_m / 2 * float(rng.uniform(0.62, 0.85))
    if roof == "hip" and width_m > depth_m:
        sink.extend(place(hip(width_m, depth_m, rise * 0.85, tiles=made.tiles, trim=made.trim), z_m=top))
    elif roof == "cross":
        rise = width_m / 2 * float(rng.uniform(0.7, 0.9))
        cross = gable(depth_m, width_m, rise, tiles=made.tiles, wall=made.upper, trim=made.trim)
        sink.extend(place(cross, z_m=top, yaw_rad=np.pi / 2))
        _attic_window(walls["front"], width_m / 2, top + 0.35, made, rng=rng)
    else:
        long = gable(width_m, depth_m, rise, tiles=made.tiles, wall=made.upper, trim=made.trim)
        sink.extend(place(long, z_m=top))
        if floors == 1 or rng.random() < 0.25:
            _dormer(sink, float(rng.uniform(-0.2, 0.2)) * width_m, depth_m, rise, top, made, rng=rng)
    brick = made.wall if made.wall.startswith("brick") else "brick_red"
    x = (width_m / 2 - 0.8) * (1 if left_door else -1)
    head = top + rise * (0.75 if roof == "cross" else 1.0) + 0.8
    chimney(sink, x if roof != "hip" else x * 0.3, 0.6, top - 0.2, head, brick=brick)
    if garage:
        _garage(sink, made, width_m, depth_m, garage, rng=rng)
    return sink.parts()


def row(count: int, unit_m: float, depth_m: float, floors: int, rng: np.random.Generator) -> list[Part]:
    """`count` houses wall to wall under one roof, facing -y, centred at the origin: a terrace, or a pair if two."""
    sink, made = Sink("building"), look(rng)
    total, top = count * unit_m, BASE_M + floors * FLOOR_M
    coats = ["plaster_white", "plaster_cream", "plaster_ochre", "plaster_rose", "plaster_grey"]
    painted = made.wall.startswith("plaster")
    for index in range(count):
        unit = Sink("building")
        coat = str(rng.choice(coats)) if painted else made.wall
        own = Look(
            wall=coat, upper=coat if painted else made.upper, tiles=made.tiles, trim=made.trim, window=made.window
        )
        walls = facades(unit, unit_m, depth_m)
        door_u = unit_m * (0.22 if index % 2 else 0.78)
        _front(walls["front"], own, door_u, floors, top, roofed=True, rng=rng)
        _other(walls["back"], own, floors, top, back=True, attached=False, rng=rng)
        for side, last in (("left", index == 0), ("right", index == count - 1)):
            if last:
                _other(walls[side], own, floors, top, back=False, attached=False, rng=rng)
        sink.extend(place(unit.parts(), x_m=(index + 0.5) * unit_m - total / 2))
    rise = depth_m / 2 * 0.75
    if count == 2:
        sink.extend(place(hip(total, depth_m, rise, tiles=made.tiles, trim=made.trim), z_m=top))
    else:
        long = gable(total, depth_m, rise, tiles=made.tiles, wall=made.upper, trim=made.trim)
        sink.extend(place(long, z_m=top))
    brick = made.wall if not painted else "brick_red"
    for index in range(1, count, 1 if count == 2 else 2):
        x = index * unit_m - total / 2
        chimney(sink, x, 0.0, top, top + rise + 1.0, brick=brick, pots=4)
        if count > 2:
            _dormer(sink, x + unit_m / 2, depth_m, rise, top, made, rng=rng)
    return sink.parts()


def far_house(rng: np.random.Generator) -> list[Part]:
    """Makes a house for large distances: walls, a roof and pictures of windows; about fifty triangles."""
    sink = Sink("building")
    width, depth, floors = float(rng.uniform(8, 15)), float(rng.uniform(7.5, 9.5)), int(rng.integers(1, 4))
    top = 0.5 + 2.7 * floors
    wall, tiles = str(rng.choice(FAR_WALLS)), str(rng.choice(FAR_ROOFS))
    for facade in facades(sink, width, depth, z_m=-1.0).values():
        facade.panel(wall, 0.0, 0.0, facade.width_m, top + 1.0)
        count = max(2, round(facade.width_m / 3.2))
        for floor in range(floors):
            for index in range(count):
                u, v = (index + 0.5) / count * facade.width_m, 2.0 + 2.7 * floor
                facade.picture(
                    "windows",
                    window_rect("casement", int(rng.integers(8))),
                    u - 0.65,
                    v,
                    u + 0.65,
                    v + 1.3,
                    d_m=0.04,
                )
    half, rise, eave = depth / 2, depth * 0.4, 0.5
    low, x = top - rise * eave / half, width / 2 + 0.3
    for sign in (-1, 1):
        y = sign * (half + eave)
        slope = [(-x * -sign, y, low), (x * -sign, y, low), (x * -sign, 0, top + rise), (-x * -sign, 0, top + rise)]
        sink.quad(tiles, slope, tile_m=3.0)
        end = [
            (sign * width / 2, -sign * half, top),
            (sign * width / 2, sign * half, top),
            (sign * width / 2, 0, top + rise),
        ]
        sink.quad(wall, end, tile_m=4.0)
    sink.tiled_box(
        "brick_red", (width * 0.3, -0.5, top), (width * 0.3 + 0.7, 0.5, top + rise + 0.9), tile_m=2.0, skip="z"
    )
    return sink.parts()


def _front(
    facade: Facade, made: Look, door_u: float, floors: int, top: float, *, roofed: bool, rng: np.random.Generator
) -> None:
    """Adds the front: the door, a porch if there is room below the eaves, windows in bays, sometimes a bay window."""
    width, style = facade.width_m, made.window
    holes = [front_door(facade, door_u, BASE_M, trim=made.trim, rng=rng)]
    if roofed:
        style_of = "gable" if rng.random() < 0.45 else "lean"
        porch(facade, door_u, BASE_M, style=style_of, tiles=made.tiles, trim=made.trim)
    count = max(2, round(width / 3.1))
    spots = [(index + 0.5) / count * width for index in range(count)]
    ground = [u for u in spots if abs(u - door_u) > 0.75 + style.width_m / 2]
    bay_u = None
    if ground and roofed and rng.random() < 0.45:
        bay_u = max(ground, key=lambda u: abs(u - door_u))
        bay_u = min(max(bay_u, 1.5), width - 1.5)
        if abs(bay_u - door_u) < 2.1:
            bay_u = None
    tall = 2 if bay_u is not None and floors > 1 and rng.random() < 0.4 else 1
    if bay_u is not None:
        bay_window(
            facade, bay_u, BASE_M, wall=made.wall, tiles=made.tiles, style=style, rng=rng, storeys=tall, floor_m=FLOOR_M
        )
    windows = []
    for floor in range(floors):
        low = BASE_M + floor * FLOOR_M + style.sill_m
        for u in spots if floor else ground:
            if bay_u is not None and floor < tall and abs(u - bay_u) < 1.4 + style.width_m / 2:
                continue
            windows.append(Opening(u - style.width_m / 2, low, u + style.width_m / 2, low + style.height_m))
    for opening in windows:
        window(facade, opening, style, rng=rng)
    _walls(facade, made, top, [*holes, *windows])


def _other(
    facade: Facade, made: Look, floors: int, top: float, *, back: bool, attached: bool, rng: np.random.Generator
) -> None:
    """Adds a side or the back, with fewer windows, flush with the wall, because no camera on the street comes near
    them.
    """
    count = max(2, round(facade.width_m / 3.4)) if back else 1 + int(rng.random() < 0.5)
    for floor in range(int(attached), floors):
        low = BASE_M + floor * FLOOR_M + 0.95
        for index in range(count):
            u, half = (index + 0.5) / count * facade.width_m, 0.75 if back else 0.55
            rect = window_rect(made.window.kind, int(rng.integers(8)))
            facade.picture("windows", rect, u - half, low, u + half, low + 1.2, d_m=0.015)
    _walls(facade, made, top, [])


def _walls(facade: Facade, made: Look, top: float, holes: list[Opening]) -> None:
    split = BASE_M + FLOOR_M - 0.1
    facade.wall(made.wall, 0.0, 0.0, facade.width_m, split, holes)
    facade.wall(made.upper, 0.0, split, facade.width_m, top, holes)
    facade.box("concrete_dark", (0.0, facade.width_m), (0.0, BASE_M - 0.05), (0.0, 0.03), skip="bu")
    if made.upper != made.wall:
        facade.box(made.trim, (0.0, facade.width_m), (split - 0.06, split + 0.06), (0.0, 0.04), skip="b")


def _attic_window(facade: Facade, u: float, v: float, made: Look, *, rng: np.random.Generator) -> None:
    facade.picture("windows", window_rect("casement", int(rng.integers(8))), u - 0.5, v, u + 0.5, v + 1.1, d_m=0.02)
    for side in ((u - 0.6, u - 0.5), (u + 0.5, u + 0.6)):
        facade.box(made.trim, side, (v - 0.1, v + 1.2), (0.0, 0.05), skip="b")
    for level in ((v - 0.1, v), (v + 1.1, v + 1.2)):
        facade.box(made.trim, (u - 0.5, u + 0.5), level, (0.0, 0.05), skip="blr")


def _dormer(
    sink: Sink, x: float, depth_m: float, rise: float, top: float, made: Look, *, rng: np.random.Generator
) -> None:
    """Adds a small gabled dormer in the front slope of the roof."""
    y = -depth_m / 2 + 0.75
    low = top + rise * 0.75 / (depth_m / 2)
    high, half = low + 1.25, 0.75
    deep = min((high - top) / rise * depth_m / 2 - 0.75, -y)
    made_of = made.upper if made.upper.startswith("plaster") else "plaster_white"
    wall_box(sink, made_of, (x - half, y, low - 0.1), (x + half, y + deep, high), skip="zZY")
    front = Facade(sink, np.array([x - half, y, low]), np.array([1.0, 0.0, 0.0]), 2 * half)
    front.picture("windows", window_rect("casement", int(rng.integers(8))), 0.2, 0.12, 2 * half - 0.2, 1.15, d_m=0.03)
    for u in ((0.1, 0.2), (2 * half - 0.2, 2 * half - 0.1)):
        front.box(made.trim, u, (0.02, 1.2), (0.0, 0.06), skip="b")
    front.box(made.trim, (0.1, 2 * half - 0.1), (0.02, 0.12), (0.0, 0.08), skip="b")
    cap = gable(deep + 0.9, 2 * half, 0.6, tiles=made.tiles, wall=made_of, trim=made.trim, ends="x")
    sink.extend(place(cap, x_m=x, y_m=y + (deep + 0.9) / 2, z_m=high, yaw_rad=np.pi / 2))


def _garage(sink: Sink, made: Look, width_m: float, depth_m: float, side: str, *, rng: np.random.Generator) -> None:
    """Adds a wing beside the house, a little behind its front, with a door to the street."""
    wide, deep, high = GARAGE_M
    wing = Sink("building")
    swatch = str(rng.choice(["white_paint", "anthracite", "brown_paint", "dark_green", "grey_paint"]))
    walls = facades(wing, wide, deep)
    hole = garage_door(walls["front"], wide / 2, 2.5, swatch=swatch, trim=made.trim)
    walls["front"].wall(made.wall, 0.0, 0.0, wide, high, [hole])
    for name in ("back", side):
        walls[name].wall(made.wall, 0.0, 0.0, walls[name].width_m, high)
    roof = gable(deep, wide, 1.15, tiles=made.tiles, wall=made.upper, trim=made.trim)
    wing.extend(place(roof, z_m=high, yaw_rad=np.pi / 2))
    sign = -1 if side == "left" else 1
    x, y = sign * (width_m + wide) / 2, -depth_m / 2 + 0.8 + deep / 2
    sink.extend(place(wing.parts(), x_m=x, y_m=y))
