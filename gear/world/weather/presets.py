"""The weather presets, and the changes that a weather makes to a world's MJCF."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from gear.config.nodes import Mapping, Scalar, parse_file
from gear.config.reader import read_node
from gear.contracts.rendering import FULL_SCALE_LUX
from gear.values.frames import UInt8Image
from gear.values.resources import data_dir
from gear.values.scene import Weather
from gear.world.compilation import quiet_mjcf
from gear.world.compilation.instances import free_name
from gear.world.weather.light import FACE_ORDER, Floats, Lighting, encode_srgb, lighting_of
from gear.world.weather.wet_ground import GeomMaterial, wet_materials

if TYPE_CHECKING:
    from gear.world.compilation.quiet_mjcf import mjcf

_CLASSIC_WHITE = 1.1
_CLASSIC_SKY_SHARE = (0.48, 0.95)
_CLASSIC_TINT = 0.2
_CLASSIC_LEAST_SUN = 1e-3
"""Smallest strength of the sun in OpenGL; Filament's intensity is divided by this strength."""


def _read_presets() -> dict[str, Weather]:
    path = data_dir("configs") / "weather" / "presets.yml"
    root = parse_file(path)
    if not isinstance(root, Mapping):
        raise TypeError(f"{path} holds no presets")
    presets = {}
    for name, (place, node) in root.entries.items():
        entries = node.entries if isinstance(node, Mapping) else {}
        named = Mapping({"name": (place, Scalar(name, False, place)), **entries}, node.place)
        presets[name] = read_node(Weather, named, name)
    return presets


PRESETS: dict[str, Weather] = _read_presets()
"""Weather presets by name, from `configs/weather/presets.yml`."""


def apply_weather(
    root: mjcf.RootElement,
    weather: Weather,
    lighting: Lighting | None = None,
    geom_materials: Sequence[GeomMaterial] = (),
) -> None:
    """Replaces the light of a composed world by the light of a weather, and makes the ground wet.

    The world gets a light `sun`, a skybox texture `sky`, and a cube texture as image-based light for Filament. The
    wetter the weather is, the darker and smoother are the materials of open ground. A custom text field makes Filament
    interpret colours of materials and geoms as linear albedo.

    Args:
        root: MJCF of the world, changed in place.
        weather: the weather.
        lighting: the light of the weather; None computes the light.
        geom_materials: default class and own material (or None) of geoms that are copied as text and are not in the
            tree.
    """
    lighting = lighting or lighting_of(weather)
    _remove_old_light(root)
    _add_sky(root, lighting)
    _add_sun(root, lighting, weather.night)
    amount = wetness(weather)
    if amount > 0:
        wet_materials(root, amount, geom_materials)
    root.custom.add("text", name="filament.material.base_color_type", data="linear")
    # Filament's ambient occlusion is off: the camera pipeline has its own, which is faster and leaks no memory.
    root.custom.add("numeric", name="filament.ao.enabled", data=[0])


def wetness(weather: Weather) -> float:
    """Wetness of open ground, 0..1: the largest of the weather's wetness, puddles and rain.

    Args:
        weather: the weather.
    """
    return float(min(1.0, max(weather.wetness, 1.4 * weather.precipitation_deposits, weather.precipitation) / 100))


def _remove_old_light(root: mjcf.RootElement) -> None:
    for light in root.find_all("light"):
        light.remove()
    for texture in root.find_all("texture"):
        if texture.type == "skybox":
            texture.remove()
    for element in [*root.find_all("text"), *root.find_all("numeric")]:
        if element.name.rsplit("/", 1)[-1].startswith("filament."):
            element.remove()


def _add_sky(root: mjcf.RootElement, lighting: Lighting) -> None:
    """Adds the picture of the sky, and the light in a street as image-based light."""
    _add_cube(root, "sky", "skybox", lighting.sky_faces)
    street = _add_cube(root, "street_light", "cube", lighting.street_faces)
    root.worldbody.add("light", name="sky", type="image", texture=street, intensity=FULL_SCALE_LUX, diffuse=(0, 0, 0))


def _add_cube(root: mjcf.RootElement, name: str, kind: str, faces: UInt8Image) -> Any:
    strip = cv2.imencode(".png", faces[..., ::-1], [cv2.IMWRITE_PNG_COMPRESSION, 1])[1].tobytes()
    return root.asset.add(
        "texture",
        name=free_name(root, "texture", name),
        type=kind,
        file=quiet_mjcf.mjcf.Asset(strip, ".png"),
        gridsize=(6, 1),
        gridlayout=FACE_ORDER,
        colorspace="sRGB",
    )


def _add_sun(root: mjcf.RootElement, lighting: Lighting, night: float) -> None:
    """Adds the sun for both renderers, and the ambient light of the sky for the classic OpenGL renderer.

    Filament multiplies `intensity` and `diffuse`; OpenGL uses only `diffuse`. OpenGL adds lights as display values, so
    its shares of sun and sky are shares of display values. Its ambient light is that of the headlight, because shadows
    would also remove the sun's ambient light. At night neither renderer has a sun: the camera pipeline converts frames
    of ambient light to night, and a brighter white would clip in them.
    """
    sunlit = lighting.ambient + lighting.sun
    sky_share = float(np.clip((_display(lighting.ambient) / _display(sunlit)).mean(), *_CLASSIC_SKY_SHARE))
    strength = max((_CLASSIC_WHITE - sky_share) * (1 - night), _CLASSIC_LEAST_SUN)
    root.worldbody.add(
        "light",
        name="sun",
        type="directional",
        dir=tuple(-lighting.towards_sun),
        pos=tuple(200 * lighting.towards_sun),
        diffuse=tuple(strength * lighting.sun / lighting.sun.max()),
        ambient=(0, 0, 0),
        specular=(0.1 * (1 - night),) * 3,
        intensity=float(lighting.sun.max() * FULL_SCALE_LUX / strength),
        castshadow=True,
    )
    tint = (lighting.ambient / lighting.ambient.mean()) ** _CLASSIC_TINT
    headlight = root.visual.headlight
    headlight.active, headlight.ambient = 1, tuple(sky_share * tint)
    headlight.diffuse = headlight.specular = (0, 0, 0)


def _display(light: Floats) -> Floats:
    return encode_srgb(light).astype(np.float64) / 255
