"""JSON files with a seal: the SHA-256 of their own content, by which a single changed byte is detected.

The last entry of a sealed file is `"sha256"`: the hash of the file without that entry. Files without a seal are
accepted, because earlier versions of gear wrote none, and other programs that rewrite a file change its layout.
"""

from __future__ import annotations

import hashlib
from pathlib import Path

from gear.dataset.files import read_bytes
from gear.dataset.json_text import dump_json, parse_json
from gear.values.errors import DatasetError
from gear.values.serial import Json

SEAL = "sha256"
HEAD, TAIL, END = b',\n "sha256": "', b'"\n}\n', b"\n}\n"
DIGITS = 64
LENGTH = len(HEAD) + DIGITS + len(TAIL)

MOST_CHANGED = 4
"""Largest number of changed characters in the entry `sha256` of a file with which it still counts as a damaged seal."""

REPAIR = "`gear verify DIR --repair` makes it again"


class DamagedError(DatasetError):
    """An error about a file whose bytes are not those that gear wrote."""


def sealed_json(content: dict[str, Json]) -> bytes:
    """Encodes a JSON object with a seal, the SHA-256 of its own content as last entry."""
    body = dump_json(content)
    return body[: -len(END)] + HEAD + hashlib.sha256(body).hexdigest().encode() + TAIL


def load_sealed(path: Path) -> Json:
    """Reads a JSON file of gear (sidecar, plan or manifest), and checks the SHA-256 in it if it has one.

    Args:
        path: the file.

    Returns:
        The content without the entry `sha256`.

    Raises:
        DamagedError: the content does not match its SHA-256, or is not JSON.
        DatasetError: the file cannot be read.
    """
    data = read_bytes(path)
    if not is_whole(data):
        raise DamagedError(path, f"is damaged: its content does not match its own sha256; {REPAIR}")
    try:
        content = parse_json(data)
    except (ValueError, RecursionError) as error:  # brackets in brackets, too
        problem = f"is not JSON ({error}); {REPAIR}, or delete it and run the same collection again"
        raise DamagedError(path, problem) from error
    if isinstance(content, dict):
        content.pop(SEAL, None)
    return content


def is_whole(data: bytes) -> bool:
    """Whether the bytes of a JSON file match the SHA-256 in its last entry; also True for files without such an entry.

    Args:
        data: content of the file.
    """
    if is_sealed(data):
        body = data[:-LENGTH] + END
        return data[-LENGTH:] == HEAD + hashlib.sha256(body).hexdigest().encode() + TAIL
    return not is_sealed(data.rstrip() + b"\n")  # else blanks at its end were lost or added


def is_sealed(data: bytes) -> bool:
    """Whether the bytes `data` of a JSON file end with an entry `sha256`, possibly a damaged one."""
    seal = data[-LENGTH:]
    frame, wanted = seal[: len(HEAD)] + seal[-len(TAIL) :], HEAD + TAIL
    if len(seal) < LENGTH:
        return False
    return sum(one != other for one, other in zip(frame, wanted, strict=True)) <= MOST_CHANGED
