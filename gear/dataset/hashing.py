"""Computes the SHA-256 of files, several files in parallel."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TypeVar

from gear.values.errors import DatasetError
from gear.values.regular_file import check_regular

PIECE_BYTES = 1 << 20
MOST_THREADS = 8
"""Largest number of threads; with more threads the disk is the limit. `hashlib` releases Python's global lock, so the
threads run in parallel.
"""

S = TypeVar("S")
T = TypeVar("T")


def file_hash(path: Path) -> str:
    """The SHA-256 of the file `path`, as 64 hexadecimal digits; the file is read in pieces, so it may be large.

    Raises:
        DatasetError: the file is missing, not a regular file, or cannot be read.
    """
    digest = hashlib.sha256()
    try:
        with check_regular(path).open("rb") as stream:
            while piece := stream.read(PIECE_BYTES):
                digest.update(piece)
    except OSError as error:
        raise DatasetError(path, f"cannot read it: {error.strerror}") from error
    return digest.hexdigest()


def in_threads(call: Callable[[S], T], items: Sequence[S]) -> Iterator[T]:
    """Calls the function `call` for each item in parallel threads, and yields the results in the order of `items`."""
    with ThreadPoolExecutor(min(MOST_THREADS, os.cpu_count() or 1)) as pool:
        yield from pool.map(call, items)
