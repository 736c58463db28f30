"""Reads meshes and textures in threads while their world is still being composed.

Python composes the world while MuJoCo reads files, so composing and reading run at the same time. MuJoCo stores the
decoded files in its cache, by path and modification time. It reads a file again if the world uses it with other
settings, such as a scaled mesh.
"""

from __future__ import annotations

import contextlib
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import mujoco

from gear.world.compilation.memory import disable_asset_cache

_BATCH_BYTES = 2 << 20
"""Total size of the files that a thread reads at once; after each batch the thread frees its temporary memory."""

_CACHE_BYTES = 2 << 30
"""Capacity of MuJoCo's cache, larger than any town. If it were too small, some files would be read twice."""

_INERTIA = "shell"
"""Method by which gear's MJCF files compute the inertia of a mesh. MuJoCo's default method would reject open
surfaces.
"""


class AssetPrefetcher:
    """Reads meshes and textures into MuJoCo's cache, in the threads of a pool."""

    def __init__(self, readers: ThreadPoolExecutor | None) -> None:
        """Makes a prefetcher.

        Args:
            readers: the threads that read; None if no file should be read in advance.
        """
        self._readers = readers

    def prefetch(self, files: Iterable[str]) -> None:
        """Starts to read files: paths that end in `.png` are textures, all others are meshes.

        Files that cannot be read are ignored; the compilation of the world reports them.

        Args:
            files: paths of meshes and textures.
        """
        if self._readers is not None:
            for batch in _batches(files):
                self._readers.submit(_read, batch)

    def wait(self) -> None:
        """Waits until all files are read. Afterwards `prefetch` must not be called again."""
        if self._readers is not None:
            self._readers.shutdown()


@contextlib.contextmanager
def asset_prefetcher(readers: int) -> Iterator[AssetPrefetcher]:
    """A context with a prefetcher. MuJoCo's cache is open inside the context, and empty and closed afterwards.

    Args:
        readers: number of threads that read. With 0 the cache stays closed and no file is read in advance, which saves
            memory.
    """
    disable_asset_cache()
    if not readers:
        yield AssetPrefetcher(None)
        return
    mujoco.mj_setCacheCapacity(mujoco.mj_getCache(), _CACHE_BYTES)
    try:
        with ThreadPoolExecutor(readers) as threads:
            try:
                yield AssetPrefetcher(threads)
            except BaseException:
                threads.shutdown(cancel_futures=True)
                raise
    finally:
        disable_asset_cache()


def _batches(files: Iterable[str]) -> Iterator[list[str]]:
    """Batches of files, largest files first, so that no thread has to read a large file alone at the end."""
    batch: list[str] = []
    batch_bytes = 0
    for size_bytes, file in sorted(((Path(file).stat().st_size, file) for file in files), reverse=True):
        batch.append(file)
        batch_bytes += size_bytes
        if batch_bytes >= _BATCH_BYTES:
            yield batch
            batch, batch_bytes = [], 0
    if batch:
        yield batch


def _read(files: list[str]) -> None:
    """Compiles a model that consists only of these files, which leaves them in MuJoCo's cache."""
    root = ET.Element("mujoco")
    assets = ET.SubElement(root, "asset")
    for number, file in enumerate(files):
        if file.endswith(".png"):
            ET.SubElement(assets, "texture", name=str(number), file=file, type="2d")
        else:
            ET.SubElement(assets, "mesh", name=str(number), file=file, inertia=_INERTIA)
    spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
    spec.compiler.usethread = False  # this function already runs in several threads
    spec.compile()
