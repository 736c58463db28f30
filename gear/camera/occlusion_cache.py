"""A cache on disk of the maps of the sky that assets hide (`SkyOcclusion`).

Computing the map of one asset takes 20 ms, and reading it less than one; the first samples of a run need about nine new
maps each. A map is stored under a hash of everything that determines it: the asset's triangles, the code that computes
the map, and the versions of NumPy and OpenCV. The files are in `~/.cache/gear/sky-occlusion` (`$XDG_CACHE_HOME`).
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import io
import os
import re
import tempfile
import zipfile
from pathlib import Path

import cv2
import numpy as np

from gear.camera import contact_shadows, fractal, surface_points
from gear.camera.contact_shadows import SkyOcclusion, grid_of
from gear.values.frames import Shape
from gear.values.regular_file import read_regular
from gear.values.user_cache import user_cache_folder

MOST_MAPS = 2000
"""Largest number of maps in the cache; the town with most assets has 85. The oldest maps are removed."""

_OWN = re.compile(r"[0-9a-f]{32}\.npz|\.making-\w+\.npz")
"""Names of files that this cache writes; other files in its folder are never removed."""

_MOST_BYTES = 16 << 20
_CODE = (contact_shadows, fractal, surface_points)


def cached_occlusion(shape: Shape, folder: Path | None = None) -> SkyOcclusion:
    """The sky that an asset hides, from the cache; computed and stored if the cache does not have it.

    A missing, damaged or unwritable cache only costs time.

    Args:
        shape: triangles of the asset in the actor frame; it stands on z = 0.
        folder: folder of the cache; None for the user's cache folder.

    Returns:
        The same values as `SkyOcclusion.of`.
    """
    try:
        cache = folder or user_cache_folder() / "sky-occlusion"
    except RuntimeError:  # the user has no home folder
        return SkyOcclusion.of(shape)
    path = cache / f"{_key(shape)}.npz"
    occlusion = _read(path, shape)
    if occlusion is None:
        occlusion = SkyOcclusion.of(shape)
        _write(path, occlusion)
    return occlusion


def _key(shape: Shape) -> str:
    """Hash of everything that determines the map of an asset."""
    digest = hashlib.sha256(_code_digest())
    for array in (shape.vertices_m, shape.faces, shape.box_centre_m, shape.box_size_m):
        digest.update(f"{array.dtype.str} {array.shape}\0".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:32]


@functools.cache
def _code_digest() -> bytes:
    digest = hashlib.sha256(f"{np.__version__} {cv2.__version__}\0".encode())
    for module in _CODE:
        assert module.__file__ is not None
        digest.update(Path(module.__file__).read_bytes())
    return digest.digest()


def _read(path: Path, shape: Shape) -> SkyOcclusion | None:
    """The map in a file; None if there is no such file, or if it is damaged: the checksum in the file says so."""
    rows, columns, cells_per_m = grid_of(shape)
    try:
        with np.load(io.BytesIO(read_regular(path, most_bytes=_MOST_BYTES)), allow_pickle=False) as content:
            share = content["share"]
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, NotImplementedError, RuntimeError):
        return None
    if share.dtype != np.float32 or share.shape != (rows, columns):
        return None
    return SkyOcclusion(share, cells_per_m)


def _write(path: Path, occlusion: SkyOcclusion) -> None:
    """Stores a map, whole or not at all, and removes the oldest maps of a full cache."""
    content = io.BytesIO()
    np.savez(content, share=occlusion.share)
    with contextlib.suppress(OSError):  # a full or read-only disk must not keep a sample from being made
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=".making-", suffix=".npz")
        try:
            with os.fdopen(descriptor, "wb") as stream:
                stream.write(content.getbuffer())
            Path(name).replace(path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise
        _remove_oldest(path.parent)


def _remove_oldest(folder: Path) -> None:
    """Removes the oldest maps of a full cache, and with them files that killed runs left unfinished."""
    maps = [
        (entry.stat(follow_symlinks=False).st_mtime, entry.path)
        for entry in os.scandir(folder)
        if _OWN.fullmatch(entry.name) and entry.is_file(follow_symlinks=False)
    ]
    for _, oldest in sorted(maps)[: max(0, len(maps) - MOST_MAPS)]:
        Path(oldest).unlink(missing_ok=True)
