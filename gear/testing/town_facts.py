"""A town under test: compiled by MuJoCo alone, composed by gear, and measured with rays."""

from __future__ import annotations

import time
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt

from gear.config.nodes import parse_file
from gear.config.reader import read_node
from gear.testing.tiny_town import CLEAR
from gear.values.errors import TownError, UnknownNameError
from gear.values.geometry import Array
from gear.values.resources import data_dir
from gear.world.assets.library import AssetLibrary
from gear.world.compilation.model_compilation import GROUND_GROUP, OBSTACLE_GROUP
from gear.world.roads.lanes import LaneGraph
from gear.world.scene_spec import SceneLibrary
from gear.world.world import World

DOWN = np.array([0.0, 0.0, -1.0])
VISIBLE_GROUPS = (0, 1, 2)

RAY_START_M = 0.6
"""Height above the expected ground at which rays to the ground start: above kerbs, below anything that hangs."""


@dataclass(frozen=True, slots=True, eq=False)
class Rays:
    """Casts rays at the geoms of some geom groups of a MuJoCo model.

    Attributes:
        model: the compiled model.
        data: MuJoCo data of the model with kinematics up to date.
        groups: the geom groups, 0 to 5, that rays can hit.
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    groups: tuple[int, ...]

    def first_hit(self, start_m: Array, along: Array) -> tuple[float, int]:
        """Distance to the first geom on a ray, as a multiple of `along`, and the geom's id; infinity and -1 for no hit.

        Args:
            start_m: start of the ray in the world, metres.
            along: direction of the ray.
        """
        groups, hit = np.zeros(6, np.uint8), np.full(1, -1, np.int32)
        groups[list(self.groups)] = 1
        distance = mujoco.mj_ray(self.model, self.data, start_m, along, groups, 1, -1, hit)
        return (float(distance), int(hit[0])) if distance >= 0 else (np.inf, -1)

    def height_m(self, point_m: npt.ArrayLike, above_m: float) -> float:
        """Height of the first geom below a point, with a ray that starts `above_m` above the point; NaN for no
        hit.

        Args:
            point_m: (3,) point in the world.
            above_m: height above the point at which the ray starts, metres.
        """
        start_m = np.asarray(point_m, dtype=np.float64) - above_m * DOWN
        distance_m, geom = self.first_hit(start_m, DOWN)
        return float(start_m[2] - distance_m) if geom >= 0 else float("nan")

    def name(self, geom: int) -> str:
        """The name of a geom in messages; for unnamed geoms its number and its body.

        Args:
            geom: id of the geom.
        """
        return (
            self.model.geom(geom).name or f"number {geom} of body {self.model.body(self.model.geom_bodyid[geom]).name}"
        )


@dataclass(frozen=True, eq=False)
class TownUnderTest:
    """A town and its scenes with everything that the town contract checks; slow parts are computed at first use.

    Attributes:
        library: the town's MJCF file and the folders of its assets.
        scenes: the town's scene library.
    """

    library: AssetLibrary
    scenes: SceneLibrary

    @property
    def path(self) -> Path:
        """The path of the town's MJCF file."""
        return self.library.town

    @cached_property
    def compiled(self) -> tuple[mujoco.MjSpec, mujoco.MjModel, float]:
        """MuJoCo's spec and model of the town, and the seconds that compiling took.

        Raises:
            TownError: MuJoCo cannot compile the town.
        """
        began_s = time.perf_counter()
        try:
            spec = mujoco.MjSpec.from_file(str(self.path))
            model = spec.compile()
        except ValueError as error:
            raise TownError(self.path, f"MuJoCo cannot compile it: {' '.join(str(error).split())}") from error
        return spec, model, time.perf_counter() - began_s

    @cached_property
    def graph(self) -> LaneGraph:
        """The town's lanes, walks and parking bays.

        Raises:
            TownError: a lane, walk or bay is malformed, or the town has no bounds.
        """
        return LaneGraph.from_model(self.compiled[1], self.path)

    @cached_property
    def visible(self) -> Rays:
        """Rays that hit only the visible geoms of the town, without boards or actors."""
        model = self.compiled[1]
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        return Rays(model, data, VISIBLE_GROUPS)

    @cached_property
    def first_world(self) -> tuple[World, float]:
        """The world of the first scene, and the seconds that composing and compiling took."""
        began_s = time.perf_counter()
        world = self._composed(next(iter(self.scenes.scenes)))
        return world, time.perf_counter() - began_s

    @cached_property
    def ground(self) -> Rays:
        """Rays that hit only the collision geoms of the ground."""
        return self._placement_rays(GROUND_GROUP)

    @cached_property
    def obstacles(self) -> Rays:
        """Rays that hit the collision geoms other than the ground, with the first scene's boards."""
        return self._placement_rays(OBSTACLE_GROUP)

    def world(self, scene: str) -> World:
        """The world of a scene, composed and compiled; that of the first scene is shared with `first_world`.

        Args:
            scene: name of the scene.

        Raises:
            UnknownNameError: there is no scene with this name.
            TownError: gear cannot compose the world.
        """
        if scene not in self.scenes.scenes:
            raise UnknownNameError(f"scene of {self.scenes.town}", scene, self.scenes.scenes)
        if scene == next(iter(self.scenes.scenes)):
            return self.first_world[0]
        return self._composed(scene)

    def _composed(self, scene: str) -> World:
        return World.build(town=self.path, scene_name=scene, scene=self.scenes.scenes[scene], weather=CLEAR)

    def _placement_rays(self, group: int) -> Rays:
        model = self.first_world[0].placement_model
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        return Rays(model, data, (group,))


@lru_cache(maxsize=2)
def town_under_test(town: str, scenes: str) -> TownUnderTest:
    """A town with its scenes, shared by all checks of the town contract.

    Args:
        town: name of the town, or path of its MJCF.
        scenes: path of the scene library; empty for gear's own library of that town.

    Raises:
        UnknownNameError: there is no such town or scene library.
        ConfigError: the scene library cannot be read.
    """
    library = AssetLibrary.for_town(town)
    path = Path(scenes) if scenes else data_dir("configs") / "scenes" / f"{library.town_name}.yml"
    if not path.is_file():
        raise UnknownNameError("scene library", str(path), hint="(give the contract's `scenes` a path)")
    return TownUnderTest(library, read_node(SceneLibrary, parse_file(path)))
