"""Files appear whole or not at all, and never outside the dataset's root."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import platform
import threading
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from gear.values.errors import DatasetError

SCRATCH = "gear/scratch"
"""Half-written files live here, away from the folders that foreign loaders list, by host, process and thread."""

TRIES = 100
"""Another process may tidy up the folder of half-written files, or that of notes, between two steps."""


def sha256(data: bytes) -> str:
    """Hex digest."""
    return hashlib.sha256(data).hexdigest()


def inside(root: Path, relative: str) -> Path:
    """`root/relative`, which must not leave the root, not even through a link.

    Raises:
        DatasetError: it would.
    """
    pure = PurePosixPath(relative)
    if pure.is_absolute() or ".." in pure.parts or not pure.parts or "\\" in relative or "\0" in relative:
        raise DatasetError(root, f"{relative!r} is not a path inside a dataset")
    path = root.joinpath(*pure.parts)
    if not path.resolve().is_relative_to(root.resolve()):
        raise DatasetError(root, f"{relative!r} leads outside the dataset through a link")
    return path


@contextlib.contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turns a full disk, a read-only folder and the like into one line.

    Raises:
        DatasetError: an `OSError` came up inside.
    """
    try:
        yield
    except OSError as error:
        hints = {
            errno.ENOSPC: "the disk is full; free some space and run the same command again, finished samples are kept",
            errno.EDQUOT: "the quota is used up; finished samples are kept",
            errno.EROFS: "the file system is read-only; choose another --out",
            errno.EACCES: "no permission to write there; choose another --out",
            errno.EPERM: "no permission to write there; choose another --out",
            errno.ENOTDIR: "a file is where a folder should be; choose another --out",
            errno.EISDIR: "a folder is where a file should be; choose another --out",
            errno.EEXIST: "a file is where a folder should be; choose another --out",
        }
        raise DatasetError(path, hints.get(error.errno or 0, error.strerror or str(error))) from error


def write_whole(root: Path, relative: str, data: bytes) -> None:
    """Writes, syncs and renames into place.

    Raises:
        DatasetError: the disk refuses, or the path leaves the root.
    """
    target = inside(root, relative)
    with explained(target):
        scratch = root / SCRATCH
        for left in reversed(range(TRIES)):
            try:
                target.parent.mkdir(parents=True, exist_ok=True)
                scratch.mkdir(parents=True, exist_ok=True)
                _write_and_rename(scratch / f"{_host()}-{os.getpid()}-{threading.get_ident()}", target, data)
            except (FileNotFoundError, FileExistsError):  # there while it was made, and gone when it was looked at
                if not left:
                    raise
            else:
                return


def write_alone(path: Path, data: bytes) -> None:
    """The same for a file that belongs to no dataset; what is half-written lies beside it under a hidden name.

    Raises:
        DatasetError: the disk refuses, or a folder is there.
    """
    refuse_folder(path)
    with explained(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        temporary = path.with_name(f".{path.name}.{os.getpid()}-{threading.get_ident()}")
        _write_and_rename(temporary, path, data)


def _write_and_rename(temporary: Path, target: Path, data: bytes) -> None:
    try:
        with temporary.open("wb") as stream:
            stream.write(data)
            stream.flush()
            os.fsync(stream.fileno())
        temporary.replace(target)
    except BaseException:  # Ctrl-C, too
        temporary.unlink(missing_ok=True)
        raise


def refuse_folder(path: Path) -> None:
    """Where a file is to be written.

    Raises:
        DatasetError: it is a folder.
    """
    with explained(path):
        if not path.name or path.is_dir():
            raise DatasetError(path, "is a folder, a file was asked for; name one in it")


def clear_scratch(root: Path) -> None:
    """Removes what killed runs left half-written, but nothing of other runs that are alive, and the folder `gear` where
    nothing else is in it: only a dataset has one. Call it when nobody in this process writes there.
    """
    scratch = root / SCRATCH
    with explained(scratch), contextlib.suppress(FileNotFoundError):  # others tidy up, too
        for leftover in scratch.iterdir():
            if not _is_being_written(leftover.name):
                leftover.unlink(missing_ok=True)
    for folder in (scratch, scratch.parent):
        with contextlib.suppress(OSError):  # something is in it, or others have just removed it
            folder.rmdir()


def _is_being_written(name: str) -> bool:
    """Whether a half-written file's writer is another process that is alive, or on a host that cannot be asked."""
    host, _, rest = name.rpartition("-")[0].rpartition("-")
    if not rest.isdecimal() or int(rest) == os.getpid():
        return False
    if host != _host():
        return bool(host)
    try:
        os.kill(int(rest), 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True


def _host() -> str:
    return platform.node().replace("/", "_")


def sync_folder(path: Path) -> None:
    """Makes renames inside a folder last through a power cut, where the system can."""
    with contextlib.suppress(OSError):
        descriptor = os.open(path, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def read_bytes(path: Path) -> bytes:
    """The file's bytes.

    Raises:
        DatasetError: it is missing or cannot be read.
    """
    try:
        return path.read_bytes()
    except OSError as error:
        raise DatasetError(path, f"cannot read it: {error.strerror}") from error
