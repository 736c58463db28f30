"""Prepares normal maps for Filament, which computes tangents without texture coordinates.

Filament, as MuJoCo 4.0 uses it, computes a mesh's tangents from its normals alone, in the frame into which MuJoCo
rotates the mesh for its inertia. For a unit normal (x, y, z) in that frame, red tilts it along `T` and green along `B`
(measured),

    T = (-x z / (1 + y), -z, 1 - z^2 / (1 + y))        B = -(1 - x^2 / (1 + y), -x, -x z / (1 + y))

which is Frisvad's basis about y, left-handed ("Building an Orthonormal Basis from a Unit Vector", 2012). On every
upright wall red therefore points up and green to the viewer's right. On level ground and on slopes the directions
depend on the yaw of the mesh's frame. A usual normal map has red to the right and green up. Filament shows it correctly
if its two channels are exchanged and the frame of the mesh is upright with a suitable yaw.
"""

from __future__ import annotations

import mujoco
import numpy as np
import numpy.typing as npt

from gear.values.geometry import Array

_YAWS = 16
"""Number of evenly spaced yaws that are tested for a mesh."""

_SAMPLED_TRIANGLES = 192
"""Number of triangles by which the yaw of a mesh is chosen, evenly spaced among all its triangles."""

_NORMAL, _RGB_CHANNELS = int(mujoco.mjtTextureRole.mjTEXROLE_NORMAL), 3
_MESH = int(mujoco.mjtGeom.mjGEOM_MESH)
_SINGULAR = 1e-6
"""The basis is undefined if 1 + y is below this value."""

_SLACK_M = 1e-4
"""Margin of bounding boxes, metres: those of flat meshes have no thickness, and rotated vertices are rounded."""


def align_normal_maps(model: mujoco.MjModel) -> None:
    """Changes normal maps, and the frames of the meshes that use them, so that Filament lights them correctly.

    No triangle moves: only the frame between a geom and its mesh is rotated. Primitives, meshes without texture
    coordinates, and textures that a material also uses in another role are not changed.

    Args:
        model: compiled model, changed in place. In the files of its meshes z is up.
    """
    textured = np.flatnonzero((model.geom_type == _MESH) & (model.geom_matid >= 0))
    textured = textured[model.mesh_texcoordnum[model.geom_dataid[textured]] > 0]
    normal_map = model.mat_texid[model.geom_matid[textured], _NORMAL] if len(textured) else np.zeros(0, np.int32)
    if not (normal_map >= 0).any():
        return
    for texture in np.setdiff1d(normal_map[normal_map >= 0], np.delete(model.mat_texid, _NORMAL, axis=1)).tolist():
        _exchange_red_and_green(model, texture)
    meshes = np.unique(model.geom_dataid[textured[normal_map >= 0]]).tolist()
    upright_from_mesh = {mesh: _matrix(model.mesh_quat[mesh]) for mesh in meshes}
    yaws = best_yaws([_sheet(model, mesh, rotation) for mesh, rotation in upright_from_mesh.items()])
    for (mesh, rotation), yaw in zip(upright_from_mesh.items(), yaws, strict=True):
        _turn(model, mesh, rotation, float(yaw))


def tangents(normals: Array) -> tuple[Array, Array]:
    """The directions in which the red and the green channel of a normal map tilt a normal, as Filament computes
    them. gear turns the frames of meshes until these directions agree with the texture.

    Args:
        normals: (..., 3) unit vectors in a mesh's frame.

    Returns:
        (..., 3) unit vectors for red, and the same for green.
    """
    x, y, z = np.moveaxis(normals, -1, 0)
    is_singular = 1 + y < _SINGULAR
    share = 1 / np.where(is_singular, 1.0, 1 + y)
    red = np.stack([-x * z * share, -z, 1 - z * z * share], axis=-1)
    green = -np.stack([1 - x * x * share, -x, -x * z * share], axis=-1)
    red[is_singular], green[is_singular] = (-1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
    return red, green


def best_yaws(sheets: list[tuple[Array, Array, Array]]) -> Array:
    """Finds the yaws of meshes at which their normal maps are shown correctly.

    Args:
        sheets: for each mesh, in an upright frame: (M, 3) unit normals of its triangles, (M, 3) directions to the right
            in the texture, and (M, 3) directions up in the texture. The directions have twice the triangle's area as
            length.

    Returns:
        (meshes,) yaw in radians at which red points up and green to the right over most of the mesh.
    """
    normals, right, up = (np.concatenate(columns) for columns in zip(*sheets, strict=True))
    starts = np.cumsum([0, *(len(sheet[0]) for sheet in sheets[:-1])])
    yaws = np.arange(_YAWS) * (2 * np.pi / _YAWS)
    fits = []
    for yaw in yaws.tolist():
        turn = _about_z(yaw)
        red, green = tangents(normals @ turn)
        agreement = np.einsum("ij,ij->i", red, up @ turn) + np.einsum("ij,ij->i", green, right @ turn)
        fits.append(np.add.reduceat(agreement, starts))
    # For upright walls nearly all yaws fit equally well, and rounding must not choose among them.
    fit = np.array(fits)
    is_best = fit >= fit.max(axis=0) - 1e-4 * np.abs(fit).max(axis=0)
    return np.asarray(yaws[is_best.argmax(axis=0)])


def _sheet(model: mujoco.MjModel, mesh: int, upright_from_mesh: Array) -> tuple[Array, Array, Array]:
    """Normals and texture directions of a mesh, in the form that `best_yaws` expects."""
    count = int(model.mesh_facenum[mesh])
    chosen = model.mesh_faceadr[mesh] + np.unique(
        np.linspace(0, count - 1, min(count, _SAMPLED_TRIANGLES)).astype(np.int64)
    )
    corners = model.mesh_vert[model.mesh_vertadr[mesh] + model.mesh_face[chosen]].astype(np.float64)
    uvs = model.mesh_texcoord[model.mesh_texcoordadr[mesh] + model.mesh_facetexcoord[chosen]].astype(np.float64)
    edges = (corners[:, 1:] - corners[:, :1]) @ upright_from_mesh.T
    steps = uvs[:, 1:] - uvs[:, :1]
    across = np.cross(edges[:, 0], edges[:, 1])
    doubled_area = np.linalg.norm(across, axis=1, keepdims=True)
    # In MuJoCo's texture coordinates v grows downwards.
    right = edges[:, 0] * steps[:, 1, 1:] - edges[:, 1] * steps[:, 0, 1:]
    down = edges[:, 1] * steps[:, 0, :1] - edges[:, 0] * steps[:, 1, :1]
    turned = np.sign(steps[:, 0, :1] * steps[:, 1, 1:] - steps[:, 1, :1] * steps[:, 0, 1:])
    return (
        across / np.maximum(doubled_area, 1e-12),
        doubled_area * turned * _unit(right),
        -doubled_area * turned * _unit(down),
    )


def _turn(model: mujoco.MjModel, mesh: int, upright_from_mesh: Array, yaw: float) -> None:
    """Rotates the frame of a mesh about its origin, and its geoms in the opposite direction, so that nothing moves."""
    new_from_mesh = _about_z(yaw).T @ upright_from_mesh
    upright_from_new = np.array([np.cos(yaw / 2), 0.0, 0.0, np.sin(yaw / 2)])
    mesh_from_new = np.empty(4)
    mujoco.mju_negQuat(mesh_from_new, model.mesh_quat[mesh])
    mujoco.mju_mulQuat(mesh_from_new, mesh_from_new.copy(), upright_from_new)
    matrix = new_from_mesh.T.astype(np.float32)
    vertices, normals = (
        values[int(start[mesh]) : int(start[mesh] + size[mesh])]
        for values, start, size in (
            (model.mesh_vert, model.mesh_vertadr, model.mesh_vertnum),
            (model.mesh_normal, model.mesh_normaladr, model.mesh_normalnum),
        )
    )
    vertices[:], normals[:] = vertices @ matrix, normals @ matrix
    polygons = slice(model.mesh_polyadr[mesh], model.mesh_polyadr[mesh] + model.mesh_polynum[mesh])
    model.mesh_polynormal[polygons] = model.mesh_polynormal[polygons] @ new_from_mesh.T
    # Boxes around the turned bounding boxes are larger than necessary, and correct.
    boxes = model.bvh_aabb[int(model.mesh_bvhadr[mesh]) : int(model.mesh_bvhadr[mesh] + model.mesh_bvhnum[mesh])]
    boxes[:, :3] = boxes[:, :3] @ new_from_mesh.T
    boxes[:, 3:] = boxes[:, 3:] @ np.abs(new_from_mesh).T + _SLACK_M
    low, high = vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)
    model.mesh_quat[mesh] = upright_from_new
    for geom in np.flatnonzero((model.geom_dataid == mesh) & (model.geom_type == _MESH)).tolist():
        turned = np.empty(4)
        mujoco.mju_mulQuat(turned, model.geom_quat[geom], mesh_from_new)
        model.geom_quat[geom] = turned
        # Otherwise kinematics would take the frame of the body's inertia for the geom's.
        model.geom_sameframe[geom] = int(mujoco.mjtSameFrame.mjSAMEFRAME_NONE)
        model.geom_aabb[geom] = *(low + high) / 2, *(high - low) / 2
        model.geom_size[geom] = np.maximum(-low, high)


def _exchange_red_and_green(model: mujoco.MjModel, texture: int) -> None:
    width, height, channels = (int(of[texture]) for of in (model.tex_width, model.tex_height, model.tex_nchannel))
    if channels < _RGB_CHANNELS:
        return
    start = int(model.tex_adr[texture])
    pixels = model.tex_data[start : start + width * height * channels].reshape(-1, channels)
    red = pixels[:, 0].copy()  # column by column: an eighth of the time of both at once
    pixels[:, 0], pixels[:, 1] = pixels[:, 1], red


def _matrix(quat: npt.NDArray[np.float64]) -> Array:
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, quat)
    return matrix.reshape(3, 3)


def _about_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _unit(vectors: Array) -> Array:
    return np.asarray(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12))
