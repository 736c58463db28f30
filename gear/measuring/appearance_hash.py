"""Hashes of a dataset's appearance: the assets, light, camera response and renderer on which trained weights
depend.

Weights files record the appearance (`Appearance`) of their training data. If the appearance of the installed version
differs from it, the networks may have to be trained again, and `gear models` says so.
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
"""Side length in pixels of the sky map that is hashed; a small map is enough to detect changes of the light."""

HASH_LENGTH = 16

PLANNED = (("town",), ("assets",), ("renderer", "name"), ("versions", "mujoco"))
"""Key paths in the content of a plan that decide the appearance of a dataset."""

ALIKE = {"raster": "filament"}
"""Renderers that count as another renderer, because networks give the same results (docs/explanation/rendering.md)."""

RAMP = (0.01, 0.05, 0.2, 0.5, 0.8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Appearance:
    """The appearance of a dataset's pictures: hashes and names of everything that decides it, apart from seeds and
    scenes.

    Attributes:
        assets: sha256 of all assets that the pictures of a town can show, by name of the town.
        renderers: names of the renderers, sorted; renderers with the same appearance share one name.
        light: sha256 of the light and the camera's response in all weather presets by day.
        mujoco: major and minor version of MuJoCo, such as `3.2`, because its renderer changes between minor releases.
    """

    assets: dict[str, str]
    renderers: tuple[str, ...]
    light: str
    mujoco: str

    @property
    def hash(self) -> str:
        """The first 16 hexadecimal digits of the appearance's sha256; equal appearances have equal hashes."""
        return _digest(to_json(self))[:HASH_LENGTH]

    def differences(self, other: Appearance) -> list[str]:
        """Names the parts in which two appearances differ, such as `light` or `assets of town10`; empty if they are
        equal.

        Args:
            other: the appearance with which this one is compared.
        """
        towns = sorted(
            town for town in self.assets.keys() | other.assets.keys() if self.assets.get(town) != other.assets.get(town)
        )
        found = [f"assets of {', '.join(towns)}"] if towns else []
        return found + [
            name for name in ("renderers", "light", "mujoco") if getattr(self, name) != getattr(other, name)
        ]


def appearance_of(plans: Iterable[Plan]) -> Appearance:
    """The appearance of datasets, computed from the plans that they were collected with.

    The light is computed with the installed version of gear, because a plan records only the version number of gear.
    """
    contents = [plan.content for plan in plans]
    return Appearance(
        assets={content["town"]: content["assets"] for content in contents},
        renderers=tuple(sorted({_appearance_name(content["renderer"]["name"]) for content in contents})),
        light=light_digest(),
        mujoco=", ".join(sorted({_minor(content["versions"]["mujoco"]) for content in contents})),
    )


def current_appearance(trained: Appearance, digests: dict[str, str] | None = None) -> Appearance:
    """The appearance that the towns of a training run have in the installed version of gear.

    Towns that are not installed are left out.

    Args:
        trained: appearance of the training data, which names the towns.
        digests: sha256 of assets by town, as a cache: hashes in it are used, and newly computed ones are added.
    """
    known = {} if digests is None else digests
    for town in trained.assets.keys() - known.keys():
        with contextlib.suppress(GearError):
            known[town] = assets_digest(AssetLibrary.for_town(town))
    return Appearance(
        assets={town: known[town] for town in trained.assets if town in known},
        renderers=trained.renderers,
        light=light_digest(),
        mujoco=_minor(mujoco.__version__),
    )


def read_appearance(value: Json) -> Appearance | None:
    """Reads an appearance from the JSON `value`; returns None if the JSON does not describe an appearance."""
    try:
        return from_json(Appearance, value, "look")
    except FieldError:
        return None


@cache
def light_digest() -> str:
    """The sha256 of the light in every weather preset by day.

    It covers sun and sky, the ambient occlusion of road users, the reflections of wet ground, and the camera's response
    to a ramp of grey values. Presets by night are left out, because shipped weights are not trained on them.
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


def _appearance_name(renderer: str) -> str:
    return ALIKE.get(renderer, renderer)


def _minor(version: str) -> str:
    return ".".join(version.split(".")[:2])


def _digest(value: Json) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
