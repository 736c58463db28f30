"""One MJCF out of many: a town, its boards, and a pool of actors.

dm_control.mjcf keeps the names of different files apart; what stands in a town goes around it as it is. Every asset's
file is attached once, for its meshes, textures and materials; each instance is a body whose geoms refer to those, so
ten equal cars cost one mesh. Only faces that take a patch get a material and a texture of their own.
"""

from __future__ import annotations

import copy
import math
import os
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from gear.values.errors import TownError
from gear.values.scene import Weather
from gear.world.assets.library import ActorFacts, AssetLibrary
from gear.world.compilation.asset_prefetch import AssetPrefetcher
from gear.world.compilation.instances import AssetInstances, FaceNames, load_mjcf
from gear.world.compilation.quiet_mjcf import mjcf
from gear.world.compilation.static_parts import MeshPath, StaticParts, split_town
from gear.world.scene_spec import BoardSpec
from gear.world.weather.light import Lighting, lighting_of
from gear.world.weather.presets import apply_weather

PARKED_DEPTH_M = 60.0
"""Actors of the pool that a sample does not use wait this far below the town, under its ground."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Slot:
    """One place of the pool: an instance of an actor that samples may use.

    Attributes:
        body: its body in both models.
        actor: what it is an instance of.
        carries_surface: whether its face has a texture of its own.
    """

    body: str
    actor: ActorFacts
    carries_surface: bool = False


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Composition:
    """A composed world, not yet compiled.

    Attributes:
        tree: the whole of it as MJCF.
        assets: files that it refers to, by name; of meshes, where they lie.
        folder: where those of them lie that are no longer in `assets`.
        town: path of the town's MJCF.
        files: every MJCF file that it is composed of, the town's first.
        slots: the pool.
        faces: what takes patches, in patch order.
    """

    tree: ET.Element
    assets: Mapping[str, bytes]
    town: Path
    files: tuple[Path, ...]
    slots: tuple[Slot, ...]
    faces: tuple[FaceNames, ...]
    folder: Path | None = None

    @property
    def pictures(self) -> list[str]:
        """Paths of the textures, once it is laid out."""
        return [str(path) for path in self.folder.glob("*.png")] if self.folder else []

    def laid_out(self, folder: Path) -> Composition:
        """The same with its files written into a folder, but for meshes, which it refers to where they lie: MuJoCo
        copies what is in memory, all of it at once.
        """
        for name, content in self.assets.items():
            if not isinstance(content, MeshPath):
                (folder / name).write_bytes(content)
        tree = copy.deepcopy(self.tree)
        for element in tree.iter():
            element.attrib.pop("strippath", None)
            place = self.assets.get(element.get("file", ""))
            if isinstance(place, MeshPath):
                element.set("file", os.fsdecode(place))
        return replace(self, tree=tree, assets={}, folder=folder)


def compose(
    library: AssetLibrary,
    boards: Sequence[BoardSpec],
    pool: Sequence[tuple[ActorFacts, int]],
    carrier: ActorFacts | None,
    weather: Weather,
    lighting: Callable[[], Lighting] | None,
    prefetcher: AssetPrefetcher,
) -> Composition:
    """Puts a town, its boards and its actors into one tree.

    Args:
        library: of the town.
        boards: in patch order.
        pool: actors and how many instances of each; the first one is the ego car's.
        carrier: an actor that bears a surface, besides the pool.
        weather: light and air.
        lighting: waits for the weather's light, where that is being worked out already; else None.
        prefetcher: is told of meshes as soon as they are known.

    Raises:
        TownError: a file cannot be composed.
        UnknownNameError: a board's asset is not there.
    """
    with ThreadPoolExecutor(1) as aside:
        light = aside.submit(lighting or partial(lighting_of, weather))
        text, statics = split_town(library.town)
        prefetcher.prefetch(map(os.fsdecode, statics.mesh_paths.values()))
        root = load_mjcf(library.town, text, statics.mesh_paths)
        slots = slots_of(pool, carrier)
        parts = AssetInstances(root, prefetcher)
        faces = _fill(root, parts, library, statics, boards, slots)
    apply_weather(root, weather, light.result(), statics.geom_materials)
    tree = ET.fromstring(statics.put_into(parts.put_defaults_into(root.to_xml_string())))
    parts.put_copies_into(tree)
    return Composition(
        tree=tree,
        assets=root.get_assets(),
        town=library.town,
        files=(library.town, *parts.files),
        slots=slots,
        faces=faces,
    )


def _fill(
    root: mjcf.RootElement,
    parts: AssetInstances,
    library: AssetLibrary,
    statics: StaticParts,
    boards: Sequence[BoardSpec],
    slots: Iterable[Slot],
) -> tuple[FaceNames, ...]:
    """Puts boards and actors into the town's tree."""
    faces: list[FaceNames] = []
    for index, board in enumerate(boards):
        path = library.path("surface", board.asset)
        body = _new_body(root, library.town, statics, f"board_{index}", **_placed(board))
        faces.append(parts.add_surface_instance(path, body, is_carried=False))
    for slot in slots:
        if slot.body in {face.owner for face in faces}:
            problem = f"is called {slot.actor.name!r}, so its instances would have the names of the boards; rename it"
            raise TownError(slot.actor.path, problem)
        path = slot.actor.path
        if not slot.carries_surface and parts.has_instance(path):
            _refuse_taken(root, library.town, statics, slot.body)
            parts.copy_instance(path, slot.body)
            continue
        body = _new_body(root, library.town, statics, slot.body, mocap=True)
        if slot.carries_surface:
            faces.append(parts.add_surface_instance(path, body, is_carried=True))
        else:
            parts.add_instance(path, body)
    parts.drop_templates()
    return tuple(faces)


def slots_of(pool: Sequence[tuple[ActorFacts, int]], carrier: ActorFacts | None) -> tuple[Slot, ...]:
    """The slots of a pool, and of the actor that bears a surface besides."""
    slots = [
        Slot(body=f"{actor.name}_{index}", actor=actor) for actor, count in _merged(pool) for index in range(count)
    ]
    if carrier is not None:
        slots.append(Slot(body="carrier", actor=carrier, carries_surface=True))
    return tuple(slots)


def _new_body(root: mjcf.RootElement, town: Path, statics: StaticParts, name: str, **attributes: Any) -> Any:
    _refuse_taken(root, town, statics, name)
    return root.worldbody.add("body", name=name, **attributes)


def _refuse_taken(root: mjcf.RootElement, town: Path, statics: StaticParts, name: str) -> None:
    if name in statics.body_names or root.find("body", name) is not None:
        raise TownError(town, f"has a body named {name!r}, a name that gear gives to what it puts there")


def _merged(pool: Sequence[tuple[ActorFacts, int]]) -> list[tuple[ActorFacts, int]]:
    counts: Counter[str] = Counter()
    facts: dict[str, ActorFacts] = {}
    for actor, count in pool:
        facts[actor.name] = actor
        counts[actor.name] += count
    return [(facts[name], count) for name, count in counts.items()]


def _placed(board: BoardSpec) -> dict[str, Any]:
    half = math.radians(board.facing_deg) / 2
    return {"pos": board.position_m, "quat": (math.cos(half), 0.0, 0.0, math.sin(half))}
