"""Decodes pictures without the messages of native decoders on stderr, where only a command's one-line error should
appear.
"""

from __future__ import annotations

import os
import sys
import tempfile
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
        with tempfile.TemporaryFile() as said:
            kept = os.dup(2)
            try:
                os.dup2(said.fileno(), 2)
                picture = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
            except cv2.error:
                return None
            finally:
                os.dup2(kept, 2)
                os.close(kept)
            said.seek(0)
            text = said.read(READ_BYTES)
    is_damaged = any(message in text for message in DAMAGE)
    return None if picture is None or is_damaged else np.asarray(picture)
