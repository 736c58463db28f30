"""One texture of plain colours for everything too small to need a texture of its own.

A swatch is a square cell; its colour, roughness and metalness go into the colour and ORM textures alike, so all
plain things of a block can be one draw call.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from authoring.materials.image import Image, linear_to_srgb, to_bytes
from authoring.materials.noise import tileable_noise

GRID = 8
SIZE_PX = 512


@dataclass(frozen=True, slots=True)
class Swatch:
    """A plain surface: linear albedo, roughness, metalness and how blotchy (dirt, wear) it is."""

    albedo: tuple[float, float, float]
    roughness: float = 0.7
    metallic: float = 0.0
    wear: float = 0.08


SWATCHES: dict[str, Swatch] = {
    "white_paint": Swatch((0.66, 0.65, 0.62), 0.55),
    "cream_paint": Swatch((0.58, 0.52, 0.40), 0.6),
    "grey_paint": Swatch((0.26, 0.27, 0.28), 0.55),
    "anthracite": Swatch((0.045, 0.048, 0.052), 0.5),
    "black_paint": Swatch((0.022, 0.022, 0.024), 0.4),
    "dark_green": Swatch((0.022, 0.06, 0.035), 0.45),
    "dark_blue": Swatch((0.02, 0.04, 0.10), 0.45),
    "dark_red": Swatch((0.16, 0.022, 0.02), 0.5),
    "brown_paint": Swatch((0.10, 0.055, 0.032), 0.55),
    "teal_paint": Swatch((0.03, 0.13, 0.13), 0.5),
    "mustard": Swatch((0.42, 0.25, 0.05), 0.55),
    "signal_red": Swatch((0.42, 0.025, 0.02), 0.4),
    "signal_yellow": Swatch((0.65, 0.40, 0.02), 0.4),
    "signal_blue": Swatch((0.02, 0.09, 0.33), 0.4),
    "signal_green": Swatch((0.02, 0.22, 0.09), 0.4),
    "orange": Swatch((0.55, 0.16, 0.02), 0.45),
    "galvanised": Swatch((0.42, 0.43, 0.44), 0.5, 0.7, 0.14),
    "aluminium": Swatch((0.62, 0.63, 0.64), 0.35, 0.85, 0.05),
    "steel": Swatch((0.34, 0.34, 0.35), 0.4, 0.9, 0.1),
    "rust": Swatch((0.14, 0.06, 0.03), 0.9, 0.1, 0.3),
    "copper_green": Swatch((0.16, 0.30, 0.25), 0.8, 0.1, 0.2),
    "zinc_roof": Swatch((0.24, 0.26, 0.28), 0.55, 0.4, 0.15),
    "limestone": Swatch((0.50, 0.46, 0.38), 0.85, 0.0, 0.14),
    "sandstone": Swatch((0.42, 0.32, 0.21), 0.85, 0.0, 0.14),
    "concrete_light": Swatch((0.42, 0.41, 0.39), 0.85, 0.0, 0.12),
    "concrete_dark": Swatch((0.24, 0.235, 0.225), 0.9, 0.0, 0.16),
    "slate": Swatch((0.07, 0.075, 0.08), 0.7, 0.0, 0.2),
    "terracotta": Swatch((0.30, 0.11, 0.06), 0.85, 0.0, 0.2),
    "brick_trim": Swatch((0.15, 0.06, 0.04), 0.9, 0.0, 0.15),
    "bitumen": Swatch((0.04, 0.04, 0.042), 0.95, 0.0, 0.2),
    "rubber": Swatch((0.018, 0.018, 0.018), 0.85),
    "oak": Swatch((0.30, 0.17, 0.08), 0.65, 0.0, 0.2),
    "teak": Swatch((0.17, 0.085, 0.04), 0.6, 0.0, 0.2),
    "weathered_wood": Swatch((0.23, 0.20, 0.16), 0.85, 0.0, 0.25),
    "dark_glass": Swatch((0.02, 0.025, 0.028), 0.06, 0.0, 0.02),
    "grey_glass": Swatch((0.05, 0.06, 0.065), 0.08, 0.0, 0.02),
    "lamp_glass": Swatch((0.70, 0.68, 0.60), 0.25, 0.0, 0.02),
    "plastic_white": Swatch((0.68, 0.68, 0.67), 0.35),
    "plastic_grey": Swatch((0.16, 0.165, 0.17), 0.45),
    "plastic_green": Swatch((0.03, 0.16, 0.06), 0.45),
    "canvas_white": Swatch((0.62, 0.60, 0.55), 0.95),
    "canvas_red": Swatch((0.34, 0.03, 0.03), 0.95),
    "canvas_green": Swatch((0.03, 0.11, 0.06), 0.95),
    "canvas_sand": Swatch((0.46, 0.38, 0.26), 0.95),
    "flower_red": Swatch((0.45, 0.03, 0.04), 0.8),
    "flower_pink": Swatch((0.55, 0.14, 0.26), 0.8),
    "flower_yellow": Swatch((0.60, 0.42, 0.04), 0.8),
    "flower_white": Swatch((0.65, 0.63, 0.58), 0.8),
    "cast_iron": Swatch((0.055, 0.052, 0.05), 0.6, 0.3, 0.2),
    "earth": Swatch((0.07, 0.05, 0.035), 1.0, 0.0, 0.3),
}


def swatch_rect(name: str) -> tuple[float, float, float, float]:
    """The UV rectangle (u0, v0, u1, v1) that is safely inside a swatch, v up."""
    if name not in SWATCHES:
        raise ValueError(f"no palette swatch named {name!r}; there are {', '.join(SWATCHES)}")
    row, column = divmod(list(SWATCHES).index(name), GRID)
    margin = 0.2
    u0, v0 = (column + margin) / GRID, 1 - (row + 1 - margin) / GRID
    side = (1 - 2 * margin) / GRID
    return u0, v0, u0 + side, v0 + side


def palette_images(*, rng: np.random.Generator) -> tuple[Image, Image]:
    """The colour (sRGB) and ORM textures, each (512, 512, 3) uint8."""
    cell = SIZE_PX // GRID
    albedo = np.full((SIZE_PX, SIZE_PX, 3), 0.2)
    orm = np.zeros((SIZE_PX, SIZE_PX, 3))
    orm[..., 0], orm[..., 1] = 1.0, 0.8
    blotches = tileable_noise(SIZE_PX, period=16, octaves=4, rng=rng)
    for index, swatch in enumerate(SWATCHES.values()):
        row, column = divmod(index, GRID)
        box = np.s_[row * cell : (row + 1) * cell, column * cell : (column + 1) * cell]
        shade = 1 + swatch.wear * 2 * blotches[box]
        albedo[box] = np.asarray(swatch.albedo) * shade[..., None]
        orm[(*box, 1)] = np.clip(swatch.roughness + 0.08 * blotches[box], 0.04, 1)
        orm[(*box, 2)] = swatch.metallic
    return linear_to_srgb(albedo), to_bytes(orm)
