"""Optical flow as KITTI stores it: 16-bit colour PNG files with the flow in units of 1/64 pixel, and validity."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from gear.formats.picture_size import check_size
from gear.formats.png_chunks import check_chunks
from gear.values.frames import FloatImage

UNITS_PER_PX, ZERO = 64, 32768
"""Units per pixel, and the stored number for a flow of 0. A flow lies in -512 to 511.98 pixels."""

FLOW, VISIBLE, ACTORS = "flow/{camera}", "flow/{camera}/visible", "flow/{camera}/actors"
"""Keys of a camera's flow, of the mask of points that the next picture shows, and of the map of road users, among the
auxiliary files of a sample.
"""

_PNG = [cv2.IMWRITE_PNG_COMPRESSION, 3, cv2.IMWRITE_PNG_FILTER, cv2.IMWRITE_PNG_FILTER_PAETH]


def encode_flow(flow_px: FloatImage, is_valid: npt.NDArray[np.bool_] | None = None) -> bytes:
    """Encodes an (H, W, 2) flow to the right and downwards, in pixels, as KITTI's PNG.

    Args:
        flow_px: the flow; NaN, and flows that are too large for the format, become invalid.
        is_valid: (H, W) bool; all other pixels become invalid, too. None for all pixels.
    """
    units = np.rint(flow_px.astype(np.float64) * UNITS_PER_PX) + ZERO
    is_stored = ((units >= 0) & (units <= 65535)).all(axis=-1)  # false of NaN
    if is_valid is not None:
        is_stored &= is_valid
    stored = np.zeros((*is_stored.shape, 3), np.uint16)  # OpenCV's order is blue, green, red
    stored[..., 0] = is_stored
    stored[..., 1] = np.where(is_stored, units[..., 1], 0)
    stored[..., 2] = np.where(is_stored, units[..., 0], 0)
    done, data = cv2.imencode(".png", stored, _PNG)
    assert done
    return bytes(data)


def decode_flow(data: bytes) -> FloatImage:
    """Decodes KITTI's PNG to (H, W, 2) float32 flow to the right and downwards, in pixels; NaN where it is
    invalid.

    Args:
        data: bytes of the PNG file.

    Raises:
        ValueError: the bytes are not such a picture.
    """
    check_size(data)
    check_chunks(data)
    stored = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED) if data else None
    if stored is None or stored.dtype != np.uint16 or stored.ndim != 3 or stored.shape[2] != 3:
        raise ValueError("not an optical flow in KITTI's format")
    flow_px = (stored[..., :0:-1].astype(np.float32) - np.float32(ZERO)) / np.float32(UNITS_PER_PX)
    return np.where(stored[..., :1] > 0, flow_px, np.float32(np.nan))
