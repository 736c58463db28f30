"""A model's colours as OpenGL must be given them so that what it shows looks right."""

from __future__ import annotations

import copy

import mujoco
import numpy as np
import numpy.typing as npt


def encode_srgb(linear: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Linear light (...) in 0..1 to sRGB values in 0..1."""
    light = np.clip(np.asarray(linear, dtype=np.float64), 0.0, 1.0)
    return np.where(light <= 0.0031308, light * 12.92, 1.055 * np.maximum(light, 0.0031308) ** (1 / 2.4) - 0.055)


def displayed_model(model: mujoco.MjModel) -> mujoco.MjModel:
    """A copy whose colours are display values.

    OpenGL would decode a texture that is marked sRGB, light it, and show the linear result as it is: far too dark. In
    the copy such textures are not marked, and the linear colours of geoms and materials are encoded. Lights of the
    kind `image`, which OpenGL does not have, are off, and so is the headlight.
    """
    shown = copy.copy(model)
    shown.tex_colorspace[:] = mujoco.mjtColorSpace.mjCOLORSPACE_LINEAR
    for rgba in (shown.mat_rgba, shown.geom_rgba):
        rgba[:, :3] = encode_srgb(rgba[:, :3])
    shown.light_active[shown.light_type == mujoco.mjtLightType.mjLIGHT_IMAGE] = 0
    shown.vis.headlight.active = 0
    return shown
