"""Every material of the town: its MJCF attributes, its texture files and how many metres a tile covers."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Material:
    """One physically based MuJoCo material.

    Attributes:
        rgb: stem of the colour texture (sRGB), `<stem>.png` in mjcf/textures.
        normal, orm: stems of the normal and the occlusion/roughness/metalness textures, where it has them.
        tile_m: metres that UV 0..1 covers; 0 for an atlas, whose UVs are rectangles.
        tint: linear factor on the colour texture.
        roughness, metallic: factors; with an ORM texture they are 1, whatever is said here, and the texture decides.
        emission: light of its own, as a share of the texture's colour.
    """

    rgb: str
    tile_m: float
    normal: str | None = None
    orm: str | None = None
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    roughness: float = 0.85
    metallic: float = 0.0
    emission: float = 0.0


MATERIALS: dict[str, Material] = {
    "palette": Material(rgb="palette", orm="palette_orm", tile_m=0),
    # walls
    "brick_red": Material(rgb="brick_red", normal="brick_n", orm="brick_orm", tile_m=2.0),
    "brick_brown": Material(rgb="brick_brown", normal="brick_n", orm="brick_orm", tile_m=2.0),
    "brick_buff": Material(rgb="brick_buff", normal="brick_n", orm="brick_orm", tile_m=2.0),
    "plaster_white": Material(
        rgb="plaster", normal="plaster_n", orm="plaster_orm", tile_m=4.0, tint=(0.92, 0.90, 0.85)
    ),
    "plaster_ochre": Material(
        rgb="plaster", normal="plaster_n", orm="plaster_orm", tile_m=4.0, tint=(0.70, 0.56, 0.36)
    ),
    "plaster_rose": Material(rgb="plaster", normal="plaster_n", orm="plaster_orm", tile_m=4.0, tint=(0.58, 0.38, 0.30)),
    "plaster_cream": Material(
        rgb="plaster", normal="plaster_n", orm="plaster_orm", tile_m=4.0, tint=(0.86, 0.77, 0.58)
    ),
    "plaster_grey": Material(rgb="plaster", normal="plaster_n", orm="plaster_orm", tile_m=4.0, tint=(0.47, 0.50, 0.50)),
    "ashlar": Material(rgb="ashlar", normal="ashlar_n", orm="ashlar_orm", tile_m=3.0),
    "concrete": Material(rgb="concrete", normal="concrete_n", orm="concrete_orm", tile_m=4.0),
    "metal_panel": Material(rgb="metal_panel", normal="metal_panel_n", orm="metal_panel_orm", tile_m=2.0),
    "cladding_white": Material(
        rgb="metal_panel", normal="metal_panel_n", orm="metal_panel_orm", tile_m=2.0, tint=(1.0, 0.99, 0.96)
    ),
    "cladding_blue": Material(
        rgb="metal_panel", normal="metal_panel_n", orm="metal_panel_orm", tile_m=2.0, tint=(0.14, 0.27, 0.46)
    ),
    "cladding_green": Material(
        rgb="metal_panel", normal="metal_panel_n", orm="metal_panel_orm", tile_m=2.0, tint=(0.30, 0.42, 0.32)
    ),
    "containers": Material(rgb="containers", normal="containers_n", orm="containers_orm", tile_m=0),
    "wood": Material(rgb="wood", normal="wood_n", orm="wood_orm", tile_m=2.0),
    "roof_gravel": Material(rgb="roof_gravel", normal="roof_gravel_n", orm="roof_gravel_orm", tile_m=2.0),
    "slate_roof": Material(rgb="slate_roof", normal="slate_roof_n", orm="slate_roof_orm", tile_m=3.0),
    "tile_roof": Material(rgb="tile_roof", normal="tile_roof_n", orm="tile_roof_orm", tile_m=3.0),
    "tile_roof_brown": Material(
        rgb="tile_roof", normal="tile_roof_n", orm="tile_roof_orm", tile_m=3.0, tint=(0.66, 0.66, 0.68)
    ),
    "tile_roof_grey": Material(
        rgb="tile_roof", normal="tile_roof_n", orm="tile_roof_orm", tile_m=3.0, tint=(0.62, 0.92, 1.0)
    ),
    # openings
    "windows": Material(rgb="windows", normal="windows_n", orm="windows_orm", tile_m=0),
    "curtain_wall": Material(rgb="curtain_wall", normal="curtain_wall_n", orm="curtain_wall_orm", tile_m=12.0),
    "shop_fronts": Material(rgb="shop_fronts", normal="shop_fronts_n", orm="shop_fronts_orm", tile_m=0),
    "signs": Material(rgb="signs", tile_m=0, roughness=0.5),
    "awnings": Material(rgb="awnings", tile_m=0, roughness=0.95),
    "far_facades": Material(rgb="far_facades", orm="far_facades_orm", tile_m=0),
    "far_facades_warm": Material(rgb="far_facades", orm="far_facades_orm", tile_m=0, tint=(0.86, 0.74, 0.64)),
    "far_facades_dark": Material(rgb="far_facades", orm="far_facades_orm", tile_m=0, tint=(0.60, 0.62, 0.66)),
    # streets
    "asphalt": Material(rgb="asphalt", normal="asphalt_n", orm="asphalt_orm", tile_m=6.0),
    "asphalt_worn": Material(rgb="asphalt_worn", normal="asphalt_worn_n", orm="asphalt_orm", tile_m=6.0),
    "asphalt_lane": Material(rgb="asphalt_lane", normal="asphalt_n", orm="asphalt_orm", tile_m=6.0),
    "asphalt_lane_end": Material(rgb="asphalt_lane_end", normal="asphalt_n", orm="asphalt_orm", tile_m=6.0),
    "asphalt_fresh": Material(
        rgb="asphalt", normal="asphalt_n", orm="asphalt_orm", tile_m=6.0, tint=(0.53, 0.53, 0.55)
    ),
    "asphalt_patch": Material(
        rgb="asphalt", normal="asphalt_n", orm="asphalt_orm", tile_m=6.0, tint=(0.76, 0.75, 0.74)
    ),
    "asphalt_seal": Material(rgb="asphalt", orm="asphalt_orm", tile_m=6.0, tint=(0.32, 0.32, 0.33)),
    "pavement": Material(rgb="pavement", normal="pavement_n", orm="pavement_orm", tile_m=3.0),
    "cobbles": Material(rgb="cobbles", normal="cobbles_n", orm="cobbles_orm", tile_m=2.0),
    "tactile": Material(rgb="tactile", normal="tactile_n", tile_m=1.6, roughness=0.8),
    "kerb": Material(rgb="kerb", normal="concrete_n", orm="concrete_orm", tile_m=2.0),
    "road_paint_white": Material(rgb="road_paint", tile_m=2.0, roughness=0.7),
    "road_paint_yellow": Material(rgb="road_paint", tile_m=2.0, tint=(0.95, 0.58, 0.06), roughness=0.7),
    "ironwork": Material(rgb="ironwork", normal="ironwork_n", tile_m=0, roughness=0.55, metallic=0.4),
    "grass": Material(rgb="grass", normal="grass_n", tile_m=4.0, roughness=0.95),
    "soil": Material(rgb="soil", normal="soil_n", tile_m=3.0, roughness=1.0),
    # vegetation
    "bark": Material(rgb="bark", normal="bark_n", tile_m=1.0, roughness=0.95),
    "foliage_green": Material(rgb="foliage", normal="foliage_n", tile_m=1.6, tint=(0.62, 0.78, 0.36), roughness=1.0),
    "foliage_light": Material(rgb="foliage", normal="foliage_n", tile_m=1.6, tint=(0.86, 0.92, 0.42), roughness=1.0),
    "foliage_dark": Material(rgb="foliage", normal="foliage_n", tile_m=1.6, tint=(0.42, 0.58, 0.34), roughness=1.0),
    "foliage_olive": Material(rgb="foliage", normal="foliage_n", tile_m=1.6, tint=(0.74, 0.70, 0.40), roughness=1.0),
    # street furniture
    "traffic_signs": Material(rgb="traffic_signs", tile_m=0, roughness=0.45),
    "direction_signs": Material(rgb="direction_signs", tile_m=0, roughness=0.45),
    "lenses": Material(rgb="lenses", tile_m=0, roughness=0.3, emission=1.0),
}


def material_xml(names: list[str], *, texture_dir: str = "../textures") -> str:
    """The `<texture>` and `<material>` elements of some materials, to paste into an `<asset>`.

    Args:
        names: of `MATERIALS`; each comes out once, in the registry's order, however often it is asked for.
        texture_dir: where the PNGs are, relative to the MJCF file (or to its `texturedir`).
    """
    unknown = sorted(set(names) - set(MATERIALS))
    if unknown:
        raise ValueError(f"no material named {', '.join(map(repr, unknown))}; there are {', '.join(MATERIALS)}")
    chosen = {name: material for name, material in MATERIALS.items() if name in names}
    colours = {material.rgb for material in chosen.values()}
    maps = {stem for material in chosen.values() for stem in (material.normal, material.orm) if stem}
    prefix = f"{texture_dir}/" if texture_dir else ""
    lines = [
        f'<texture name="{stem}" type="2d" colorspace="{"sRGB" if stem in colours else "linear"}" '
        f'file="{prefix}{stem}.png"/>'
        for stem in sorted(colours | maps)
    ]
    for name, material in chosen.items():
        tint = " ".join(f"{channel:g}" for channel in material.tint)
        roughness, metallic = (1.0, 1.0) if material.orm else (material.roughness, material.metallic)
        emission = f' emission="{material.emission:g}"' if material.emission else ""
        layers = "".join(
            f'<layer role="{role}" texture="{stem}"/>'
            for role, stem in (
                ("rgb", material.rgb),
                ("normal", material.normal),
                ("orm", material.orm),
                ("emissive", material.rgb if material.emission else None),
            )
            if stem
        )
        lines.append(
            f'<material name="{name}" rgba="{tint} 1" metallic="{metallic:g}" roughness="{roughness:g}"{emission}>'
            f"{layers}</material>"
        )
    return "\n".join(lines)
