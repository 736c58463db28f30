"""Buildings made of storeys with windows in bays: every style except the curtain wall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from authoring.kit.cores import core
from authoring.kit.extras import air_conditioner, downpipe, fire_escape, flower_box, oriel
from authoring.kit.facade import SIDES, Facade, Opening, belt, facades
from authoring.kit.ground import ground_floor
from authoring.kit.openings import balcony, window
from authoring.kit.parts import Sink
from authoring.kit.party_walls import party_wall
from authoring.kit.roofs import flat_roof, gable_roof, mansard, roof_machinery
from authoring.kit.styles import Style


def storeyed_building(
    sink: Sink,
    style: Style,
    width_m: float,
    depth_m: float,
    floors: int,
    sides: Sequence[str],
    *,
    rng: np.random.Generator,
    covered_m: Mapping[str, float] | None = None,
) -> None:
    """Adds walls, windows, ground floor, ornament and roof of one building; the arguments are those of `building`."""
    top_m, low_m = style.ground_m + (floors - 1) * style.floor_m, covered_m or {}
    for side, facade in facades(sink, width_m, depth_m).items():
        if side in sides:
            _street_side(facade, style, floors, top_m, main=side == sides[0], rng=rng)
        elif side == "back":
            _plain_side(facade, style, floors, top_m, rng=rng)
        else:
            party_wall(
                facade, style, floors, top_m, ridge_m=_ridge_m(style, depth_m), covered_m=low_m.get(side, 0.0), rng=rng
            )
    _ornament(sink, style, width_m, depth_m, floors, top_m, sides)
    core(sink, width_m, depth_m, top_m, ground_m=style.ground_m)
    if style.roof == "mansard":
        mansard(sink, width_m, depth_m, top_m, sides=sides, dormer_pitch_m=style.bay_m, rng=rng)
    elif style.roof == "gable" and depth_m < 16:
        gable_roof(sink, width_m, depth_m, top_m, wall=style.wall, rise_m=min(3.6, depth_m * 0.3))
    else:
        flat_roof(sink, width_m, depth_m, top_m, wall=style.wall, coping=style.trim)
        roof_machinery(sink, width_m, depth_m, top_m, rng=rng, water_tank=style.water_tank)


def _ridge_m(style: Style, depth_m: float) -> float:
    """Returns the height of the roof above the walls at a party wall, metres."""
    if style.roof == "mansard":
        return 3.0
    return min(3.6, depth_m * 0.3) if style.roof == "gable" and depth_m < 16 else 0.8


def bays(width_m: float, bay_m: float, margin_m: float) -> list[float]:
    """Returns the centres of as many bays as fit into a facade, evenly spaced, metres from its left end."""
    usable = width_m - 2 * margin_m
    count = max(1, int(usable / bay_m))
    pitch = usable / count
    return [margin_m + (i + 0.5) * pitch for i in range(count)]


def _street_side(
    facade: Facade, style: Style, floors: int, top_m: float, *, main: bool, rng: np.random.Generator
) -> None:
    width = facade.width_m
    holes = ground_floor(facade, style, main=main, rng=rng)
    facade.wall(style.base, 0.0, 0.0, width, style.ground_m, holes)
    centres = bays(width, style.bay_m, 0.7)
    pitch = centres[1] - centres[0] if len(centres) > 1 else width - 1.4
    half = min(style.window.width_m, pitch - (0.12 if style.fins else 0.5)) / 2
    kinds = _bay_kinds(style, len(centres), floors, pitch, rng=rng)
    for floor in range(1, floors):
        level = style.ground_m + (floor - 1) * style.floor_m
        openings = []
        for centre, kind in zip(centres, kinds, strict=True):
            if kind == "oriel":
                continue
            deep = kind == "balcony" and (floor > 1 or style.ground != "shops")
            sill = 0.1 if deep else style.window.sill_m
            top = min(style.window.sill_m + style.window.height_m, style.floor_m - 0.35)
            openings.append(Opening(centre - half, level + sill, centre + half, level + top))
            if deep:
                reach, slab = (0.7, style.trim) if style.railing == "bars" and pitch <= 3.4 else (1.5, "concrete_light")
                side = min(half + 0.45, pitch / 2 - 0.05)
                balcony(facade, centre - side, centre + side, level, reach, railing=style.railing, slab=slab)
        facade.wall(style.wall, 0.0, level, width, level + style.floor_m, openings)
        for opening in openings:
            window(facade, opening, style.window, rng=rng)
            _window_extras(facade, opening, style, rng=rng)
    levels = [style.ground_m + f * style.floor_m for f in range(floors - 1)]
    for centre, kind in zip(centres, kinds, strict=True):
        if kind == "oriel":
            oriel(
                facade,
                centre,
                min(pitch - 0.3, 2.9),
                levels,
                style.floor_m,
                wall=style.wall,
                trim=style.trim,
                style=style.window,
                rng=rng,
            )
        elif kind == "escape":
            fire_escape(facade, centre - pitch / 2 + 0.15, centre + pitch / 2 - 0.15, levels)
    if style.downpipes:
        for u in (0.16, width - 0.16):
            downpipe(facade, u, top_m - 0.35)
    if style.fins and floors > 1:
        for u in (0.2, *(a + pitch / 2 for a in centres[:-1]), width - 0.2):
            facade.box(style.trim, (u - 0.13, u + 0.13), (style.ground_m, top_m), (0.0, 0.4))
    if style.pilasters and floors > 1:
        for u in (0.35, *(a + pitch / 2 for a in centres[:-1]), width - 0.35):
            _pilaster(facade, u, style, top_m - 0.8)


def _bay_kinds(style: Style, count: int, floors: int, pitch: float, *, rng: np.random.Generator) -> list[str]:
    """Draws the kind of each column of windows: plain, with balconies, with an oriel, or with a fire escape."""
    kinds = ["balcony" if rng.random() < style.balconies else "plain" for _ in range(count)]
    if style.oriels and floors > 2 and pitch > 2.2:
        for index in range(int(rng.integers(0, 2)), count, int(rng.integers(2, 4))):
            kinds[index] = "oriel"
    elif style.escapes and floors > 3 and count > 2:
        kinds[int(rng.integers(count))] = "escape"
    return kinds


def _window_extras(facade: Facade, opening: Opening, style: Style, *, rng: np.random.Generator) -> None:
    chance = rng.random()
    if chance < style.clutter * 0.4:
        air_conditioner(facade, (opening.u0 + opening.u1) / 2, opening.v0)
    elif chance < style.clutter:
        flower_box(facade, opening, rng=rng)


def _pilaster(facade: Facade, u: float, style: Style, top_m: float) -> None:
    """Adds a flat column from the first floor to the cornice, with base and capital."""
    low = style.ground_m + 0.1
    facade.box(style.trim, (u - 0.2, u + 0.2), (low + 0.35, top_m - 0.3), (0.0, 0.07), skip="but")
    facade.box(style.trim, (u - 0.26, u + 0.26), (low, low + 0.35), (0.0, 0.11), skip="b")
    facade.box(style.trim, (u - 0.27, u + 0.27), (top_m - 0.3, top_m), (0.0, 0.12), skip="b")


def _plain_side(facade: Facade, style: Style, floors: int, top_m: float, *, rng: np.random.Generator) -> None:
    """Adds a side towards a courtyard, with few windows and no ornament."""
    width = facade.width_m
    openings = []
    if width > 8 and rng.random() < 0.7:
        for centre in bays(width, style.bay_m * 1.8, 2.0):
            for floor in range(1, floors):
                low = style.ground_m + (floor - 1) * style.floor_m + 0.9
                openings.append(Opening(centre - 0.5, low, centre + 0.5, low + 1.4))
    facade.wall(style.wall, 0.0, 0.0, width, top_m, openings)
    bare = replace(style.window, surround=None, lintel=None, shutters=None)
    for opening in openings:
        window(facade, opening, bare, rng=rng)


def _ornament(
    sink: Sink, style: Style, width_m: float, depth_m: float, floors: int, top_m: float, sides: Sequence[str]
) -> None:
    def ring(profile: list[tuple[float, float]]) -> None:
        belt(sink, style.trim, width_m, depth_m, profile, sides=sides)

    first = style.ground_m
    levels = [first + f * style.floor_m for f in range(floors - 1)] if style.string_courses == "all" else [first]
    if style.string_courses != "none" and floors > 1:
        for level in levels:
            ring([(0.0, level - 0.14), (0.06, level - 0.1), (0.1, level), (0.1, level + 0.06), (0.0, level + 0.1)])
    if style.cornice == "simple":
        ring([(0.0, top_m - 0.3), (0.12, top_m - 0.22), (0.28, top_m - 0.05), (0.3, top_m + 0.05), (0.0, top_m + 0.1)])
    elif style.cornice in ("bracket", "classic"):
        reach = 0.55 if style.cornice == "bracket" else 0.7
        ring([(0.0, top_m - 0.75), (0.07, top_m - 0.72), (0.09, top_m - 0.5), (0.09, top_m - 0.3)])
        ring(
            [
                (0.09, top_m - 0.3),
                (reach - 0.1, top_m - 0.12),
                (reach, top_m),
                (reach, top_m + 0.1),
                (0.0, top_m + 0.16),
            ]
        )
        for side, facade in facades(sink, width_m, depth_m).items():
            if side in sides:
                count = max(2, int(facade.width_m / (0.9 if style.cornice == "bracket" else 0.7)))
                for u in np.linspace(0.3, facade.width_m - 0.3, count):
                    facade.box(
                        style.trim, (u - 0.08, u + 0.08), (top_m - 0.5, top_m - 0.12), (0.09, reach - 0.14), skip="bt"
                    )
    if style.quoins:
        for index, side in enumerate(SIDES):
            if side not in sides:
                continue
            facade = facades(sink, width_m, depth_m)[side]
            for number, low in enumerate(np.arange(style.ground_m + 0.2, top_m - 1.3, 0.5)):
                long = 0.75 if (number + index) % 2 else 0.45
                for u in ((0.0, long), (facade.width_m - long, facade.width_m)):
                    facade.box(style.trim, u, (float(low), float(low) + 0.44), (0.0, 0.035))
