"""A scene names boards and a truck that its town has."""

from __future__ import annotations

import dataclasses

import pytest

from gear.config.nodes import Place
from gear.testing.tiny_town import TINY_TOWN, tiny_scenes
from gear.values.errors import ConfigError, UnknownNameError
from gear.world.assets.library import AssetLibrary
from gear.world.scene_spec import SceneSpec, TruckSpec
from gear.world.surfaces.surface_carriers import check_scene_assets

LIBRARY = AssetLibrary.for_town(TINY_TOWN)


@pytest.mark.parametrize("name", ["board", "double", "truck", "no_billboard"])
def test_the_tiny_towns_scenes_name_what_is_there(name: str) -> None:
    check_scene_assets(LIBRARY, tiny_scenes().scenes[name], f"scenes.{name}")


def test_the_error_names_the_asset_and_its_place() -> None:
    truck = SceneSpec(truck=TruckSpec(asset="truck_bx"))
    with pytest.raises(UnknownNameError, match="no vehicle named 'truck_bx'; did you mean truck_box"):
        check_scene_assets(LIBRARY, truck, "scenes.one")
    placed = TruckSpec(asset="truck_bx", places={"asset": Place("my.yml", 7, 3)})
    with pytest.raises(ConfigError, match=r"my\.yml:7:3: scenes\.one\.truck\.asset: .*truck_bx"):
        check_scene_assets(LIBRARY, SceneSpec(truck=placed), "scenes.one")
    board = tiny_scenes().scenes["board"]
    broken = dataclasses.replace(board, boards=(dataclasses.replace(board.boards[0], asset="nowhere", places={}),))
    with pytest.raises(UnknownNameError, match="no surface named 'nowhere'"):
        check_scene_assets(LIBRARY, broken, "scenes.one")
