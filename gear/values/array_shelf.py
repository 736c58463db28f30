"""A shelf: a folder that keeps arrays which take longer to compute than to read.

The arrays of one name are one file, with a hash of everything that determines them and a checksum. A missing, damaged
or unwritable file only costs time.
"""

from __future__ import annotations

import contextlib
import hashlib
import mmap
import os
import tempfile
import time
import zlib
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from gear.values.regular_file import check_regular

Arrays: TypeAlias = tuple[npt.NDArray[Any], ...]

_MAGIC = b"gear arrays 1\n"
_CHECKSUM_BYTES = 4
_SUFFIX = ".arrays"
_SCRATCH = ".making-"
_ABANDONED_S = 3600.0
_PROCESSOR = ("model name", "flags", "Features", "CPU part")


@dataclass(frozen=True, slots=True, kw_only=True)
class ArrayShelf:
    """A folder with at most one file for each name, so its size is bounded by the number of names.

    Attributes:
        folder: the folder; None if nothing is kept.
        owner: what the arrays of this folder belong to, for example a hash of the content of a compiled world.
    """

    folder: Path | None = None
    owner: str = ""

    def arrays(self, name: str, inputs: Iterable[bytes], compute: Callable[[], Sequence[npt.NDArray[Any]]]) -> Arrays:
        """The arrays of a name, read from the shelf; computed and stored if the shelf does not have them.

        Args:
            name: name of the file, without suffix.
            inputs: everything beside the owner that determines the arrays, among it the code that computes them
                (`code_digest`). The versions of NumPy and the processor are always part of it.
            compute: computes the arrays; none of them may hold Python objects.

        Returns:
            The arrays, in the order of `compute`.
        """
        if self.folder is None:
            return tuple(compute())
        path, key = self.folder / f"{name}{_SUFFIX}", self._key(inputs)
        arrays = _read(path, key)
        if arrays is None:
            arrays = tuple(compute())
            with contextlib.suppress(OSError):  # a full or read-only disk, or a folder that was removed
                _write(path, key, arrays)
        return arrays

    def _key(self, inputs: Iterable[bytes]) -> bytes:
        digest = hashlib.sha256()
        for part in (self.owner.encode(), np.__version__.encode(), _processor(), *inputs):
            digest.update(len(part).to_bytes(8, "little") + part)
        return digest.digest()


NO_SHELF = ArrayShelf()
"""A shelf that keeps nothing."""


@cache
def code_digest(*paths: str) -> bytes:
    """The SHA-256 hash of files of code; a part of `inputs` of `ArrayShelf.arrays`.

    Args:
        paths: paths of the files.
    """
    return hashlib.sha256(b"".join(hashlib.sha256(Path(path).read_bytes()).digest() for path in paths)).digest()


@cache
def _processor() -> bytes:
    """The lines of Linux's description of the first processor that say which instructions it has; empty elsewhere.

    Libraries choose instructions by the processor, and other instructions may round differently.
    """
    try:
        first = Path("/proc/cpuinfo").read_text("utf-8", "replace").split("\n\n")[0]
    except OSError:
        return b""
    return "\n".join(line for line in first.splitlines() if line.startswith(_PROCESSOR)).encode()


def _read(path: Path, key: bytes) -> Arrays | None:
    """The arrays in a file; None if there is no such file, if it has another key, or if it is damaged."""
    try:
        with check_regular(path).open("rb") as file:
            mapped = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
    except (OSError, ValueError):  # ValueError: the file is empty
        return None
    with mapped:
        if mapped.read(len(_MAGIC) + len(key)) != _MAGIC + key:
            return None
        checksum = mapped.read(_CHECKSUM_BYTES)
        begin = mapped.tell()
        arrays = []
        with memoryview(mapped) as content:
            if zlib.crc32(content[begin:]).to_bytes(_CHECKSUM_BYTES, "little") != checksum:
                return None
            while mapped.tell() < len(mapped):
                np.lib.format.read_magic(mapped)
                shape, _, dtype = np.lib.format.read_array_header_1_0(mapped)
                array = np.empty(shape, dtype)
                end = mapped.tell() + array.nbytes
                array.reshape(-1).view(np.uint8).data[:] = content[mapped.tell() : end]
                mapped.seek(end)
                arrays.append(array)
    return tuple(arrays)


def _write(path: Path, key: bytes, arrays: Arrays) -> None:
    """Stores arrays in a file, whole or not at all, and removes what killed processes left unfinished."""
    descriptor, name = tempfile.mkstemp(dir=path.parent, prefix=_SCRATCH, suffix=_SUFFIX)
    try:
        with os.fdopen(descriptor, "w+b") as file:
            head = _MAGIC + key
            file.write(head + bytes(_CHECKSUM_BYTES))
            for array in arrays:
                np.lib.format.write_array(file, np.asarray(array, order="C"), (1, 0), allow_pickle=False)
            file.flush()
            with mmap.mmap(descriptor, 0, access=mmap.ACCESS_READ) as mapped, memoryview(mapped) as content:
                checksum = zlib.crc32(content[len(head) + _CHECKSUM_BYTES :])
            file.seek(len(head))
            file.write(checksum.to_bytes(_CHECKSUM_BYTES, "little"))
        Path(name).replace(path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise
    for left in path.parent.glob(f"{_SCRATCH}*{_SUFFIX}"):
        if time.time() - left.stat().st_mtime > _ABANDONED_S:
            left.unlink(missing_ok=True)
