"""Checks that a face shows its texture upright, whole, and on the viewer's side, as its `surface` frame defines it."""

from __future__ import annotations

import mujoco
import numpy as np

from gear.values.geometry import Array, RigidTransform
from gear.world.assets.geom_triangles import geom_triangles

UV_TOLERANCE = 0.01
"""Largest difference between a corner's texture coordinates and the expected coordinates, as a share of the face's
sides.
"""

_BOX_TEXTURE = ((1, -2), (0, -2), (0, -1))
"""Axes of the box along which u and v increase, on the sides that face along x, y and z; a minus sign reverses the
axis. All renderers use the same axes on opposite sides, so one side of each pair shows a mirrored texture.
"""


def texture_problem(model: mujoco.MjModel, geom_id: int, surface_from_geom: RigidTransform) -> str:
    """The reason why a face cannot show a patch; "" if it can.

    Args:
        model: compiled model.
        geom_id: the face, flat in the plane z = 0 of its surface frame, whose origin is its middle.
        surface_from_geom: transform into the surface frame, in which a viewer sees x to the right, y down and z into
            the face.
    """
    kind = mujoco.mjtGeom(int(model.geom_type[geom_id]))
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return _wrong_box(surface_from_geom.rotation)
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        return _wrong_mesh(model, geom_id, surface_from_geom)
    return f"must be a mesh or a box, not a {kind.name.removeprefix('mjGEOM_').lower()}"


def _wrong_box(rotation: Array) -> str:
    side = int(np.abs(rotation[2]).argmax())
    u, v = _BOX_TEXTURE[side]
    # The rows of `rotation` are the surface's axes in the box's frame.
    if rotation[0, u] > 0.999 and rotation[1, abs(v)] < -0.999:
        return ""
    return (
        "shows its texture turned or mirrored on the side that `surface` says is seen; turn the box so that this is "
        "its +x side with z up, or make it a mesh"
    )


def _wrong_mesh(model: mujoco.MjModel, geom_id: int, surface_from_geom: RigidTransform) -> str:
    vertices, faces = geom_triangles(model, geom_id)
    corners = surface_from_geom.apply(vertices)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    seen = normals[:, 2] < 0
    if not seen.any():
        return "cannot be seen from where its site `surface` is looked at: its triangles face the other way"
    mesh = int(model.geom_dataid[geom_id])
    if model.mesh_texcoordadr[mesh] < 0:
        return "has no texture coordinates"
    start, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    chosen = model.mesh_facetexcoord[start : start + count][seen]
    uv = model.mesh_texcoord[int(model.mesh_texcoordadr[mesh]) + chosen]
    sides_m = 2 * np.abs(corners[..., :2]).max(axis=(0, 1))
    if np.abs(uv - (corners[seen][..., :2] / sides_m + 0.5)).max() > UV_TOLERANCE:
        return "must show its texture once and whole, u from left to right and v from top to bottom of `surface`"
    return ""
