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


def decode_quietly(data: bytes, flags: int = cv2.IMREAD_UNCHANGED) -> npt.NDArray[Any] | None:
    """Decodes a picture with OpenCV. Lines that libjpeg, libtiff and OpenCV write to stderr are discarded.

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
        kept, nothing = os.dup(2), os.open(os.devnull, os.O_WRONLY)
        try:
            os.dup2(nothing, 2)
            picture = cv2.imdecode(np.frombuffer(data, np.uint8), flags)
        except cv2.error:
            return None
        finally:
            os.dup2(kept, 2)
            os.close(kept)
            os.close(nothing)
    return None if picture is None else np.asarray(picture)
