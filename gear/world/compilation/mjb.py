"""Writes and reads compiled models through memory-mapped files.

MuJoCo's own functions copy the whole model once more; for a large model, this takes half of their time.
"""

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
    """Writes a model into a new file and returns the CRC-32 of its content.

    Args:
        model: the compiled model.
        path: path of the new file.

    Returns:
        The CRC-32 of the content, which `read_model` checks.

    Raises:
        OSError: the disk is full.
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
    """Reads a model that `write_model` wrote.

    Args:
        path: path of the file.
        crc32: CRC-32 of the content; after a power failure a file may have the right size and the wrong content.

    Raises:
        OSError: the file is missing or cannot be read.
        ValueError: its content has another CRC-32.
    """
    with path.open("rb") as file:
        content = _view(mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ))
    if isal_zlib.crc32(content) != crc32:
        raise ValueError(f"{path} is not what was written there")
    return _model_in(content) or mujoco.MjModel.from_binary_path(str(path))


def _view(mapped: mmap.mmap) -> Bytes:
    """An array over a memory map, which keeps the map open as long as the array exists.

    Closing a map explicitly while an array uses it, as after Ctrl-C, would raise an error that hides the first one.
    """
    return np.frombuffer(mapped, np.uint8)


def _model_in(content: Bytes) -> mujoco.MjModel | None:
    """Loads a model from memory, for which MuJoCo's Python bindings have no function; None if this is impossible."""
    load = getattr(ctypes.CDLL(mujoco._structs.__file__), "mj_loadModelBuffer", None)
    adopt = getattr(mujoco.MjModel, "_from_model_ptr", None)
    if load is None or adopt is None:
        return None
    load.argtypes, load.restype = (ctypes.c_void_p, ctypes.c_int64), ctypes.c_void_p
    address = load(content.ctypes.data, content.nbytes)
    return adopt(address) if address else None
