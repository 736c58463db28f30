"""Scales a board's MJCF so that its face has the size that the scene asks for.

A board faces along its +x axis and stands on the ground at its origin. Its width is therefore scaled along y and its
height along z; its depth is not changed. MuJoCo scales the meshes; this module scales the positions of geoms, bodies
and sites and the sizes of geoms. Posts (upright cylinders and capsules) and spheres keep their radius. A board with
rotated geoms cannot be scaled, because scaling would shear the geoms.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Sequence
from pathlib import Path

from gear.values.errors import TownError
from gear.world.surfaces.face_size import asset_face_size_m

_TURNING = frozenset({"quat", "axisangle", "euler", "zaxis", "xyaxes", "fromto"})
_MESH_FRAME = frozenset({"scale", "refpos", "refquat"})


def scale_board(root: ET.Element, path: Path, size_m: tuple[float, float]) -> None:
    """Scales the MJCF of a board in place.

    Args:
        root: root element of the file.
        path: path of the file, for error messages.
        size_m: new width and height of the face.

    Raises:
        TownError: the file has no face, includes other files, or has parts that cannot be scaled.
    """
    width_m, height_m = asset_face_size_m(path)
    scale = (1.0, size_m[0] / width_m, size_m[1] / height_m)
    _check_scalable(root, path)
    for mesh in root.iterfind("asset/mesh"):
        mesh.set("scale", _scaled(mesh.get("scale", "1 1 1"), scale))
    for element in root.iterfind("worldbody//*"):
        if text := element.get("pos"):
            element.set("pos", _scaled(text, scale))
        if element.tag == "geom" and (text := element.get("size")):
            round_scale = {1: (1.0,), 2: (1.0, scale[2])}
            element.set("size", _scaled(text, round_scale.get(len(text.split()), scale)))


def _check_scalable(root: ET.Element, path: Path) -> None:
    if next(root.iter("include"), None) is not None:
        raise _refused(path, "it includes other files")
    for default in root.iterfind("default//*"):
        if not (_TURNING | _MESH_FRAME | {"pos", "size"}).isdisjoint(default.keys()):
            raise _refused(path, "its default classes place, turn or scale geoms")
    for mesh in root.iterfind("asset/mesh"):
        if not {"refpos", "refquat"}.isdisjoint(mesh.keys()):
            raise _refused(path, f"mesh {mesh.get('name', mesh.get('file'))!r} has a frame of its own")
    for element in root.iterfind("worldbody//*"):
        if element.tag in ("geom", "body") and not _TURNING.isdisjoint(element.keys()):
            raise _refused(path, f"{element.tag} {element.get('name')!r} is turned")


def _refused(path: Path, reason: str) -> TownError:
    return TownError(
        path, f"cannot be given a size_m, since {reason}; write its geoms without a turn or frame of their own"
    )


def _scaled(text: str, scale: Sequence[float]) -> str:
    return " ".join(f"{float(number) * factor:.9g}" for number, factor in zip(text.split(), scale, strict=True))
