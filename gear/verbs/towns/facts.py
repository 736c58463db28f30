"""Reads the metadata of towns and their scenes quickly, without compiling meshes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from gear.collecting.lookup import find_scenes
from gear.values.errors import GearError, UnknownNameError
from gear.values.resources import data_dir
from gear.values.serial import Json, to_json
from gear.world.assets.library import AssetLibrary
from gear.world.roads.lanes import LaneGraph
from gear.world.roads.read_lanes import read_lanes
from gear.world.scene_spec import SceneLibrary
from gear.world.surfaces.surface_carriers import check_scene_assets


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Town:
    """A town with its scenes.

    Attributes:
        library: the town's MJCF file and the folders of its assets.
        lanes: the town's lanes, walks and parking bays.
        scenes: the usable scenes of the town; None if the town has no scene library.
        faulty: errors of the unusable scenes, by name of the scene.
    """

    library: AssetLibrary
    lanes: LaneGraph
    scenes: SceneLibrary | None
    faulty: Mapping[str, GearError] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """Name of the town: the name of its MJCF file without the suffix."""
        return self.library.town_name

    @property
    def size_m(self) -> tuple[float, float]:
        """Size of the town in metres, (west to east, south to north)."""
        xmin, ymin, xmax, ymax = self.lanes.bounds_m
        return xmax - xmin, ymax - ymin

    @property
    def lane_km(self) -> float:
        """Total length of all lanes in kilometres, lanes in junctions included."""
        return sum(lane.line.length_m for lane in self.lanes.lanes.values()) / 1000

    def to_json(self) -> Json:
        """Returns the town as JSON: `name`, `path`, `bounds_m`, numbers of lanes, walks and parking bays, `scenes` with
        all their fields, and `faulty_scenes` with their errors.
        """
        scenes = {} if self.scenes is None else self.scenes.scenes
        return {
            "name": self.name,
            "path": str(self.library.town),
            "bounds_m": list(self.lanes.bounds_m),
            "lanes": len(self.lanes.lanes),
            "junction_lanes": sum(lane.is_junction for lane in self.lanes.lanes.values()),
            "lane_km": round(self.lane_km, 3),
            "walks": len(self.lanes.walks),
            "parking_bays": len(self.lanes.bays),
            "scenes": {name: to_json(scene) for name, scene in scenes.items()},
            "faulty_scenes": {name: str(error) for name, error in self.faulty.items()},
        }


def town_names() -> list[str]:
    """Returns the names of the towns that are part of gear."""
    return sorted(path.stem for path in (data_dir("mjcf") / "towns").glob("*.xml"))


def towns() -> tuple[Town, ...]:
    """Returns the towns that are part of gear, with their scenes; no mesh is compiled, so the call is quick."""
    return tuple(read_town(name) for name in town_names())


def read_town(town: str | Path, scenes: str | Path | None = None) -> Town:
    """Reads the lanes and the scenes of a town.

    Args:
        town: name of the town, or path of its MJCF file.
        scenes: path or name of the town's scene library; None takes the library that is part of gear.

    Raises:
        UnknownNameError: there is no such town or file.
        TownError: the MJCF file breaks gear's conventions for towns.
        ConfigError: no scene of the library is usable, or the library is for another town.
    """
    library = AssetLibrary.for_town(town)
    usable, faulty = _scenes(library, scenes)
    return Town(library=library, lanes=read_lanes(library.town), scenes=usable, faulty=faulty)


def _scenes(library: AssetLibrary, given: str | Path | None) -> tuple[SceneLibrary | None, dict[str, GearError]]:
    """Returns the usable scenes, and the errors of scenes that cannot be read or that name missing assets."""
    try:
        file = find_scenes(library, "" if given is None else str(given))
    except UnknownNameError:
        if given is None:
            return None, {}
        raise
    faulty: dict[str, GearError] = dict(file.faulty)
    for name, scene in file.scenes.items():
        try:
            check_scene_assets(library, scene, f"scenes.{name}")
        except GearError as error:
            faulty[name] = error
    if len(faulty) == len(file.names):
        raise next(iter(faulty.values()))
    usable = {name: scene for name, scene in file.scenes.items() if name not in faulty}
    return replace(file.library, scenes=usable), faulty
