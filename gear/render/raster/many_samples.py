"""Chooses the pixels that get four samples in quality `film`; one sample is enough for all other pixels.

    needs samples = edge of ids or depth, or a face, or contrast of the picture with one sample per pixel

A pixel inside a uniform surface looks the same with one sample and with four. Shading takes most of a picture's time,
and one pixel in six needs four samples (docs/results/rendering.md).

Faces, on which patches are drawn, and the pixels beside faces always have four samples. The contrast of a pixel depends
on its eight neighbours only, so the number of samples never depends on a patch.
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
"""Value that is added to the mip level of textures in pixels with one sample, so that they read the level that four
samples read.
"""

CONTRAST = 32
"""Difference in display values (0..255) between neighbouring pixels, for the response to a clear day. Pixels with a
larger difference get four samples.
"""

_FULL = 65535
_AROUND = np.ones((3, 3), np.uint8)
_SHIFT = 4
_DISPLAYED = Response(exposure=4.5, contrast=1.43).apply(
    np.round((np.arange(_FULL + 1) >> _SHIFT) * (LINEAR_FULL_SCALE / (_FULL >> _SHIFT))).astype(np.uint16)
)
"""Display values 0..255 of light 0..65535 in 4096 steps, with the camera's response for a clear day."""


def at_edges_and_faces(geom_id: IdImage, depth_m: FloatImage, faces: Iterable[int]) -> Mask:
    """The pixels that get four samples because of geometry: (H, W) bool, True on edges, on faces and beside faces.

    Args:
        geom_id: (H, W) int32, -1 where nothing was hit.
        depth_m: (H, W) float32, NaN where nothing was hit.
        faces: ids of the geoms that can show a patch.
    """
    needed = edge_mask(geom_id, depth_m)
    for face in faces:
        needed |= cv2.dilate(cv2.compare(geom_id, face, cv2.CMP_EQ), _AROUND)
    return np.asarray(needed > 0)


def at_contrasts(light: UInt16Image) -> Mask:
    """The pixels that get four samples because of contrast: (H, W) bool.

    A pixel is True if the green display values in the 3 x 3 pixels around it differ by more than `CONTRAST`.

    Args:
        light: (H, W, 3) uint16, one sample per pixel; 65535 is full scale.
    """
    shown = cv2.LUT(cv2.extractChannel(light, 1), _DISPLAYED[None])
    return np.asarray(cv2.morphologyEx(shown, cv2.MORPH_GRADIENT, _AROUND) > CONTRAST)
