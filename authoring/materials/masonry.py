"""Masonry in courses: bricks, ashlar, slates, roof tiles, paving slabs, cobbles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from authoring.materials.image import Image, linear_to_srgb, normal_from_height, open_sky, orm, rough
from authoring.materials.noise import tileable_noise, worley, wrapped_blur

Array = npt.NDArray[np.float64]
Textures = dict[str, Image]


@dataclass(frozen=True, slots=True, eq=False)
class Courses:
    """A wall of blocks in courses, seen pixel by pixel; every array is (H, W).

    Attributes:
        block: number of the block.
        edge_m: distance to the block's edge, negative inside the joint.
        up: 0 at the block's lower edge, 1 at its upper.
        along: 0 at the block's left edge, 1 at its right.
    """

    block: npt.NDArray[np.int64]
    edge_m: Array
    up: Array
    along: Array

    def per_block(self, values: Array) -> Array:
        """One value for each block, spread over its pixels."""
        return np.asarray(values[self.block % len(values)])


def courses(
    size_px: int,
    tile_m: float,
    *,
    rows: int,
    columns: int,
    joint_m: float,
    wobble: Array | None = None,
    bond: float = 0.5,
) -> Courses:
    """Lays `rows` x `columns` blocks in a square tile, every other course shifted by `bond` of a block."""
    axis = (np.arange(size_px) + 0.5) / size_px * tile_m
    x, y = np.meshgrid(axis, axis[::-1])
    if wobble is not None:
        x, y = x + wobble, y + np.roll(wobble, size_px // 3, axis=(0, 1))
    height, width = tile_m / rows, tile_m / columns
    row = np.floor(y / height).astype(int)
    shifted = x / width - (row % 2) * bond
    column = np.floor(shifted).astype(int)
    along, up = shifted - column, y / height - row
    edge = np.minimum(np.minimum(along, 1 - along) * width, np.minimum(up, 1 - up) * height) - joint_m / 2
    return Courses((row % rows) * columns + column % columns, edge, up, along)


def brick(*, rng: np.random.Generator) -> Textures:
    """Three colours of facing brick with one normal and one ORM map."""
    size, tile_m, rows, columns = 512, 2.0, 30, 8
    wobble = 0.002 * tileable_noise(size, period=32, octaves=2, rng=rng)
    wall = courses(size, tile_m, rows=rows, columns=columns, joint_m=0.011, wobble=wobble)
    fine = tileable_noise(size, period=64, octaves=3, rng=rng, gain=0.7)
    broad = tileable_noise(size, period=3, octaves=4, rng=rng)
    solid = np.clip(wall.edge_m / 0.003, 0, 1)
    lift = wall.per_block(rng.uniform(-1, 1, rows * columns))
    height = 0.007 * np.clip(wall.edge_m / 0.006, 0, 1) ** 0.6 + 0.0012 * lift * solid + 0.0009 * fine
    textures: Textures = {
        "brick_n": normal_from_height(height, (tile_m, tile_m)),
        "brick_orm": orm(0.55 + 0.45 * solid, 0.86 + 0.06 * fine, 0.0),
    }
    mortar = np.array([0.40, 0.37, 0.32])
    recipes = {
        "brick_red": ([(0.26, 0.075, 0.042), (0.21, 0.058, 0.036), (0.30, 0.10, 0.055), (0.15, 0.045, 0.034)], mortar),
        "brick_brown": (
            [(0.15, 0.072, 0.042), (0.11, 0.05, 0.032), (0.19, 0.10, 0.06), (0.085, 0.045, 0.034)],
            mortar * 0.6,
        ),
        "brick_buff": ([(0.42, 0.31, 0.18), (0.36, 0.26, 0.15), (0.47, 0.36, 0.23), (0.32, 0.21, 0.12)], mortar * 1.05),
    }
    for name, (colours, joint) in recipes.items():
        pick = rng.choice(4, size=rows * columns, p=[0.42, 0.28, 0.2, 0.1])
        shade = wall.per_block(rng.uniform(0.86, 1.12, rows * columns))
        face = np.asarray(colours)[pick][wall.block % (rows * columns)] * (shade * (1 + 0.16 * fine))[..., None]
        albedo = joint * (1 + 0.12 * fine)[..., None] * (1 - solid[..., None]) + face * solid[..., None]
        textures[name] = linear_to_srgb(albedo * (1 + 0.13 * broad)[..., None])
    return textures


def ashlar(*, rng: np.random.Generator) -> Textures:
    """Limestone in large blocks with fine joints, rain streaks and weathering."""
    size, tile_m, rows, columns = 1024, 3.0, 6, 4
    wall = courses(size, tile_m, rows=rows, columns=columns, joint_m=0.008)
    fine = tileable_noise(size, period=128, octaves=3, rng=rng, gain=0.7)
    broad = tileable_noise(size, period=4, octaves=5, rng=rng)
    grain = wrapped_blur(tileable_noise(size, period=64, octaves=3, rng=rng), 1.5)
    solid = np.clip(wall.edge_m / 0.004, 0, 1)
    tone = wall.per_block(rng.uniform(0.9, 1.08, rows * columns))
    stone = np.array([0.50, 0.45, 0.36]) * (tone * (1 + 0.10 * broad + 0.08 * fine))[..., None]
    warm = wall.per_block(rng.uniform(-1, 1, rows * columns))[..., None] * (0.02, 0.0, -0.02)
    albedo = (stone + warm) * (0.62 + 0.38 * solid)[..., None]
    tooled = 0.0007 * grain + 0.0004 * fine
    height = 0.006 * np.clip(wall.edge_m / 0.012, 0, 1) ** 0.7 + tooled
    # Some blocks are of a harder bed than others; weather opens their pores in clouds, and joints are sand.
    bed = wall.per_block(rng.uniform(-0.05, 0.05, rows * columns))
    roughness = rough(0.85, solid * (bed + 0.07 * broad) + 0.10 * (1 - solid))
    return {
        "ashlar": linear_to_srgb(albedo),
        "ashlar_n": normal_from_height(height, (tile_m, tile_m)),
        "ashlar_orm": orm(open_sky(height, tile_m), roughness, 0.0),
    }


def slates(*, rng: np.random.Generator) -> Textures:
    """Roof slates, each course overlapping the one below."""
    size, tile_m, rows, columns = 512, 3.0, 18, 12
    roof = courses(size, tile_m, rows=rows, columns=columns, joint_m=0.006)
    fine = tileable_noise(size, period=64, octaves=3, rng=rng)
    tone = roof.per_block(rng.uniform(0.7, 1.3, rows * columns))
    solid = np.clip(roof.edge_m / 0.006, 0, 1)
    albedo = np.array([0.075, 0.08, 0.09]) * (tone * (1 + 0.15 * fine) * (0.5 + 0.5 * solid))[..., None]
    height = 0.012 * (1 - roof.up) + 0.003 * np.clip(roof.edge_m / 0.01, 0, 1) + 0.001 * fine
    # Rain has polished some slates, lichen has roughened others, most so at their sheltered upper end.
    polish = roof.per_block(rng.uniform(-0.14, 0.12, rows * columns))
    roughness = rough(0.6, solid * (polish + 0.05 * fine + 0.06 * roof.up) + 0.2 * (1 - solid))
    return {
        "slate_roof": linear_to_srgb(albedo),
        "slate_roof_n": normal_from_height(height, (tile_m, tile_m)),
        "slate_roof_orm": orm(_under_laps(roof.up, 0.10) * (0.7 + 0.3 * solid), roughness, 0.0),
    }


def roof_tiles(*, rng: np.random.Generator) -> Textures:
    """Clay pantiles."""
    size, tile_m, rows, columns = 512, 3.0, 10, 14
    roof = courses(size, tile_m, rows=rows, columns=columns, joint_m=0.004, bond=0.0)
    fine = tileable_noise(size, period=32, octaves=4, rng=rng)
    tone = roof.per_block(rng.uniform(0.75, 1.2, rows * columns))
    wave = np.sin(roof.along * 2 * np.pi)
    shade = 0.72 + 0.28 * np.clip(wave * 0.5 + 0.7, 0, 1) * np.clip((1 - roof.up) * 6, 0.35, 1)
    albedo = np.array([0.26, 0.105, 0.062]) * (tone * shade * (1 + 0.2 * fine))[..., None]
    height = 0.03 * wave + 0.03 * (1 - roof.up) + 0.002 * fine
    # Moss and dust lie in the valleys, and each tile was fired at its own heat.
    fired = roof.per_block(rng.uniform(-0.06, 0.06, rows * columns))
    roughness = rough(0.82, fired - 0.05 * wave + 0.06 * fine)
    valley = 1 - 0.16 * np.clip(-wave, 0, 1)
    return {
        "tile_roof": linear_to_srgb(albedo),
        "tile_roof_n": normal_from_height(height, (tile_m, tile_m)),
        "tile_roof_orm": orm(_under_laps(roof.up, 0.10) * valley, roughness, 0.0),
    }


def pavement(*, rng: np.random.Generator) -> Textures:
    """Concrete paving slabs, 0.5 m x 0.5 m in running bond, with stains, gum and worn joints."""
    size, tile_m, rows, columns = 1024, 3.0, 6, 6
    floor = courses(size, tile_m, rows=rows, columns=columns, joint_m=0.007)
    fine = tileable_noise(size, period=256, octaves=2, rng=rng)
    broad = tileable_noise(size, period=4, octaves=5, rng=rng)
    tone = floor.per_block(rng.uniform(0.86, 1.1, rows * columns))
    tilt = floor.per_block(rng.uniform(-1, 1, rows * columns))
    solid = np.clip(floor.edge_m / 0.004, 0, 1)
    chips = np.clip((0.012 - floor.edge_m) / 0.012, 0, 1) * np.clip(broad * 2 - 0.5, 0, 1)
    spots = _spots(size, 26, (3, 8), rng=rng)
    shade = tone * (1 + 0.10 * broad + 0.10 * fine) * (1 - 0.25 * chips) * (1 - 0.35 * spots)
    albedo = np.array([0.37, 0.36, 0.335]) * shade[..., None]
    joint = np.array([0.15, 0.14, 0.12]) * (1 + 0.3 * broad)[..., None]
    albedo = joint * (1 - solid[..., None]) + albedo * solid[..., None]
    height = 0.004 * np.clip(floor.edge_m / 0.008, 0, 1) + 0.0015 * tilt * (floor.along - 0.5) * solid + 0.0006 * fine
    # Soles polish the slabs' faces and leave their rims; gum is smooth.
    worn = floor.per_block(rng.uniform(-0.04, 0.04, rows * columns))
    roughness = rough(0.88, solid * (worn + 0.05 * broad - 0.04 * (1 - chips)) - 0.15 * spots + 0.06 * (1 - solid))
    return {
        "pavement": linear_to_srgb(albedo),
        "pavement_n": normal_from_height(height, (tile_m, tile_m)),
        "pavement_orm": orm(open_sky(height, tile_m), roughness, 0.0),
    }


def cobbles(*, rng: np.random.Generator) -> Textures:
    """Granite setts."""
    size, tile_m, rows, columns = 512, 2.0, 18, 16
    wobble = 0.006 * tileable_noise(size, period=16, octaves=2, rng=rng)
    floor = courses(size, tile_m, rows=rows, columns=columns, joint_m=0.014, wobble=wobble)
    fine = tileable_noise(size, period=64, octaves=3, rng=rng, gain=0.8)
    tone = floor.per_block(rng.uniform(0.7, 1.25, rows * columns))
    solid = np.clip(floor.edge_m / 0.006, 0, 1)
    stone = np.array([0.20, 0.195, 0.19]) * (tone * (1 + 0.2 * fine))[..., None]
    joint = np.array([0.10, 0.09, 0.075]) * (1 + 0.3 * fine)[..., None]
    albedo = joint * (1 - solid[..., None]) + stone * solid[..., None]
    height = 0.012 * np.clip(floor.edge_m / 0.025, 0, 1) ** 0.5 + 0.001 * fine
    # Wheels polish the crowns of the stones.
    crown = np.clip(floor.edge_m / 0.03, 0, 1)
    polish = floor.per_block(rng.uniform(0.5, 1.0, rows * columns))
    roughness = rough(0.85, 0.05 * fine - 0.2 * polish * crown)
    return {
        "cobbles": linear_to_srgb(albedo),
        "cobbles_n": normal_from_height(height, (tile_m, tile_m)),
        "cobbles_orm": orm(open_sky(height, tile_m, strength=2.0), roughness, 0.0),
    }


def tactile(*, rng: np.random.Generator) -> Textures:
    """Tactile paving: off-white slabs of 0.4 m with rows of blisters."""
    size, tile_m = 512, 1.6
    floor = courses(size, tile_m, rows=4, columns=4, joint_m=0.006, bond=0.0)
    fine = tileable_noise(size, period=64, octaves=3, rng=rng)
    pitch = tile_m / 24
    axis = (np.arange(size) + 0.5) / size * tile_m
    local = np.mod(axis, pitch) - pitch / 2
    radius = np.hypot(*np.meshgrid(local, local))
    bump = np.clip((0.0145 - radius) / 0.006, 0, 1)
    tone = floor.per_block(rng.uniform(0.9, 1.08, 16))
    solid = np.clip(floor.edge_m / 0.004, 0, 1)
    shade = tone * (1 + 0.08 * fine) * (0.85 + 0.18 * bump) * (0.5 + 0.5 * solid)
    albedo = np.array([0.52, 0.48, 0.38]) * shade[..., None]
    height = 0.005 * bump + 0.003 * solid
    return {"tactile": linear_to_srgb(albedo), "tactile_n": normal_from_height(height, (tile_m, tile_m))}


def gravel(*, rng: np.random.Generator) -> Textures:
    """Roof gravel: pebbles of many greys."""
    size, tile_m, cells = 512, 2.0, 64
    near, second, stone = worley(size, cells=cells, rng=rng)
    tone = rng.uniform(0.55, 1.35, cells * cells)[stone]
    gap = np.clip((second - near) / 0.35, 0, 1)
    broad = tileable_noise(size, period=4, octaves=3, rng=rng)
    albedo = np.array([0.23, 0.22, 0.20]) * (tone * (0.35 + 0.65 * gap) * (1 + 0.2 * broad))[..., None]
    height = 0.012 * np.sqrt(gap)
    pebble = rng.uniform(-0.08, 0.04, cells * cells)[stone]
    return {
        "roof_gravel": linear_to_srgb(albedo),
        "roof_gravel_n": normal_from_height(height, (tile_m, tile_m)),
        "roof_gravel_orm": orm(0.72 + 0.28 * gap, rough(0.92, pebble * gap), 0.0),
    }


def _under_laps(up: Array, reach: float) -> Array:
    """Occlusion just below the edge of the course above: 0.5 at a block's upper end, 1 from `reach` of it downwards."""
    return np.asarray(1 - 0.5 * np.clip((up - 1 + reach) / reach, 0, 1))


def _spots(size_px: int, count: int, radii_px: tuple[int, int], *, rng: np.random.Generator) -> Array:
    """Small round stains, soft at their edge, wrapped; 0..1."""
    axis = np.arange(size_px)
    result = np.zeros((size_px, size_px))
    for _ in range(count):
        x, y = rng.uniform(0, size_px, 2)
        radius = float(rng.uniform(*radii_px))
        dx = np.abs(axis - x)
        dy = np.abs(axis - y)
        distance = np.hypot(*np.meshgrid(np.minimum(dx, size_px - dx), np.minimum(dy, size_px - dy)))
        result = np.maximum(result, np.clip((radius - distance) / 2, 0, 1) * float(rng.uniform(0.4, 1)))
    return result
