"""A town under test: compiled by stock MuJoCo, compiled by gear, and felt with rays."""

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
"""Ground is looked for from so far above where it should be: higher than kerbs, lower than whatever hangs above."""


@dataclass(frozen=True, slots=True, eq=False)
class Rays:
    """Casts rays at some geom groups of a posed model."""

    model: mujoco.MjModel
    data: mujoco.MjData
    groups: tuple[int, ...]

    def first_hit(self, start_m: Array, along: Array) -> tuple[float, int]:
        """Distance in lengths of `along` to the first geom that is hit, and its id; infinity and -1 for nothing."""
        groups, hit = np.zeros(6, np.uint8), np.full(1, -1, np.int32)
        groups[list(self.groups)] = 1
        distance = mujoco.mj_ray(self.model, self.data, start_m, along, groups, 1, -1, hit)
        return (float(distance), int(hit[0])) if distance >= 0 else (np.inf, -1)

    def height_m(self, point_m: npt.ArrayLike, above_m: float) -> float:
        """Height of what is hit first below a place, looking down from so far above it; NaN for nothing."""
        start_m = np.asarray(point_m, dtype=np.float64) - above_m * DOWN
        distance_m, geom = self.first_hit(start_m, DOWN)
        return float(start_m[2] - distance_m) if geom >= 0 else float("nan")

    def name(self, geom: int) -> str:
        """As messages name a geom."""
        return (
            self.model.geom(geom).name or f"number {geom} of body {self.model.body(self.model.geom_bodyid[geom]).name}"
        )


@dataclass(frozen=True, eq=False)
class TownUnderTest:
    """Everything that the contract looks at; what is costly is made when first asked for."""

    library: AssetLibrary
    scenes: SceneLibrary

    @property
    def path(self) -> Path:
        """The town's MJCF."""
        return self.library.town

    @cached_property
    def compiled(self) -> tuple[mujoco.MjSpec, mujoco.MjModel, float]:
        """By stock MuJoCo, and the seconds it took.

        Raises:
            TownError: MuJoCo refuses it.
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
        """Its lanes, walks and bays.

        Raises:
            TownError: one is malformed, or there are no bounds.
        """
        return LaneGraph.from_model(self.compiled[1], self.path)

    @cached_property
    def visible(self) -> Rays:
        """Rays that hit what can be seen of the town alone."""
        model = self.compiled[1]
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        return Rays(model, data, VISIBLE_GROUPS)

    @cached_property
    def first_world(self) -> tuple[World, float]:
        """Gear's world of the first scene, and the seconds it took."""
        began_s = time.perf_counter()
        world = self.world(next(iter(self.scenes.scenes)))
        return world, time.perf_counter() - began_s

    @cached_property
    def ground(self) -> Rays:
        """Rays that hit what one stands on."""
        return self._placement_rays(GROUND_GROUP)

    @cached_property
    def obstacles(self) -> Rays:
        """Rays that hit what stands in the way, the first scene's boards too."""
        return self._placement_rays(OBSTACLE_GROUP)

    def world(self, scene: str) -> World:
        """Gear's world of a scene, freshly composed.

        Raises:
            UnknownNameError: there is no such scene.
            TownError: gear cannot compose it.
        """
        if scene not in self.scenes.scenes:
            raise UnknownNameError(f"scene of {self.scenes.town}", scene, self.scenes.scenes)
        return World.build(town=self.path, scene_name=scene, scene=self.scenes.scenes[scene], weather=CLEAR)

    def _placement_rays(self, group: int) -> Rays:
        model = self.first_world[0].placement_model
        data = mujoco.MjData(model)
        mujoco.mj_kinematics(model, data)
        return Rays(model, data, (group,))


@lru_cache(maxsize=2)
def town_under_test(town: str, scenes: str) -> TownUnderTest:
    """A town by name or path with its scenes by path, or gear's own for that town if empty; shared by all checks.

    Raises:
        UnknownNameError: there is no such town or scene library.
        ConfigError: the scene library cannot be read.
    """
    library = AssetLibrary.for_town(town)
    path = Path(scenes) if scenes else data_dir("configs") / "scenes" / f"{library.town_name}.yml"
    if not path.is_file():
        raise UnknownNameError("scene library", str(path), hint="(give the contract's `scenes` a path)")
    return TownUnderTest(library, read_node(SceneLibrary, parse_file(path)))
