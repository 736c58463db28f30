"""Makes buildings of any style, size and number of floors, in detail or as a textured box for large distances."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from authoring.kit.facade import SIDES
from authoring.kit.far import far_building
from authoring.kit.glass_office import glass_office
from authoring.kit.parts import Part, Sink, place
from authoring.kit.storeys import storeyed_building
from authoring.kit.styles import FAMILIES, shop_house
from authoring.materials.atlas import FAR_STYLES

STYLES = FAR_STYLES
# No storey is lower.
FLOOR_M = 3.0


def building(
    *,
    style: str,
    width_m: float,
    depth_m: float,
    floors: int,
    rng: np.random.Generator,
    sides: Sequence[str] = ("front",),
    lod: str = "near",
    covered_m: Mapping[str, float] | None = None,
) -> list[Part]:
    """Makes one building in its own frame: the footprint is centred at the origin, the ground is at z = 0, and the main
    facade faces -y.

    Args:
        style: of `STYLES`.
        width_m: width along x in metres, at least 5.
        depth_m: depth along y in metres, at least 5.
        floors: number of storeys with the ground floor, at least 1.
        rng: random generator of all details; the same state gives the same building.
        sides: the sides that face a street, of `front` (-y), `right` (+x), `back` (+y) and `left` (-x); the others are
            plain.
        lod: level of detail: `near` for 1.5 to 6 thousand triangles (more for the largest), `far` for under 200.
        covered_m: height in metres up to which neighbours hide the sides `left` and `right`; nothing is added there.
    """
    if style not in STYLES:
        raise ValueError(f"no building style named {style!r}; there are {', '.join(STYLES)}")
    if width_m < 5 or depth_m < 5 or floors < 1:
        raise ValueError(f"a building of {width_m} m x {depth_m} m and {floors} floors is too small")
    if not set(sides) <= set(SIDES):
        raise ValueError(f"sides must be of {', '.join(SIDES)}; got {', '.join(sides)}")
    if lod not in ("near", "far"):
        raise ValueError(f"lod must be 'near' or 'far', got {lod!r}")
    sink = Sink("building")
    if lod == "far":
        far_building(sink, style, width_m, depth_m, floors, rng=rng)
    elif style == "glass_office":
        glass_office(sink, width_m, depth_m, floors, sides, rng=rng)
    elif style == "shop_row":
        return _shop_row(width_m, depth_m, floors, sides, rng=rng, covered_m=covered_m or {})
    else:
        storeyed_building(sink, FAMILIES[style](rng), width_m, depth_m, floors, sides, rng=rng, covered_m=covered_m)
    return sink.parts()


def _shop_row(
    width_m: float,
    depth_m: float,
    floors: int,
    sides: Sequence[str],
    *,
    rng: np.random.Generator,
    covered_m: Mapping[str, float],
) -> list[Part]:
    """Makes a row of narrow houses, each with its own materials and height."""
    count = max(1, round(width_m / float(rng.uniform(6.0, 8.0))))
    shares = rng.uniform(0.8, 1.25, count)
    widths = shares / shares.sum() * width_m
    lowest = FLOOR_M * max(1, floors - 1)
    row = Sink("building")
    left = -width_m / 2
    for index, house_m in enumerate(widths):
        faces = [s for s in sides if s in ("front", "back")]
        faces += ["left"] * (index == 0 and "left" in sides) + ["right"] * (index == count - 1 and "right" in sides)
        house = Sink("building")
        storeys = max(1, floors + int(rng.integers(-1, 1)))
        ends = {"left": index == 0, "right": index == count - 1}
        covered = {side: covered_m.get(side, 0.0) if end else lowest for side, end in ends.items()}
        storeyed_building(house, shop_house(rng), float(house_m), depth_m, storeys, faces, rng=rng, covered_m=covered)
        row.extend(place(house.parts(), x_m=left + house_m / 2))
        left += float(house_m)
    return row.parts()
