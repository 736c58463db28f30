"""What the pictures of a dataset look like, as far as weights trained on them can tell: assets, light, renderer.

Weights say which look they were trained on; when towns, light, camera or renderer change, they may have to be trained
again, and `gear models` says so.
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

from gear.camera.ground_shade import MOST_HIDDEN, worth_beside
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
"""A small sky says as much about the light as a large one."""

HASH_LENGTH = 16

PLANNED = (("town",), ("assets",), ("renderer", "name"), ("versions", "mujoco"))
"""What `look_of` reads in the content of plans, by key, and key in key: names and hashes."""

ALIKE = {"raster": "filament"}
"""Renderers that no network has been found to tell apart, and the name that their look goes by (docs/rendering.md)."""

RAMP = (0.01, 0.05, 0.2, 0.5, 0.8)


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """What decides how pictures look, seeds and scenes aside.

    Attributes:
        assets: sha256 of all that a town's pictures can show, by the town's name.
        renderers: their names, sorted; one name for those that look alike.
        light: sha256 of what the weather presets make of sun and sky, and of the camera's response to them.
        mujoco: its minor release; renderers change with it.
    """

    assets: dict[str, str]
    renderers: tuple[str, ...]
    light: str
    mujoco: str

    @property
    def hash(self) -> str:
        """16 hexadecimal digits; equal looks have equal ones."""
        return _digest(to_json(self))[:HASH_LENGTH]

    def differences(self, other: Look) -> list[str]:
        """What changed, in words; empty for equal looks."""
        towns = sorted(
            town for town in self.assets.keys() | other.assets.keys() if self.assets.get(town) != other.assets.get(town)
        )
        found = [f"assets of {', '.join(towns)}"] if towns else []
        return found + [
            name for name in ("renderers", "light", "mujoco") if getattr(self, name) != getattr(other, name)
        ]


def look_of(plans: Iterable[Plan]) -> Look:
    """The look of datasets, by what they were collected with.

    Their light is that of this version of gear: the plans do not say more of it than the version's name.
    """
    contents = [plan.content for plan in plans]
    return Look(
        assets={content["town"]: content["assets"] for content in contents},
        renderers=tuple(sorted({_look_name(content["renderer"]["name"]) for content in contents})),
        light=light_digest(),
        mujoco=", ".join(sorted({_minor(content["versions"]["mujoco"]) for content in contents})),
    )


def look_now(trained: Look, digests: dict[str, str] | None = None) -> Look:
    """What the same towns would look like if they were collected now; towns that are not installed are left out.

    Args:
        trained: what is to be compared.
        digests: of the assets of towns that were read already; gets those that are read now.
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
    """A look from JSON; None where it is none."""
    try:
        return from_json(Look, value, "look")
    except FieldError:
        return None


@cache
def light_digest() -> str:
    """sha256 of every preset by day with the light that follows from it, what road users keep of it from the ground,
    what wet ground mirrors, and the camera's response to a ramp.

    No shipped weights know nights.
    """
    presets: dict[str, Any] = {}
    for name, weather in PRESETS.items():
        if weather.night:
            continue
        light = lighting_of(weather, sky_face_px=SKY_FACE_PX)
        numbers = [*light.towards_sun, *light.sun, *light.ambient]
        levels = [int(level) for level in light.sky_faces.mean(axis=(0, 1)).round()]
        ramp = [round(float(value), 2) for value in response_for("filament", weather).curve(RAMP)]
        hidden = round(MOST_HIDDEN * worth_beside(even_share(weather, light)), 2)
        film = round(FILM_F90 * wetness(weather), 2)
        presets[name] = [to_json(weather), [f"{number:.3g}" for number in numbers], levels, ramp, hidden, film]
    return _digest(presets)


def _look_name(renderer: str) -> str:
    return ALIKE.get(renderer, renderer)


def _minor(version: str) -> str:
    return ".".join(version.split(".")[:2])


def _digest(value: Json) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()
