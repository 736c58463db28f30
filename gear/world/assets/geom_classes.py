"""Finds the semantic label of each geom, from the name of its default class in the MJCF."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt

from gear.values.errors import TownError
from gear.values.labels import LABEL_BY_NAME

HIDDEN_CODE = 255
"""Label code of geoms that no renderer draws."""

FIRST_HIDDEN_GROUP = 3
"""First geom group that is hidden. Geoms of this group and of higher groups, such as collision geoms, are not drawn."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class GeomClasses:
    """The semantic labels of the geoms of a compiled model, by geom id.

    Attributes:
        label_code: (ngeom,) uint8 label codes; `HIDDEN_CODE` for hidden geoms.
        is_paint: (ngeom,) bool: whether the geom's colour is drawn at random for each sample.
        is_face: (ngeom,) bool: whether the geom is a face that can show a patch.
    """

    label_code: npt.NDArray[np.uint8]
    is_paint: npt.NDArray[np.bool_]
    is_face: npt.NDArray[np.bool_]


def unprefixed_class(classname: str) -> str:
    """The name of a default class in its own file, without the prefix `<file>/` that dm_control adds when it
    composes files.

    Args:
        classname: name of the class in the composed world, such as `town10/building.brick`.
    """
    return classname.rsplit("/", 1)[-1]


def classify(spec: mujoco.MjSpec, path: Path) -> GeomClasses:
    """Finds the semantic label of each geom of a model.

    Args:
        spec: spec of the model; it must have been compiled, so that its geoms have ids.
        path: the town's file, for error messages.

    Returns:
        Label codes, paint and faces of all geoms, by geom id.

    Raises:
        TownError: the class of a visible geom does not start with a known label.
    """
    geoms = spec.geoms
    label_code = np.full(len(geoms), HIDDEN_CODE, np.uint8)
    is_paint, is_face = np.zeros(len(geoms), bool), np.zeros(len(geoms), bool)
    for geom in geoms:
        if geom.group >= FIRST_HIDDEN_GROUP:
            continue
        name = unprefixed_class(geom.classname.name)
        first, _, rest = name.partition(".")
        label = LABEL_BY_NAME.get(first)
        if label is None or label.code == 0:
            raise _unmapped(geom, name, path)
        label_code[geom.id] = label.code
        variants = rest.split(".")
        is_paint[geom.id] = variants[-1] == "paint"
        is_face[geom.id] = variants[-1] == "face"
    for array in (label_code, is_paint, is_face):
        array.setflags(write=False)
    return GeomClasses(label_code=label_code, is_paint=is_paint, is_face=is_face)


def _unmapped(geom: mujoco.MjsGeom, name: str, path: Path) -> TownError:
    owner, _, own = geom.name.rpartition("/")
    where = f"geom {own!r}" + (f" of {owner.strip('/')}.xml" if owner.strip("/") else "")
    what = f"class {name!r}" if name else "no class"
    return TownError(
        path, f"{where} can be seen but has {what}; its class must start with a label, such as `building.brick`"
    )
