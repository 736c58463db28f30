"""Where a bench takes place, and where in its file something is said."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from gear.collecting.lookup import find_scenes
from gear.config.nodes import Mapping, Node, Place
from gear.values.errors import ConfigError, GearError, UnknownNameError
from gear.verbs.bench.config import BenchConfig
from gear.world.assets.library import AssetLibrary
from gear.world.scene_spec import SceneSpec
from gear.world.surfaces.surface_carriers import check_scene_assets


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """One scene of a town.

    Attributes:
        town: its name, or its file.
        name: the scene's name in the town's own library, or a library's file and a name in it, `my.yml:corner`.
        surfaces: how many patches it shows.
    """

    town: str
    name: str
    surfaces: int

    @property
    def label(self) -> str:
        """Of folders and rows."""
        return f"{Path(self.town).stem}-{self.name.rpartition(':')[2]}"


def measured_scenes(config: BenchConfig, node: Node) -> tuple[Scene, ...]:
    """All scenes that the bench measures in, in its order.

    Raises:
        ConfigError: a town or a scene is not known, has nothing that shows a patch, or is named twice.
    """
    found: dict[str, Scene] = {}
    for town, names in config.places.items():
        key = ("places", town)
        try:
            for one in _named(town, names):
                if one.label in found:
                    raise GearError(f"scene {one.name!r} is named twice")
                found[one.label] = one
        except ConfigError:
            raise
        except GearError as error:
            raise located(node, error, *key) from error
    return tuple(found.values())


def calibration_scene(config: BenchConfig, node: Node, measured: tuple[Scene, ...]) -> Scene | None:
    """The scene that defenses learn from, if one is named.

    Raises:
        ConfigError: it is not known, shows no patch, or is one of those that are measured.
    """
    if config.calibration is None:
        return None
    try:
        (one,) = _named(config.calibration.town, (config.calibration.scene,))
        if one.label in [other.label for other in measured]:
            raise GearError(f"scene {one.name!r} is measured in, too; what a defense has seen, it finds more easily")
    except ConfigError:
        raise
    except GearError as error:
        raise located(node, error, "calibration", "scene") from error
    return one


def _named(town: str, names: tuple[str, ...]) -> Iterator[Scene]:
    """Those scenes of a town; all of its own that show patches, where none is named."""
    library = AssetLibrary.for_town(town)
    own = None if all(":" in name for name in names) and names else find_scenes(library).scenes
    for name in names or [name for name, scene in (own or {}).items() if _surfaces(scene)]:
        path, _, bare = name.rpartition(":")
        known = find_scenes(library, path).scenes if path else own or {}
        if bare not in known:
            raise UnknownNameError(f"scene of {path or town}", bare, known)
        if not _surfaces(known[bare]):
            raise GearError(f"scene {bare!r} has neither a board nor the truck, so no patch would be seen")
        check_scene_assets(library, known[bare], f"scenes.{bare}")
        yield Scene(town=town, name=name, surfaces=_surfaces(known[bare]))


def _surfaces(scene: SceneSpec) -> int:
    return len(scene.boards) + (scene.truck is not None)


def place_of(node: Node, *path: str) -> Place:
    """Where a key stands, or the nearest one above it that is there."""
    place = node.place
    for key in path:
        if not isinstance(node, Mapping) or key not in node.entries:
            break
        place, node = node.entries[key]
    return place


def located(node: Node, error: GearError, *path: str) -> GearError:
    """An error with the place in the file that it is about."""
    return place_of(node, *path).error(".".join(path), str(error))
