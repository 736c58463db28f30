"""Compiled models in files, written and read in place: half of the time of a large model's way to the disk and back
went into the copy of it that is made in between."""

from __future__ import annotations

import ctypes
import mmap
import os
from pathlib import Path
from typing import TypeAlias

import mujoco
import numpy as np
from isal import isal_zlib

Bytes: TypeAlias = np.ndarray[tuple[int], np.dtype[np.uint8]]


def write_model(model: mujoco.MjModel, path: Path) -> int:
    """Writes a model into a new file; the CRC-32 of the content.

    Raises:
        OSError: there is no room for it.
    """
    size = mujoco.mj_sizeModel(model)
    with path.open("w+b") as file:
        if hasattr(os, "posix_fallocate"):
            os.posix_fallocate(file.fileno(), 0, size)
        else:
            file.truncate(size)
        content = _view(mmap.mmap(file.fileno(), size))
    mujoco.mj_saveModel(model, None, content)
    return isal_zlib.crc32(content)


def read_model(path: Path, crc32: int) -> mujoco.MjModel:
    """Reads what `write_model` wrote.

    Args:
        path: of the file.
        crc32: of its content; a power cut may leave one of the right size.

    Raises:
        OSError: there is none.
        ValueError: it is not what was written.
    """
    with path.open("rb") as file:
        content = _view(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    if isal_zlib.crc32(content) != crc32:
        raise ValueError(f"{path} is not what was written there")
    return _model_in(content) or mujoco.MjModel.from_binary_path(str(path))


def _view(mapped: mmap.mmap) -> Bytes:
    """A map as an array, which alone holds it: a map that is closed by hand while an array looks at it, as after Ctrl-C
    in the middle of a reading, raises an error of its own in place of what happened."""
    return np.frombuffer(mapped, np.uint8)


def _model_in(content: Bytes) -> mujoco.MjModel | None:
    """A model out of memory, which MuJoCo's bindings offer for files alone; None where its library hides the way."""
    load = getattr(ctypes.CDLL(mujoco._structs.__file__), "mj_loadModelBuffer", None)
    adopt = getattr(mujoco.MjModel, "_from_model_ptr", None)
    if load is None or adopt is None:
        return None
    load.argtypes, load.restype = (ctypes.c_void_p, ctypes.c_int64), ctypes.c_void_p
    address = load(content.ctypes.data, content.nbytes)
    return adopt(address) if address else None
