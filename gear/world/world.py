"""A town with its scene, compiled once; every sample only moves what is there."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import mujoco
import numpy as np

from gear.contracts.rendering import Stage
from gear.values.errors import PlacementError
from gear.values.frames import GeomTable, SceneObject, Shape, UInt8Image
from gear.values.labels import GROUND_CODES
from gear.values.scene import ActorRecord, SceneRecord, SurfaceRecord, Vec3, Weather
from gear.world.assets.actor_types import ActorType, StaticObjects, actor_types, static_objects, visible_geoms
from gear.world.assets.geom_classes import GeomClasses
from gear.world.assets.library import AssetLibrary
from gear.world.compilation.compiled_world import CompiledWorld, compile_world
from gear.world.compilation.compose import PARKED_DEPTH_M, Slot
from gear.world.compilation.memory import release_memory
from gear.world.roads.lanes import LaneGraph
from gear.world.scene_spec import SceneSpec
from gear.world.surfaces.face_texture import SurfaceAlbedo, SurfaceAlbedos
from gear.world.surfaces.patch_faces import Face, find_faces

FACES_KEPT, SHOWN_A_FACE = 8, 5
"""Resampled faces are kept: so many in all, or so many of each, which in a sample may be seen with a patch, neutral,
white, black and grey."""

_OUT_OF_SIGHT_M = -1e5


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PlacedStage:
    """One sample, ready to be rendered and to be measured.

    Attributes:
        stage: for the renderer. Its `data` is the world's own: it holds until the next `place`.
        geoms: what each geom is.
        objects: countable things by object id.
    """

    stage: Stage
    geoms: GeomTable
    objects: Mapping[int, SceneObject]


@dataclass(frozen=True, slots=True, eq=False)
class _SlotGeoms:
    slot: Slot
    mocap_id: int
    geom_ids: tuple[int, ...]
    paint_ids: tuple[int, ...]


@dataclass(eq=False, kw_only=True)
class World:
    """A compiled town, scene, weather and pool of actors.

    Attributes:
        library: where its MJCF comes from.
        scene_name, scene, weather: what it was built for.
        model: what is seen.
        placement_model: what is felt; its actors are free, by the same body names.
        classes: label of each visible geom.
        slots: the pool.
        types: assets of the pool by name.
        faces: what takes patches, in patch order.
        statics: countable things of the town.
        lanes: where road users may be.
    """

    library: AssetLibrary
    scene_name: str
    scene: SceneSpec
    weather: Weather
    model: mujoco.MjModel
    placement_model: mujoco.MjModel
    classes: GeomClasses
    slots: tuple[Slot, ...]
    types: Mapping[str, ActorType]
    faces: tuple[Face, ...]
    statics: StaticObjects
    lanes: LaneGraph
    _data: mujoco.MjData = field(init=False, repr=False)
    _slot_geoms: tuple[_SlotGeoms, ...] = field(init=False, repr=False)
    _shown: OrderedDict[tuple[str, str], UInt8Image] = field(init=False, repr=False, default_factory=OrderedDict)

    def __post_init__(self) -> None:
        self._data = mujoco.MjData(self.model)
        self._slot_geoms = tuple(self._geoms_of(slot) for slot in self.slots)

    @staticmethod
    def build(*, town: str | Path, scene_name: str, scene: SceneSpec, weather: Weather) -> World:
        """Composes and compiles.

        Args:
            town: a town's name, or the path of its MJCF.
            scene_name: what records call the scene.
            scene: boards, truck and limits.
            weather: light and air.

        Raises:
            UnknownNameError: there is no such town, board or truck.
            TownError: a file breaks the conventions.
        """
        library = AssetLibrary.for_town(town)
        return World.of(library, scene_name, scene, weather, compile_world(library, scene, weather))

    @staticmethod
    def of(
        library: AssetLibrary, scene_name: str, scene: SceneSpec, weather: Weather, compiled: CompiledWorld
    ) -> World:
        """What was compiled of a scene, measured.

        Raises:
            TownError: a file breaks the conventions.
        """
        model, classes, slots = compiled.model, compiled.classes, compiled.slots
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        world = World(
            library=library,
            scene_name=scene_name,
            scene=scene,
            weather=weather,
            model=model,
            placement_model=compiled.placement_model,
            classes=classes,
            slots=slots,
            types=actor_types(model, data, classes, slots),
            faces=find_faces(model, data, compiled.faces, library.town),
            statics=static_objects(model, data, classes, slots, library.town),
            lanes=LaneGraph.from_model(compiled.placement_model, library.town),
        )
        release_memory()
        return world

    @property
    def shapes(self) -> dict[str, Shape]:
        """Visible triangles of the pool's assets by name."""
        return {name: actor_type.shape for name, actor_type in self.types.items()}

    @property
    def parked_m(self) -> float:
        """Height at which actors of the pool wait that a sample does not use, also in a town far below its origin."""
        return min(0.0, self.lanes.lowest_m) - PARKED_DEPTH_M

    @property
    def town_name(self) -> str:
        """Name of the town."""
        return self.library.town_name

    def surface_records(self, carrier_id: int | None = None) -> tuple[SurfaceRecord, ...]:
        """What takes patches, as data; `carrier_id` is the actor that bears them in a truck's scene."""
        return tuple(face.record(carrier_id) for face in self.faces)

    def place(self, record: SceneRecord, surfaces: SurfaceAlbedos | None = None) -> PlacedStage:
        """Moves everything to where the record says.

        Args:
            record: of this world's town and scene.
            surfaces: what each surface shows, by name; the neutral face where nothing is said.

        Raises:
            PlacementError: the record needs actors that this world does not hold.
            ValueError: a surface is named that is not there.
        """
        faces = self._faces(surfaces or {})
        taken = self._assign(record)
        self._pose(record, taken)
        object_id = self.statics.object_id.copy()
        paint: dict[int, Vec3] = {}
        objects: dict[int, SceneObject] = dict(self.statics.objects)
        for actor, geoms in zip(record.actors, taken, strict=True):
            object_id[list(geoms.geom_ids)] = actor.id
            objects[actor.id] = self._object(actor)
            if actor.paint_rgb is not None:
                paint.update(dict.fromkeys(geoms.paint_ids, actor.paint_rgb))
        surface_index = np.full(self.model.ngeom, -1, np.int16)
        for index, face in enumerate(self.faces):
            surface_index[face.geom_id] = index
        for array in (object_id, surface_index):
            array.setflags(write=False)
        return PlacedStage(
            stage=Stage(model=self.model, data=self._data, paint_rgb=paint, faces=faces),
            geoms=GeomTable(label_code=self.classes.label_code, object_id=object_id, surface_index=surface_index),
            objects=objects,
        )

    def with_surfaces(self, placed: PlacedStage, surfaces: SurfaceAlbedos) -> Stage:
        """What was placed last, with other faces; nothing is moved.

        Args:
            placed: of the last `place`.
            surfaces: what each surface shows, by name; the neutral face where nothing is said.

        Raises:
            ValueError: a surface is named that is not there.
        """
        return replace(placed.stage, faces=self._faces(surfaces))

    @contextmanager
    def without_ground(self, placed: PlacedStage) -> Iterator[Stage]:
        """What was placed last, with neutral faces and nothing that hides it from below; its ground is back at the end.

        Args:
            placed: of the last `place`.
        """
        is_ground = np.isin(self.classes.label_code, GROUND_CODES)
        heights_m = self._data.geom_xpos[is_ground, 2]
        self._data.geom_xpos[is_ground, 2] = _OUT_OF_SIGHT_M
        try:
            yield self.with_surfaces(placed, {})
        finally:
            self._data.geom_xpos[is_ground, 2] = heights_m

    def _faces(self, surfaces: SurfaceAlbedos) -> dict[int, UInt8Image]:
        unknown = set(surfaces) - {face.name for face in self.faces}
        if unknown:
            raise ValueError(f"no surface named {', '.join(sorted(unknown))}; there are {len(self.faces)}")
        return {face.geom_id: self._show(face, surfaces.get(face.name, "none")) for face in self.faces}

    def _geoms_of(self, slot: Slot) -> _SlotGeoms:
        body = self.model.body(slot.body).id
        geoms = visible_geoms(self.model, body, self.classes.label_code)
        paint = tuple(geom for geom in geoms if self.classes.is_paint[geom])
        return _SlotGeoms(slot, int(self.model.body_mocapid[body]), tuple(geoms), paint)

    def _assign(self, record: SceneRecord) -> list[_SlotGeoms]:
        """A slot for each actor: the first free one of its asset, so that a record always takes the same."""
        free = list(self._slot_geoms)
        taken = []
        for actor in record.actors:
            for candidate in free:
                slot = candidate.slot
                if slot.actor.name == actor.asset and slot.carries_surface == (actor.role == "carrier"):
                    free.remove(candidate)
                    taken.append(candidate)
                    break
            else:
                raise PlacementError(
                    record.scene, f"sample {record.index} needs one more {actor.asset} than this world was built with"
                )
        return taken

    def _pose(self, record: SceneRecord, taken: list[_SlotGeoms]) -> None:
        xmin, ymin, xmax, ymax = self.lanes.bounds_m
        self._data.mocap_pos[:] = ((xmin + xmax) / 2, (ymin + ymax) / 2, self.parked_m)
        self._data.mocap_quat[:] = (1.0, 0.0, 0.0, 0.0)
        for actor, geoms in zip(record.actors, taken, strict=True):
            self._data.mocap_pos[geoms.mocap_id] = actor.world_from_actor.position_m
            self._data.mocap_quat[geoms.mocap_id] = actor.world_from_actor.quat_wxyz
        self._data.time = record.time_s
        mujoco.mj_kinematics(self.model, self._data)
        mujoco.mj_comPos(self.model, self._data)
        mujoco.mj_camlight(self.model, self._data)

    def _object(self, actor: ActorRecord) -> SceneObject:
        actor_type = self.types[actor.asset]
        return SceneObject(
            id=actor.id,
            asset=actor.asset,
            label_code=actor_type.label.code,
            kitti_type=actor_type.label.kitti_type,
            is_ego=actor.role == "ego",
            world_from_object=actor.world_from_actor.transform("world", "object"),
            shape=actor_type.shape,
        )

    def _show(self, face: Face, albedo: SurfaceAlbedo) -> UInt8Image:
        """Resampled faces are kept: a data set shows one patch thousands of times."""
        key: str = (
            albedo
            if isinstance(albedo, str)
            else f"{albedo.shape} {hashlib.blake2b(albedo.tobytes(), digest_size=16).hexdigest()}"
        )
        if (face.name, key) not in self._shown:
            self._shown[face.name, key] = face.show(albedo)
            if len(self._shown) > max(FACES_KEPT, SHOWN_A_FACE * len(self.faces)):
                self._shown.popitem(last=False)
        self._shown.move_to_end((face.name, key))
        return self._shown[face.name, key]
