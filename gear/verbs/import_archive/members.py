"""Reads tar and zip archives of strangers: every member is checked before the first byte is written.

An archive may try to write outside the folder (absolute paths, `..`, links), to fill the disk (a small archive that
unpacks to a huge size), or to hide what it holds (two members of one name, data after the end). Each of these refuses
the whole archive.

Python's readers ignore what follows the end of a bzip2 or xz stream. It is ignored here, too: every file of the dataset
is checked by its hash.
"""

from __future__ import annotations

import bz2
import contextlib
import errno
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

from gear.plugins.text import printable
from gear.values.errors import DatasetError
from gear.values.regular_file import check_regular
from gear.verbs.import_archive.member_names import MemberNames

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

ZIP_MAGIC, ZIP_END = (b"PK\x03\x04", b"PK\x05\x06"), b"PK\x05\x06"
"""First bytes of a zip archive, with and without members; first bytes of the record at its end."""

ZIP_END_BYTES, LONGEST_COMMENT_BYTES = 22, 65535
"""Size of the record at the end of a zip archive without its comment, and largest size of the comment."""

TAR_END_BYTES = 1024
"""Number of zero bytes that end a tar archive; more zero bytes may follow."""

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
                if _first_bytes(path).startswith(ZIP_MAGIC):
                    _check_zip_end(path)
                    self._zip = self._open.enter_context(zipfile.ZipFile(path))
                    self.members = self._checked()
                else:
                    source = _Bounded(self._open.enter_context(_decompressed(path)), self._limit)
                    opened = tarfile.open(fileobj=cast("IO[bytes]", source), mode="r:")  # noqa: SIM115
                    self._tar = self._open.enter_context(opened)
                    self.members = self._checked()
                    _check_tar_end(source, self._tar.offset)
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
                raise DatasetError(self.path, f"is damaged: '{printable(member.path)}' is shorter than announced")
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
            DatasetError: a member is a link or a device, leads outside, has the path of another member or an odd name,
                or unpacks to too much.
        """
        limit = self._limit
        found: dict[str, Member] = {}
        names = MemberNames(self.path)
        total = 0
        for number, (path, size, kind, info) in enumerate(self._entries()):
            if number >= MOST_MEMBERS:
                raise DatasetError(self.path, f"holds more than {MOST_MEMBERS} members; no dataset of gear does")
            if kind == "folder" and path in ("", "."):
                continue
            names.check(path)
            if kind == "folder":
                continue
            if kind != "file":
                problem = f"holds '{printable(path)}', which is {kind}; gear unpacks only files and folders"
                raise DatasetError(self.path, problem)
            names.add_file(path)
            total += size
            if size > LARGEST_FILE_BYTES or total > limit:
                problem = f"unpacks to more than {limit / 1e6:.0f} MB, or to a file of more than 2 GB"
                raise DatasetError(self.path, f"{problem}; no dataset of gear does")
            found[path], self._infos[path] = Member(path, size), info
        names.check_folders()
        return tuple(found.values())

    def _entries(self) -> Iterator[tuple[str, int, str, tarfile.TarInfo | zipfile.ZipInfo]]:
        """Yields path, size, kind (`file`, `folder`, or a description) and header of every member."""
        if self._zip is not None:
            for entry in self._zip.infolist():
                yield _normal(entry.filename), entry.file_size, _zip_kind(entry), entry
            return
        assert self._tar is not None
        for member in self._tar:
            is_link = member.issym() or member.islnk()
            kind = "a link" if is_link else "folder" if member.isdir() else "file"
            if not is_link and not member.isdir() and (not member.isreg() or member.issparse()):
                kind = "a device, a pipe or a sparse file"
            if member.size < 0:
                raise DatasetError(self.path, "is damaged: a member has a negative size")
            yield _normal(member.name), member.size, kind, member


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


def _zip_kind(entry: zipfile.ZipInfo) -> str:
    """Returns what a member of a zip archive is: `file`, `folder`, or a description of something else."""
    mode = entry.external_attr >> 16
    if stat.S_ISLNK(mode):
        return "a link"
    if stat.S_IFMT(mode) not in (0, stat.S_IFREG, stat.S_IFDIR):
        return "a device or a pipe"
    if entry.flag_bits & 1:
        return "an encrypted file"
    return "folder" if entry.is_dir() else "file"


def _check_zip_end(path: Path) -> None:
    """Checks that a zip archive ends where its last record says; otherwise it is cut off, or other data follow.

    Raises:
        BadZipFile: the record is missing, or other data follow it.
    """
    with path.open("rb") as file:
        file.seek(max(0, path.stat().st_size - ZIP_END_BYTES - LONGEST_COMMENT_BYTES))
        tail = file.read()
    at = tail.rfind(ZIP_END)
    if at < 0 or at + ZIP_END_BYTES > len(tail):
        raise zipfile.BadZipFile("its end is missing; it is cut off or damaged")
    (comment,) = struct.unpack_from("<H", tail, at + ZIP_END_BYTES - 2)
    if at + ZIP_END_BYTES + comment != len(tail):
        raise zipfile.BadZipFile("other data follow the end of the zip archive")


def _check_tar_end(source: IO[bytes] | io.RawIOBase, end: int) -> None:
    """Checks that zero bytes follow the last member of a tar archive, and nothing else; reads to the end of a
    compressed stream, which checks its checksum.

    Args:
        source: the decompressed archive.
        end: position in bytes where the reader of headers stopped.

    Raises:
        ReadError: the zero bytes are missing, or other data follow.
    """
    source.seek(end)
    zeros = 0
    while piece := source.read(1 << 20):
        if piece.strip(b"\0"):
            raise tarfile.ReadError("a header is damaged, or other data follow the end of the tar archive")
        zeros += len(piece)
    if zeros < TAR_END_BYTES:
        raise tarfile.ReadError("its end is missing; it is cut off or damaged")


def _first_bytes(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(6)


def _decompressed(path: Path) -> IO[bytes]:
    start = _first_bytes(path)
    opener = next((opener for magic, opener in MAGIC.items() if start.startswith(magic)), None)
    return cast("IO[bytes]", path.open("rb") if opener is None else opener(path, "rb"))


@contextlib.contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Turns the errors of Python's readers into errors that name the archive."""
    try:
        yield
    except BROKEN as error:
        is_header = isinstance(error, (RecursionError, ValueError, OverflowError, struct.error))
        is_header |= isinstance(error, OSError) and error.errno == errno.EINVAL  # a position beyond the archive
        text = getattr(error, "strerror", None) or str(error) or type(error).__name__
        text = "a header is damaged" if is_header else text
        raise DatasetError(path, f"cannot be unpacked: {printable(text)}") from error
