"""A picture with its caption as HTML; the picture is embedded as JPEG."""

from __future__ import annotations

import base64

import cv2

from gear.reporting.html_table import safe
from gear.values.frames import UInt8Image

QUALITY = 82
"""JPEG quality."""


def figure(pixels: UInt8Image, caption: str, width_px: int) -> str:
    """Returns a picture with its caption as HTML that needs no other file.

    Args:
        pixels: (H, W, 3) uint8 RGB.
        caption: text below the picture; it is escaped.
        width_px: width of the embedded picture. Larger pictures are averaged, smaller ones repeat their pixels.

    Raises:
        ValueError: the picture cannot be encoded.
    """
    height, width = pixels.shape[:2]
    size = (width_px, max(1, round(height * width_px / width)))
    way = cv2.INTER_AREA if width > width_px else cv2.INTER_NEAREST
    small = cv2.resize(pixels, size, interpolation=way)[..., ::-1]
    done, data = cv2.imencode(".jpg", small, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    if not done:
        raise ValueError(f"cannot encode a picture of shape {pixels.shape}")
    encoded = base64.b64encode(data.tobytes()).decode()
    return (
        f'<figure><img width="{size[0]}" height="{size[1]}" alt="{safe(caption)}" '
        f'src="data:image/jpeg;base64,{encoded}"><figcaption>{safe(caption)}</figcaption></figure>'
    )
