"""The textures of faces, the flat geoms on which patches are drawn: finds these textures and checks patches for
them.
"""

from __future__ import annotations

from collections.abc import Mapping

import mujoco
import numpy as np

from gear.values.frames import UInt8Image


def texture_of_face(model: mujoco.MjModel, geom_id: int) -> int:
    """The id of the colour texture of a face, from the material of its geom.

    Args:
        model: compiled model.
        geom_id: id of the face's geom.

    Raises:
        ValueError: the geom has no such texture, so it cannot be a face.
    """
    material = int(model.geom_matid[geom_id])
    texture = int(model.mat_texid[material, mujoco.mjtTextureRole.mjTEXROLE_RGB]) if material >= 0 else -1
    if texture < 0:
        raise ValueError(f"geom {geom_id} ({model.geom(geom_id).name!r}) has no colour texture, so it is no face")
    return texture


def checked_faces(model: mujoco.MjModel, faces: Mapping[int, UInt8Image]) -> dict[int, tuple[int, UInt8Image]]:
    """Checks the patches of a stage (a posed world that is rendered): their dtype and size.

    Args:
        model: the compiled world.
        faces: patches, (H, W, 3) uint8 sRGB, by geom id of their face.

    Returns:
        The id of the texture that each patch replaces, and the patch, by geom id.

    Raises:
        ValueError: a patch is not uint8, or does not have the size of its texture.
    """
    checked = {}
    for geom_id, srgb in faces.items():
        texture = texture_of_face(model, geom_id)
        shape = (int(model.tex_height[texture]), int(model.tex_width[texture]), 3)
        if srgb.shape != shape or srgb.dtype != np.uint8:
            raise ValueError(f"face of geom {geom_id} must be uint8 {shape}, got {srgb.dtype} {srgb.shape}")
        checked[geom_id] = (texture, srgb)
    return checked
