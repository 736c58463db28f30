"""A town with its scene, compiled once. A sample moves its actors and changes its patches, without compiling."""

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
from gear.values.array_shelf import NO_SHELF, ArrayShelf
from gear.values.errors import PlacementError
from gear.values.frames import GeomTable, SceneObject, Shape, UInt8Image
from gear.values.labels import GROUND_CODES
from gear.values.scene import ActorRecord, SceneRecord, SurfaceRecord, Vec3, Weather
from gear.world.assets.actor_types import ActorType, StaticObjects, actor_types, static_objects, visible_geoms
from gear.world.assets.geom_classes import GeomClasses
from gear.world.assets.library import AssetLibrary
from gear.world.compilation.actor_pool import PARKED_DEPTH_M, Slot
from gear.world.compilation.compiled_world import CompiledWorld, compile_world
from gear.world.compilation.memory import release_memory
from gear.world.compilation.world_plan import WorldPlan, plan_world
from gear.world.roads.lanes import LaneGraph
from gear.world.scene_spec import SceneSpec
from gear.world.surfaces.face_texture import SurfaceAlbedo, SurfaceAlbedos
from gear.world.surfaces.patch_faces import Face, find_faces

FACES_KEPT, TEXTURES_PER_FACE = 8, 5
"""Number of resampled textures that a world keeps: `FACES_KEPT` in total, or `TEXTURES_PER_FACE` for each face
if that is more. In one sample a face may show a patch, its neutral texture, white, black and grey.
"""

_OUT_OF_SIGHT_M = -1e5
"""Height in metres to which geoms are moved that must not be visible to any camera."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class PlacedStage:
    """One sample, ready to be rendered and measured.

    Attributes:
        stage: the posed world, the input of a renderer. Its `data` belongs to the world and is valid until the next
            call of `place`.
        geoms: label, object and surface of each geom of the render model.
        objects: countable objects by object id.
    """

    stage: Stage
    geoms: GeomTable
    objects: Mapping[int, SceneObject]


@dataclass(frozen=True, slots=True, eq=False)
class _SlotGeoms:
    """A slot of the pool, with its mocap body and its visible geoms in the render model."""

    slot: Slot
    mocap_id: int
    geom_ids: tuple[int, ...]
    paint_ids: tuple[int, ...]


@dataclass(eq=False, kw_only=True)
class World:
    """A compiled town with a scene, a weather and a pool of actors.

    Attributes:
        library: the town's MJCF file and the folders of its assets.
        scene_name, scene, weather: the scene with its name, and the weather, for which the world was compiled.
        model: the render model: visible geoms, actors as mocap bodies.
        placement_model: the placement model: collision geoms, actors as free bodies with the same names.
        classes: labels of the render model's geoms.
        slots: the pool of actors.
        types: the measured assets of the pool, by name.
        faces: the faces that can show patches, in patch order.
        statics: countable objects of the town, such as traffic lights.
        lanes: lanes, walks and parking bays.
        shelf: keeps arrays that are computed from the models; it keeps nothing for a world that is not in the cache.
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
    shelf: ArrayShelf = NO_SHELF
    _data: mujoco.MjData = field(init=False, repr=False)
    _slot_geoms: tuple[_SlotGeoms, ...] = field(init=False, repr=False)
    _textures: OrderedDict[tuple[str, str], UInt8Image] = field(init=False, repr=False, default_factory=OrderedDict)

    def __post_init__(self) -> None:
        self._data = mujoco.MjData(self.model)
        self._slot_geoms = tuple(self._geoms_of(slot) for slot in self.slots)

    @staticmethod
    def build(*, town: str | Path, scene_name: str, scene: SceneSpec, weather: Weather) -> World:
        """Composes and compiles a world.

        Args:
            town: name of a town, or path of its MJCF.
            scene_name: name of the scene in records.
            scene: boards or truck, and limits.
            weather: light and air.

        Raises:
            UnknownNameError: there is no such town, board or truck.
            TownError: a file breaks the conventions.
        """
        plan = plan_world(AssetLibrary.for_town(town), scene, weather)
        return World.of(plan, scene_name, compile_world(plan))

    @staticmethod
    def of(plan: WorldPlan, scene_name: str, compiled: CompiledWorld, shelf: ArrayShelf = NO_SHELF) -> World:
        """Makes a world from compiled models: measures actors and faces, and reads the lanes.

        Args:
            plan: the plan from which the models were compiled.
            scene_name: name of the scene in records.
            compiled: the models.
            shelf: shelf of these models.

        Raises:
            TownError: an actor, a face or a lane breaks the conventions.
        """
        library, model, classes, slots = plan.assets.library, compiled.model, compiled.classes, compiled.slots
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        world = World(
            library=library,
            scene_name=scene_name,
            scene=plan.scene,
            weather=plan.weather,
            model=model,
            placement_model=compiled.placement_model,
            classes=classes,
            slots=slots,
            types=actor_types(model, data, classes, slots),
            faces=find_faces(model, data, compiled.faces, library.town, shelf),
            statics=static_objects(model, data, classes, slots, library.town),
            lanes=LaneGraph.from_model(compiled.placement_model, library.town),
            shelf=shelf,
        )
        release_memory()
        return world

    @property
    def shapes(self) -> dict[str, Shape]:
        """The visible triangles of each asset in the pool of actors, by the asset's name."""
        return {name: actor_type.shape for name, actor_type in self.types.items()}

    @property
    def parked_m(self) -> float:
        """Height in metres at which unused actors are placed, below every lane of the town."""
        return min(0.0, self.lanes.lowest_m) - PARKED_DEPTH_M

    @property
    def town_name(self) -> str:
        """Name of the town, as it is written into scene records."""
        return self.library.town_name

    def surface_records(self, carrier_id: int | None = None) -> tuple[SurfaceRecord, ...]:
        """The records of all faces that can show patches, in patch order.

        Args:
            carrier_id: id of the actor that carries the faces in a scene with a truck, otherwise None.
        """
        return tuple(face.record(carrier_id) for face in self.faces)

    def place(self, record: SceneRecord, surfaces: SurfaceAlbedos | None = None) -> PlacedStage:
        """Moves the actors to their poses in a record, and gives the faces their textures.

        Args:
            record: a sample of this world's town and scene.
            surfaces: patch or colour of each surface, by the surface's name; surfaces that are missing get their
                neutral texture.

        Raises:
            PlacementError: the record has more actors of an asset than this world.
            ValueError: `surfaces` contains a name that no surface has.
        """
        faces = self._textures_of(surfaces or {})
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
        is_absent = np.zeros(self.model.ngeom, np.bool_)
        for geoms in self._slot_geoms:
            is_absent[list(geoms.geom_ids)] = True
        for geoms in taken:
            is_absent[list(geoms.geom_ids)] = False
        for array in (object_id, surface_index, is_absent):
            array.setflags(write=False)
        return PlacedStage(
            stage=Stage(model=self.model, data=self._data, paint_rgb=paint, faces=faces, is_absent=is_absent),
            geoms=GeomTable(label_code=self.classes.label_code, object_id=object_id, surface_index=surface_index),
            objects=objects,
        )

    def with_surfaces(self, placed: PlacedStage, surfaces: SurfaceAlbedos) -> Stage:
        """Replaces the textures on the faces of the sample that was placed last, without moving actors. Returns the
        stage, the input of a renderer.

        Args:
            placed: result of the last `place`.
            surfaces: patch or colour of each surface, by the surface's name; surfaces that are missing get their
                neutral texture.

        Raises:
            ValueError: `surfaces` contains a name that no surface has.
        """
        return replace(placed.stage, faces=self._textures_of(surfaces))

    @contextmanager
    def without_ground(self, placed: PlacedStage) -> Iterator[Stage]:
        """Context with a stage of the sample that was placed last, without its ground and with neutral faces. A camera
        below the ground then sees the scene.

        Args:
            placed: result of the last `place`.
        """
        is_ground = np.isin(self.classes.label_code, GROUND_CODES)
        heights_m = self._data.geom_xpos[is_ground, 2]
        self._data.geom_xpos[is_ground, 2] = _OUT_OF_SIGHT_M
        try:
            yield self.with_surfaces(placed, {})
        finally:
            self._data.geom_xpos[is_ground, 2] = heights_m

    def _textures_of(self, surfaces: SurfaceAlbedos) -> dict[int, UInt8Image]:
        """Texture of each face by its geom id."""
        unknown = set(surfaces) - {face.name for face in self.faces}
        if unknown:
            raise ValueError(f"no surface named {', '.join(sorted(unknown))}; there are {len(self.faces)}")
        return {face.geom_id: self._texture(face, surfaces.get(face.name, "none")) for face in self.faces}

    def _geoms_of(self, slot: Slot) -> _SlotGeoms:
        body = self.model.body(slot.body).id
        geoms = visible_geoms(self.model, body, self.classes.label_code)
        paint = tuple(geom for geom in geoms if self.classes.is_paint[geom])
        return _SlotGeoms(slot, int(self.model.body_mocapid[body]), tuple(geoms), paint)

    def _assign(self, record: SceneRecord) -> list[_SlotGeoms]:
        """The slot of each actor: the first free one of its asset, so that a record always gets the same slots."""
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
        """Moves the actors of a record to their poses, and all others below the middle of the town."""
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
            key_points=dict(actor_type.facts.key_points),
        )

    def _texture(self, face: Face, albedo: SurfaceAlbedo) -> UInt8Image:
        """The texture of a face. The last ones are kept, because a dataset shows one patch thousands of times."""
        key: str = (
            albedo
            if isinstance(albedo, str)
            else f"{albedo.shape} {hashlib.blake2b(albedo.tobytes(), digest_size=16).hexdigest()}"
        )
        textures = self._textures
        if (face.name, key) not in textures:
            textures[face.name, key] = face.texture(albedo)
            if len(textures) > max(FACES_KEPT, TEXTURES_PER_FACE * len(self.faces)):
                textures.popitem(last=False)
        textures.move_to_end((face.name, key))
        return textures[face.name, key]
