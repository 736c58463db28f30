"""The facades of far buildings: one strip a storey, eight bays long, which tiles along the street."""

from __future__ import annotations

import numpy as np

from authoring.materials.atlas import FAR_STYLES
from authoring.materials.canvas import Canvas
from authoring.materials.glazing import BEHIND, GLASS
from authoring.materials.image import Image
from authoring.materials.noise import tileable_noise

BAYS = 8
# wall colour, ground colour, frame colour, window width and height as shares of the bay
_LOOKS = {
    "brick_apartment": ((0.23, 0.075, 0.045), (0.40, 0.36, 0.29), (0.52, 0.50, 0.45), 0.38, 0.56),
    "plaster_apartment": ((0.58, 0.47, 0.31), (0.42, 0.36, 0.28), (0.58, 0.57, 0.54), 0.36, 0.56),
    "stone_classic": ((0.48, 0.43, 0.34), (0.42, 0.38, 0.31), (0.55, 0.53, 0.48), 0.42, 0.62),
    "glass_office": ((0.04, 0.045, 0.05), (0.30, 0.28, 0.24), (0.05, 0.05, 0.055), 0.94, 0.74),
    "concrete_office": ((0.35, 0.34, 0.315), (0.25, 0.25, 0.25), (0.06, 0.06, 0.065), 0.86, 0.50),
    "shop_row": ((0.60, 0.55, 0.46), (0.10, 0.09, 0.09), (0.55, 0.53, 0.50), 0.34, 0.56),
    "warehouse_loft": ((0.17, 0.07, 0.045), (0.16, 0.07, 0.045), (0.04, 0.042, 0.045), 0.62, 0.58),
    "modern_residential": ((0.62, 0.61, 0.57), (0.20, 0.20, 0.20), (0.045, 0.047, 0.05), 0.58, 0.72),
}


def far_facades(*, rng: np.random.Generator) -> dict[str, Image]:
    """Upper and ground storeys of every style, as strips of 64 px."""
    colour, surface = [], []
    for style in FAR_STYLES:
        wall, ground, frame, wide, tall = _LOOKS[style]
        for storey, base in ((False, wall), (True, ground)):
            strip = Canvas(1024, 64, oversample=4)
            strip.fill(base, roughness=0.85)
            for bay in range(BAYS):
                width, height = (wide, tall) if not storey else (min(0.86, wide + 0.25), 0.66)
                _bay(strip, bay, width, height, frame, ground=storey, rng=rng)
            if style == "modern_residential" and not storey:
                for bay in range(0, BAYS, 2):
                    strip.rect((bay + 0.1) / BAYS, 0.72, (bay + 0.9) / BAYS, 0.99, (0.10, 0.105, 0.11), roughness=0.4)
            if style == "stone_classic" or storey:
                strip.rect(0, 0, 1, 0.05, np.asarray(base) * 1.1, roughness=0.85)
                strip.rect(0, 0.05, 1, 0.08, np.asarray(base) * 0.45, roughness=0.85)
            noise = tileable_noise(1024, period=8, octaves=6, rng=rng)[:64]
            strip.albedo *= (1 + 0.08 * np.kron(noise, np.ones((4, 4))))[..., None]
            colour.append(strip.image())
            surface.append(strip.orm())
    return {"far_facades": np.concatenate(colour), "far_facades_orm": np.concatenate(surface)}


def _bay(
    strip: Canvas,
    bay: int,
    width: float,
    height: float,
    frame: tuple[float, float, float],
    *,
    ground: bool,
    rng: np.random.Generator,
) -> None:
    x0, x1 = (bay + 0.5 - width / 2) / BAYS, (bay + 0.5 + width / 2) / BAYS
    y1 = 0.97 if ground else 0.5 + height / 2 + 0.02
    y0 = y1 - height
    edge = 0.003
    strip.rect(x0 - 0.004, y1, x1 + 0.004, min(1.0, y1 + 0.05), (0.45, 0.42, 0.36), roughness=0.8)
    strip.rect(x0, y0, x1, y1, frame, roughness=0.6)
    strip.rect(x0 + edge, y0 + 0.02, x1 - edge, y1 - 0.02, (0.095, 0.105, 0.11), **GLASS)
    dressing = rng.random()
    if dressing < 0.35:
        strip.rect(
            x0 + edge, y0 + 0.02, x1 - edge, y0 + height * float(rng.uniform(0.2, 0.6)), (0.34, 0.33, 0.30), **BEHIND
        )
    elif dressing < 0.5:
        for left in (x0 + edge, x1 - edge - 0.008):
            strip.rect(left, y0 + 0.02, left + 0.008, y1 - 0.02, (0.36, 0.34, 0.30), **BEHIND)
    strip.rect((x0 + x1) / 2 - 0.0012, y0, (x0 + x1) / 2 + 0.0012, y1, frame, roughness=0.6)
    strip.rect(x0, y0, x1, y0 + 0.035, (0.02, 0.02, 0.02), roughness=0.6)
