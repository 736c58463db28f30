"""Textures: walls have every map, ORM says what it should, normal maps have one frame, PNGs are small and whole."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
import pytest

from authoring import kit
from authoring.materials import MATERIALS, glazing, masonry
from authoring.materials.build import TEXTURES
from authoring.materials.image import Image, normal_from_height, normal_from_slopes, open_sky
from authoring.materials.png import HARMLESS_ERROR, PALETTES, few_colours, write_png
from gear.values.rng import derive_rng

# What facades wear that is print, cloth or a plain colour.
FLAT = {"palette", "signs", "awnings"}
# Mean roughness of what has no metal.
ROUGHNESS = {
    "plaster_orm": 0.85, "ashlar_orm": 0.85, "concrete_orm": 0.85, "slate_roof_orm": 0.6, "tile_roof_orm": 0.82,
    "wood_orm": 0.75, "roof_gravel_orm": 0.95, "pavement_orm": 0.88, "cobbles_orm": 0.85, "containers_orm": 0.6,
}  # fmt: skip


def rgb(stem: str) -> Image:
    """(H, W, 3) of a texture as shipped."""
    bgr = cv2.imread(str(TEXTURES / f"{stem}.png"))
    assert bgr is not None
    return np.ascontiguousarray(bgr[..., ::-1], np.uint8)


def worn_by_buildings() -> set[str]:
    """Materials of near buildings of every style."""
    return {
        part.material
        for style in kit.STYLES
        for seed in range(3)
        for part in kit.building(
            style=style, width_m=20.0, depth_m=14.0, floors=5, rng=derive_rng(seed, style), sides=("front", "back")
        )
    }


def test_all_materials_of_facades_have_normal_roughness_and_occlusion_maps() -> None:
    worn = worn_by_buildings() - FLAT
    assert {"brick_red", "ashlar", "windows", "shop_fronts", "curtain_wall"} <= worn
    assert not [name for name in worn if MATERIALS[name].normal is None or MATERIALS[name].orm is None]


def test_all_walls_and_roofs_have_these_maps() -> None:
    walls = ("brick", "plaster", "ashlar", "concrete", "metal_panel", "cladding", "wood", "slate", "tile", "containers")
    names = [name for name in MATERIALS if name.startswith(walls)]
    assert len(names) > 15
    assert not [name for name in names if MATERIALS[name].normal is None or MATERIALS[name].orm is None]


@pytest.mark.parametrize("stem", list(ROUGHNESS))
def test_orm_is_as_rough_as_the_material_open_to_the_sky_and_no_metal(stem: str) -> None:
    occlusion, roughness, metalness = (rgb(stem)[..., channel] / 255 for channel in range(3))
    assert roughness.mean() == pytest.approx(ROUGHNESS[stem], abs=0.05)
    assert 0.3 < roughness.min() < roughness.max()
    assert roughness.std() > 0.01
    assert 0.88 < occlusion.mean() <= 1
    assert occlusion.min() > 0.3
    assert not metalness.any()


def test_joints_see_less_of_the_sky_than_what_stands_out() -> None:
    height_m = np.full((64, 64), 0.006)
    height_m[31:33] = 0
    sky = open_sky(height_m, 0.4)
    assert sky[31].max() < 0.6
    assert sky[10].min() == 1
    assert np.all(open_sky(np.zeros((16, 16)), 1.0) == 1)


def test_red_leans_to_the_right_and_green_up() -> None:
    rising = normal_from_slopes(np.full((1, 1), 0.5), np.full((1, 1), -0.25))[0, 0].astype(int)
    assert rising[0] < 75 and rising[1] > 150 and rising[2] > 220


def test_what_rises_upwards_leans_down() -> None:
    """Row 0 is the texture's top."""
    height_m = 0.1 * np.sin(np.linspace(0, 2 * np.pi, 64, endpoint=False))[:, None] * np.ones((1, 64))
    normal = normal_from_height(height_m, (1.0, 1.0))
    assert normal[0, 0, 1] > 140  # it falls upwards here, so that it faces up
    assert normal[32, 0, 1] < 115
    assert np.ptp(normal[..., 0]) == 0


def test_panes_lean_each_its_own_way_and_are_flat() -> None:
    normal = glazing.windows(rng=np.random.default_rng(0))["windows_n"]
    # The lower left and the lower right pane of sash windows.
    panes = [normal[420:490, 128 * k + x : 128 * k + x + 20, :2] for k in range(8) for x in (22, 80)]
    assert all(np.ptp(pane, axis=(0, 1)).max() == 0 for pane in panes)
    leans = np.array([pane[0, 0] for pane in panes], int)
    assert len(np.unique(leans, axis=0)) > 8
    assert np.abs(leans - 127.5).max() < 4


def test_painting_and_writing_again_give_the_same_bytes_each_time(tmp_path: Path) -> None:
    for name in ("a", "b"):
        painted = masonry.roof_tiles(rng=derive_rng(0, "textures", "roof_tiles"))
        for stem, image in painted.items():
            write_png(tmp_path / f"{stem}_{name}.png", image)
    for stem in painted:
        assert (tmp_path / f"{stem}_a.png").read_bytes() == (tmp_path / f"{stem}_b.png").read_bytes()


@pytest.mark.parametrize("kind", ["noise", "few", "one"])
def test_written_pictures_read_as_their_few_colours(tmp_path: Path, kind: str) -> None:
    rng = np.random.default_rng(1)
    spread = {"noise": 255, "few": 3, "one": 1}[kind]
    image = rng.integers(0, spread, (48, 80, 3)).astype(np.uint8)
    indices, colours = few_colours(image)
    write_png(tmp_path / "a.png", image)
    read = cv2.imread(str(tmp_path / "a.png"))
    assert read is not None
    np.testing.assert_array_equal(read[..., ::-1], colours[indices])
    error = float(np.sqrt(((colours[indices].astype(float) - image) ** 2).mean()))
    assert error <= HARMLESS_ERROR or len(colours) > PALETTES[-2]
    assert np.all(np.diff(colours.astype(int) @ (299, 587, 114)) >= 0)


def test_pictures_are_packed_smaller_than_pillow_packs_them(tmp_path: Path) -> None:
    from PIL import Image as PillowImage

    image = rgb("asphalt")[:256, :256]
    write_png(tmp_path / "own.png", image)
    PillowImage.fromarray(image).quantize(256).save(tmp_path / "other.png", optimize=True)
    assert (tmp_path / "own.png").stat().st_size < (tmp_path / "other.png").stat().st_size
