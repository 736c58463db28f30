"""Meshes and textures read while their world is still being composed: that is Python's, and reading is MuJoCo's.

What is read waits in MuJoCo's own cache, by path and time of the file. What is then asked for otherwise, such as a mesh
with a scale, is read again.
"""

from __future__ import annotations

import contextlib
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import mujoco

from gear.world.compilation.memory import disable_asset_cache

_SHARE_BYTES = 2 << 20
"""Of files that one thread reads at a time: what it needs besides the meshes is given back after each share."""

_CACHE_BYTES = 2 << 30
"""Room for more than any town: it is taken as it is needed. Without it the last ones would be read twice."""

_INERTIA = "shell"
"""As gear's files have it; with MuJoCo's own default an open surface is refused."""


class AssetPrefetcher:
    """Files on their way into the cache."""

    def __init__(self, readers: ThreadPoolExecutor | None) -> None:
        self._readers = readers

    def prefetch(self, files: Iterable[str]) -> None:
        """Begins to read files: PNGs, and else meshes. What is wrong with one is for those to say who need it."""
        if self._readers is not None:
            for share in _shares(files):
                self._readers.submit(_read, share)

    def wait(self) -> None:
        """Returns when all are read; none can be expected after that."""
        if self._readers is not None:
            self._readers.shutdown()


@contextlib.contextmanager
def asset_prefetcher(readers: int) -> Iterator[AssetPrefetcher]:
    """Lets files be read ahead, and forgets them in the end.

    Args:
        readers: threads that read; with 0 nothing is read ahead, and nothing is in memory twice.
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


def _shares(files: Iterable[str]) -> Iterator[list[str]]:
    """The largest come first, so that nobody is left with one of them in the end."""
    share: list[str] = []
    share_bytes = 0
    for size_bytes, file in sorted(((Path(file).stat().st_size, file) for file in files), reverse=True):
        share.append(file)
        share_bytes += size_bytes
        if share_bytes >= _SHARE_BYTES:
            yield share
            share, share_bytes = [], 0
    if share:
        yield share


def _read(files: list[str]) -> None:
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
