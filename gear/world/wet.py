"""Wet ground: what lies open to the rain, darker and smoother.

Water fills the pores, so that less light comes back from inside, and the surface mirrors more sharply.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from gear.world.instances import class_name
from gear.world.materials import NO_OWN_RGBA
from gear.world.quiet_mjcf import mjcf

WET_LABELS = frozenset({"road", "road_marking", "sidewalk", "parking", "ground"})
"""What lies open to the rain and holds its water."""

Worn = tuple[str, str | None]
"""A default class, and a material that a geom has besides."""

_DARKENING = 0.45
_SMOOTHING = 0.7


def wet_ground(root: mjcf.RootElement, amount: float, worn: Sequence[Worn] = ()) -> None:
    """Wets materials and colours of open ground.

    Args:
        root: of a world.
        amount: 0 is dry, 1 as wet as can be.
        worn: default class and own material of geoms of the world that are not in the tree; none has a colour of its
            own beside its class's.
    """
    dim = 1 - _DARKENING * amount
    geoms = [geom for geom in root.find_all("geom") if _is_open(class_name(geom.dclass))]
    colours = list(_own_colours(root, geoms, worn))
    for material in _open_materials(root, geoms, worn):
        material.rgba = _dimmed(material.rgba if material.rgba is not None else (1.0, 1.0, 1.0, 1.0), dim)
        if material.roughness is not None and material.roughness >= 0:
            material.roughness = float(material.roughness * (1 - _SMOOTHING * amount))
    for geom, colour in colours:
        geom.rgba = _dimmed(colour, dim)


def _dimmed(rgba: Any, share: float) -> Any:
    return np.array(rgba) * (share, share, share, 1.0)


def _own_colours(root: mjcf.RootElement, geoms: Sequence[Any], worn: Sequence[Worn]) -> Iterator[tuple[Any, Any]]:
    """Geoms, and the geoms of default classes, that have a colour before their material's; with that colour."""
    for default in {name: root.find("default", name) for name, _ in worn if _is_open(name)}.values():
        colour = _inherited(default, "rgba")
        if colour is not None:
            yield default.geom, colour
    for geom in geoms:
        colour = geom.rgba if geom.rgba is not None else _inherited(geom.dclass, "rgba")
        if colour is not None and tuple(colour) != NO_OWN_RGBA:
            yield geom, colour
        elif geom.material is None and _inherited(geom.dclass, "material") is None:
            yield geom, NO_OWN_RGBA


def _open_materials(root: mjcf.RootElement, geoms: Sequence[Any], worn: Sequence[Worn]) -> list[Any]:
    """Materials of open ground, each once."""
    pairs: list[tuple[Any, Any]] = [
        (root.find("default", name), None if own is None else root.find("material", own))
        for name, own in worn
        if _is_open(name)
    ]
    pairs += [(geom.dclass, geom.material) for geom in geoms]
    found = (own if own is not None else _inherited(default, "material") for default, own in pairs)
    return list({material.full_identifier: material for material in found if material is not None}.values())


def _is_open(class_name: str) -> bool:
    return class_name.rsplit("/", 1)[-1].partition(".")[0] in WET_LABELS


def _inherited(default: Any, attribute: str) -> Any:
    """What a default class, or one that it stands in, gives its geoms."""
    # Of a class that went around dm_control only the name is here, and such a one gives neither material nor colour.
    while default is not None and not isinstance(default, str) and default.tag == "default":
        value = None if default.geom is None else getattr(default.geom, attribute)
        if value is not None:
            return value
        default = default.parent
    return None
