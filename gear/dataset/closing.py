"""Reads the sidecars (JSON files of the samples) of a split one at a time and collects the manifest's entries."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from pathlib import Path
from typing import overload

from gear.contracts.tasks import Sidecar
from gear.dataset.files import inside, read_bytes, sha256
from gear.dataset.layout import sidecar_path
from gear.dataset.sidecar import no_sidecar, read_sidecar
from gear.values.errors import FieldError
from gear.values.serial import Json


class SidecarStream(Sequence[Sidecar]):
    """All sidecars (JSON files of the samples) of a split in order of index; each is read on access and not kept.

    The sidecars of 20,000 samples would take gigabytes of memory. Only the entries of the manifest are kept: indices,
    files and hashes.
    """

    def __init__(self, root: Path, split: str, samples: int, views: Set[str]) -> None:
        """Args:
        root: root of the dataset.
        split: name of the split.
        samples: number of samples.
        views: names of the cameras that each record must have.
        """
        self._root, self._split, self._views = root, split, views
        self._entries: list[Json] = [None] * samples
        self._hashes: list[str] = [""] * samples

    def __len__(self) -> int:
        return len(self._entries)

    @overload
    def __getitem__(self, index: int) -> Sidecar: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Sidecar]: ...
    def __getitem__(self, index: int | slice) -> Sidecar | Sequence[Sidecar]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        if not -len(self) <= index < len(self):
            raise IndexError(f"sidecar {index} of {len(self)}")
        return self._read(index % len(self))

    def __iter__(self) -> Iterator[Sidecar]:
        return (self._read(index) for index in range(len(self)))

    def _read(self, index: int) -> Sidecar:
        """Reads a sidecar, and keeps the data that the manifest lists about it.

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
        return sidecar

    def facts(self) -> dict[str, Json]:
        """The entries `samples` and `sidecars` of the split's manifest (JSON that lists all files of the split).

        Sidecars that were not read yet are read.

        Raises:
            DatasetError: a sidecar is missing, damaged, or lacks a camera.
        """
        for index, known in enumerate(self._hashes):
            if not known:
                self._read(index)
        hashes = {sidecar_path(self._split, index): digest for index, digest in enumerate(self._hashes)}
        return {"samples": self._entries, "sidecars": hashes}
