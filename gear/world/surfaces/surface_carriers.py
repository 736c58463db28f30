"""What bears the surfaces of a scene, by the names that its library gives it."""

from __future__ import annotations

from gear.config.reader import located_errors
from gear.world.assets.library import AssetLibrary
from gear.world.scene_spec import SceneSpec


def check_scene_assets(library: AssetLibrary, scene: SceneSpec, key: str) -> None:
    """Whether a town has the boards and the truck of a scene; `key` is where that stands in its library.

    Raises:
        UnknownNameError: one is not there.
        ConfigError: likewise, where a file names it.
    """
    for number, board in enumerate(scene.boards):
        with located_errors(board.places, "asset", f"{key}.boards[{number}]"):
            library.path("surface", board.asset)
    if scene.truck is not None:
        with located_errors(scene.truck.places, "asset", f"{key}.truck"):
            library.path("vehicle", scene.truck.asset)
