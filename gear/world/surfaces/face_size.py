"""Reads the size of the face in a board's MJCF file."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import mujoco

from gear.values.errors import TownError
from gear.world.assets.geom_classes import unprefixed_class
from gear.world.assets.geom_triangles import geom_triangles
from gear.world.assets.mjspec import read_spec


def asset_face_size_m(path: Path) -> tuple[float, float]:
    """Width and height in metres of a board's face, from the board's MJCF file.

    Args:
        path: path of the board's MJCF file.

    Raises:
        TownError: the file cannot be compiled, or has no face with a surface.
    """
    return _measured(path, path.stat().st_mtime_ns if path.is_file() else 0)


@lru_cache(maxsize=64)
def _measured(path: Path, _modified_ns: int) -> tuple[float, float]:
    try:
        spec = read_spec(path)
        model = spec.compile()
    except ValueError as error:
        raise TownError(path, f"MuJoCo cannot compile it: {' '.join(str(error).split())}") from error
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for geom in spec.geoms:
        if unprefixed_class(geom.classname.name).endswith(".face"):
            try:
                vertices = geom_triangles(model, geom.id)[0] @ data.geom_xmat[geom.id].reshape(3, 3).T
            except ValueError as error:
                raise TownError(path, f"{error}; make it a mesh or a box") from error
            # A board looks along its +x axis, so its face is as wide as it reaches along y and as high as along z.
            _, width_m, height_m = (vertices.max(axis=0) - vertices.min(axis=0)).tolist()
            return width_m, height_m
    raise TownError(path, "has no geom of a class ending in `.face`")
