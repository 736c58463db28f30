"""Reads tar and zip archives of strangers: every member is checked before the first byte is written.

An archive may try to write outside the folder (absolute paths, `..`, links), to fill the disk (a small archive that
unpacks to a huge size), or to hide what it holds (two members of one name). Each of these refuses the whole archive.
"""

from __future__ import annotations

import bz2
import contextlib
import gzip
import io
import lzma
import stat
import struct
import tarfile
import zipfile
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import IO, Any, cast

from gear.dataset.guarded_paths import parts_of
from gear.plugins.text import printable
from gear.values.errors import DatasetError
from gear.values.regular_file import check_regular

LARGEST_RATIO, ALWAYS_BYTES = 100, 100_000_000
"""An archive may unpack to `ALWAYS_BYTES`, or to this many times its own size if that is more; headers count, too.
Pictures hardly compress, and the JSON files of a dataset compress to about a tenth.
"""

LARGEST_FILE_BYTES = 2_000_000_000
"""Largest size of one file; a file is unpacked in memory."""

MOST_MEMBERS = 20_000_000
"""Largest number of members: files, folders and others."""

LARGEST_READ_BYTES = 64_000_000
"""Largest number of bytes that the reader of headers may request at once; longer headers are an attack on memory."""

BROKEN = (
    tarfile.TarError, zipfile.BadZipFile, zlib.error, lzma.LZMAError, EOFError, OSError, RuntimeError, ValueError,
    OverflowError, struct.error,
)  # fmt: skip
"""Errors of Python's readers on damaged archives. RuntimeError: an encrypted zip. ValueError: also a name that is not
Unicode.
"""

MAGIC: dict[bytes, Any] = {b"\x1f\x8b": gzip.open, b"BZh": bz2.open, b"\xfd7zXZ\x00": lzma.open}
"""Functions that open a compressed file, by the file's first bytes."""


@dataclass(frozen=True, slots=True)
class Member:
    """A file in an archive.

    Attributes:
        path: path in the archive; relative, without `..`.
        size: size of the unpacked file in bytes.
    """

    path: str
    size: int


class Archive:
    """An open archive whose members are all harmless."""

    def __init__(self, path: Path) -> None:
        """Opens an archive and checks all of its members; nothing is written.

        Args:
            path: a tar archive (plain, or compressed with gzip, bzip2 or xz) or a zip archive.

        Raises:
            DatasetError: the file is no archive, is damaged, or holds a member that could do harm.
        """
        self.path = path
        self._open = contextlib.ExitStack()
        self._tar: tarfile.TarFile | None = None
        self._zip: zipfile.ZipFile | None = None
        self._infos: dict[str, tarfile.TarInfo | zipfile.ZipInfo] = {}
        try:
            with _explained(path):
                check_regular(path)
                self._limit = max(ALWAYS_BYTES, LARGEST_RATIO * path.stat().st_size)
                if zipfile.is_zipfile(path):
                    self._zip = self._open.enter_context(zipfile.ZipFile(path))
                else:
                    source = self._open.enter_context(_decompressed(path))
                    opened = tarfile.open(fileobj=cast("IO[bytes]", _Bounded(source, self._limit)), mode="r:")  # noqa: SIM115
                    self._tar = self._open.enter_context(opened)
                self.members = self._checked()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Closes the archive."""
        self._open.close()

    def __enter__(self) -> Archive:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def files(self) -> Iterator[tuple[Member, bytes]]:
        """Yields every file with its bytes, in the order of the archive.

        Raises:
            DatasetError: a file is damaged.
        """
        for member in self.members:
            with _explained(self.path):
                data = self._read(member)
            if len(data) != member.size:
                raise DatasetError(self.path, f"is damaged: {member.path!r} is shorter than announced")
            yield member, data

    def _read(self, member: Member) -> bytes:
        info = self._infos[member.path]
        if isinstance(info, zipfile.ZipInfo):
            assert self._zip is not None
            with self._zip.open(info) as file:
                return file.read(member.size)
        opened = None if self._tar is None else self._tar.extractfile(info)
        assert opened is not None  # all members are regular files
        pieces, left = [], member.size
        while left and (piece := opened.read(min(left, LARGEST_READ_BYTES))):
            pieces.append(piece)
            left -= len(piece)
        return b"".join(pieces)

    def _checked(self) -> tuple[Member, ...]:
        """Returns the files of the archive.

        Raises:
            DatasetError: a member is a link or a device, leads outside, occurs twice, or unpacks to too much.
        """
        limit = self._limit
        found: dict[str, Member] = {}
        total = 0
        for number, (path, size, kind, info) in enumerate(self._entries()):
            if number >= MOST_MEMBERS:
                raise DatasetError(self.path, f"holds more than {MOST_MEMBERS} members; no dataset of gear does")
            if kind == "folder" and path in ("", "."):
                continue
            parts_of(self.path, path)
            if kind == "folder":
                continue
            if kind != "file":
                raise DatasetError(self.path, f"holds {path!r}, which is {kind}; gear unpacks only files and folders")
            if path in found:
                raise DatasetError(self.path, f"holds {path!r} twice")
            total += size
            if size > LARGEST_FILE_BYTES or total > limit:
                problem = f"unpacks to more than {limit / 1e6:.0f} MB, or to a file of more than 2 GB"
                raise DatasetError(self.path, f"{problem}; no dataset of gear does")
            found[path], self._infos[path] = Member(path, size), info
        return tuple(found.values())

    def _entries(self) -> Iterator[tuple[str, int, str, tarfile.TarInfo | zipfile.ZipInfo]]:
        """Yields path, size, kind (`file`, `folder`, or a description) and header of every member."""
        if self._zip is not None:
            for entry in self._zip.infolist():
                mode = entry.external_attr >> 16
                kind = "folder" if entry.is_dir() else "a link" if stat.S_ISLNK(mode) else "file"
                kind = "an encrypted file" if entry.flag_bits & 1 else kind
                yield _normal(entry.filename), entry.file_size, kind, entry
            return
        assert self._tar is not None
        for member in self._tar:
            is_link = member.issym() or member.islnk()
            kind = "a link" if is_link else "folder" if member.isdir() else "file"
            if not is_link and not member.isdir() and (not member.isreg() or member.issparse()):
                kind = "a device, a pipe or a sparse file"
            yield _normal(member.name), max(member.size, 0), kind, member


def _normal(path: str) -> str:
    """A path without empty components and without `.`, so that each file has one path; `.` for the root."""
    return str(PurePosixPath(path))


class _Bounded(io.RawIOBase):
    """A stream whose reads are limited, so that a header cannot demand all of the memory, and whose length is limited,
    so that headers without files (folders, comments) cannot demand hours.
    """

    def __init__(self, stream: IO[bytes], limit: int) -> None:
        """Limits a stream.

        Args:
            stream: the decompressed archive.
            limit: position in bytes beyond which nothing is read.
        """
        super().__init__()
        self._stream = stream
        self._limit = limit

    def read(self, size: int = -1, /) -> bytes:
        if not 0 <= size <= LARGEST_READ_BYTES:
            raise tarfile.ReadError("a header is too long")
        self._check(self._stream.tell() + size)
        return self._stream.read(size)

    def seek(self, offset: int, whence: int = 0, /) -> int:
        if whence == 0:
            self._check(offset)
        return self._stream.seek(offset, whence)

    def _check(self, position: int) -> None:
        if position > self._limit:
            raise tarfile.ReadError(f"it has more than {self._limit / 1e6:.0f} MB when decompressed")

    def tell(self) -> int:
        return self._stream.tell()

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True


def _decompressed(path: Path) -> IO[bytes]:
    with path.open("rb") as file:
        start = file.read(6)
    opener = next((opener for magic, opener in MAGIC.items() if start.startswith(magic)), None)
    return cast("IO[bytes]", path.open("rb") if opener is None else opener(path, "rb"))


@contextlib.contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Turns the errors of Python's readers into errors that name the archive."""
    try:
        yield
    except BROKEN as error:
        text = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise DatasetError(path, f"cannot be unpacked: {printable(text)}") from error
