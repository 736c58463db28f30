"""Draws every texture of the registry into mjcf/textures: `python -m authoring.materials.build [FOLDER]`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

from authoring.materials import far, freight, glazing, graphics, ground, masonry, traffic_art
from authoring.materials.image import Image, shrunk
from authoring.materials.palette import palette_images
from authoring.materials.png import write_png
from authoring.materials.registry import MATERIALS
from gear.values.rng import derive_rng

Painter = Callable[..., dict[str, Image]]
TEXTURES = Path(__file__).resolve().parents[2] / "mjcf" / "textures"
PAINTERS: tuple[Painter, ...] = (
    masonry.brick,
    masonry.ashlar,
    masonry.slates,
    masonry.roof_tiles,
    masonry.pavement,
    masonry.cobbles,
    masonry.tactile,
    masonry.gravel,
    ground.asphalt,
    ground.asphalt_lanes,
    ground.concrete,
    ground.plaster,
    ground.metal_panel,
    ground.boards,
    ground.road_paint,
    ground.grass,
    ground.soil,
    ground.bark,
    ground.foliage,
    glazing.windows,
    glazing.shop_fronts,
    glazing.curtain_wall,
    graphics.signs,
    graphics.awnings,
    traffic_art.traffic_signs,
    graphics.lenses,
    graphics.ironwork,
    far.far_facades,
    freight.containers,
    freight.direction_signs,
)
# Normal maps add less to a picture than colours and need as many bytes; the other maps add even less.
LARGEST_MAP_PX = 512


def paint() -> dict[str, Image]:
    """Every texture by its stem, (H, W, 3) uint8."""
    colour, surface = palette_images(rng=derive_rng(0, "textures", "palette"))
    textures = {"palette": colour, "palette_orm": surface}
    for painter in PAINTERS:
        textures |= painter(rng=derive_rng(0, "textures", painter.__name__))
    return textures


def registered_stems() -> set[str]:
    """The stems that the registry's materials use."""
    return {stem for m in MATERIALS.values() for stem in (m.rgb, m.normal, m.orm) if stem}


def written_textures(textures: dict[str, Image]) -> dict[str, Image]:
    """The registered textures at the sizes that they are written with, in order of their names."""
    if missing := registered_stems() - set(textures):
        raise ValueError(f"no function paints {', '.join(sorted(missing))}")
    largest = {material.rgb: max(textures[material.rgb].shape) for material in MATERIALS.values()}
    for material in MATERIALS.values():
        side = max(textures[material.rgb].shape)
        if material.normal:
            # The relief of an atlas is only edges of a few pixels.
            largest[material.normal] = LARGEST_MAP_PX if material.tile_m else side
        if material.orm:
            largest[material.orm] = min(LARGEST_MAP_PX, max(largest.get(material.orm, 0), side // 2))
    return {stem: shrunk(textures[stem], side) for stem, side in sorted(largest.items())}


def build(folder: Path) -> None:
    """Write every registered texture into `folder`."""
    for stem, image in written_textures(paint()).items():
        write_png(folder / f"{stem}.png", image)


if __name__ == "__main__":
    build(Path(sys.argv[1]) if len(sys.argv) > 1 else TEXTURES)
