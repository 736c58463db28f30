"""Builds the camera pipeline of a weather: fog and haze, rain, water on the ground, and contact shadows."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import numpy as np

from gear.camera.air import Air, Fog
from gear.camera.contact_shadows import ContactShadows
from gear.camera.effects import CameraEffects
from gear.camera.night import Night
from gear.camera.occlusion_cache import cached_occlusion
from gear.camera.pipeline import CameraPipeline
from gear.camera.rain import Rain
from gear.camera.response import encode_srgb, response_for
from gear.camera.water import Water
from gear.values.frames import Shape
from gear.values.scene import Weather
from gear.world.weather.light import (
    Floats,
    Lighting,
    airlight,
    ambient_radiance,
    lamplit_houses,
    lighting_of,
    mirrored_radiance,
)
from gear.world.weather.presets import wetness

DENSEST_FOG_PER_M = 0.05
"""Extinction coefficient for CARLA's fog density of 100 percent, 1/m: objects at 60 m can no longer be recognised."""

RAIN_PER_M = 0.0035
"""Extinction coefficient of the veil of rain (the haze of distant drops) for 100 percent precipitation, 1/m."""

RAIN_FROM_M, RAIN_FALLOFF = 0.75, 0.1
"""Start distance (metres) and falloff of the veil of rain. They equal those of the fog in CARLA's presets for rain."""

AEROSOL_PER_M = 1.6e-4
"""Extinction coefficient of clear air by aerosol, 1/m: a visibility of 24 km."""

MOLECULES_PER_M = (7.6e-6, 1.16e-5, 2.3e-5)
"""Extinction coefficients by Rayleigh scattering at 610, 550 and 465 nm (red, green, blue), at sea level, 1/m."""

FALLOFF_PER_M = 0.0693
"""Rate at which fog gets thinner with height for a falloff of 1, 1/m: the density halves every ten metres, as in Unreal
Engine.
"""


FULL_PUDDLES = 0.32
"""Share of open ground under water for `precipitation_deposits` of 100 percent."""

DROP_LIGHT = 1.25
"""Radiance of a rain drop relative to the horizon; a drop is brighter, because it refracts light of a large part of the
sky.
"""

SHADE_SKY_FACE_PX = 8
"""Side in pixels of the sky's cube faces when only the light of the sky is computed, without a picture of the sky."""

_MIRROR_ROWS, _MIRROR_COLUMNS = 128, 512


def camera_pipeline(
    weather: Weather,
    renderer_name: str,
    town: str,
    effects: CameraEffects | None = None,
    night: Night | None = None,
    shapes: Mapping[str, Shape] | None = None,
) -> CameraPipeline:
    """Builds the camera pipeline, which converts a renderer's frames of a town in one weather to pictures.

    Args:
        weather: light and air.
        renderer_name: name of the renderer.
        town: name of the town, which determines where its puddles are.
        effects: camera effects; None for none.
        night: lamps of the town at night; None by day.
        shapes: triangles of the assets, by name; they cast contact shadows; None for no contact shadows.
    """
    left = night.sky_level if night else 1.0
    mirrored = left * mirrored_radiance(weather, _MIRROR_ROWS, _MIRROR_COLUMNS)
    if night is not None:
        mirrored += night.lit * lamplit_houses(_MIRROR_ROWS)
    return CameraPipeline(
        response=response_for(renderer_name, weather),
        contact_shadows=None if shapes is None else contact_shadows_of(weather, renderer_name, shapes),
        night=night,
        air=air_of(weather, renderer_name, left),
        water=Water(
            town=town,
            share=FULL_PUDDLES * weather.precipitation_deposits / 100,
            ripples=min(1.0, 1.5 * weather.precipitation / 100),
            film=wetness(weather),
            mirrored=_shown(mirrored, renderer_name).astype(np.float32),
        ),
        rain=Rain.of(
            weather.precipitation,
            weather.wind_intensity,
            np.minimum(_shown(left * DROP_LIGHT * airlight(weather).mean(axis=0), renderer_name), 1.0),
        ),
        effects=effects or CameraEffects(),
    )


def contact_shadows_of(weather: Weather, renderer_name: str, shapes: Mapping[str, Shape]) -> ContactShadows:
    """The contact shadows that assets cast on the ground in the light of a weather.

    Args:
        weather: the weather.
        renderer_name: name of the renderer.
        shapes: triangles of the assets by name.
    """
    light = lighting_of(weather, sky_face_px=SHADE_SKY_FACE_PX)
    return ContactShadows(
        shapes=shapes,
        even_share=even_share(weather, light),
        is_display=renderer_name == "classic",
        occlusion_of=cached_occlusion,
    )


def even_share(weather: Weather, light: Lighting) -> float:
    """The share, 0..1, of the light on open level ground that does not come directly from the sun.

    Args:
        weather: the weather.
        light: the light of the same weather, of any size of sky pictures.
    """
    even = ambient_radiance(weather)[0].mean()
    sun = light.sun.mean() * max(light.towards_sun[2], 0) / math.pi
    return float(even / (even + sun))


def _shown(light: Floats, renderer_name: str) -> Floats:
    """Converts linear light to the units of a renderer's frames; the classic renderer's frames hold display values."""
    return encode_srgb(light) if renderer_name == "classic" else light


def air_of(weather: Weather, renderer_name: str, left: float = 1.0) -> Air:
    """The air of a weather (fog, haze and clear air) in the units of a renderer's frames.

    Args:
        weather: the weather.
        renderer_name: name of the renderer; frames of the classic renderer hold display values, all others linear
            light.
        left: share of the air's light that remains at night; 1 by day.
    """
    aerosol = AEROSOL_PER_M * weather.mie_scattering_scale / 0.03
    molecules = np.array(MOLECULES_PER_M) * weather.rayleigh_scattering_scale / 0.0331
    return Air(
        fogs=fogs_of(weather),
        clear_per_m=weather.scattering_intensity * (aerosol + molecules),
        ring=_shown(left * airlight(weather), renderer_name),
    )


def fogs_of(weather: Weather) -> tuple[Fog, ...]:
    """The fog and the veil of rain of a weather; empty for clear air.

    CARLA's fog density ranges from 0 percent (clear air) to 100 percent (thick fog). The fog has the start distance and
    falloff of the weather, the veil of rain those of CARLA's presets. If these values are equal, the fog and the veil
    are joined to one fog.

    Args:
        weather: the weather.
    """
    fog = DENSEST_FOG_PER_M * (weather.fog_density / 100) ** 1.5
    rain = RAIN_PER_M * math.pow(weather.precipitation / 100, 1.5)
    usual = Fog(
        per_m=float(weather.scattering_intensity * rain), from_m=RAIN_FROM_M, thinning_per_m=_thinning(RAIN_FALLOFF)
    )
    own = Fog(
        per_m=float(weather.scattering_intensity * fog),
        from_m=weather.fog_distance_m,
        thinning_per_m=_thinning(weather.fog_falloff),
    )
    # One fog takes half the time of two.
    if (own.from_m, own.thinning_per_m) == (usual.from_m, usual.thinning_per_m):
        both = dataclasses.replace(own, per_m=float(weather.scattering_intensity * (fog + rain)))
        return tuple(one for one in (both,) if one.per_m > 0)
    return tuple(one for one in (own, usual) if one.per_m > 0)


def _thinning(falloff: float) -> float:
    return FALLOFF_PER_M * falloff
