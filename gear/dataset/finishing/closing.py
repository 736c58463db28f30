"""Reads the sidecars (JSON files of the samples) of a split one at a time and collects the manifest's entries.

When a split is extended, the part that was closed is taken from the old manifest and index files. Its sidecars are
hashed, but not parsed.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass
from pathlib import Path

from gear.contracts.tasks import Sidecar
from gear.dataset.files import inside, read_bytes, sha256
from gear.dataset.hashing import file_hash, in_threads
from gear.dataset.json_text import dump_json
from gear.dataset.layout import manifest_path, sidecar_path
from gear.dataset.sealed_json import load_sealed
from gear.dataset.sidecar import no_sidecar, read_sidecar
from gear.values.errors import DatasetError, FieldError
from gear.values.lazy_sequence import LazySequence
from gear.values.progress import NO_CALLBACKS, Progress
from gear.values.serial import Json


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ClosedPart:
    """The first samples of a split, for which an earlier run wrote manifest and index files (closed the split), and
    which have not changed since.

    Attributes:
        entries: the manifest's entries of the samples, in order.
        hashes: SHA-256 of their sidecars (JSON files of the samples), in order.
        indexes: bytes of the index files by path.
    """

    entries: Sequence[Json]
    hashes: Sequence[str]
    indexes: Mapping[str, bytes]


def closed_part(root: Path, split: str, samples: int, facts: Mapping[str, Json]) -> ClosedPart | None:
    """The part of a split that an earlier run closed.

    Args:
        root: root of the dataset.
        split: name of the split.
        samples: number of samples of the extended split.
        facts: entries that the old manifest must have: the same configuration, versions and keys.

    Returns:
        The part, or None if there is no manifest, it is of another configuration, or a sidecar or an index file has
        changed.
    """
    try:
        there = load_sealed(inside(root, manifest_path(split)))
        entries, sidecars, indexes = there["samples"], there["sidecars"], there["indexes"]
        hashes = [sidecars[sidecar_path(split, index)] for index in range(len(entries))]
        is_ours = all(dump_json(there[name]) == dump_json(value) for name, value in facts.items())
        if not is_ours or not 0 < len(entries) <= samples or len(sidecars) != len(entries):
            return None
        files = {name: read_bytes(inside(root, name)) for name in indexes}
        paths = [inside(root, sidecar_path(split, index)) for index in range(len(entries))]
        if any(sha256(files[name]) != digest for name, digest in indexes.items()):
            return None
        if any(found != digest for found, digest in zip(in_threads(file_hash, paths), hashes, strict=True)):
            return None
    except (DatasetError, KeyError, TypeError, AttributeError):  # missing, damaged, or edited
        return None
    return ClosedPart(entries=entries, hashes=hashes, indexes=files)


def can_extend(task: type) -> bool:
    """Whether a task's `extend` may be used instead of its `finalise`: one class must define both.

    A subclass that replaces only one of the two methods would write other index files with `extend` than with
    `finalise`.

    Args:
        task: class of the task.
    """
    owners = [next((owner for owner in task.__mro__ if name in vars(owner)), None) for name in ("extend", "finalise")]
    return owners[0] is owners[1]


class SidecarStream(LazySequence[Sidecar]):
    """All sidecars (JSON files of the samples) of a split in order of index; each is read on access and not kept.

    The sidecars of 20,000 samples would take gigabytes of memory. Only the entries of the manifest are kept: indices,
    files and hashes.
    """

    def __init__(
        self,
        root: Path,
        split: str,
        samples: int,
        views: Set[str],
        closed: ClosedPart | None = None,
        on_progress: Progress = NO_CALLBACKS.on_progress,
    ) -> None:
        """Prepares the stream; nothing is read.

        Args:
            root: root of the dataset.
            split: name of the split.
            samples: number of samples.
            views: names of the cameras that each record must have.
            closed: the part of the split that was closed before; None for no such part.
            on_progress: called after every sidecar that is read for the first time, with the numbers of known and of
                all sidecars.
        """
        self._root, self._split, self._views, self._on_progress = root, split, views, on_progress
        self._entries: list[Json] = [None] * samples
        self._hashes: list[str] = [""] * samples
        if closed is not None:
            self._entries[: len(closed.entries)] = closed.entries
            self._hashes[: len(closed.hashes)] = closed.hashes
        self._known = sum(map(bool, self._hashes))

    def __len__(self) -> int:
        return len(self._entries)

    def item(self, index: int) -> Sidecar:
        """Reads a sidecar, and keeps the data that the manifest lists about it.

        Args:
            index: index of the sample.

        Raises:
            DatasetError: the sidecar is missing, damaged, or lacks a camera.
        """
        path = inside(self._root, sidecar_path(self._split, index))
        sidecar = read_sidecar(path)
        if not self._hashes[index]:
            record = sidecar.record
            lacking = self._views - {camera.name for camera in record.cameras}
            if lacking:
                raise no_sidecar(path, FieldError("record.cameras", f"there is no {min(lacking)!r}"))
            self._hashes[index] = sha256(read_bytes(path))
            self._entries[index] = {
                "index": record.index,
                "sequence": record.sequence,
                "frame": record.frame,
                "files": dict(sidecar.files),
            }
            self._known += 1
            self._on_progress(self._known, len(self))
        return sidecar

    def facts(self) -> dict[str, Json]:
        """The entries `samples` and `sidecars` of the split's manifest (JSON that lists all files of the split).

        Sidecars that were not read yet are read.

        Raises:
            DatasetError: a sidecar is missing, damaged, or lacks a camera.
        """
        for index, known in enumerate(self._hashes):
            if not known:
                self.item(index)
        hashes = {sidecar_path(self._split, index): digest for index, digest in enumerate(self._hashes)}
        return {"samples": self._entries, "sidecars": hashes}
