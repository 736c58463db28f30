"""The video of a drive: the reference camera's picture, what the network saw, and the controller's state.

H.264 by PyAV (FFmpeg), on one thread, so that equal drives have equal videos. PyAV is an optional package (extra
`video`).
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import cv2
import numpy as np

from gear.contracts.controllers import Action
from gear.driving.simulation import FRAME_S, Situation
from gear.formats.cityscapes import COLOURS
from gear.values.errors import GearError
from gear.values.frames import UInt8Image

WIDTH_PX = 832
"""Largest width of a video, pixels; wider pictures are made smaller."""

QUALITY = "24"
"""Constant rate factor of H.264; a larger number gives smaller files."""

FARTHEST_M = 60.0
"""Depth at the end of the colour scale, metres."""

TEXT_PX, MARGIN_PX = 20, 8
WHITE, RED, BLACK = (255, 255, 255), (255, 70, 50), (0, 0, 0)


def check_video() -> None:
    """Checks that PyAV is installed.

    Raises:
        GearError: it is not; the message names the extra to install.
    """
    try:
        import av  # noqa: F401
    except ModuleNotFoundError as error:
        raise GearError("videos need PyAV: pip install 'mujoco-gear[video]', or set video=false") from error


class Video:
    """Collects the frames of one drive and encodes them as a video."""

    def __init__(self) -> None:
        self._frames: list[UInt8Image] = []

    def watch(self, situation: Situation, views: Mapping[str, UInt8Image], seen: Any, action: Action) -> None:
        """Draws one frame.

        Args:
            situation: state of the drive.
            views: (H, W, 3) uint8 pictures by camera, the reference camera first; nothing is drawn without pictures.
            seen: prediction of the network; None without one.
            action: the controller's decision.
        """
        if views:
            self._frames.append(drawn(situation, next(iter(views.values())), seen, action))

    def mp4(self) -> bytes:
        """The video as an MP4 file; empty without frames."""
        if not self._frames:
            return b""
        import av

        data = io.BytesIO()
        with av.open(data, "w", format="mp4") as container:
            stream = container.add_stream("libx264", rate=Fraction(round(1 / FRAME_S)))
            stream.height, stream.width = self._frames[0].shape[:2]
            stream.pix_fmt = "yuv420p"
            stream.options = {"crf": QUALITY, "preset": "fast", "threads": "1"}
            for picture in self._frames:
                container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
            container.mux(stream.encode())
        return data.getvalue()


def drawn(situation: Situation, picture: UInt8Image, seen: Any, action: Action) -> UInt8Image:
    """One frame of a drive's video: a line of text, the picture with the predicted boxes, and below it the predicted
    label or depth map, if there is one.

    Args:
        situation: the state of the drive.
        picture: (H, W, 3) uint8 picture of the first camera; it is not changed.
        seen: prediction of the network; None without a network.
        action: the controller's decision. The line of text shows its acceleration and notes, and is red during
            emergency braking.

    Returns:
        (H', W', 3) uint8 frame.
    """
    boxes = _boxes(seen)
    shown = picture.copy()
    for left_px, top_px, right_px, bottom_px in boxes:
        cv2.rectangle(shown, (left_px, top_px), (right_px, bottom_px), RED, 2)
    parts = [_fitted(shown)]
    coloured = _coloured(seen)
    if coloured is not None:
        parts.append(_fitted(coloured))
    speed_kmh, command = situation.ego.speed_mps * 3.6, action.acceleration_mps2
    words = [f"{situation.time_s:4.1f} s", f"{speed_kmh:3.0f} km/h", f"{command:+.1f} m/s2"]
    words += [f"{name} {value:.1f}" for name, value in sorted(action.notes.items()) if name != "is_emergency"]
    is_emergency = action.notes.get("is_emergency", 0.0) > 0
    line = np.zeros((TEXT_PX + 2 * MARGIN_PX, parts[0].shape[1], 3), np.uint8)
    line[:] = RED if is_emergency else BLACK
    place = (MARGIN_PX, TEXT_PX + MARGIN_PX // 2)
    cv2.putText(line, "  ".join(words), place, cv2.FONT_HERSHEY_SIMPLEX, 0.55, WHITE, 1, cv2.LINE_AA)
    return np.ascontiguousarray(np.concatenate([line, *parts]))


def _coloured(seen: Any) -> UInt8Image | None:
    """A picture of a dense prediction: depth in metres, or Cityscapes' label ids; None for other predictions."""
    if not isinstance(seen, np.ndarray) or seen.ndim != 2:
        return None
    if seen.dtype == np.uint8:
        return np.asarray(COLOURS[np.minimum(seen, len(COLOURS) - 1)], np.uint8)
    far = np.clip(np.nan_to_num(np.asarray(seen, np.float32), nan=FARTHEST_M) / FARTHEST_M, 0.0, 1.0)
    levels = np.asarray(np.rint(255 * (1 - far)), np.uint8)
    return np.ascontiguousarray(cv2.applyColorMap(levels, cv2.COLORMAP_TURBO)[..., ::-1], np.uint8)


def _boxes(seen: Any) -> list[tuple[int, int, int, int]]:
    """The 2D boxes of detections, whole pixels; empty for other predictions."""
    if not isinstance(seen, (tuple, list)):
        return []
    found = [getattr(one, "box_px", None) for one in seen]
    return [(round(b[0]), round(b[1]), round(b[2]), round(b[3])) for b in found if b is not None]


def _fitted(picture: UInt8Image) -> UInt8Image:
    """A picture at most `WIDTH_PX` wide, with even sides, as H.264 needs them."""
    height, width = picture.shape[:2]
    scale = min(1.0, WIDTH_PX / width)
    size = (round(width * scale) // 2 * 2, round(height * scale) // 2 * 2)
    if size == (width, height):
        return picture
    return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.uint8)
