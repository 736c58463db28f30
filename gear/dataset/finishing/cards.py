"""The two files that describe a dataset in its root: `README.md` (the dataset card) and `croissant.json`.

The files depend only on the manifests of the finished splits, so every run that finishes a split writes the same bytes.
Both files contain a hash of their own content. A file without such a hash belongs to the user and is neither changed
nor deleted.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from gear.dataset.files import inside, read_bytes, sha256, write_whole
from gear.dataset.guarded_paths import owned, remove_file
from gear.dataset.layout import CARD, CARDS, CROISSANT, GEAR, manifest_path, split_folder
from gear.dataset.locks import dataset_lock
from gear.dataset.plan import read_plan
from gear.dataset.sealed_json import is_sealed, is_whole, load_sealed, sealed_json
from gear.formats.croissant import FilePattern, croissant
from gear.formats.dataset_card import SplitFacts, card
from gear.formats.sample_parts import Part, column_of, parts
from gear.values.errors import DatasetError
from gear.values.serial import Json

FIRST = ("leftimg8bit", "images", "image_2")
"""Names of the folders with camera pictures in the formats of the tasks; a card lists them first."""

STRUCTURE = (
    "Files lie as the task's benchmark has them. `gear/<split>/samples/` holds the complete scene and ground truth of "
    "each sample, `gear/<split>/manifest.json` versions, configuration and the SHA-256 of every file. gear checks all "
    "of them with `gear verify`, reads them with `gear.open_dataset` and writes other layouts with `gear export`. "
    "`croissant.json` describes the same in the Croissant format."
)

NOTE = re.compile(
    rb"\n<!-- Written by gear; without this line gear leaves the file alone. sha256: ([0-9a-f]{64}) -->\n\Z"
)
MARK, END = b"<!-- Written by gear", re.compile(rb"sha256: [0-9a-f]{64} -->")
"""Beginning and end of gear's last line in `README.md`; either part alone shows that gear wrote the file."""


def write_cards(root: Path, *, is_repair: bool = False) -> None:
    """Writes the dataset card and `croissant.json`, or removes them if no split is finished.

    Args:
        root: root of the dataset.
        is_repair: whether damaged files are replaced; otherwise files that were changed are kept.

    Raises:
        DatasetError: a file cannot be written, or is a link.
    """
    folder = owned(root, GEAR)
    if not folder.is_dir():
        return
    with dataset_lock(folder):  # and not of the root, which the caller may have locked
        wanted = cards(root)
        for relative in CARDS:
            path = owned(root, relative)
            if path.exists() and not path.is_file():
                continue  # a folder or a FIFO is the user's own
            there = read_bytes(path) if path.exists() else None
            is_free = there is None or _is_as_written(relative, there) or (is_repair and is_own(relative, there))
            if not is_free or there == wanted.get(relative):
                continue
            if relative in wanted:
                write_whole(root, relative, wanted[relative])
            else:
                remove_file(root, relative)


def cards(root: Path) -> dict[str, bytes]:
    """Makes the files that describe a dataset to readers and to search engines; writes nothing.

    Args:
        root: folder of the dataset.

    Returns:
        The bytes of the dataset card (`README.md`) and of `croissant.json`, by path; empty if no split is finished.
    """
    finished = list(_finished(root))
    if not finished:
        return {}
    facts = [one for one, _ in finished]
    patterns = _patterns(finished)
    configs = {
        name: {split: sorted(globs) for split, globs in by_split.items()} for name, (_, by_split) in patterns.items()
    }
    files = [
        FilePattern(name=name, suffix=suffix, globs=sorted(glob for globs in by_split.values() for glob in globs))
        for name, (suffix, by_split) in patterns.items()
    ]
    files.append(
        FilePattern(name="samples", suffix="json", globs=[f"{split_folder(one.name)}/samples/*.json" for one in facts])
    )
    hashes: dict[str, str] = {}
    for one, manifest in finished:
        hashes |= manifest["indexes"]
        hashes[manifest_path(one.name)] = sha256(read_bytes(inside(root, manifest_path(one.name))))
    return {
        CARD: _noted(card(facts, configs, STRUCTURE).encode()),
        CROISSANT: sealed_json(croissant(facts, files, hashes)),
    }


def damaged_cards(root: Path) -> list[str]:
    """The paths of description files that gear wrote and whose bytes are no longer those that gear wrote.

    Files that the user wrote are not checked. A missing file is not damaged, because datasets of earlier versions have
    none and a user may delete it.

    Args:
        root: folder of the dataset.

    Returns:
        The paths relative to the root, sorted.
    """
    return [
        relative
        for relative in sorted(own_cards(root))
        if not _is_as_written(relative, read_bytes(inside(root, relative)))
    ]


def own_cards(root: Path) -> set[str]:
    """The paths of the description files (`README.md`, `croissant.json`) that gear wrote; the user's own files are left
    out.

    Args:
        root: folder of the dataset.
    """
    paths = {relative: inside(root, relative) for relative in CARDS}
    return {relative for relative, path in paths.items() if path.is_file() and is_own(relative, read_bytes(path))}


def is_own(relative: str, data: bytes) -> bool:
    """Whether gear wrote a description file, even if the file was damaged later; False for a file of the user.

    An empty file counts as a damaged file of gear.

    Args:
        relative: path of the file, `README.md` or `croissant.json`.
        data: bytes of the file.
    """
    if not data:
        return True
    if relative == CARD:
        return MARK in data or END.search(data) is not None
    return is_sealed(data)


def _is_as_written(relative: str, data: bytes) -> bool:
    """Whether the bytes of a description file are exactly those that gear wrote."""
    if relative == CROISSANT:
        return is_sealed(data) and is_whole(data)
    note = NOTE.search(data)
    return note is not None and sha256(data[: note.start()]).encode() == note[1]


def _noted(text: bytes) -> bytes:
    """The text of a card with the hash of its content."""
    line = f"\n{MARK.decode()}; without this line gear leaves the file alone. sha256: {sha256(text)} -->\n"
    return text + line.encode()


def _finished(root: Path) -> Iterator[tuple[SplitFacts, Json]]:
    """The finished splits whose plan and manifest are whole, by name."""
    for path in sorted((root / GEAR).glob("*/manifest.json")):
        split = path.parent.name
        try:
            plan, manifest = read_plan(root, split), load_sealed(inside(root, manifest_path(split)))
        except DatasetError:
            continue
        if plan is None or not isinstance(manifest, dict) or not _is_listed(manifest):
            continue
        yield SplitFacts.of(plan.info, plan.task["name"], len(manifest["samples"]), manifest), manifest


def _is_listed(manifest: dict[str, Json]) -> bool:
    samples, indexes = manifest.get("samples"), manifest.get("indexes")
    return (
        isinstance(samples, list)
        and isinstance(indexes, dict)
        and all(isinstance(one, dict) and isinstance(one.get("files"), dict) for one in samples)
    )


def _patterns(finished: list[tuple[SplitFacts, Json]]) -> dict[str, tuple[str, dict[str, set[str]]]]:
    """For each kind of file its suffix, and by split the patterns that find the files; the camera's pictures first."""
    found: dict[tuple[str, str], dict[str, set[str]]] = {}
    for one, manifest in finished:
        for part in _parts(one.name, manifest):
            found.setdefault((part.name, part.suffix), {}).setdefault(one.name, set()).add(part.glob)
    names = sorted(found, key=lambda kind: (kind[0] not in FIRST, kind))
    return {column_of(*kind, names): (kind[1], found[kind]) for kind in names}


def _parts(split: str, manifest: Json) -> Iterator[Part]:
    for sample in manifest["samples"]:
        yield from parts([path for path in sample["files"] if not path.startswith(f"{GEAR}/")], split)
