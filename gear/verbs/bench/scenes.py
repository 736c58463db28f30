"""The scenes of a benchmark, and error messages that name the line of the bench config."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from gear.collecting.lookup import find_scenes
from gear.config.nodes import Mapping, Node, Place
from gear.values.errors import ConfigError, GearError
from gear.verbs.bench.config import BenchConfig
from gear.world.assets.library import AssetLibrary
from gear.world.scene_spec import SceneSpec
from gear.world.surfaces.surface_carriers import check_scene_assets


@dataclass(frozen=True, slots=True, kw_only=True)
class Scene:
    """One scene of a town.

    Attributes:
        town: name of the town, or path of its MJCF file.
        name: name in the town's own scene library, or file and name of another library, such as `my.yml:corner`.
        surfaces: number of surfaces that can show patches.
    """

    town: str
    name: str
    surfaces: int

    @property
    def label(self) -> str:
        """Name of the scene in folders and tables: `<town>-<scene>`."""
        return f"{Path(self.town).stem}-{self.name.rpartition(':')[2]}"


def measured_scenes(config: BenchConfig, node: Node) -> tuple[Scene, ...]:
    """Returns all scenes in which networks are measured, in the order of the config.

    Args:
        config: the bench config.
        node: the YAML nodes of the config, for positions in error messages.

    Raises:
        ConfigError: a town or a scene is unknown, a scene has no surface for patches, or a scene is named twice.
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
    """Returns the scene in which defenses are calibrated; None if the config names none.

    Args:
        config: the bench config.
        node: the YAML nodes of the config, for positions in error messages.
        measured: scenes in which networks are measured.

    Raises:
        ConfigError: the scene is unknown, has no surface for patches, or is one of the measured scenes.
    """
    if config.calibration is None:
        return None
    try:
        (one,) = _named(config.calibration.town, (config.calibration.scene,))
        if one.label in [other.label for other in measured]:
            raise GearError(f"scene {one.name!r} is also a measured scene; calibrate the defense on another one")
    except ConfigError:
        raise
    except GearError as error:
        raise located(node, error, "calibration", "scene") from error
    return one


def _named(town: str, names: tuple[str, ...]) -> Iterator[Scene]:
    """Yields the named scenes of a town; if none is named, all of its scenes with surfaces for patches."""
    library = AssetLibrary.for_town(town)
    if not names:
        own = find_scenes(library)
        for error in own.faulty.values():
            raise error
        names = tuple(name for name, scene in own.scenes.items() if _surfaces(scene))
    for name in names:
        path, _, bare = name.rpartition(":")
        scene = find_scenes(library, path).scene(bare)
        if not _surfaces(scene):
            raise GearError(f"scene {bare!r} has neither a board nor the truck, so no patch would be seen")
        check_scene_assets(library, scene, f"scenes.{bare}")
        yield Scene(town=town, name=name, surfaces=_surfaces(scene))


def _surfaces(scene: SceneSpec) -> int:
    return len(scene.boards) + (scene.truck is not None)


def place_of(node: Node, *path: str) -> Place:
    """Returns the position (file and line) of a key in the config file; if the key is missing, that of the nearest
    existing key above.

    Args:
        node: the YAML nodes of the config.
        *path: keys from the outermost to the innermost, such as `"places", "town10"`.
    """
    place = node.place
    for key in path:
        if not isinstance(node, Mapping) or key not in node.entries:
            break
        place, node = node.entries[key]
    return place


def located(node: Node, error: GearError, *path: str) -> GearError:
    """Returns the error with the position in the config file (file and line) of the key that `path` names.

    Args:
        node: the YAML nodes of the config.
        error: the error without a position.
        *path: keys from the outermost to the innermost, such as `"places", "town10"`.
    """
    return place_of(node, *path).error(".".join(path), str(error))
