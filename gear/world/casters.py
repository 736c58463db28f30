"""What stands in a compiled town and throws shadows in the light of lamps."""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from gear.values.labels import GROUND_CODES
from gear.world.classes import FIRST_HIDDEN_GROUP
from gear.world.shapes import geom_triangles

_ENDLESS = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)


def find_casters(
    model: mujoco.MjModel, data: mujoco.MjData, label_code: npt.NDArray[np.uint8]
) -> npt.NDArray[np.float32]:
    """(N, 3, 3) triangles in the world of all that is seen of a town and its boards, but for the ground.

    Args:
        model: compiled; its meshes must still be there.
        data: kinematics up to date.
        label_code: (ngeom,) labels of all geoms.
    """
    stands = model.body_mocapid[model.body_rootid[model.geom_bodyid]] < 0
    chosen = stands & (model.geom_group < FIRST_HIDDEN_GROUP) & ~np.isin(label_code, GROUND_CODES)
    found = [np.zeros((0, 3, 3), np.float32)]
    for geom in np.flatnonzero(chosen & ~np.isin(model.geom_type, _ENDLESS)).tolist():
        vertices, faces = geom_triangles(model, geom)
        at_m = vertices @ data.geom_xmat[geom].reshape(3, 3).T + data.geom_xpos[geom]
        found.append(at_m.astype(np.float32)[faces])
    return np.concatenate(found)
