"""Reads the metadata of one scene's assets (size, kind, colours) from their MJCF files, before the world is
composed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from gear.values.errors import TownError
from gear.world.assets.library import ActorFacts, AssetLibrary
from gear.world.scene_spec import SceneSpec

EGO_ASSET = "car_saloon"
"""Name of the ego car's MJCF file in `mjcf/vehicles`."""


@dataclass(frozen=True, slots=True)
class AssetFile:
    """An MJCF file of an asset, with the size that one world gives to it.

    Attributes:
        path: path of the file.
        face_size_m: width and height to which the board's face is scaled; None keeps the size in the file.
    """

    path: Path
    face_size_m: tuple[float, float] | None = None

    @property
    def name(self) -> str:
        """Name of the asset's model in a composed world: the file's name without suffix, followed by the size if the
        asset is scaled.
        """
        if self.face_size_m is None:
            return self.path.stem
        return "{}_{:g}x{:g}m".format(self.path.stem, *self.face_size_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneAssets:
    """The assets of one scene: their paths, and the metadata in their files.

    Attributes:
        library: the town's MJCF file and the folders of its assets.
        boards: the file of each board, in patch order.
        vehicles: vehicles by name, in alphabetical order; their weights are multiplied by the factors of the scene's
            mix.
        pedestrians: people by name, in alphabetical order.
        ego: the ego car.
        carrier: the vehicle that carries the patch; None in a scene without a truck.
    """

    library: AssetLibrary
    boards: tuple[AssetFile, ...]
    vehicles: Mapping[str, ActorFacts]
    pedestrians: Mapping[str, ActorFacts]
    ego: ActorFacts
    carrier: ActorFacts | None


def read_scene_assets(library: AssetLibrary, scene: SceneSpec) -> SceneAssets:
    """Finds the assets of a scene and reads their metadata.

    Args:
        library: the asset library of the town.
        scene: the scene, which names its boards or truck and the mix of vehicles.

    Raises:
        UnknownNameError: the town has no such board or truck, or no ego car.
        TownError: an actor's file breaks the conventions, or a vehicle and a pedestrian have the same name.
    """
    for name in library.vehicles.keys() & library.pedestrians.keys():
        problem = f"has the name of {library.pedestrians[name].path}, so records could not tell them apart; rename one"
        raise TownError(library.vehicles[name].path, problem)
    library.path("vehicle", EGO_ASSET)
    if scene.truck is not None:
        library.path("vehicle", scene.truck.asset)
    mix = scene.npc_vehicles.mix
    vehicles = {
        name: replace(facts, weight=facts.weight * mix.get(facts.kind, 1.0)) for name, facts in library.vehicles.items()
    }
    return SceneAssets(
        library=library,
        boards=tuple(AssetFile(library.path("surface", board.asset), board.size_m) for board in scene.boards),
        vehicles=vehicles,
        pedestrians=library.pedestrians,
        ego=vehicles[EGO_ASSET],
        carrier=None if scene.truck is None else vehicles[scene.truck.asset],
    )
