"""The label of each geom, which the name of its default class gives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import numpy.typing as npt

from gear.values.errors import TownError
from gear.values.labels import LABEL_BY_NAME

HIDDEN_CODE = 255
"""Label code of hidden geoms, which no renderer draws."""

FIRST_HIDDEN_GROUP = 3
"""Geoms of this group and above are hidden; collision geoms are in it."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class GeomClasses:
    """Labels by geom id of a compiled model.

    Attributes:
        label_code: (ngeom,) uint8, `HIDDEN_CODE` for hidden geoms.
        is_paint: (ngeom,) bool, whether a sample may choose the geom's colour.
        is_face: (ngeom,) bool, whether the geom is a face that takes a patch.
    """

    label_code: npt.NDArray[np.uint8]
    is_paint: npt.NDArray[np.bool_]
    is_face: npt.NDArray[np.bool_]


def unprefixed_class(classname: str) -> str:
    """The name of a class in its own file: dm_control prefixes it with `<file>/` when it composes files."""
    return classname.rsplit("/", 1)[-1]


def classify(spec: mujoco.MjSpec, path: Path) -> GeomClasses:
    """Finds the labels of a model's geoms.

    Args:
        spec: of the model, compiled, so that its geoms have ids.
        path: the town's file, for errors.

    Raises:
        TownError: the class of a visible geom starts with no known label.
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
