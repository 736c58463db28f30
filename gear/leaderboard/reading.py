"""Reads and writes records. A record that is damaged, forged, enormous or not of this form is refused with one line."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from gear.dataset.json_text import parse_json
from gear.leaderboard.package_facts import printable
from gear.leaderboard.record import FORMAT, VERSION, Record, canonical
from gear.values.errors import DatasetError, FieldError
from gear.values.regular_file import read_regular
from gear.values.serial import Json, from_json, to_json

MOST_BYTES = 16 << 20
"""Largest size of a record's file in bytes."""

MOST_RECORDS = 10_000

T = TypeVar("T")


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Filed:
    """A record that was read from a file.

    Attributes:
        record: the record.
        path: its file.
        sha256: SHA-256 of the file, the record's name in checks and pages.
    """

    record: Record
    path: Path
    sha256: str


def encoded(record: Record) -> bytes:
    """The content of a record's file: canonical JSON with format and version."""
    return canonical({"format": FORMAT, "version": VERSION, **to_json(record)})


def read_record(path: Path) -> Filed:
    """Reads a record.

    Args:
        path: the file.

    Raises:
        DatasetError: the file cannot be read, is too large, is not canonical JSON, or holds values that a record must
            not hold.
    """
    data = limited(path, MOST_BYTES)
    record: Record = read_as(Record, data, path, FORMAT, VERSION)
    return Filed(record=record, path=path, sha256=hashlib.sha256(data).hexdigest())


def read_records(folder: Path) -> Iterator[Filed | DatasetError]:
    """Yields every record of a folder (`*.json`, without its subfolders) in the order of names, or why it is refused.

    Raises:
        DatasetError: the folder cannot be read, or has too many files.
    """
    try:
        paths = sorted(path for path in folder.iterdir() if path.suffix == ".json")
    except OSError as error:
        raise DatasetError(folder, f"cannot be read: {error.strerror}") from error
    if len(paths) > MOST_RECORDS:
        raise DatasetError(folder, f"holds more than {MOST_RECORDS} records")
    for path in paths:
        try:
            yield read_record(path)
        except DatasetError as error:
            yield error


def limited(path: Path, most_bytes: int) -> bytes:
    """Reads a regular file (not a folder, device or pipe) of limited size.

    Args:
        path: the file, or a link to it.
        most_bytes: largest allowed size in bytes.

    Raises:
        DatasetError: the file is missing, no regular file, or too large.
    """
    try:
        data = read_regular(path, most_bytes=most_bytes + 1)
    except OSError as error:
        raise DatasetError(path, f"cannot read it: {error.strerror}") from error
    if len(data) > most_bytes:
        raise DatasetError(path, f"is larger than {most_bytes >> 20} MiB")
    return data


def read_as(kind: type[T], data: bytes, path: Path, form: str, version: int) -> T:
    """Reads a canonical JSON file with format and version as a dataclass.

    Args:
        kind: the dataclass.
        data: bytes of the file.
        path: path of the file, for errors.
        form: expected value of the key `format`.
        version: expected value of the key `version`.

    Raises:
        DatasetError: the bytes are not canonical JSON of this format, or a value is refused.
    """
    try:
        content: Any = parse_json(data)
        is_canonical = canonical(content) == data
    except (ValueError, RecursionError) as error:
        raise DatasetError(path, f"is not JSON ({_short(error)})") from error
    if not isinstance(content, dict) or content.get("format") != form:
        raise DatasetError(path, f"is no {form}")
    if content.get("version") != version:
        found = printable(str(content.get("version")))[:20]
        raise DatasetError(path, f"has version {found} of {form}; this gear reads {version}")
    if not is_canonical:
        raise DatasetError(path, "is not in canonical form; it was edited after gear wrote it")
    return _typed(kind, {key: value for key, value in content.items() if key not in ("format", "version")}, path)


def _typed(kind: type[T], content: Json, path: Path) -> T:
    try:
        return from_json(kind, content)
    except (FieldError, TypeError, OverflowError) as error:
        raise DatasetError(path, f"is refused ({_short(error)})") from error


def _short(error: BaseException) -> str:
    text = printable(str(error))
    return text if len(text) <= 200 else text[:197] + "..."
