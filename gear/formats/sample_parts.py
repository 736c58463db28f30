"""Short names for the files of a sample, for export layouts that store all files of a sample together."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from pathlib import PurePosixPath

from gear.contracts.tasks import Sidecar


@dataclass(frozen=True, slots=True, kw_only=True)
class Part:
    """One file of a sample, with a short name.

    Attributes:
        name: lower-case letters, digits and `_`: the name of the folder. If the sample has several files in the folder,
            the distinct end of the file's name is appended.
        suffix: suffix of the file, lower-case, without a dot.
        path: path relative to the dataset's root.
        glob: glob pattern that finds the files with this name of all samples in the same folder.
    """

    name: str
    suffix: str
    path: str
    glob: str


def parts_of(sidecar: Sidecar, split: str) -> list[Part]:
    """The files of a sample with their short names, sorted by name and suffix. Auxiliary files, such as probes,
    are left out.

    Args:
        sidecar: metadata of the sample (its JSON file), which lists its files.
        split: name of the split; the folder with this name is left out of the short names.
    """
    auxiliary = {file.path for file in sidecar.auxiliary.values()}
    return parts([path for path in sidecar.files if path not in auxiliary], split)


def parts(paths: Iterable[str], split: str) -> list[Part]:
    """Short names for the files of one sample, sorted by name and suffix.

    `val/image_2/000000.png` gets the name `image_2`. If `…_gtFine_color.png` exists in the same folder,
    `gtFine/val/city/city_000000_000000_gtFine_labelIds.png` gets the name `gtfine_labelids`.

    Args:
        paths: paths of the files of one sample, relative to the dataset's root.
        split: name of the split; the folder with this name is left out of the short names.
    """
    listed = sorted(paths)
    for is_full in (False, True):
        found = _named(listed, split, is_full=is_full)
        if len({(part.name, part.suffix) for part in found}) == len(listed):
            break
    return sorted(found, key=lambda part: (part.name, part.suffix))


def _named(paths: list[str], split: str, *, is_full: bool) -> list[Part]:
    """The parts, named after the first folder or, where that is not enough, after all folders."""
    folders: dict[str, list[PurePosixPath]] = {}
    for text in paths:
        path = PurePosixPath(text)
        above = [folder for folder in path.parts[:-1] if folder != split]
        folders.setdefault("_".join(above if is_full else above[:1]), []).append(path)
    found = []
    for folder, files in folders.items():
        ends = _ends([path.name.partition(".")[0] for path in files])
        for path, end in zip(files, ends, strict=True):
            suffix = path.name.partition(".")[2]
            name = re.sub("[^a-z0-9]+", "_", f"{folder}_{end}".lower()).strip("_") or "file"
            pattern = f"*_{end}.{suffix}" if end else f"*.{suffix}"
            glob = f"{path.parent.as_posix()}/{pattern}"
            found.append(Part(name=name, suffix=suffix.lower(), path=path.as_posix(), glob=glob))
    return found


def _ends(stems: list[str]) -> list[str]:
    """What tells the names of files apart: their words behind the first words, which all of them share."""
    words = [stem.split("_") for stem in stems]
    shared = 0
    while all(len(one) > shared and one[shared] == words[0][shared] for one in words):
        shared += 1
    return ["_".join(one[shared:]) for one in words]


def column_of(name: str, suffix: str, files: Collection[tuple[str, str]]) -> str:
    """The column name of a file in a table: its short name. The suffix is appended if files with different
    suffixes share the name.

    Args:
        name: short name of the file.
        suffix: suffix of the file, without a dot.
        files: short name and suffix of every file of the samples.
    """
    is_shared = sum(other == name for other, _ in files) > 1
    return f"{name}_{suffix.replace('.', '_')}" if is_shared else name
