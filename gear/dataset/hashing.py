"""Hashes many files, several at a time."""

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
"""Largest number of threads; with more the disk is the limit. `hashlib` releases Python's lock, so that threads hash in
parallel.
"""

S = TypeVar("S")
T = TypeVar("T")


def file_hash(path: Path) -> str:
    """The SHA-256 of a file, as 64 hexadecimal digits.

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
    """The results of a call on each item, in order, computed in threads."""
    with ThreadPoolExecutor(min(MOST_THREADS, os.cpu_count() or 1)) as pool:
        yield from pool.map(call, items)
