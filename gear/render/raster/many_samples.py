"""Which pixels of `film` get four samples: for all other pixels one sample is enough.

    needs samples = edge of ids or depth, or a face, or contrast of the picture with one sample per pixel

A pixel inside a plain surface looks the same with one sample and with four. Shading is most of a picture's time, and
one pixel in six needs four samples (docs/results/rendering.md).

Faces and the pixels beside them always have four, so that no pixel's number of samples depends on a patch: the
contrast of a pixel depends on its eight neighbours only.
"""

from __future__ import annotations

from collections.abc import Iterable

import cv2
import numpy as np
import numpy.typing as npt

from gear.camera.response import Response
from gear.render.linear_samples import edge_mask
from gear.values.frames import LINEAR_FULL_SCALE, FloatImage, IdImage, UInt16Image

Mask = npt.NDArray[np.bool_]

LOD_BIAS = -1.0
"""Added to the mip level of textures where a pixel has one sample: the level that four samples read."""

CONTRAST = 32
"""Difference, of 255 steps of a picture by day, between neighbouring pixels above which they get four samples."""

_FULL = 65535
_AROUND = np.ones((3, 3), np.uint8)
_SHIFT = 4
_DISPLAYED = Response(exposure=4.5, contrast=1.43).apply(
    np.round(np.arange((_FULL >> _SHIFT) + 1) * (LINEAR_FULL_SCALE / (_FULL >> _SHIFT))).astype(np.uint16)
)
"""Display values of light in 4096 steps, by the camera's response to a clear day."""


def at_edges_and_faces(geom_id: IdImage, depth_m: FloatImage, faces: Iterable[int]) -> Mask:
    """(H, W) bool, pixels that get four samples for their geometry alone: edges, and faces with the pixels beside them.

    Args:
        geom_id: (H, W) int32, -1 where nothing is.
        depth_m: (H, W) float32, NaN where nothing is.
        faces: ids of the geoms that can show a patch.
    """
    needed = edge_mask(geom_id, depth_m)
    for face in faces:
        needed |= cv2.dilate(cv2.compare(geom_id, face, cv2.CMP_EQ), _AROUND)
    return np.asarray(needed > 0)


def at_contrasts(light: UInt16Image) -> Mask:
    """(H, W) bool, pixels that differ from one of their eight neighbours, or whose neighbours differ.

    Args:
        light: (H, W, 3) uint16, one sample per pixel; 65535 is full scale.
    """
    shown = _DISPLAYED[light[..., 1] >> _SHIFT]
    return np.asarray(cv2.morphologyEx(shown, cv2.MORPH_GRADIENT, _AROUND) > CONTRAST)
