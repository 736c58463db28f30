"""Checks that a town has the boards and the truck that a scene uses."""

from __future__ import annotations

from gear.config.reader import located_errors
from gear.world.assets.library import AssetLibrary
from gear.world.scene_spec import SceneSpec


def check_scene_assets(library: AssetLibrary, scene: SceneSpec, key: str) -> None:
    """Checks that a town has the boards or the truck of a scene.

    Args:
        library: library of the town.
        scene: the scene, which names the assets.
        key: key of the scene in its file, such as `scenes.corner`, for error messages.

    Raises:
        UnknownNameError: the town has no such board or truck.
        ConfigError: the town has no such board or truck, and the line of the scene file that names it is known.
    """
    for number, board in enumerate(scene.boards):
        with located_errors(board.places, "asset", f"{key}.boards[{number}]"):
            library.path("surface", board.asset)
    if scene.truck is not None:
        with located_errors(scene.truck.places, "asset", f"{key}.truck"):
            library.path("vehicle", scene.truck.asset)
