"""Reads meshes and textures in threads while their world is still being composed.

Composing is Python's work and reading is MuJoCo's, so both run at once. What was read waits in MuJoCo's cache, by the
path and the modification time of the file. MuJoCo reads a file again where the world uses it with other settings, such
as a scaled mesh.
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
"""Size of the files that one thread reads at a time; it gives back its temporary memory after each batch."""

_CACHE_BYTES = 2 << 30
"""Capacity of MuJoCo's cache, more than any town needs. In a smaller one the last files would be read twice."""

_INERTIA = "shell"
"""How gear's files compute the inertia of a mesh; MuJoCo's default refuses open surfaces."""


class AssetPrefetcher:
    """Reads files into MuJoCo's cache, in the threads of a pool."""

    def __init__(self, readers: ThreadPoolExecutor | None) -> None:
        """Takes the pool; without one nothing is read."""
        self._readers = readers

    def prefetch(self, files: Iterable[str]) -> None:
        """Begins to read files: a path ending in `.png` is a texture, any other a mesh.

        A file that cannot be read is no error here: it is one where the world is compiled.
        """
        if self._readers is not None:
            for batch in _batches(files):
                self._readers.submit(_read, batch)

    def wait(self) -> None:
        """Waits until all files are read. No further file can be prefetched."""
        if self._readers is not None:
            self._readers.shutdown()


@contextlib.contextmanager
def asset_prefetcher(readers: int) -> Iterator[AssetPrefetcher]:
    """Opens MuJoCo's cache for a prefetcher, and empties and closes it at the end.

    Args:
        readers: number of threads that read; with 0 nothing is prefetched, and nothing is in memory twice.
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
    """Batches of files, the largest files first, so that no thread is left with a large one at the end."""
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
    """Compiles a model of the files alone, which leaves them in MuJoCo's cache."""
    root = ET.Element("mujoco")
    assets = ET.SubElement(root, "asset")
    for number, file in enumerate(files):
        if file.endswith(".png"):
            ET.SubElement(assets, "texture", name=str(number), file=file, type="2d")
        else:
            ET.SubElement(assets, "mesh", name=str(number), file=file, inertia=_INERTIA)
    spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
    spec.compiler.usethread = False  # the readers are the threads
    spec.compile()
