"""What compiling a world leaves, in memory and on disk."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from gear.values.scene import Weather
from gear.values.serial import from_json, to_json
from gear.world.assets.actor_types import actor_types
from gear.world.assets.geom_classes import GeomClasses
from gear.world.assets.library import ActorFacts, AssetLibrary
from gear.world.compilation.actor_pool import plan_pool, vehicles_of
from gear.world.compilation.asset_prefetch import asset_prefetcher
from gear.world.compilation.compose import Slot, compose, slots_of
from gear.world.compilation.drop_bvh import without_mesh_bvh
from gear.world.compilation.instances import FaceNames
from gear.world.compilation.mjb import read_model, write_model
from gear.world.compilation.model_compilation import placement_model, placement_spec, render_model
from gear.world.compilation.normal_maps import align_normal_maps
from gear.world.scene_spec import SceneSpec
from gear.world.weather.light import Lighting
from gear.world.weather.presets import wetness
from gear.world.weather.wet_ground import wet_own_colours

_RENDER, _PLACEMENT, _FACTS = "render.mjb", "placement.mjb", "facts.json"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CompiledWorld:
    """A world's two models and what they do not say of themselves.

    Attributes:
        model: what is seen.
        placement_model: what is felt.
        classes: labels of the geoms of what is seen.
        slots: the pool.
        faces: what takes patches, in patch order.
    """

    model: mujoco.MjModel
    placement_model: mujoco.MjModel
    classes: GeomClasses
    slots: tuple[Slot, ...]
    faces: tuple[FaceNames, ...]

    def save(self, folder: Path) -> None:
        """Writes it into an empty folder, without what rays find triangles by."""
        with without_mesh_bvh(self.model):
            crc32 = {_RENDER: write_model(self.model, folder / _RENDER)}
        crc32[_PLACEMENT] = write_model(self.placement_model, folder / _PLACEMENT)
        facts = {
            "faces": to_json(self.faces),
            "label_code": self.classes.label_code.tolist(),
            "is_paint": self.classes.is_paint.tolist(),
            "is_face": self.classes.is_face.tolist(),
            "crc32": crc32,
        }
        (folder / _FACTS).write_text(json.dumps(facts), encoding="utf-8")

    @staticmethod
    def load(folder: Path, library: AssetLibrary, scene: SceneSpec) -> CompiledWorld:
        """Reads what `save` wrote for the same library and scene.

        Raises:
            OSError: there is nothing, or it cannot be read.
            ValueError, KeyError, GearError: something else lies there, or half of it.
        """
        facts = json.loads((folder / _FACTS).read_text(encoding="utf-8"))
        model, placement = (read_model(folder / name, facts["crc32"][name]) for name in (_RENDER, _PLACEMENT))
        classes = GeomClasses(
            label_code=np.array(facts["label_code"], np.uint8),
            is_paint=np.array(facts["is_paint"], np.bool_),
            is_face=np.array(facts["is_face"], np.bool_),
        )
        for array in (classes.label_code, classes.is_paint, classes.is_face):
            array.setflags(write=False)
        return CompiledWorld(
            model=model,
            placement_model=placement,
            classes=classes,
            slots=slots_of(plan_pool(scene, library), carrier_of(scene, library)),
            faces=from_json(tuple[FaceNames, ...], facts["faces"]),
        )


def compile_world(
    library: AssetLibrary,
    scene: SceneSpec,
    weather: Weather,
    lighting: Callable[[], Lighting] | None = None,
    *,
    readers: int = 0,
) -> CompiledWorld:
    """Composes and compiles.

    Args:
        library, scene, weather: of the world.
        lighting: as for `compose`.
        readers: threads that read meshes and textures meanwhile. It is sooner done, and town10 takes 2.0 GB for 1.4 GB.

    Raises:
        UnknownNameError: there is no such board or truck.
        TownError: a file breaks the conventions.
    """
    with (
        asset_prefetcher(readers) as prefetcher,
        tempfile.TemporaryDirectory(prefix="gear-") as folder,
        ThreadPoolExecutor(1) as aside,
    ):
        pool, carrier = plan_pool(scene, library), carrier_of(scene, library)
        composition = compose(library, scene.boards, pool, carrier, weather, lighting, prefetcher).laid_out(
            Path(folder)
        )
        prefetcher.prefetch(composition.pictures)
        prefetcher.wait()
        placement = aside.submit(placement_spec, composition)
        model, classes = render_model(composition)
    align_normal_maps(model)
    wet_own_colours(model, classes.label_code, wetness(weather))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    types = actor_types(model, data, classes, composition.slots)
    placement_bodies = {slot.body: types[slot.actor.name].placement_body for slot in composition.slots}
    return CompiledWorld(
        model=model,
        placement_model=placement_model(composition, placement.result(), placement_bodies),
        classes=classes,
        slots=composition.slots,
        faces=composition.faces,
    )


def carrier_of(scene: SceneSpec, library: AssetLibrary) -> ActorFacts | None:
    """The actor that bears a scene's surface, if one does.

    Raises:
        UnknownNameError: there is no such truck.
    """
    if scene.truck is None:
        return None
    library.path("vehicle", scene.truck.asset)
    return vehicles_of(scene, library)[scene.truck.asset]
