"""Checks that a town has the boards and the truck that a scene names."""

from __future__ import annotations

from gear.config.reader import located_errors
from gear.world.assets.library import AssetLibrary
from gear.world.scene_spec import SceneSpec


def check_scene_assets(library: AssetLibrary, scene: SceneSpec, key: str) -> None:
    """Checks that a town has the assets that carry the surfaces of a scene.

    Args:
        library: of the town.
        scene: names the assets.
        key: key of the scene in its file, such as `scenes.corner`.

    Raises:
        UnknownNameError: the town has no such board or truck.
        ConfigError: the same, with the place in the file that names the asset.
    """
    for number, board in enumerate(scene.boards):
        with located_errors(board.places, "asset", f"{key}.boards[{number}]"):
            library.path("surface", board.asset)
    if scene.truck is not None:
        with located_errors(scene.truck.places, "asset", f"{key}.truck"):
            library.path("vehicle", scene.truck.asset)
