"""A board whose scene gives it a size: models, records and ground truth have it, and a patch covers it."""

from __future__ import annotations

import dataclasses
import shutil
from pathlib import Path

import numpy as np
import pytest

from gear.config.collection import SplitConfig
from gear.testing.tiny_town import CLEAR, SMALL_RIG, TINY_TOWN, tiny_scenes
from gear.values.errors import FieldError, TownError
from gear.world.assets.library import AssetLibrary
from gear.world.planner import ScenePlanner
from gear.world.scene_spec import BoardSpec, SceneSpec
from gear.world.surfaces.face_size import asset_face_size_m
from gear.world.world import World

SIZE_M = (4.0, 3.0)


def sized(scene: SceneSpec, size_m: tuple[float, float], number: int = 0) -> SceneSpec:
    boards = list(scene.boards)
    boards[number] = dataclasses.replace(boards[number], size_m=size_m)
    return dataclasses.replace(scene, boards=tuple(boards))


def build(scene: SceneSpec, town: Path = TINY_TOWN) -> World:
    return World.build(town=town, scene_name="board", scene=scene, weather=CLEAR)


@pytest.mark.parametrize("town", [TINY_TOWN, "own"])
def test_the_face_has_the_size_of_the_scene(town: Path | str, tmp_path: Path) -> None:
    """Both a board of boxes and gear's own, which is made of meshes."""
    if town == "own":
        shutil.copytree(TINY_TOWN.parents[1], tmp_path, dirs_exist_ok=True)
        shutil.rmtree(tmp_path / "surfaces")
        shutil.copytree(AssetLibrary.for_town("town10").folder("surface"), tmp_path / "surfaces")
        town = tmp_path / "towns" / "tiny.xml"
    scene = tiny_scenes().scenes["double"]
    plain, world = build(scene, Path(town)), build(sized(scene, SIZE_M, 1), Path(town))
    for before, face, size_m in zip(plain.faces, world.faces, [(7.4, 3.7), SIZE_M], strict=True):
        assert (face.width_m, face.height_m) == pytest.approx(size_m, abs=0.01)
        assert face.asset == before.asset == "billboard"
        # The board stands where it stood, and its face hangs in proportion.
        old, new = before.parent_from_surface, face.parent_from_surface
        np.testing.assert_allclose(new.translation_m[:2], old.translation_m[:2], atol=1e-6)
        share = face.height_m / before.height_m
        assert new.translation_m[2] == pytest.approx(share * old.translation_m[2], abs=0.01)
    surface = world.surface_records()[1]
    assert (surface.width_m, surface.height_m) == SIZE_M


def test_the_collision_geoms_are_scaled_too() -> None:
    scene = tiny_scenes().scenes["board"]
    plain, world = build(scene), build(sized(scene, (3.7, 1.85)))

    board, post = (world.placement_model.geom(f"board_0_{name}") for name in ("board", "stand"))
    old_board, old_post = (plain.placement_model.geom(f"board_0_{name}") for name in ("board", "stand"))
    np.testing.assert_allclose(board.size, old_board.size * (1.0, 0.5, 0.5))
    np.testing.assert_allclose(board.pos, old_board.pos * (1.0, 0.5, 0.5))
    np.testing.assert_allclose(post.size[:2], old_post.size[:2] * (1.0, 0.5))


def test_the_ego_car_sees_the_face_that_is_there() -> None:
    """A smaller face covers fewer pixels, in the share of its area."""
    scene = tiny_scenes().scenes["board"]
    record = ScenePlanner(build(scene), SMALL_RIG, SplitConfig(seed=0, samples=1), split_name="debug").plan(0)
    world = build(sized(scene, (3.7, 1.85)))
    (surface,) = ScenePlanner(world, SMALL_RIG, SplitConfig(seed=0, samples=1), split_name="debug").plan(0).surfaces
    (full,) = record.surfaces
    assert surface.width_m * surface.height_m == pytest.approx(full.width_m * full.height_m / 4, rel=1e-3)


@pytest.mark.parametrize("size_m", [(0.01, 3.0), (4.0, 200.0), (-1.0, 1.0), (float("nan"), 1.0)])
def test_sizes_of_no_board_are_refused(size_m: tuple[float, float]) -> None:
    with pytest.raises(FieldError, match=r"size_m: must be a width and a height of 0\.1 to 100 m"):
        BoardSpec(position_m=(0.0, 0.0, 0.0), facing_deg=0.0, size_m=size_m)


@pytest.mark.parametrize(
    ("part", "reason"),
    [
        ('<body name="arm" pos="0 0 1" zaxis="0 1 0"/>', "body 'arm' is turned"),
        ('<geom name="arm" class="collision" size="1 1 1" euler="0 0 30"/>', "geom 'arm' is turned"),
    ],
)
def test_what_cannot_be_scaled_is_refused(part: str, reason: str, tmp_path: Path) -> None:
    shutil.copytree(TINY_TOWN.parents[1], tmp_path, dirs_exist_ok=True)
    board = tmp_path / "surfaces" / "billboard.xml"
    text = board.read_text()
    board.write_text(text.replace("</body>", f"{part}</body>", 1))
    town = tmp_path / "towns" / "tiny.xml"
    scene = tiny_scenes().scenes["board"]
    assert build(scene, town).faces
    with pytest.raises(TownError, match=f"billboard.xml: cannot be given a size_m, since {reason}"):
        build(sized(scene, SIZE_M), town)


def test_the_size_in_the_file_is_kept_without_one() -> None:
    face = build(tiny_scenes().scenes["board"]).faces[0]
    path = AssetLibrary.for_town(TINY_TOWN).path("surface", "billboard")
    assert (face.width_m, face.height_m) == pytest.approx(asset_face_size_m(path), abs=1e-6)
