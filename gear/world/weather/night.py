"""A town at night: its lamps and lit windows, and the share of the ambient light that remains."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from gear.camera.lamp_shadows import Casters, LampShadows
from gear.camera.lamps import Headlamps
from gear.camera.night import Night
from gear.values.errors import TownError
from gear.values.labels import VEHICLES
from gear.values.rng import derive_rng
from gear.values.scene import Weather
from gear.world.weather.lamps import find_lamps, find_windows
from gear.world.weather.light import ambient_radiance
from gear.world.weather.presets import wetness
from gear.world.weather.shadow_casters import find_shadow_casters
from gear.world.world import World

LEVEL, SKY_LEVEL = 0.03, 0.14
"""Shares of the ambient light that remain at night, on the ground and in the sky."""

GAUGE_SHARE = 0.72
"""Distance between the two headlamps as a share of the vehicle's width."""


def night_of(world: World, weather: Weather, renderer_name: str) -> Night | None:
    """The lamps, lit windows and shadow casters of a world at night; None while the sun is up.

    Args:
        world: the world; its meshes must not have been released.
        weather: its `night` determines how much brighter lamps are than the sky.
        renderer_name: name of the renderer; frames of the classic renderer hold display values.

    Raises:
        TownError: the glass of a lamp has no finite surface.
    """
    if not weather.night:
        return None
    model = world.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    material = materials_of(model)
    level = LEVEL**weather.night
    try:
        lamps = find_lamps(model, data)
    except ValueError as error:
        problem = f"{error}; make the glass of lamps of meshes, boxes, cylinders, capsules or ellipsoids"
        raise TownError(world.library.town, problem) from error
    return Night(
        level=level,
        sky_level=SKY_LEVEL**weather.night,
        lit=1 - level,
        even=ambient_radiance(weather),
        lamps=lamps,
        windows=find_windows(model, data, derive_rng(0, "windows", world.town_name)),
        vehicles={
            name: Headlamps(
                front_m=actor_type.front_m,
                half_gauge_m=GAUGE_SHARE * actor_type.half_width_m if actor_type.vehicle.headlamps > 1 else 0.0,
            )
            for name, actor_type in world.types.items()
            if actor_type.vehicle is not None and actor_type.vehicle.headlamps
        },
        wetness=wetness(weather),
        is_signal=np.array([index >= 0 and model.mat_emission[index] > 0 for index in model.geom_matid]),
        is_lens=np.array([name == "lights" for name in material]),
        is_pane=lit_panes(material, world.classes.label_code),
        is_display=renderer_name == "classic",
        shadows=LampShadows(
            casters=Casters.of(find_shadow_casters(model, data, world.classes.label_code)), shapes=world.shapes
        ),
    )


def materials_of(model: mujoco.MjModel) -> list[str]:
    """The name of each geom's material, as in the geom's own MJCF file; "" for a geom without a material.

    Args:
        model: compiled model.

    Returns:
        One name per geom, by geom id.
    """
    return [model.mat(index).name.rsplit("/", 1)[-1] if index >= 0 else "" for index in model.geom_matid]


def lit_panes(material: list[str], label_code: npt.NDArray[np.uint8]) -> npt.NDArray[np.bool_]:
    """Finds the windows of vehicles with a lit interior, such as buses: (ngeom,) bool.

    Args:
        material: name of each geom's material, from `materials_of`.
        label_code: (ngeom,) uint8 label codes of the geoms.
    """
    codes = [kind.code for kind in VEHICLES.values() if kind.has_lit_interior]
    return np.asarray((np.array(material) == "glass") & np.isin(label_code, codes))
