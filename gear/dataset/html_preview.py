"""HTML previews of datasets and of pairs of samples, for notebooks."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Mapping
from html import escape

import cv2

from gear.values.frames import UInt8Image

WIDTH_PX = 320
"""Width in pixels of a preview picture."""

QUALITY = 85
"""JPEG quality of the embedded pictures."""


def preview_table(title: str, rows: Iterable[tuple[str, Mapping[str, UInt8Image]]]) -> str:
    """Formats small pictures of samples as one HTML table that contains the pictures themselves.

    Args:
        title: line above the table.
        rows: for each sample a caption, and (H, W, 3) uint8 RGB pictures by name.
    """
    lines = [f"<div><b>{escape(title)}</b><table>"]
    for caption, pictures in rows:
        cells = "".join(f"<td>{_image(name, rgb)}</td>" for name, rgb in pictures.items())
        lines.append(f"<tr><td>{escape(caption)}</td>{cells}</tr>")
    return "".join([*lines, "</table></div>"])


def _image(name: str, rgb: UInt8Image) -> str:
    height_px = max(round(rgb.shape[0] * WIDTH_PX / rgb.shape[1]), 1)
    small = cv2.resize(rgb, (WIDTH_PX, height_px), interpolation=cv2.INTER_AREA)
    data = cv2.imencode(".jpg", small[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, QUALITY])[1].tobytes()
    source = f"data:image/jpeg;base64,{base64.b64encode(data).decode()}"
    return f'<img alt="{escape(name)}" title="{escape(name)}" src="{source}">'
