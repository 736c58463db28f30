"""The appearance of pictures, as far as trained weights depend on it: assets, light and renderer.

Weights record the appearance (the *look*) that they were trained on. When towns, light, camera or renderer change, the
networks may have to be trained again, and `gear models` says so.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import Any

import mujoco

from gear.camera.contact_shadows import MOST_HIDDEN, sky_share_beside
from gear.camera.response import response_for
from gear.camera.water import FILM_F90
from gear.dataset.plan import Plan
from gear.values.errors import FieldError, GearError
from gear.values.serial import Json, from_json, to_json
from gear.world.assets.asset_hash import assets_digest
from gear.world.assets.library import AssetLibrary
from gear.world.weather.air import even_share
from gear.world.weather.light import lighting_of
from gear.world.weather.presets import PRESETS, wetness

SKY_FACE_PX = 8
"""Size of the sky map that is hashed; a small map is enough to detect changes of the light."""

HASH_LENGTH = 16

PLANNED = (("town",), ("assets",), ("renderer", "name"), ("versions", "mujoco"))
"""Keys in the content of plans that `look_of` reads: names and hashes."""

ALIKE = {"raster": "filament"}
"""Common name of renderers for which no network was found to give different results (docs/explanation/rendering.md)."""

RAMP = (0.01, 0.05, 0.2, 0.5, 0.8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """Everything that decides how pictures look, apart from seeds and scenes.

    Attributes:
        assets: sha256 of all assets that the pictures of a town can show, by name of the town.
        renderers: names of the renderers, sorted; renderers with the same look share one name.
        light: sha256 of the sun and sky of all weather presets, and of the camera's response to them.
        mujoco: minor release of MuJoCo, with which renderers change.
    """

    assets: dict[str, str]
    renderers: tuple[str, ...]
    light: str
    mujoco: str

    @property
    def hash(self) -> str:
        """16 hexadecimal digits; equal looks have equal hashes."""
        return _digest(to_json(self))[:HASH_LENGTH]

    def differences(self, other: Look) -> list[str]:
        """The differences between two looks, as words; empty for equal looks."""
        towns = sorted(
            town for town in self.assets.keys() | other.assets.keys() if self.assets.get(town) != other.assets.get(town)
        )
        found = [f"assets of {', '.join(towns)}"] if towns else []
        return found + [
            name for name in ("renderers", "light", "mujoco") if getattr(self, name) != getattr(other, name)
        ]


def look_of(plans: Iterable[Plan]) -> Look:
    """The look of datasets, from the plans that they were collected with.

    The light is that of the installed version of gear, because plans record only the version's name.
    """
    contents = [plan.content for plan in plans]
    return Look(
        assets={content["town"]: content["assets"] for content in contents},
        renderers=tuple(sorted({_look_name(content["renderer"]["name"]) for content in contents})),
        light=light_digest(),
        mujoco=", ".join(sorted({_minor(content["versions"]["mujoco"]) for content in contents})),
    )


def current_look(trained: Look, digests: dict[str, str] | None = None) -> Look:
    """The look that the same towns have in the installed version; towns that are not installed are left out.

    Args:
        trained: look to compare with.
        digests: asset hashes of towns that were read before; hashes that are computed are added.
    """
    known = {} if digests is None else digests
    for town in trained.assets.keys() - known.keys():
        with contextlib.suppress(GearError):
            known[town] = assets_digest(AssetLibrary.for_town(town))
    return Look(
        assets={town: known[town] for town in trained.assets if town in known},
        renderers=trained.renderers,
        light=light_digest(),
        mujoco=_minor(mujoco.__version__),
    )


def read_look(value: Json) -> Look | None:
    """Reads a look from JSON; None if the JSON is not a look."""
    try:
        return from_json(Look, value, "look")
    except FieldError:
        return None


@cache
def light_digest() -> str:
    """sha256 of the light of every preset by day: sun and sky, the ambient occlusion of road users, the reflections of
    wet ground, and the camera's response to a ramp.

    Shipped weights are not trained on nights, so nights are left out.
    """
    presets: dict[str, Any] = {}
    for name, weather in PRESETS.items():
        if weather.night:
            continue
        light = lighting_of(weather, sky_face_px=SKY_FACE_PX)
        numbers = [*light.towards_sun, *light.sun, *light.ambient]
        levels = [int(level) for level in light.sky_faces.mean(axis=(0, 1)).round()]
        ramp = [round(float(value), 2) for value in response_for("filament", weather).curve(RAMP)]
        hidden = round(MOST_HIDDEN * sky_share_beside(even_share(weather, light)), 2)
        film = round(FILM_F90 * wetness(weather), 2)
        presets[name] = [to_json(weather), [f"{number:.3g}" for number in numbers], levels, ramp, hidden, film]
    return _digest(presets)


def _look_name(renderer: str) -> str:
    return ALIKE.get(renderer, renderer)


def _minor(version: str) -> str:
    return ".".join(version.split(".")[:2])


def _digest(value: Json) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
