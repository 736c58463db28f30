"""What stands in a compiled town and throws shadows in the light of lamps."""

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
    """(N, 3, 3) triangles in the world of all that is seen of a town and its boards, but for the ground.

    Args:
        model: compiled; its meshes must still be there.
        data: kinematics up to date.
        label_code: (ngeom,) labels of all geoms.
    """
    chosen = static_geoms(model) & (model.geom_group < FIRST_HIDDEN_GROUP) & ~np.isin(label_code, GROUND_CODES)
    found = [np.zeros((0, 3, 3), np.float32)]
    for geom in np.flatnonzero(chosen & ~np.isin(model.geom_type, _ENDLESS)).tolist():
        found.append(world_triangles(model, data, geom).astype(np.float32))
    return np.concatenate(found)
