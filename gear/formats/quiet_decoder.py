"""Decodes pictures without the messages of native decoders on stderr, where only a command's one-line error should
appear.
"""

from __future__ import annotations

import os
import sys
import threading
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt

_LOCK = threading.Lock()

DAMAGE = (b"Corrupt JPEG data", b"Premature end of JPEG", b"does not end with EOC")
"""Messages of libjpeg and OpenJPEG about pictures whose missing parts they fill in."""

READ_BYTES = 1 << 16
"""Number of bytes of the messages that are searched."""


def decode_quietly(data: bytes, flags: int = cv2.IMREAD_UNCHANGED) -> npt.NDArray[Any] | None:
    """Decodes a picture with OpenCV. Lines that libjpeg, libtiff and OpenCV write to stderr are not shown. A picture of
    which such a line says that a part is missing or damaged counts as one that cannot be decoded.

    Stderr of the whole process is redirected during the call, so the function is for single pictures such as patches,
    not for many pictures in threads.

    Args:
        data: content of the file.
        flags: flags of `cv2.imdecode`.

    Returns:
        (H, W) or (H, W, C) picture in the order of OpenCV (BGR); None if it cannot be decoded.
    """
    if not data:
        return None
    with _LOCK:
        sys.stderr.flush()
        kept, (heard, said) = os.dup(2), os.pipe()
        try:
            os.set_blocking(heard, False)
            os.set_blocking(said, False)  # what does not fit into the pipe is dropped
            os.dup2(said, 2)
            picture = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
            text = _read(heard)
        except cv2.error:
            return None
        finally:
            os.dup2(kept, 2)
            for descriptor in (kept, heard, said):
                os.close(descriptor)
    is_damaged = any(message in text for message in DAMAGE)
    return None if picture is None or is_damaged else np.asarray(picture)


def _read(pipe: int) -> bytes:
    """What a pipe that does not block holds."""
    try:
        return os.read(pipe, READ_BYTES)
    except BlockingIOError:  # nothing
        return b""
