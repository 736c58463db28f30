"""Makes open ground wet: its materials become darker and smoother.

Water fills the pores of the material. The material therefore reflects less diffuse light, and its surface reflects more
sharply.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np
import numpy.typing as npt

from gear.contracts.rendering import has_own_colour
from gear.values.labels import LABEL_BY_NAME
from gear.world.compilation.instances import class_name

if TYPE_CHECKING:
    from gear.world.compilation.quiet_mjcf import mjcf

WET_LABELS = frozenset({"road", "road_marking", "sidewalk", "parking", "ground"})
"""Labels of the ground that rain makes wet."""

GeomMaterial = tuple[str, str | None]
"""The default class of a geom, and the material that the geom itself specifies; None for no such material."""

_DARKENING = 0.45
_SMOOTHING = 0.7


def wet_materials(root: mjcf.RootElement, amount: float, geom_materials: Sequence[GeomMaterial] = ()) -> None:
    """Makes the materials of open ground wet: darker and smoother. Used before compiling; `wet_own_colours` does
    the same for colours that belong to no material.

    Args:
        root: MJCF of a world, changed in place.
        amount: wetness, 0 for dry to 1 for as wet as possible.
        geom_materials: default class and own material of geoms that are copied as text and are not in the tree.
    """
    for material in _open_materials(root, geom_materials):
        rgba = np.array(material.rgba if material.rgba is not None else (1.0, 1.0, 1.0, 1.0))
        rgba[:3] *= 1 - _DARKENING * amount
        material.rgba = rgba
        if material.roughness is not None and material.roughness >= 0:
            material.roughness = float(material.roughness * (1 - _SMOOTHING * amount))


def wet_own_colours(model: mujoco.MjModel, label_code: npt.NDArray[np.uint8], amount: float) -> None:
    """Darkens the geoms of open ground that have a colour of their own instead of a material.

    Args:
        model: compiled model; the colours of its geoms are changed in place.
        label_code: (ngeom,) uint8 label codes of the geoms.
        amount: wetness, 0 for dry to 1 for as wet as possible.
    """
    is_open = np.isin(label_code, [LABEL_BY_NAME[name].code for name in WET_LABELS])
    model.geom_rgba[is_open & has_own_colour(model), :3] *= np.float32(1 - _DARKENING * amount)


def _open_materials(root: mjcf.RootElement, geom_materials: Sequence[GeomMaterial]) -> list[Any]:
    """The materials of geoms with a label in `WET_LABELS`, each once."""
    pairs: list[tuple[Any, Any]] = [
        (root.find("default", name), None if own is None else root.find("material", own))
        for name, own in geom_materials
        if _is_open(name)
    ]
    pairs += [(geom.dclass, geom.material) for geom in root.find_all("geom") if _is_open(class_name(geom.dclass))]
    found = (own if own is not None else _inherited_material(default) for default, own in pairs)
    return list({material.full_identifier: material for material in found if material is not None}.values())


def _is_open(class_name: str) -> bool:
    return class_name.rsplit("/", 1)[-1].partition(".")[0] in WET_LABELS


def _inherited_material(default: Any) -> Any:
    """The material that a default class, or a class around it, assigns to geoms."""
    # Of a class that did not pass dm_control only the name is known; such classes name no material.
    while default is not None and not isinstance(default, str) and default.tag == "default":
        if default.geom is not None and default.geom.material is not None:
            return default.geom.material
        default = default.parent
    return None
