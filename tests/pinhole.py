"""What tests ask of a camera that gear itself never needs."""

from __future__ import annotations

import numpy as np

from gear.values.scene import CameraRecord


def rays(camera: CameraRecord) -> np.ndarray:
    """(H, W, 3) directions in the world through the pixels' centres, whose length is 1 along the view."""
    columns, rows = np.meshgrid(np.arange(camera.width_px), np.arange(camera.height_px))
    pinhole = camera.intrinsics
    x, y = (columns - pinhole.cx_px) / pinhole.fx_px, (rows - pinhole.cy_px) / pinhole.fy_px
    return np.stack([x, y, np.ones_like(x)], axis=-1) @ camera.world_from_camera_transform.rotation.T
