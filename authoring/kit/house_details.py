"""Parts of the fronts of houses: bay windows, porches, front doors, garage doors."""

from __future__ import annotations

import numpy as np

from authoring.kit.facade import Facade, Opening
from authoring.kit.openings import WindowStyle, window
from authoring.kit.parts import Sink
from authoring.materials.atlas import door_rect, window_rect
from authoring.materials.registry import MATERIALS

DOORS = ("panel_green", "panel_brown", "panel_blue", "panel_black")


def front_door(facade: Facade, u: float, base_m: float, *, trim: str, rng: np.random.Generator) -> Opening:
    """Adds a panelled door with a frame, a fanlight and two steps, and returns the opening that the wall must leave."""
    hole = Opening(u - 0.5, base_m, u + 0.5, base_m + 2.4)
    facade.reveal(trim, hole, 0.16)
    facade.picture("shop_fronts", door_rect(str(rng.choice(DOORS))), u - 0.5, base_m, u + 0.5, base_m + 2.05, d_m=-0.16)
    facade.box(trim, (u - 0.5, u + 0.5), (base_m + 2.05, base_m + 2.12), (-0.16, -0.08), skip="blr")
    facade.swatch("dark_glass", u - 0.5, base_m + 2.12, u + 0.5, base_m + 2.4, d_m=-0.15)
    for side in ((u - 0.62, u - 0.5), (u + 0.5, u + 0.62)):
        facade.box(trim, side, (base_m, base_m + 2.4), (0.0, 0.04), skip="bu")
    facade.box(trim, (u - 0.66, u + 0.66), (base_m + 2.4, base_m + 2.55), (0.0, 0.07), skip="b")
    for step in range(2):
        top, deep = base_m - step * base_m / 2, 0.35 + 0.35 * step
        facade.box("concrete_light", (u - 0.8, u + 0.8), (0.0, top), (0.0, deep), skip="bu")
    return hole


def porch(facade: Facade, u: float, base_m: float, *, style: str, tiles: str, trim: str) -> None:
    """Adds a roof over a front door: `lean` (a tiled slope on brackets) or `gable` (on two posts)."""
    top, deep, half = base_m + 2.75, 1.35, 1.15
    tile_m = MATERIALS[tiles].tile_m
    at = facade.at
    if style == "lean":
        deep = 0.95
        slope = [
            at(u - half, top, deep),
            at(u + half, top, deep),
            at(u + half, top + 0.55, 0),
            at(u - half, top + 0.55, 0),
        ]
        facade.sink.quad(tiles, np.stack(slope), tile_m=tile_m)
        facade.sink.swatch_quad(trim, np.stack([p - (0, 0, 0.1) for p in slope[::-1]]))
        facade.box(trim, (u - half, u + half), (top - 0.12, top + 0.02), (deep - 0.06, deep + 0.02), skip="")
        for side in (-1, 1):
            edge = u + side * half
            cheek = [at(edge, top - 0.1, 0), at(edge, top - 0.1, deep), at(edge, top, deep), at(edge, top + 0.55, 0)]
            facade.sink.swatch_quad(trim, np.stack(cheek[::side]))
            bracket = (edge - 0.05, edge + 0.05)
            facade.box(trim, bracket, (top - 0.7, top - 0.1), (0.0, 0.12), skip="b")
        return
    rise = 0.75
    for side in (-1, 1):
        edge = u + side * (half + 0.15)
        slope = [at(edge, top, deep + 0.2), at(u, top + rise, deep + 0.2), at(u, top + rise, 0), at(edge, top, 0)]
        facade.sink.quad(tiles, np.stack(slope[:: -1 if side > 0 else 1])[[0, 1, 2, 3]], tile_m=tile_m)
        facade.sink.swatch_quad(trim, np.stack([p - (0, 0, 0.08) for p in slope[:: 1 if side > 0 else -1]]))
        facade.box(trim, (edge - 0.05, edge + 0.05), (top - 0.1, top + 0.04), (0.0, deep + 0.2), skip="b")
        facade.box(trim, (u + side * half - 0.07, u + side * half + 0.07), (0.0, top), (deep - 0.14, deep), skip="u")
    front = [at(u - half - 0.1, top, deep + 0.05), at(u + half + 0.1, top, deep + 0.05), at(u, top + rise, deep + 0.05)]
    facade.sink.swatch_quad(trim, np.stack(front))
    facade.box(trim, (u - half - 0.1, u + half + 0.1), (top - 0.16, top), (deep - 0.12, deep + 0.07), skip="")
    facade.box("concrete_light", (u - half - 0.1, u + half + 0.1), (0.0, base_m - 0.02), (0.0, deep + 0.1), skip="bu")


def bay_window(
    facade: Facade,
    u: float,
    base_m: float,
    *,
    wall: str,
    tiles: str,
    style: WindowStyle,
    rng: np.random.Generator,
    storeys: int = 1,
    floor_m: float = 2.65,
) -> None:
    """Adds a rectangular bay 2.6 m wide in front of a wall, through one or two storeys, under a tiled lean-to."""
    half, deep = 1.3, 0.7
    top = base_m + storeys * floor_m - 0.25
    front = Facade(facade.sink, facade.at(u - half, 0.0, deep), facade.right, 2 * half)
    holes = []
    for storey in range(storeys):
        sill = base_m + storey * floor_m + 0.7
        holes += [Opening(c - 0.55, sill, c + 0.55, sill + 1.35) for c in (half - 0.6, half + 0.6)]
    front.wall(wall, 0.0, 0.0, 2 * half, top, holes)
    for hole in holes:
        window(front, hole, style, rng=rng)
    tile_m = MATERIALS[wall].tile_m
    for side in (-1, 1):
        edge = u + side * half
        cheek = [facade.at(edge, 0, 0), facade.at(edge, 0, deep), facade.at(edge, top, deep), facade.at(edge, top, 0)]
        facade.sink.quad(wall, np.stack(cheek if side < 0 else [cheek[1], cheek[0], cheek[3], cheek[2]]), tile_m=tile_m)
        for storey in range(storeys):
            sill = base_m + storey * floor_m + 0.7
            pane = [
                facade.at(edge + side * 0.012, v, d)
                for d, v in ((0.12, sill), (deep - 0.12, sill), (deep - 0.12, sill + 1.35), (0.12, sill + 1.35))
            ]
            u0, v0, u1, v1 = window_rect(style.kind, int(rng.integers(8)))
            uvs = [(u0, v0), ((u0 + u1) / 2, v0), ((u0 + u1) / 2, v1), (u0, v1)]
            order = pane if side < 0 else [pane[1], pane[0], pane[3], pane[2]]
            facade.sink.polygon("windows", np.stack(order), uvs)
    eave = 0.16
    a, b = facade.at(u - half - eave, top - 0.05, deep + eave), facade.at(u + half + eave, top - 0.05, deep + eave)
    c, d = facade.at(u + half, top + 0.5, 0.0), facade.at(u - half, top + 0.5, 0.0)
    roof_tile = MATERIALS[tiles].tile_m
    facade.sink.quad(tiles, np.stack([a, b, c, d]), tile_m=roof_tile)
    left, right = facade.at(u - half - eave, top - 0.05, 0.0), facade.at(u + half + eave, top - 0.05, 0.0)
    facade.sink.quad(tiles, np.stack([left, a, d]), tile_m=roof_tile)
    facade.sink.quad(tiles, np.stack([b, right, c]), tile_m=roof_tile)
    facade.box(
        "white_paint", (u - half - eave, u + half + eave), (top - 0.17, top - 0.05), (0.0, deep + eave), skip="bt"
    )


def garage_door(facade: Facade, u: float, width_m: float, *, swatch: str, trim: str) -> Opening:
    """Adds an up-and-over door with four ribs, and returns the opening that the wall must leave."""
    hole = Opening(u - width_m / 2, 0.0, u + width_m / 2, 2.15)
    facade.reveal(trim, hole, 0.12, skip="s")
    for row in range(4):
        low = 0.02 + row * 0.5325
        facade.box(swatch, (hole.u0, hole.u1), (low, low + 0.5), (-0.12, -0.09), skip="blr")
        facade.swatch("plastic_grey", hole.u0, low + 0.5, hole.u1, low + 0.5325, d_m=-0.12)
    facade.box("steel", (u - 0.08, u + 0.08), (0.95, 0.99), (-0.09, -0.05), skip="b")
    for side in ((hole.u0 - 0.1, hole.u0), (hole.u1, hole.u1 + 0.1)):
        facade.box(trim, side, (0.0, 2.15), (0.0, 0.03), skip="bu")
    facade.box(trim, (hole.u0 - 0.1, hole.u1 + 0.1), (2.15, 2.27), (0.0, 0.04), skip="b")
    return hole


def wall_box(
    sink: Sink, material: str, low: tuple[float, float, float], high: tuple[float, float, float], *, skip: str = "zZ"
) -> None:
    """Adds the plain walls of a wing between two corners."""
    sink.tiled_box(material, low, high, tile_m=MATERIALS[material].tile_m, skip=skip)
