"""Keeping compilation lean: it needs several times the memory that it leaves, and a worker has little.

Measured on town10 (the model alone has 345 MB): with MuJoCo's cache, with the files of a world in memory and with what
nobody needs once the renderer has its own copies, a worker had 1.8 GB; without them, and with large buffers that go
back to the system, it has 1.3 GB at its peak.
"""

from __future__ import annotations

import ctypes
import gc
import mmap
import sys
from collections.abc import Iterable

import mujoco
import numpy as np
import numpy.typing as npt

_SHOWN = (
    "tex_data",
    "mesh_face",
    "mesh_facenormal",
    "mesh_facetexcoord",
    "mesh_normal",
    "mesh_texcoord",
    "mesh_vert",
)
_MADV_DONTNEED = 4
_M_MMAP_THRESHOLD = -3
_M_TRIM_THRESHOLD = -1
_LARGE_BYTES = 8 << 20
_KEPT_BYTES = 32 << 20


def disable_asset_cache() -> None:
    """Turns off MuJoCo's cache of decoded meshes and pictures; a worker compiles once."""
    mujoco.mj_setCacheCapacity(mujoco.mj_getCache(), 0)


def map_large_buffers() -> None:
    """Has every buffer of a linear frame's size come straight from the system, and go straight back.

    Left alone, glibc soon keeps such buffers in its heap, in between what lives long: 130 MB of holes in `film`.
    Told so, it would also hand back all else that lies free at the end of its heap, to fetch it again for the next
    line of label maps and their like: a third of the time of measuring and encoding was spent in the system.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_M_MMAP_THRESHOLD, _LARGE_BYTES)
        mallopt(_M_TRIM_THRESHOLD, _KEPT_BYTES)


def release_memory() -> None:
    """Hands freed pages back to the system. Only glibc can be asked for them; elsewhere that step is left out."""
    gc.collect()
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def release_render_arrays(model: mujoco.MjModel) -> None:
    """Gives up the texels and triangles of a model that a renderer has been opened for, and has copies of.

    Afterwards no other renderer can be opened for it.
    """
    _give_back(getattr(model, name) for name in _SHOWN)


def _give_back(arrays: Iterable[npt.NDArray[np.generic]]) -> None:
    """Lets the system take whole pages of arrays, which then read as zeros. A model is one block, so it cannot free
    parts of itself. Only Linux promises the zeros; elsewhere the arrays stay as they are.
    """
    if sys.platform != "linux":
        return
    advise = ctypes.CDLL(None, use_errno=True).madvise
    for array in arrays:
        begin = -(-array.ctypes.data // mmap.PAGESIZE) * mmap.PAGESIZE
        end = (array.ctypes.data + array.nbytes) // mmap.PAGESIZE * mmap.PAGESIZE
        if begin < end:
            # Refusal costs memory, nothing else.
            advise(ctypes.c_void_p(begin), ctypes.c_size_t(end - begin), _MADV_DONTNEED)
