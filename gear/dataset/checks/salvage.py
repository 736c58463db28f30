"""Recovers what a damaged JSON file of gear still tells: the hashes that it lists, and its content if one byte changed.

It serves datasets in which the plan, the manifest and the sidecars are damaged at the same time, so that no intact file
says which files there should be and how they were made.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

from gear.dataset.files import inside, read_bytes
from gear.dataset.sealed_json import DIGITS, END, HEAD, LENGTH, SEAL, TAIL, is_sealed, is_whole
from gear.values.errors import DatasetError

LISTED = re.compile(rb'"([^"\n]+)": "([^"\n]{64})"')
"""A path and its hash in a JSON file of gear. Any characters are accepted in the hash, because one may be damaged."""

OTHER_HASHES = (SEAL, "content_key", "twin_key", "assets")
"""Keys of hashes in sidecars and manifests that belong to no file."""

MOST_RESTORED = 16_384
"""Largest size in bytes of a file in which the changed byte is searched for: 256 hashes are computed for every byte."""

MOST_STRAYS = 100
"""Largest number of listed paths without a file for which a file with a similar path is searched. Each search compares
all files of the dataset, and a dataset of unknown origin may list any number of paths.
"""

BITS = tuple(1 << bit for bit in range(8))
OTHER_CHANGES = tuple(change for change in range(1, 256) if change not in BITS)


def restored(data: bytes) -> bytes | None:
    """Finds the original bytes of a sealed JSON file in which one byte was changed.

    The hash in the file proves that the result is the original. Changes of a single bit are tried first.

    Args:
        data: content of the damaged file.

    Returns:
        The original content; None if more than one byte was changed, or the file is larger than `MOST_RESTORED`.
    """
    if len(data) > MOST_RESTORED or not is_sealed(data):
        return None
    body, seal = data[:-LENGTH] + END, data[-LENGTH:]
    true_seal = HEAD + hashlib.sha256(body).hexdigest().encode() + TAIL
    if sum(one != other for one, other in zip(seal, true_seal, strict=True)) <= 1:
        return data[:-LENGTH] + true_seal
    wanted = seal[len(HEAD) : len(HEAD) + DIGITS].decode(errors="replace")
    for changes in (BITS, OTHER_CHANGES):
        start = hashlib.sha256()
        for place in range(len(data) - LENGTH):
            rest = body[place + 1 :]
            for change in changes:
                digest = start.copy()
                digest.update(bytes([body[place] ^ change]) + rest)
                if digest.hexdigest() == wanted:
                    found = data[:place] + bytes([data[place] ^ change]) + data[place + 1 :]
                    return found if is_whole(found) else None
            start.update(body[place : place + 1])
    return None


def listed_hashes(root: Path, paths: Iterable[str]) -> dict[str, set[str]]:
    """Reads all paths with their hashes from damaged JSON files of a dataset.

    A path to which there is no file may contain a changed character. It counts as a file whose path differs in one
    character if this file is not listed itself, or is listed with the same hash.

    Args:
        root: root of the dataset.
        paths: damaged manifests and sidecars, relative to the root.

    Returns:
        For each path relative to the root the possible hashes: those that the damaged files list for it.
    """
    found: dict[str, set[str]] = defaultdict(set)
    for path in paths:
        for name, digest in LISTED.findall(read_bytes(inside(root, path))):
            if name.decode(errors="replace") not in OTHER_HASHES:
                found[name.decode(errors="replace")].add(digest.decode(errors="replace"))
    files = set(files_below(root))
    listed = {path: frozenset(digests) for path, digests in found.items()}
    for place, stray in enumerate(sorted(listed.keys() - files)):
        digests = found.pop(stray)
        near = (file for file in files if place < MOST_STRAYS and _differ_in_one(file, stray))
        meant = next((file for file in near if file not in listed or digests & listed[file]), None)
        if meant is not None or _is_path(root, stray):
            found[meant or stray] |= digests
    return dict(found)


def files_below(root: Path) -> list[str]:
    """All files below a folder except hidden ones, as paths relative to it; links to folders are not followed."""
    found = []
    for folder, folders, names in os.walk(root):
        folders[:] = [name for name in folders if not name.startswith(".")]
        found += [(Path(folder) / name).relative_to(root).as_posix() for name in names if not name.startswith(".")]
    return sorted(found)


def _is_path(root: Path, text: str) -> bool:
    """Whether a text from a damaged file can be the path of a file in a folder of the dataset."""
    try:
        inside(root, text)
    except (DatasetError, ValueError):
        return False
    return text.isprintable() and "/" in text


def _differ_in_one(one: str, other: str) -> bool:
    return len(one) == len(other) and sum(a != b for a, b in zip(one, other, strict=True)) == 1
