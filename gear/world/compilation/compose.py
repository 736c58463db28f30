"""Composes one MJCF from many: a town, its boards, and a pool of actors.

dm_control.mjcf keeps the names of different files apart. Each asset's file is attached once, for its meshes, textures
and materials. Each instance is a body whose geoms refer to them, so ten equal cars need the memory of one mesh. Only
faces that can show a patch get a material and a texture of their own.
"""

from __future__ import annotations

import copy
import math
import os
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gear.values.errors import TownError
from gear.world.assets.scene_assets import AssetFile
from gear.world.compilation.actor_pool import Slot
from gear.world.compilation.instances import AssetInstances, FaceNames, load_mjcf
from gear.world.compilation.scene_mjcf import SceneMjcf
from gear.world.compilation.static_parts import MeshPath
from gear.world.compilation.world_plan import WorldPlan
from gear.world.scene_spec import BoardSpec
from gear.world.weather.light import Lighting, lighting_of
from gear.world.weather.presets import apply_weather

if TYPE_CHECKING:
    from gear.world.compilation.quiet_mjcf import mjcf


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Composition:
    """A composed world that is not compiled yet.

    Attributes:
        tree: the whole world as MJCF.
        assets: content of the files to which the tree refers, by name; for a mesh, the path of its file.
        town: path of the town's MJCF file.
        files: paths of all MJCF files of the world, the town's first.
        slots: the pool of actors.
        faces: names of the faces that can show patches, in patch order.
        folder: folder of the files that `write_assets` wrote; None before this call.
    """

    tree: ET.Element
    assets: Mapping[str, bytes]
    town: Path
    files: tuple[Path, ...]
    slots: tuple[Slot, ...]
    faces: tuple[FaceNames, ...]
    folder: Path | None = None

    @property
    def texture_files(self) -> list[str]:
        """Paths of the texture files that `write_assets` wrote."""
        return [str(path) for path in self.folder.glob("*.png")] if self.folder else []

    def write_assets(self, folder: Path) -> Composition:
        """Writes the textures into a folder and returns a composition that refers only to files.

        This saves memory: MuJoCo copies all assets in memory at once, but reads files one by one.

        Args:
            folder: an existing folder; the returned composition needs it until the world is compiled.
        """
        for name, content in self.assets.items():
            if not isinstance(content, MeshPath):
                (folder / name).write_bytes(content)
        tree = copy.deepcopy(self.tree)
        for element in tree.iter():
            element.attrib.pop("strippath", None)
            content = self.assets.get(element.get("file", ""), b"")
            if isinstance(content, MeshPath):
                element.set("file", os.fsdecode(content))
        return replace(self, tree=tree, assets={}, folder=folder)


def compose(plan: WorldPlan, files: SceneMjcf, lighting: Callable[[], Lighting] | None = None) -> Composition:
    """Joins a town, its boards, its actors and its weather to one MJCF tree.

    Args:
        plan: the contents of the world.
        files: the MJCF files of the plan.
        lighting: function that returns the light of the plan's weather, if the caller already computes it; None
            computes the light in a thread.

    Raises:
        TownError: a file cannot be composed with the other files.
    """
    with ThreadPoolExecutor(1) as thread:
        light = thread.submit(lighting or partial(lighting_of, plan.weather))
        root = load_mjcf(plan.town, files.town.text, files.town.mesh_paths)
        instances = AssetInstances(root, files.assets)
        faces = _Filling(plan, root, instances, files.town.statics.body_names).fill()
    apply_weather(root, plan.weather, light.result(), files.town.statics.geom_materials)
    tree = ET.fromstring(files.town.statics.insert_into(instances.put_defaults_into(root.to_xml_string())))
    instances.put_copies_into(tree)
    return Composition(
        tree=tree,
        assets=root.get_assets(),
        town=plan.town,
        files=(plan.town, *instances.files),
        slots=plan.slots,
        faces=faces,
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Filling:
    """Adds boards and actors to the tree of a town.

    Attributes:
        plan: the contents of the world.
        root: the tree.
        instances: makes the bodies.
        town_bodies: names of the town's bodies that are not in the tree.
    """

    plan: WorldPlan
    root: mjcf.RootElement
    instances: AssetInstances
    town_bodies: frozenset[str]

    def fill(self) -> tuple[FaceNames, ...]:
        """Adds a body for every board and every slot, and returns the names of the faces that can show patches."""
        plan, instances = self.plan, self.instances
        faces: list[FaceNames] = []
        for index, (board, file) in enumerate(zip(plan.scene.boards, plan.assets.boards, strict=True)):
            body = self._new_body(f"board_{index}", **_pose(board))
            faces.append(instances.add_surface_instance(file, body, is_carried=False))
        for slot in plan.slots:
            file = AssetFile(slot.actor.path)
            if slot.body in {face.owner for face in faces}:
                problem = (
                    f"is called {slot.actor.name!r}, so its instances would have the names of the boards; rename it"
                )
                raise TownError(file.path, problem)
            if not slot.carries_surface and instances.has_instance(file):
                self._check_free(slot.body)
                instances.copy_instance(file, slot.body)
                continue
            body = self._new_body(slot.body, mocap=True)
            if slot.carries_surface:
                faces.append(instances.add_surface_instance(file, body, is_carried=True))
            else:
                instances.add_instance(file, body)
        instances.drop_templates()
        return tuple(faces)

    def _new_body(self, name: str, **attributes: Any) -> Any:
        self._check_free(name)
        return self.root.worldbody.add("body", name=name, **attributes)

    def _check_free(self, name: str) -> None:
        if name in self.town_bodies or self.root.find("body", name) is not None:
            problem = f"has a body named {name!r}, a name that gear gives to what it puts there"
            raise TownError(self.plan.town, problem)


def _pose(board: BoardSpec) -> dict[str, Any]:
    """MJCF attributes of a board's body: position in metres and a quaternion (w, x, y, z) for the rotation about z."""
    half = math.radians(board.facing_deg) / 2
    return {"pos": board.position_m, "quat": (math.cos(half), 0.0, 0.0, math.sin(half))}
