"""Roofs of buildings: flat roofs with their machinery, slate mansards, gable roofs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from authoring.kit.cores import sheet
from authoring.kit.facade import belt, facades
from authoring.kit.parts import Sink
from authoring.kit.shapes import cylinder, disc, dome
from authoring.materials.atlas import window_rect
from authoring.materials.registry import MATERIALS


def flat_roof(
    sink: Sink,
    width_m: float,
    depth_m: float,
    top_m: float,
    *,
    wall: str,
    coping: str,
    parapet_m: float = 0.7,
    thickness_m: float = 0.25,
) -> None:
    """Adds a flat roof of gravel behind a parapet whose outer face continues the wall."""
    belt(sink, wall, width_m, depth_m, [(0.0, top_m), (0.0, top_m + parapet_m)])
    sheet(sink, wall, width_m, depth_m, top_m - 0.3, top_m + parapet_m + 0.08)
    cap = 0.05
    belt(
        sink,
        coping,
        width_m,
        depth_m,
        [
            (0.0, top_m + parapet_m),
            (cap, top_m + parapet_m),
            (cap, top_m + parapet_m + 0.08),
            (-thickness_m, top_m + parapet_m + 0.09),
        ],
    )
    inner_w, inner_d = width_m - 2 * thickness_m, depth_m - 2 * thickness_m
    x, y = inner_w / 2, inner_d / 2
    tile_m = MATERIALS["roof_gravel"].tile_m
    sink.quad("roof_gravel", [(-x, -y, top_m), (x, -y, top_m), (x, y, top_m), (-x, y, top_m)], tile_m=tile_m)
    top = top_m + parapet_m + 0.09
    for start, end in (((-x, -y), (-x, y)), ((x, -y), (-x, -y)), ((x, y), (x, -y)), ((-x, y), (x, y))):
        sink.swatch_quad("concrete_dark", [(*start, top_m), (*end, top_m), (*end, top), (*start, top)])


def roof_machinery(
    sink: Sink, width_m: float, depth_m: float, top_m: float, *, rng: np.random.Generator, water_tank: bool = False
) -> None:
    """Adds stair head, air conditioners, ducts, chimneys, aerials, and perhaps a wooden water tank."""
    half_w, half_d = width_m / 2 - 1.2, depth_m / 2 - 1.2
    if half_w < 1.5 or half_d < 1.5:
        return
    head_x = float(rng.uniform(-0.5, 0.5)) * half_w
    head_y = float(rng.uniform(0.0, 0.6)) * half_d
    sink.tiled_box(
        "concrete", (head_x - 1.4, head_y - 1.2, top_m), (head_x + 1.4, head_y + 1.2, top_m + 2.5), tile_m=4.0, skip="z"
    )
    sink.swatch_box(
        "zinc_roof", (head_x - 1.55, head_y - 1.35, top_m + 2.5), (head_x + 1.55, head_y + 1.35, top_m + 2.64), skip=""
    )
    for _ in range(int(rng.integers(2, 6))):
        x, y = float(rng.uniform(-1, 1)) * half_w, float(rng.uniform(-1, 1)) * half_d
        if abs(x - head_x) < 2.4 and abs(y - head_y) < 2.2:
            continue
        w, d, h = rng.uniform(0.45, 0.95), rng.uniform(0.35, 0.7), rng.uniform(0.6, 1.3)
        sink.swatch_box("galvanised", (x - w, y - d, top_m + 0.2), (x + w, y + d, top_m + 0.2 + h), skip="")
        sink.swatch_box(
            "anthracite",
            (x - w * 0.7, y - d * 0.7, top_m + 0.2 + h),
            (x + w * 0.7, y + d * 0.7, top_m + 0.26 + h),
            skip="z",
        )
        sink.swatch_box("concrete_dark", (x - w, y - d, top_m), (x + w, y + d, top_m + 0.2), skip="zZ")
    if water_tank:
        x, y = -head_x * 0.8, -half_d * 0.3
        for dx in (-0.9, 0.9):
            for dy in (-0.9, 0.9):
                sink.swatch_box(
                    "rust",
                    (x + dx - 0.08, y + dy - 0.08, top_m),
                    (x + dx + 0.08, y + dy + 0.08, top_m + 2.4),
                    skip="zZ",
                )
        sink.swatch_box("rust", (x - 1.1, y - 1.1, top_m + 2.4), (x + 1.1, y + 1.1, top_m + 2.55), skip="")
        # The tank reaches over its frame, and its roof over the tank: both are seen from below.
        disc(sink, "weathered_wood", (x, y, top_m + 2.55), 1.25, segments=14, is_underside=True)
        cylinder(sink, "weathered_wood", (x, y, top_m + 2.55), 1.25, 2.3, segments=14, cap=False)
        disc(sink, "bitumen", (x, y, top_m + 4.85), 1.4, segments=14, is_underside=True)
        dome(sink, "bitumen", (x, y, top_m + 4.85), 1.4, 0.9, segments=14, rings=1)
    mast_x, mast_y = half_w * float(rng.uniform(-0.8, 0.8)), half_d * 0.5
    sink.swatch_box(
        "galvanised", (mast_x - 0.03, mast_y - 0.03, top_m), (mast_x + 0.03, mast_y + 0.03, top_m + 3.4), skip="z"
    )
    for height in (2.6, 2.95, 3.3):
        sink.swatch_box(
            "galvanised",
            (mast_x - 0.5, mast_y - 0.012, top_m + height),
            (mast_x + 0.5, mast_y + 0.012, top_m + height + 0.024),
            skip="",
        )


def mansard(
    sink: Sink,
    width_m: float,
    depth_m: float,
    top_m: float,
    *,
    sides: Sequence[str],
    dormer_pitch_m: float,
    rng: np.random.Generator,
    height_m: float = 3.0,
) -> None:
    """Adds a steep slate roof with dormers towards the streets and chimneys on the walls at the ends."""
    lean = 0.9
    for side, wall in facades(sink, width_m, depth_m).items():
        low = [wall.at(0, top_m), wall.at(wall.width_m, top_m)]
        high = [wall.at(wall.width_m - lean, top_m + height_m, -lean), wall.at(lean, top_m + height_m, -lean)]
        sink.quad("slate_roof", np.stack([*low, *high]), tile_m=MATERIALS["slate_roof"].tile_m)
        if side not in sides:
            continue
        count = max(1, int((wall.width_m - 2.5) / dormer_pitch_m))
        pitch = (wall.width_m - 2.5) / count
        for index in range(count):
            u = 1.25 + (index + 0.5) * pitch
            low_v, high_v, front = top_m + 0.45, top_m + 2.1, -0.12
            wall.picture(
                "windows", window_rect("casement", int(rng.integers(8))), u - 0.48, low_v, u + 0.48, high_v, d_m=front
            )
            for cheek in ((u - 0.6, u - 0.48), (u + 0.48, u + 0.6)):
                wall.box("white_paint", cheek, (low_v - 0.1, high_v), (front - 0.8, front + 0.06), skip="bu")
            wall.box("zinc_roof", (u - 0.72, u + 0.72), (high_v, high_v + 0.16), (front - 0.9, front + 0.16), skip="b")
            wall.box("white_paint", (u - 0.6, u + 0.6), (low_v - 0.16, low_v), (front - 0.8, front + 0.1), skip="bu")
    x, y = width_m / 2 - lean, depth_m / 2 - lean
    top = top_m + height_m
    sink.swatch_quad("zinc_roof", [(-x, -y, top), (x, -y, top), (x, y, top), (-x, y, top)])
    chimneys(sink, width_m, depth_m, top, rng=rng)


def gable_roof(sink: Sink, width_m: float, depth_m: float, top_m: float, *, wall: str, rise_m: float) -> None:
    """Adds two slopes of tiles to the front and the back, and triangles of wall at the ends."""
    eave = 0.35
    x, y = width_m / 2, depth_m / 2
    low = top_m - rise_m * eave / y
    tile_m = MATERIALS["tile_roof"].tile_m
    ridge = top_m + rise_m
    sink.quad("tile_roof", [(-x, -y - eave, low), (x, -y - eave, low), (x, 0, ridge), (-x, 0, ridge)], tile_m=tile_m)
    sink.quad("tile_roof", [(x, y + eave, low), (-x, y + eave, low), (-x, 0, ridge), (x, 0, ridge)], tile_m=tile_m)
    for sign in (-1, 1):
        sink.swatch_box(
            "zinc_roof", (-x, sign * (y + eave) - 0.07, low - 0.08), (x, sign * (y + eave) + 0.07, low + 0.03), skip=""
        )
    wall_tile = MATERIALS[wall].tile_m
    sink.quad(wall, [(x, -y, top_m), (x, y, top_m), (x, 0, ridge)], tile_m=wall_tile)
    sink.quad(wall, [(-x, y, top_m), (-x, -y, top_m), (-x, 0, ridge)], tile_m=wall_tile)


def chimneys(sink: Sink, width_m: float, depth_m: float, top_m: float, *, rng: np.random.Generator) -> None:
    """Adds one or two chimneys of brick with clay pots."""
    for sign in (-1, 1)[: int(rng.integers(1, 3))]:
        x, y = sign * (width_m / 2 - 1.3), float(rng.uniform(-0.2, 0.4)) * depth_m
        low = top_m - 1.2
        sink.tiled_box("brick_red", (x - 0.35, y - 0.7, low), (x + 0.35, y + 0.7, top_m + 1.3), tile_m=2.0, skip="z")
        sink.swatch_box(
            "concrete_light", (x - 0.42, y - 0.77, top_m + 1.3), (x + 0.42, y + 0.77, top_m + 1.42), skip=""
        )
        for offset in (-0.4, 0.0, 0.4):
            cylinder(sink, "terracotta", (x, y + offset, top_m + 1.42), 0.11, 0.4, segments=8)
