"""Buildings for large distances: boxes whose storeys are strips of one texture."""

from __future__ import annotations

import itertools

import numpy as np

from authoring.kit.facade import belt, facades
from authoring.kit.parts import Sink
from authoring.materials.atlas import FAR_WIDTH_M, far_rows

BAYS = 8
_STOREYS_M = {
    "glass_office": (3.7, 5.2),
    "concrete_office": (3.6, 4.4),
    "warehouse_loft": (4.0, 4.8),
    "stone_classic": (3.6, 4.6),
}
_TRIMS = {"glass_office": "anthracite", "concrete_office": "concrete_light", "modern_residential": "anthracite"}


def far_building(
    sink: Sink, style: str, width_m: float, depth_m: float, floors: int, *, rng: np.random.Generator
) -> None:
    """Adds a box of at most forty drawn storeys with a coping, a roof and a stair head; under 200 triangles."""
    floor_m, ground_m = _STOREYS_M.get(style, (3.2, 4.0))
    top_m = ground_m + (floors - 1) * floor_m
    material = str(rng.choice(["far_facades", "far_facades_warm", "far_facades_dark"]))
    strips = max(1, min(floors - 1, 18))
    for facade in facades(sink, width_m, depth_m).values():
        bays = max(1, round(facade.width_m / FAR_WIDTH_M * BAYS)) / BAYS
        levels = [0.0, *np.linspace(ground_m, top_m, strips + 1)] if floors > 1 else [0.0, top_m]
        for index, (low, high) in enumerate(itertools.pairwise(levels)):
            v0, v1 = far_rows(style, ground=index == 0)
            # Every storey starts at another bay of the strip, or drawn curtains would line up into columns.
            u0 = float(rng.integers(BAYS)) / BAYS
            corners = [
                facade.at(0, low),
                facade.at(facade.width_m, low),
                facade.at(facade.width_m, high),
                facade.at(0, high),
            ]
            sink.polygon(material, corners, [(u0, v0), (u0 + bays, v0), (u0 + bays, v1), (u0, v1)])
    trim = _TRIMS.get(style, "limestone")
    belt(sink, trim, width_m, depth_m, [(0.0, top_m - 0.3), (0.3, top_m), (0.3, top_m + 0.5), (-0.3, top_m + 0.5)])
    x, y = width_m / 2, depth_m / 2
    roof = [(-x, -y, top_m + 0.4), (x, -y, top_m + 0.4), (x, y, top_m + 0.4), (-x, y, top_m + 0.4)]
    sink.quad("roof_gravel", roof, tile_m=2.0)
    head_x = float(rng.uniform(-0.4, 0.4)) * (x - 2)
    sink.swatch_box("concrete_dark", (head_x - 1.6, -1.3, top_m + 0.4), (head_x + 1.6, 1.3, top_m + 2.8), skip="z")
