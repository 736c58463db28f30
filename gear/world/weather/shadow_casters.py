"""Finds the triangles of a compiled town that cast shadows in the light of lamps."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from gear.values.labels import GROUND_CODES
from gear.world.assets.geom_classes import FIRST_HIDDEN_GROUP
from gear.world.assets.geom_triangles import static_geoms, world_triangles

_ENDLESS = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)


def find_shadow_casters(
    model: mujoco.MjModel, data: mujoco.MjData, label_code: npt.NDArray[np.uint8]
) -> npt.NDArray[np.float32]:
    """Finds the triangles that cast shadows in the light of lamps: the visible geoms of a town and its boards, without
    the ground.

    Args:
        model: compiled model; its meshes must not have been released.
        data: MuJoCo data of the model with kinematics up to date.
        label_code: (ngeom,) uint8 label codes of all geoms.

    Returns:
        (N, 3, 3) float32 corners of the triangles in world coordinates, metres.
    """
    chosen = static_geoms(model) & (model.geom_group < FIRST_HIDDEN_GROUP) & ~np.isin(label_code, GROUND_CODES)
    found = [np.zeros((0, 3, 3), np.float32)]
    for geom in np.flatnonzero(chosen & ~np.isin(model.geom_type, _ENDLESS)).tolist():
        found.append(world_triangles(model, data, geom).astype(np.float32))
    return np.concatenate(found)
