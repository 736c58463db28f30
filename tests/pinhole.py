"""What tests ask of a camera that gear itself never needs."""

from __future__ import annotations

import numpy as np

from gear.values.scene import CameraRecord


def rays(camera: CameraRecord) -> np.ndarray:
    """(H, W, 3) directions in the world through the pixels' centres, whose length is 1 along the view."""
    columns, rows = np.meshgrid(np.arange(camera.width_px), np.arange(camera.height_px))
    x = (columns - (camera.width_px - 1) / 2) / camera.focal_px
    y = (rows - (camera.height_px - 1) / 2) / camera.focal_px
    return np.stack([x, y, np.ones_like(x)], axis=-1) @ camera.world_from_camera_transform.rotation.T
