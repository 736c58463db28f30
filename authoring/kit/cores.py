"""The core of a building, which closes gaps between the panels of its walls.

Walls are laid in panels around their openings, so that panels meet in T-junctions. A rasteriser leaves a pixel open
here and there along them, and all behind it is seen from inside and is not drawn: the sky shows through the house. A
core stands behind the walls, deeper than any recess in them, partitions join its corners with those of the walls, a
ceiling hangs below the roof, and a sheet stands behind the joint of walls and roof.
"""

from __future__ import annotations

from authoring.kit.facade import belt
from authoring.kit.parts import Sink

DEEP_M = 0.95
"""Distance from the walls to the core, metres; the deepest recess, the door of a shop, is 0.72 m deep."""

INSET_M = 0.05
"""Distance from the walls to the rim of the ceiling, and from the roof down to the ceiling, metres."""

SHEET_M = 0.03
"""Distance from the walls to the sheet behind the joint of walls and roof, metres."""

SWATCH = "concrete_dark"


def core(sink: Sink, width_m: float, depth_m: float, top_m: float, *, ground_m: float, deep_m: float = DEEP_M) -> None:
    """Adds a core and a ceiling, which close the inside of a building.

    Args:
        sink: collects the faces.
        width_m, depth_m: size of the footprint, which is centred at the origin, metres.
        top_m: height of the walls, metres.
        ground_m: height of the ground floor, whose deep recesses leave no room for partitions.
        deep_m: from the walls to the core.
    """
    x, y = width_m / 2 - deep_m, depth_m / 2 - deep_m
    ceiling_m = top_m - INSET_M
    if x > 0 and y > 0:
        sink.swatch_box(SWATCH, (-x, -y, 0.0), (x, y, ceiling_m), skip="zZ")
        if ground_m < ceiling_m:
            _partitions(sink, (x, y), deep_m - INSET_M, ground_m, ceiling_m)
    x, y = width_m / 2 - INSET_M, depth_m / 2 - INSET_M
    rim = [(-x, y, ceiling_m), (x, y, ceiling_m), (x, -y, ceiling_m), (-x, -y, ceiling_m)]
    sink.swatch_quad(SWATCH, rim)
    sheet(sink, SWATCH, width_m, depth_m, top_m - 0.3, top_m + 0.02)


def _partitions(sink: Sink, core_m: tuple[float, float], reach_m: float, low_m: float, high_m: float) -> None:
    """Walls from the core's corners towards the building's: nothing is seen along the core from wall to wall."""
    for right in (-1, 1):
        for back in (-1, 1):
            x, y = right * core_m[0], back * core_m[1]
            inner, outer = (x, y), (x + right * reach_m, y + back * reach_m)
            for start, end in ((inner, outer), (outer, inner)):
                corners = [(*start, low_m), (*end, low_m), (*end, high_m), (*start, high_m)]
                sink.swatch_quad(SWATCH, corners)


def sheet(sink: Sink, material: str, width_m: float, depth_m: float, low_m: float, high_m: float) -> None:
    """Adds a sheet around a building, just behind the outer faces of its walls, which closes a joint between two
    heights.

    Args:
        sink: collects the faces.
        material: a tiling material or a palette swatch.
        width_m, depth_m: size of the footprint, which is centred at the origin, metres.
        low_m, high_m: heights at which the sheet begins and ends, metres.
    """
    belt(sink, material, width_m - 2 * SHEET_M, depth_m - 2 * SHEET_M, [(0.0, low_m), (0.0, high_m)])
