"""The faces that can show patches: their frames and sizes in the compiled model, and their textures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np

from gear.values.array_shelf import NO_SHELF, ArrayShelf, code_digest
from gear.values.errors import TownError
from gear.values.frames import UInt8Image
from gear.values.geometry import RigidTransform
from gear.values.scene import Pose, SurfaceRecord
from gear.world.assets.geom_triangles import geom_triangles
from gear.world.compilation.instances import FaceNames
from gear.world.scene_spec import FACE_SIDE_M
from gear.world.surfaces import face_texture
from gear.world.surfaces.face_texture import SurfaceAlbedo, face_from_patch, srgb_from_linear, uniform_face
from gear.world.surfaces.upright import texture_problem

FLATNESS_M = 0.01
"""Largest thickness of a face, and largest distance of its middle from the origin of its frame, metres."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Face:
    """One face that can show a patch.

    Attributes:
        name: `surface_0`, `surface_1`, …, in patch order.
        asset: name of the MJCF file that contains the face, without suffix.
        is_carried: whether an actor carries the face.
        geom_id: id of the face's geom in the render model.
        parent_from_surface: pose of its surface frame in world coordinates, or in the frame of the actor that carries
            it. The frame's origin is the middle of the face; for a viewer in front of the face, x points right, y down
            and z into the board.
        width_m, height_m: size of the face.
        neutral: (H, W, 3) uint8 sRGB texture of the face without a patch.
    """

    name: str
    asset: str
    is_carried: bool
    geom_id: int
    parent_from_surface: RigidTransform
    width_m: float
    height_m: float
    neutral: UInt8Image

    def record(self, carrier_id: int | None) -> SurfaceRecord:
        """The record of the face for the sample's JSON file.

        Args:
            carrier_id: id of the actor that carries the face; None for a board.
        """
        return SurfaceRecord(
            name=self.name,
            asset=self.asset,
            actor_id=carrier_id if self.is_carried else None,
            parent_from_surface=Pose.from_transform(self.parent_from_surface),
            width_m=round(self.width_m, 6),
            height_m=round(self.height_m, 6),
        )

    def texture(self, albedo: SurfaceAlbedo) -> UInt8Image:
        """The texture of the face for one sample.

        Args:
            albedo: what the face shows: its neutral texture, white, black, or a patch, which is resampled.

        Returns:
            (H, W, 3) uint8 sRGB.
        """
        if not isinstance(albedo, str):
            return face_from_patch(albedo)
        if albedo == "none":
            return self.neutral
        return uniform_face(255 if albedo == "white" else 0)


def find_faces(
    model: mujoco.MjModel, data: mujoco.MjData, names: Sequence[FaceNames], path: Path, shelf: ArrayShelf = NO_SHELF
) -> tuple[Face, ...]:
    """Measures the faces of a compiled model.

    Args:
        model: the render model.
        data: MuJoCo data of the model with kinematics up to date.
        names: names of the faces' elements, in patch order.
        path: the town's file, for error messages.
        shelf: shelf of the model, for the textures of faces without a patch.

    Returns:
        The faces in patch order.

    Raises:
        TownError: a face is not flat in its `surface` frame, is smaller or larger than any board, or would not show a
            patch upright and whole.
    """
    return tuple(_face(model, data, number, name, path, shelf) for number, name in enumerate(names))


def _face(
    model: mujoco.MjModel, data: mujoco.MjData, number: int, name: FaceNames, path: Path, shelf: ArrayShelf
) -> Face:
    surface = f"surface_{number}"
    geom_id, site_id = model.geom(name.geom).id, model.site(name.site).id
    world_from_surface = RigidTransform.from_parts(
        "world", surface, data.site_xmat[site_id].reshape(3, 3), data.site_xpos[site_id]
    )
    try:
        points, _ = geom_triangles(model, geom_id)
    except ValueError as error:
        raise TownError(path, f"{name.asset}: {error}; make it a mesh or a box") from error
    world_m = points @ data.geom_xmat[geom_id].reshape(3, 3).T + data.geom_xpos[geom_id]
    local_m = world_from_surface.inverse().apply(world_m)
    low, high = local_m.min(axis=0), local_m.max(axis=0)
    if np.abs(low + high).max() > 2 * FLATNESS_M or high[2] - low[2] > FLATNESS_M:
        raise TownError(
            path,
            f"{name.asset}: the face must be flat (no thicker than {FLATNESS_M * 100:g} cm), with the site `surface` in"
            " its middle, z into the board",
        )
    width_m, height_m = float(high[0] - low[0]), float(high[1] - low[1])
    if not all(FACE_SIDE_M[0] <= side_m <= FACE_SIDE_M[1] for side_m in (width_m, height_m)):
        least_m, most_m = FACE_SIDE_M
        problem = f"is {width_m:.3g} m x {height_m:.3g} m, and its sides must be {least_m:g} to {most_m:g} m"
        raise TownError(path, f"{name.asset}: the face {problem}")
    world_from_geom = RigidTransform.from_parts(
        "world", "geom", data.geom_xmat[geom_id].reshape(3, 3), data.geom_xpos[geom_id]
    )
    if wrong := texture_problem(model, geom_id, world_from_surface.inverse() @ world_from_geom):
        raise TownError(path, f"{name.asset}: the face {wrong}")
    body = model.body(name.owner).id
    world_from_owner = RigidTransform.from_parts("world", "actor", data.xmat[body].reshape(3, 3), data.xpos[body])
    owner_from_surface = world_from_owner.inverse() @ world_from_surface
    if not name.is_carried and owner_from_surface.rotation[0, 2] > -0.999:
        raise TownError(path, f"{name.asset}: the face of a board must look along its +x axis")
    return Face(
        name=surface,
        asset=name.asset,
        is_carried=name.is_carried,
        geom_id=geom_id,
        parent_from_surface=owner_from_surface if name.is_carried else world_from_surface,
        width_m=width_m,
        height_m=height_m,
        neutral=_shelved_neutral(model, name.neutral_material, shelf, f"neutral-{number}"),
    )


def _shelved_neutral(model: mujoco.MjModel, material: str, shelf: ArrayShelf, key: str) -> UInt8Image:
    assert face_texture.__file__ is not None
    inputs = (code_digest(__file__, face_texture.__file__), material.encode())
    (texture,) = shelf.arrays(key, inputs, lambda: (_neutral(model, material),))
    texture.setflags(write=False)
    return texture


def _neutral(model: mujoco.MjModel, material: str) -> UInt8Image:
    """Texture of a face that looks like a material: (H, W, 3) uint8 sRGB from its image or its plain colour."""
    material_id = model.material(material).id
    roles = (mujoco.mjtTextureRole.mjTEXROLE_RGB, mujoco.mjtTextureRole.mjTEXROLE_RGBA)
    textures = [int(model.mat_texid[material_id, role]) for role in roles]
    texture = max(textures)
    if texture < 0:
        # A material's colour is linear albedo, and a face's bytes are sRGB.
        byte = np.floor(srgb_from_linear(model.mat_rgba[material_id, :3]) * 255 + 0.5).astype(np.uint8)
        return face_from_patch(byte[None, None, :])
    height, width, channels = (
        int(model.tex_height[texture]), int(model.tex_width[texture]), int(model.tex_nchannel[texture])
    )  # fmt: skip
    start = int(model.tex_adr[texture])
    pixels = np.array(model.tex_data[start : start + height * width * channels]).reshape(height, width, channels)
    return face_from_patch(np.ascontiguousarray(np.broadcast_to(pixels[..., :3], (height, width, 3))))
