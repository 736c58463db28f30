"""Folders at addresses of fsspec, such as `s3://bucket/folder`, to which finished files are written.

Object stores have neither locks nor renames, but each object appears whole. Files that mark others as complete, such as
sidecars (JSON files of the samples) and manifests, are therefore written last.
"""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from gear.values.errors import DatasetError

_ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]*(::|://)")
_OF_THIS_MACHINE = re.compile(r"(?:^|::)(?:file|local)(?:://|::|$)")
_LOCAL = re.compile(r"(?:file|local):///?(?=/)")

PACKAGES = {"s3": "s3fs", "s3a": "s3fs", "gs": "gcsfs", "gcs": "gcsfs", "az": "adlfs", "abfs": "adlfs"}
"""Names of the packages that fsspec needs for object stores, by protocol. Object stores have no folders, and the
packages would create a missing bucket instead.
"""

MOST_WRAPPERS = 20
"""Largest number of file systems that may wrap each other."""


def is_address(out: str | Path) -> bool:
    """Whether the folder `out` is given by an address with a protocol, such as `s3://bucket/folder`, and not by a path
    or an address `file://`.
    """
    return isinstance(out, str) and _ADDRESS.match(out) is not None and _LOCAL.match(out) is None


def local_path(out: str | Path) -> Path:
    """The path of a folder of this machine.

    Args:
        out: a path, or an address `file:///folder`.
    """
    text = str(out)
    local = isinstance(out, str) and _LOCAL.match(text)
    return Path(unquote(text[local.end() :])) if local else Path(out)


class RemoteFolder:
    """A folder at an address of fsspec.

    Attributes:
        address: the address, for messages.
    """

    def __init__(self, address: str) -> None:
        """Opens the file system of an address; the folder need not exist.

        Raises:
            DatasetError: no package for the protocol is installed, the file system cannot be opened, or it is a folder
                of this machine, which is written with other checks.
        """
        import fsspec

        self.address = address
        if _OF_THIS_MACHINE.search(address):
            raise _local_error(address)
        protocol = re.split("::|://", address, maxsplit=1)[0]
        try:
            self._files, root = fsspec.core.url_to_fs(address)
        except ImportError as error:
            package = PACKAGES.get(protocol, "a further package")
            raise DatasetError(address, f"needs {package} ({_line(error)}); install it with pip") from error
        except ValueError as error:
            raise DatasetError(address, f"no file system can be opened there ({_line(error)})") from error
        except Exception as error:  # the constructors of file systems read credentials, and may raise anything
            raise DatasetError(address, f"cannot be opened ({_line(error)})") from error
        if _is_local(self._files):
            raise _local_error(address)
        self._root = root.rstrip("/")
        self._has_folders = not PACKAGES.keys() & set(re.split("::|://", address))

    def names(self) -> list[str]:
        """The names of the files and folders directly in the folder; empty if it does not exist.

        Raises:
            DatasetError: the folder cannot be listed.
        """
        with self._explained("cannot list it"):
            self._files.invalidate_cache()
            try:
                found: list[str] = self._files.ls(self._root, detail=False)
            except FileNotFoundError:
                return []
        return sorted({path.rstrip("/").rpartition("/")[2] for path in found} - {""})

    def read(self, relative: str) -> bytes | None:
        """Reads the file `relative`, a path relative to this folder; None if the file does not exist.

        Raises:
            DatasetError: the file cannot be read.
        """
        with self._explained(f"cannot read {relative}"):
            try:
                data: bytes = self._files.cat_file(self._path(relative))
            except FileNotFoundError:
                return None
        return data

    def write(self, relative: str, data: bytes) -> None:
        """Writes a file.

        Args:
            relative: path of the file in the folder.
            data: bytes of the file.

        Raises:
            DatasetError: the file cannot be written, or its path leads outside the folder.
        """
        path = self._path(relative)
        with self._explained(f"cannot write {relative}"):
            if self._has_folders:
                self._files.makedirs(path.rpartition("/")[0], exist_ok=True)
            self._files.pipe_file(path, data)

    def remove(self, relative: str) -> None:
        """Removes the file `relative`, a path relative to this folder.

        Raises:
            DatasetError: the file cannot be removed.
        """
        with self._explained(f"cannot remove {relative}"):
            self._files.rm_file(self._path(relative))

    def _path(self, relative: str) -> str:
        """The path of a file in the file system.

        Raises:
            DatasetError: it leads outside the folder.
        """
        if {"", ".", ".."} & set(relative.split("/")) or "\\" in relative:
            raise DatasetError(self.address, f"{relative!r} is no path of a file in this folder")
        return f"{self._root}/{relative}"

    @contextlib.contextmanager
    def _explained(self, problem: str) -> Iterator[None]:
        """A context that turns the errors of the file system into one line.

        Packages of fsspec raise errors of their own kinds, for example about missing credentials.

        Raises:
            DatasetError: an error was raised.
        """
        try:
            yield
        except (DatasetError, MemoryError):
            raise
        except PermissionError as error:
            raise DatasetError(self.address, f"{problem}: no permission ({_line(error)})") from error
        except Exception as error:
            raise DatasetError(self.address, f"{problem} ({_line(error)})") from error


def _is_local(files: Any) -> bool:
    """Whether a file system of fsspec is this machine's disk, or is a wrapper around it, such as a cache."""
    from fsspec.implementations.local import LocalFileSystem

    for _ in range(MOST_WRAPPERS):
        if files is None or isinstance(files, LocalFileSystem):
            break
        files = getattr(files, "fs", None) or getattr(files, "sync_fs", None)
    return files is not None


def _local_error(address: str) -> DatasetError:
    return DatasetError(address, "is a folder of this machine; give its path")


def _line(error: BaseException) -> str:
    """The first line of an error's text, or the name of its class."""
    lines: list[Any] = str(error).strip().splitlines()
    return str(lines[0]) if lines else type(error).__name__
