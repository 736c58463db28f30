"""Writes files atomically, and only inside the folder of a dataset or at the path that the user names."""

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
from gear.values.regular_file import NotAFileError, check_regular, read_regular

__all__ = [
    "check_output_file", "clear_scratch", "explained", "inside", "named_alone", "read_bytes", "sha256",
    "streamed_alone", "sync_folder", "write_alone", "write_whole",
]  # fmt: skip

TRIES = 100
"""Number of attempts to write a file: another process may remove an empty folder or a temporary file between two steps
of writing.
"""


def sha256(data: bytes) -> str:
    """The SHA-256 of `data`, as 64 hexadecimal digits."""
    return hashlib.sha256(data).hexdigest()


def write_whole(root: Path, relative: str, data: bytes) -> None:
    """Writes `root/relative` atomically: a temporary file is written, synced and renamed, so no reader sees half of it.

    Missing folders are made; an existing file is replaced.

    Args:
        root: folder that no written path may leave, such as the folder of a dataset.
        relative: path of the file relative to the root.
        data: content of the file.

    Raises:
        DatasetError: a file cannot be written, or the path leaves the root or leads through a link.
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
    """Writes a file outside of datasets atomically.

    Raises:
        DatasetError: a file cannot be written, or the path is a folder, a device, a FIFO, a socket or a link.
    """
    with streamed_alone(path) as stream:
        stream.write(data)


@contextlib.contextmanager
def streamed_alone(path: Path) -> Iterator[BinaryIO]:
    """A context that yields a binary stream, to write a file outside of datasets piece by piece.

    The file gets its name only when the context ends without an error; until that moment it has a hidden name in the
    same folder.

    Raises:
        DatasetError: a file cannot be written, or the path is a folder, a device, a FIFO, a socket or a link.
    """
    with named_alone(path) as temporary, os.fdopen(os.open(temporary, NEW, 0o666), "wb") as stream:
        yield stream


@contextlib.contextmanager
def named_alone(path: Path) -> Iterator[Path]:
    """A context that yields a hidden name in the folder of a file outside of datasets, for other packages that write
    a file by its name; the file gets its own name when the context ends without an error.

    Args:
        path: path of the file.

    Raises:
        DatasetError: a file cannot be written, or the path is a folder, a device, a FIFO, a socket or a link.
    """
    check_output_file(path)
    with explained(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.name}.{os.getpid()}-{secrets.token_hex(8)}")
        try:
            yield temporary
            with temporary.open("rb") as written:
                os.fsync(written.fileno())
            temporary.replace(path)
        except BaseException:  # Ctrl-C, too
            temporary.unlink(missing_ok=True)
            raise


def check_output_file(path: Path) -> None:
    """Checks that a file can be written at a path: the path is free, or is a regular file that may be replaced.

    A device, FIFO or socket would be replaced as well, because a finished file is renamed to its path. As root, this
    includes `/dev/null`, and links such as `/dev/stdout`.

    Raises:
        DatasetError: the path is a folder, a device, a FIFO, a socket or a link, or contains a null character.
    """
    if "\0" in str(path):
        raise DatasetError(path, "a path cannot contain a null character")
    with explained(path):
        if not path.name or path.is_dir():
            raise DatasetError(path, "is a folder, a file was asked for; name one in it")
        if path.is_symlink():
            raise DatasetError(path, "is a link; gear writes nothing through links; name another file")
        try:
            check_regular(path)
        except FileNotFoundError:
            return
        except NotAFileError as error:
            raise DatasetError(path, f"{error.strerror}; name another one") from error


def sync_folder(path: Path) -> None:
    """Syncs the folder `path` to disk, so renames of its files survive a power failure; does nothing on systems that
    cannot.
    """
    with contextlib.suppress(OSError):
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def read_bytes(path: Path) -> bytes:
    """Reads a regular file, not a folder, device or pipe.

    Args:
        path: the file, or a link to it.

    Raises:
        DatasetError: the file is missing, not a regular file, or cannot be read.
    """
    try:
        return read_regular(path)
    except OSError as error:
        if error.errno in SYSTEM_LIMITS:
            raise
        raise DatasetError(path, f"cannot read it: {error.strerror}") from error
