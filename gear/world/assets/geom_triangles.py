"""The triangles of compiled geoms, in the frame of the geom, of a body, or in world coordinates."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np
import numpy.typing as npt

from gear.values.frames import Shape
from gear.values.geometry import Array, frozen

Faces = npt.NDArray[np.int32]
Triangles = tuple[Array, Faces]

ROUND_SEGMENTS = 24
"""Number of sides of the polygons that approximate round primitives; the error of silhouettes is less than 1 %."""


def geom_triangles(model: mujoco.MjModel, geom_id: int) -> Triangles:
    """The triangles of one geom's surface, in the geom's frame.

    Args:
        model: the compiled model.
        geom_id: id of the geom.

    Returns:
        (N, 3) float64 vertices in metres, and (M, 3) int32 vertex indices of the triangles, counter-clockwise as seen
        from outside.

    Raises:
        ValueError: the geom is a plane or a height field, which have no finite surface.
    """
    size = np.asarray(model.geom_size[geom_id], dtype=np.float64)
    kind = mujoco.mjtGeom(int(model.geom_type[geom_id]))
    kinds = mujoco.mjtGeom
    if kind == kinds.mjGEOM_MESH:
        mesh = int(model.geom_dataid[geom_id])
        vertices = slice(model.mesh_vertadr[mesh], model.mesh_vertadr[mesh] + model.mesh_vertnum[mesh])
        faces = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
        return np.asarray(model.mesh_vert[vertices], dtype=np.float64), np.asarray(
            model.mesh_face[faces], dtype=np.int32
        )
    if kind == kinds.mjGEOM_BOX:
        return _box(size)
    if kind in (kinds.mjGEOM_SPHERE, kinds.mjGEOM_ELLIPSOID):
        radii = size if kind == kinds.mjGEOM_ELLIPSOID else np.repeat(size[0], 3)
        angles = np.linspace(-np.pi / 2, np.pi / 2, ROUND_SEGMENTS // 2 + 1)
        return _revolved(np.cos(angles) * radii[0], np.sin(angles) * radii[2], radii[1] / radii[0])
    if kind == kinds.mjGEOM_CYLINDER:
        return _revolved(np.array([0, size[0], size[0], 0]), np.array([-size[1], -size[1], size[1], size[1]]))
    if kind == kinds.mjGEOM_CAPSULE:
        below = np.linspace(-np.pi / 2, 0, ROUND_SEGMENTS // 4 + 1)
        angles = np.concatenate([below, -below[::-1]])
        heights = np.sin(angles) * size[0] + np.sign(np.arange(len(angles)) - len(below) + 0.5) * size[1]
        return _revolved(np.cos(angles) * size[0], heights)
    own_name = model.geom(geom_id).name.rpartition("/")[2]
    raise ValueError(f"geom {own_name!r} is a {kind.name.removeprefix('mjGEOM_').lower()}, which has no finite surface")


def _box(half: Array) -> Triangles:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half[:3]
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], dtype=np.int32)


def _revolved(radii: Array, heights: Array, y_scale: float = 1.0) -> Triangles:
    """The surface of revolution about z of a profile of radii and heights, given from bottom to top."""
    turn = np.arange(ROUND_SEGMENTS) * (2 * np.pi / ROUND_SEGMENTS)
    x, y = np.outer(radii, np.cos(turn)), np.outer(radii, np.sin(turn)) * y_scale
    vertices = np.stack([x, y, np.repeat(heights[:, None], ROUND_SEGMENTS, axis=1)], axis=-1).reshape(-1, 3)
    faces = []
    for ring in range(len(radii) - 1):
        for side in range(ROUND_SEGMENTS):
            a = ring * ROUND_SEGMENTS + side
            b = ring * ROUND_SEGMENTS + (side + 1) % ROUND_SEGMENTS
            faces += [(a, b, b + ROUND_SEGMENTS), (a, b + ROUND_SEGMENTS, a + ROUND_SEGMENTS)]
    return vertices, np.array(faces, dtype=np.int32)


def world_triangles(model: mujoco.MjModel, data: mujoco.MjData, geom_id: int) -> Array:
    """The triangles of one geom in the world: (N, 3, 3) corners in world coordinates, metres.

    Args:
        model: compiled model.
        data: MuJoCo data of the model with kinematics up to date.
        geom_id: the geom.

    Raises:
        ValueError: the geom is a plane or a height field, which have no finite surface.
    """
    vertices, faces = geom_triangles(model, geom_id)
    return np.asarray((vertices @ data.geom_xmat[geom_id].reshape(3, 3).T + data.geom_xpos[geom_id])[faces])


def static_geoms(model: mujoco.MjModel) -> npt.NDArray[np.bool_]:
    """Which geoms belong to the town and its boards: (ngeom,) bool, False for geoms of actors.

    Args:
        model: compiled render model, in which actors are mocap bodies.
    """
    return np.asarray(model.body_mocapid[model.body_rootid[model.geom_bodyid]] < 0)


def body_shape(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    body_id: int,
    geom_ids: Sequence[int],
    label_code: npt.NDArray[np.uint8],
) -> Shape:
    """Joins the triangles of several geoms to one shape, in the frame of a body.

    Args:
        model: compiled model.
        data: MuJoCo data of the model with kinematics up to date.
        body_id: the body.
        geom_ids: the geoms; at least one.
        label_code: (ngeom,) uint8 labels of all geoms.

    Returns:
        The triangles with the label code of their geom, and the box around them along the axes of the body's frame.

    Raises:
        ValueError: a geom is a plane or a height field, which have no finite surface.
    """
    body_position_m = data.xpos[body_id]
    body_rotation = data.xmat[body_id].reshape(3, 3)
    vertices: list[Array] = []
    faces: list[Faces] = []
    codes: list[npt.NDArray[np.uint8]] = []
    count = 0
    for geom_id in geom_ids:
        points, triangles = geom_triangles(model, geom_id)
        world_m = points @ data.geom_xmat[geom_id].reshape(3, 3).T + data.geom_xpos[geom_id]
        vertices.append((world_m - body_position_m) @ body_rotation)
        faces.append(triangles + np.int32(count))
        codes.append(np.full(len(triangles), label_code[geom_id], np.uint8))
        count += len(points)
    all_vertices = frozen(np.concatenate(vertices))
    low, high = all_vertices.min(axis=0), all_vertices.max(axis=0)
    all_faces, all_codes = np.concatenate(faces), np.concatenate(codes)
    all_faces.setflags(write=False)
    all_codes.setflags(write=False)
    return Shape(
        vertices_m=all_vertices,
        faces=all_faces,
        face_label_code=all_codes,
        box_centre_m=frozen((low + high) / 2),
        box_size_m=frozen(high - low),
    )
