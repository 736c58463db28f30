"""A compiled world (two MuJoCo models and data about them), in memory and on disk."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from gear.values.serial import from_json, to_json
from gear.world.assets.actor_types import actor_types
from gear.world.assets.geom_classes import GeomClasses
from gear.world.compilation.actor_pool import Slot
from gear.world.compilation.asset_prefetch import asset_prefetcher
from gear.world.compilation.compose import compose
from gear.world.compilation.drop_bvh import without_mesh_bvh
from gear.world.compilation.instances import FaceNames
from gear.world.compilation.mjb import read_model, write_model
from gear.world.compilation.model_compilation import placement_model, placement_spec, render_model
from gear.world.compilation.normal_maps import align_normal_maps
from gear.world.compilation.scene_mjcf import read_scene_mjcf
from gear.world.compilation.world_plan import WorldPlan
from gear.world.weather.light import Lighting
from gear.world.weather.presets import wetness
from gear.world.weather.wet_ground import wet_own_colours

_RENDER, _PLACEMENT, _FACTS = "render.mjb", "placement.mjb", "facts.json"


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CompiledWorld:
    """The two MuJoCo models of a world, and the data about the world that the models do not contain.

    Attributes:
        model: the render model: visible geoms, actors as mocap bodies.
        placement_model: the placement model: collision geoms, actors as free bodies on four feet.
        classes: labels of the render model's geoms.
        slots: the pool of actors.
        faces: names of the faces that show patches, in patch order.
        checksum: names the content of the files from which the world was loaded; "" if it was compiled.
    """

    model: mujoco.MjModel
    placement_model: mujoco.MjModel
    classes: GeomClasses
    slots: tuple[Slot, ...]
    faces: tuple[FaceNames, ...]
    checksum: str = ""

    def save(self, folder: Path) -> None:
        """Writes the world into an empty folder: its two models and the data about them.

        The bounding volumes of the render model's meshes are left out, because only rays need them.

        Args:
            folder: the folder, which must exist.

        Raises:
            OSError: the disk is full.
        """
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
    def load(folder: Path, slots: tuple[Slot, ...]) -> CompiledWorld:
        """Reads a world that `CompiledWorld.save` wrote.

        Args:
            folder: folder of the saved world.
            slots: the pool of actors of the same plan, because the folder does not contain it.

        Raises:
            OSError: a file is missing or cannot be read.
            ValueError, KeyError, GearError: the files are damaged, or do not describe a world.
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
            slots=slots,
            faces=from_json(tuple[FaceNames, ...], facts["faces"]),
            checksum=f"{facts['crc32'][_RENDER]:08x}-{facts['crc32'][_PLACEMENT]:08x}",
        )


def compile_world(
    plan: WorldPlan, lighting: Callable[[], Lighting] | None = None, *, readers: int = 0
) -> CompiledWorld:
    """Composes and compiles a planned world.

    Args:
        plan: the contents of the world.
        lighting: function that returns the light of the plan's weather; None computes the light in a thread.
        readers: number of threads that read meshes and textures while the world is composed; 0 for none. With threads,
            compiling is faster, and town10 needs 2.0 GB of memory instead of 1.4 GB.

    Raises:
        TownError: a file breaks the conventions, or MuJoCo cannot compile it.
    """
    with (
        asset_prefetcher(readers) as prefetcher,
        tempfile.TemporaryDirectory(prefix="gear-") as folder,
        ThreadPoolExecutor(1) as thread,
    ):
        files = read_scene_mjcf(plan, prefetcher)
        composition = compose(plan, files, lighting).write_assets(Path(folder))
        prefetcher.prefetch(composition.texture_files)
        prefetcher.wait()
        placement = thread.submit(placement_spec, composition)
        model, classes = render_model(composition)
    align_normal_maps(model)
    wet_own_colours(model, classes.label_code, wetness(plan.weather))
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    types = actor_types(model, data, classes, plan.slots)
    bodies = {slot.body: types[slot.actor.name].placement_body for slot in plan.slots}
    return CompiledWorld(
        model=model,
        placement_model=placement_model(composition, placement.result(), bodies),
        classes=classes,
        slots=plan.slots,
        faces=composition.faces,
    )
