"""Files appear whole or not at all, and never outside the folder that they belong to."""

from __future__ import annotations

import contextlib
import hashlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from gear.dataset.disk_errors import SYSTEM_LIMITS, explained
from gear.dataset.guarded_paths import inside, opened_parent
from gear.dataset.scratch import NEW, SCRATCH, clear_scratch, half_written
from gear.values.errors import DatasetError
from gear.values.regular_file import read_regular

__all__ = [
    "clear_scratch", "explained", "inside", "read_bytes", "refuse_folder", "sha256", "streamed_alone", "sync_folder",
    "write_alone", "write_whole",
]  # fmt: skip

TRIES = 100
"""Another process may remove an empty folder, or clear a half-written file, between two steps of writing."""


def sha256(data: bytes) -> str:
    """The SHA-256 of some bytes, as 64 hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()


def write_whole(root: Path, relative: str, data: bytes) -> None:
    """Writes `root/relative`: into a half-written file first, which is synced and renamed into place.

    Raises:
        DatasetError: the disk refuses, or the path leaves the root or leads through a link.
    """
    target = root / relative
    with explained(target):
        for left in reversed(range(TRIES)):
            try:
                root.mkdir(parents=True, exist_ok=True)
                with (
                    opened_parent(root, relative, make=True) as (folder, name),
                    opened_parent(root, f"{SCRATCH}/x", make=True) as (scratch, _),
                    half_written(scratch, data) as temporary,
                ):
                    os.replace(temporary, name, src_dir_fd=scratch, dst_dir_fd=folder)
            except (FileNotFoundError, FileExistsError):  # another run removed a folder, or made one, at this moment
                if not left:
                    raise
            else:
                return


def write_alone(path: Path, data: bytes) -> None:
    """Writes a file that belongs to no dataset, whole or not at all.

    Raises:
        DatasetError: the disk refuses, or the path is a folder.
    """
    with streamed_alone(path) as stream:
        stream.write(data)


@contextlib.contextmanager
def streamed_alone(path: Path) -> Iterator[BinaryIO]:
    """Writes a file that belongs to no dataset piece by piece; it appears, whole, when the block ends.

    Until then it lies under a hidden name beside its place.

    Raises:
        DatasetError: the disk refuses, or the path is a folder.
    """
    refuse_folder(path)
    with explained(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(8)}")
        try:
            with os.fdopen(os.open(temporary, NEW, 0o666), "wb") as stream:
                yield stream
                stream.flush()
                os.fsync(stream.fileno())
            temporary.replace(path)
        except BaseException:  # Ctrl-C, too
            temporary.unlink(missing_ok=True)
            raise


def refuse_folder(path: Path) -> None:
    """Refuses a folder where a file is to be written.

    Raises:
        DatasetError: the path is a folder.
    """
    with explained(path):
        if not path.name or path.is_dir():
            raise DatasetError(path, "is a folder, a file was asked for; name one in it")


def sync_folder(path: Path) -> None:
    """Makes renames inside a folder last through a power cut, where the system can."""
    with contextlib.suppress(OSError):
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def read_bytes(path: Path) -> bytes:
    """The bytes of a regular file.

    Raises:
        DatasetError: it is missing, no regular file, or cannot be read.
    """
    try:
        return read_regular(path)
    except OSError as error:
        if error.errno in SYSTEM_LIMITS:
            raise
        raise DatasetError(path, f"cannot read it: {error.strerror}") from error
