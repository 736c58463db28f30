"""Party walls: sides without a street, which are visible where the neighbour is lower or missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from authoring.kit.extras import downpipe
from authoring.kit.facade import Facade, Opening
from authoring.kit.openings import window
from authoring.kit.shapes import cylinder
from authoring.kit.styles import Style
from authoring.materials.atlas import FASCIA_COUNT, blade_rect, fascia_rect, poster_rect
from authoring.materials.registry import MATERIALS

# What a wall has been patched, rendered or painted with.
RENDERS = {"brick": ("plaster_grey", "plaster_cream", "concrete"), "other": ("plaster_grey", "brick_brown", "concrete")}
ADVERTS = ("dark_green", "dark_red", "dark_blue", "cream_paint", "mustard")
# How far what is painted or rendered on a wall stands out of it: enough to be in front from far away.
SKIN_M = 0.02
FLUE_M = (1.05, 0.24)
# From so many storeys on there are fewer columns of windows.
TALL = 8
Box = tuple[float, float, float, float]


def party_wall(
    facade: Facade,
    style: Style,
    floors: int,
    top_m: float,
    *,
    ridge_m: float,
    covered_m: float,
    rng: np.random.Generator,
) -> None:
    """Adds a wall with flues, a few small or bricked-up windows, and perhaps an advert or the outline of a demolished
    house.

    Args:
        facade: the side of the building.
        style: style of the building.
        floors: number of storeys with the ground floor.
        top_m: height of the walls, metres.
        ridge_m: height of the roof or its parapet above the walls on this side, metres.
        covered_m: height up to which a neighbour hides the wall, metres.
        rng: random generator of the details.
    """
    width = facade.width_m
    kind = str(rng.choice(["house", "advert", "render", "plain"], p=[0.3, 0.2, 0.3, 0.2]))
    render = str(rng.choice(RENDERS["brick" if style.wall.startswith("brick") else "other"]))
    taken: list[Box] = [(0.0, 0.0, width, covered_m)] if covered_m else []
    if top_m - covered_m < 2.5:
        kind = "plain"
    if kind == "advert" and width > 8.0 and top_m - covered_m > 9.5:
        taken.append(_advert(facade, top_m, rng=rng))
    elif kind == "house" and width > 8.0 and top_m > 8.0 and not covered_m:
        taken.append(_former_house(facade, render, top_m, rng=rng))
    elif kind == "render" and not covered_m:
        high = style.ground_m + style.floor_m * int(rng.integers(0, max(floors - 2, 1)))
        facade.panel(render, 0.0, 0.0, width, min(high, top_m - 1.0), d_m=SKIN_M)
        taken.append((0.0, 0.0, width, high))
    if width > 5.0 and rng.random() < 0.6:
        taken.append(_flue(facade, style.wall, top_m, ridge_m, taken, rng=rng))
    openings, blind = _windows(width, style, floors, taken, rng=rng)
    facade.wall(style.wall, 0.0, 0.0, width, top_m, [opening for opening in openings if opening not in blind])
    bare = replace(style.window, surround=None, lintel=None, shutters=None, ledge=None)
    for opening in openings:
        if opening in blind:
            facade.panel(render, opening.u0, opening.v0, opening.u1, opening.v1, d_m=SKIN_M)
            facade.swatch("concrete_dark", opening.u0, opening.v0 - 0.1, opening.u1, opening.v0, d_m=SKIN_M)
        else:
            window(facade, opening, bare, rng=rng)
    if not covered_m and rng.random() < 0.5:
        downpipe(facade, width - 0.35 if rng.random() < 0.5 else 0.35, top_m - 0.3)
    if style.wall.startswith("brick") and rng.random() < 0.6:
        _ties(facade, style, floors, taken)


def _windows(
    width: float, style: Style, floors: int, taken: list[Box], *, rng: np.random.Generator
) -> tuple[list[Opening], list[Opening]]:
    """Draws columns of windows of stairs and bathrooms, and which of these windows are bricked up."""
    openings: list[Opening] = []
    blind: list[Opening] = []
    columns = np.arange(1.7, width - 1.6, 3.4)
    chosen = rng.random(len(columns)) < (0.5 if floors < TALL else 0.3)
    # No wall stays blank.
    if not chosen.any():
        chosen[len(columns) // 2 :] = True
    for centre in columns[chosen]:
        half, high = (0.32, 0.75) if rng.random() < 0.5 else (0.45, 1.25)
        closed = rng.random() < 0.35
        for floor in range(1, floors):
            low = style.ground_m + (floor - 1) * style.floor_m + 1.0
            u0, u1 = float(centre) - half, float(centre) + half
            if any(u0 < b[2] + 0.2 and u1 > b[0] - 0.2 and low < b[3] + 0.2 and low + high > b[1] - 0.2 for b in taken):
                continue
            openings.append(Opening(u0, low, u1, low + high))
            if closed or rng.random() < 0.15:
                blind.append(openings[-1])
    return openings, blind


def _flue(
    facade: Facade, wall: str, top_m: float, ridge_m: float, taken: list[Box], *, rng: np.random.Generator
) -> Box:
    """Adds a chimney breast that ends above the roof in a stack with pots, and returns the part of the wall that it
    covers.
    """
    half, deep = FLUE_M[0] / 2, FLUE_M[1]
    material = wall if wall not in ("ashlar", "concrete") and rng.random() < 0.7 else "brick_red"
    middle = facade.width_m * float(rng.choice([0.28, 0.5, 0.7]))
    low = max([0.0, *(b[3] + 0.3 for b in taken if b[0] < middle + half and b[2] > middle - half)])
    low = low if low < top_m - 1.5 else top_m - 0.4
    top = top_m + ridge_m + float(rng.uniform(0.7, 1.3))
    facade.box(material, (middle - half, middle + half), (low, top), (-0.35, deep), skip="bu" if not low else "b")
    facade.box("concrete_light", (middle - half - 0.07, middle + half + 0.07), (top, top + 0.1), (-0.42, deep + 0.07))
    back = (facade.at(middle + half, top_m, -0.35), facade.at(middle - half, top_m, -0.35))
    facade.surface(material, (*back, facade.at(middle - half, top, -0.35), facade.at(middle + half, top, -0.35)))
    for offset in (-0.3, 0.3) if rng.random() < 0.5 else (-0.33, 0.0, 0.33):
        x, y, z = facade.at(middle + offset, top + 0.1, -0.06)
        cylinder(facade.sink, "terracotta", (x, y, z), 0.11, 0.38, top_radius_m=0.09, segments=6, cap=False)
    return middle - half, low, middle + half, top


def _former_house(facade: Facade, render: str, top_m: float, *, rng: np.random.Generator) -> Box:
    """Adds the traces of a lower house: the plaster of its rooms below the line of its roof, its floors, its
    fireplaces.
    """
    wide = min(float(rng.uniform(6.5, 8.5)), facade.width_m - 0.6)
    left = 0.3 if rng.random() < 0.5 else facade.width_m - 0.3 - wide
    eave = min(float(rng.uniform(4.6, 6.6)), top_m - 4.0)
    ridge = eave + min(2.6, top_m - eave - 0.8)
    outline = [(left, 0.0), (left + wide, 0.0), (left + wide, eave), (left + wide / 2, ridge), (left, eave)]
    _field(facade, render, outline, SKIN_M)
    for (u0, v0), (u1, v1) in ((outline[2], outline[3]), (outline[3], outline[4])):
        strip = [(u0, v0 - 0.02), (u0, v0 + 0.16), (u1, v1 + 0.16), (u1, v1 - 0.02)]
        _field(facade, "concrete_dark", strip, SKIN_M + 0.02)
    for level in np.arange(2.8, eave - 0.4, 2.8):
        facade.swatch("weathered_wood", left, float(level), left + wide, float(level) + 0.2, d_m=SKIN_M + 0.015)
    rooms = [str(room) for room in rng.permutation(["plaster_rose", "plaster_ochre", "plaster_white"])]
    for index, level in enumerate(np.arange(0.25, eave - 2.2, 2.8)):
        u0 = left + (0.3 if index % 2 else wide * 0.45)
        facade.panel(rooms[index % 3], u0, float(level), u0 + wide * 0.45, float(level) + 2.3, d_m=SKIN_M + 0.015)
    return left, 0.0, left + wide, ridge


def _advert(facade: Facade, top_m: float, *, rng: np.random.Generator) -> Box:
    """Adds a mural high on the wall, or a painted advert: a field with a frame, an emblem and a name."""
    if rng.random() < 0.5:
        high = min(facade.width_m - 1.6, (top_m - 4.0) / 1.5) * 1.5
        wide = min(high, 9.5) / 1.5
        high = wide * 1.5
        left, low = (facade.width_m - wide) * float(rng.uniform(0.25, 0.75)), top_m - 0.7 - high
        facade.picture("signs", poster_rect(int(rng.integers(4))), left, low, left + wide, low + high, d_m=SKIN_M)
        return left, low, left + wide, low + high
    wide = min(float(rng.uniform(6.0, 9.0)), facade.width_m - 1.6)
    high = min(wide * 0.52, top_m - 5.5)
    left, low = (facade.width_m - wide) / 2, top_m - 0.9 - high
    ground, frame = (str(name) for name in rng.choice(ADVERTS, 2, replace=False))
    facade.swatch(frame, left, low, left + wide, low + high, d_m=SKIN_M)
    facade.swatch(ground, left + 0.15, low + 0.15, left + wide - 0.15, low + high - 0.15, d_m=SKIN_M + 0.015)
    line, rise = wide * 0.92, wide * 0.115
    emblem = high - rise - 0.9
    u, v = left + (wide - line) / 2, low + 0.35
    facade.picture("signs", fascia_rect(int(rng.integers(FASCIA_COUNT))), u, v, u + line, v + rise, d_m=SKIN_M + 0.03)
    u, v = left + (wide - emblem) * float(rng.choice([0.12, 0.5, 0.88])), v + rise + 0.2
    facade.picture("signs", blade_rect(int(rng.integers(8))), u, v, u + emblem, v + emblem, d_m=SKIN_M + 0.03)
    return left, low, left + wide, low + high


def _ties(facade: Facade, style: Style, floors: int, taken: list[Box]) -> None:
    """Adds iron plates at the ends of the rods that hold floors and wall together."""
    for floor in range(1, floors):
        v = style.ground_m + (floor - 1) * style.floor_m
        for u in np.arange(0.9, facade.width_m - 0.6, 3.6):
            if any(b[0] - 0.3 < u < b[2] + 0.3 and b[1] - 0.3 < v < b[3] + 0.3 for b in taken):
                continue
            tips = [(u, v - 0.22), (u + 0.22, v), (u, v + 0.22), (u - 0.22, v)]
            _field(facade, "cast_iron", [(float(a), float(b)) for a, b in tips], 0.04)


def _field(facade: Facade, material: str, outline: list[tuple[float, float]], d_m: float) -> None:
    """Adds a convex polygon of (u, v) points on the wall, counter-clockwise as seen from outside, of a tiling material
    or a swatch.
    """
    corners = np.stack([facade.at(u, v, d_m) for u, v in outline])
    if material in MATERIALS:
        offset = float(facade.origin @ facade.right)
        uvs = np.add(outline, (offset, 0.0)) / MATERIALS[material].tile_m
        facade.sink.polygon(material, corners, uvs)
    else:
        facade.sink.swatch_quad(material, corners)
