"""The video of a drive: the reference camera's picture, what the network saw, and the controller's state; and the video
of twins beside each other.

H.264 by PyAV (FFmpeg), on one thread, so that equal drives have equal videos. PyAV is an optional package (extra
`video`).
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from fractions import Fraction
from typing import Any

import cv2
import numpy as np

from gear.contracts.controllers import Action
from gear.driving.drawing import drawn, drawn_end, padded
from gear.driving.simulation import FRAME_S, Situation
from gear.values.errors import GearError
from gear.values.frames import UInt8Image

QUALITY = "24"
"""Constant rate factor of H.264; a larger number gives smaller files."""

HELD_FRAMES = 20
"""Number of frames for which the end of a drive is shown."""

COLUMN_PX, GAP_PX = 640, 4
"""Largest width of a drive in the video of twins, and the width of the line between two drives, pixels."""


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
    """Draws the frames of one drive and encodes them as a video. Frames are encoded in a thread of their own, while the
    next frame is rendered; the bytes do not depend on that.
    """

    def __init__(self, title: str) -> None:
        """Begins a video without frames.

        Args:
            title: the drive in a few words; it stands above each frame.
        """
        self._title = title
        self._height = 0
        self._encoder = _Encoder()
        self._thread = ThreadPoolExecutor(max_workers=1)
        self._encoded: list[Future[None]] = []

    def watch(self, situation: Situation, views: Mapping[str, UInt8Image], seen: Any, action: Action | None) -> None:
        """Draws one frame; the end of the drive is drawn as several equal frames.

        Args:
            situation: state of the drive.
            views: (H, W, 3) uint8 pictures by camera, the reference camera first; nothing is drawn without pictures.
            seen: prediction of the network; None without one.
            action: the controller's decision; None at the end of the drive.
        """
        if not views:
            return
        picture = next(iter(views.values()))
        if action is not None:
            frame = drawn(self._title, situation, picture, seen, action)
            self._height = self._height or frame.shape[0]
            self._encoded.append(self._thread.submit(self._encoder.add, frame))
        elif self._encoded:
            end = drawn_end(self._title, situation, picture, self._height)
            self._encoded += [self._thread.submit(self._encoder.add, end) for _ in range(HELD_FRAMES)]

    def mp4(self) -> bytes:
        """The video as an MP4 file; empty without frames. No frame can be added afterwards.

        Raises:
            av.FFmpegError: a frame could not be encoded.
        """
        self._thread.shutdown()
        for frame in self._encoded:
            frame.result()
        return self._encoder.finish()


class _Encoder:
    """Encodes frames one after another."""

    def __init__(self) -> None:
        self._data = io.BytesIO()
        self._container: Any = None
        self._stream: Any = None

    def add(self, picture: UInt8Image) -> None:
        """Encodes one (H, W, 3) uint8 frame; all frames have one size with even sides."""
        import av

        if self._container is None:
            self._container = av.open(self._data, "w", format="mp4")
            self._stream = self._container.add_stream("libx264", rate=Fraction(round(1 / FRAME_S)))
            self._stream.height, self._stream.width = picture.shape[:2]
            self._stream.pix_fmt = "yuv420p"
            self._stream.options = {"crf": QUALITY, "preset": "fast", "threads": "1"}
        self._container.mux(self._stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))

    def finish(self) -> bytes:
        """The MP4 file of all frames; empty without frames."""
        if self._container is not None:
            self._container.mux(self._stream.encode())
            self._container.close()
        return self._data.getvalue()


def encoded(frames: Sequence[UInt8Image]) -> bytes:
    """An MP4 file with 10 frames per second; empty without frames.

    Args:
        frames: (H, W, 3) uint8 frames of one size with even sides.
    """
    encoder = _Encoder()
    for picture in frames:
        encoder.add(picture)
    return encoder.finish()


def decoded(data: bytes) -> Iterator[UInt8Image]:
    """Yields the frames of a video as (H, W, 3) uint8 arrays.

    Args:
        data: bytes of a video file.

    Raises:
        ValueError: the data are no video.
    """
    import av

    try:
        with av.open(io.BytesIO(data), "r") as container:
            for frame in container.decode(video=0):
                yield np.asarray(frame.to_ndarray(format="rgb24"), np.uint8)
    except (av.FFmpegError, IndexError) as error:
        raise ValueError(f"no video that can be read ({type(error).__name__})") from error


def beside_each_other(videos: Sequence[bytes]) -> bytes:
    """One MP4 file with several drives beside each other, in step by time; the end of a shorter drive stays.

    Args:
        videos: the MP4 files of the drives, from left to right.

    Raises:
        ValueError: a video cannot be read, or has no frames.
    """
    drives = [[_column(frame) for frame in decoded(data)] for data in videos]
    if not all(drives):
        raise ValueError("a video without frames")
    height = max(frames[0].shape[0] for frames in drives)
    gap = np.full((height, GAP_PX, 3), 255, np.uint8)
    together = []
    for number in range(max(len(frames) for frames in drives)):
        parts = [frames[min(number, len(frames) - 1)] for frames in drives]
        row = [piece for part in parts for piece in (gap, padded(part, height, part.shape[1]))]
        together.append(np.ascontiguousarray(np.concatenate(row[1:], axis=1)))
    return encoded(together)


def _column(frame: UInt8Image) -> UInt8Image:
    """A frame at most `COLUMN_PX` wide, with even sides."""
    height, width = frame.shape[:2]
    scale = min(1.0, COLUMN_PX / width)
    size = (round(width * scale) // 2 * 2, round(height * scale) // 2 * 2)
    return frame if scale == 1 else np.asarray(cv2.resize(frame, size, interpolation=cv2.INTER_AREA), np.uint8)
