"""Reads the metadata of a weights file."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

from gear.networks.options import SHIPPED
from gear.networks.shipped import WeightsFile, inspect, resolve
from gear.plugins.build import find
from gear.values.serial import Json

CHUNK_BYTES = 1 << 20


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightsFacts:
    """The metadata of a weights file, and its hash.

    Attributes:
        file: path, size, tensor shapes and metadata from the header of the file.
        sha256: hash of the whole file.
    """

    file: WeightsFile
    sha256: str

    def to_json(self) -> Json:
        """Returns `path`, `size_mb`, `sha256`, the numbers of `tensors` and of their values (`numbers`), and the
        `metadata` of the header, as JSON.
        """
        return {
            "path": str(self.file.path),
            "size_mb": round(self.file.size_mb, 3),
            "sha256": self.sha256,
            "tensors": len(self.file.shapes),
            "numbers": self.file.numbers,
            "metadata": self.file.facts(),
        }


def show_weights(name: str | Path) -> WeightsFacts:
    """Reads the header of a weights file and computes the hash of the file.

    Args:
        name: a safetensors file, or the name of a model with shipped weights.

    Raises:
        UnknownNameError: there is neither such a file nor such a model.
        GearError: the file is missing or is no safetensors file, or no weights are shipped under that name.
    """
    path = file_of(name)
    file = inspect(path)
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while chunk := stream.read(CHUNK_BYTES):
            digest.update(chunk)
    return WeightsFacts(file=file, sha256=digest.hexdigest())


def file_of(name: str | Path) -> Path:
    """Returns the path of a weights file; the name of a model gives the path of its shipped weights.

    Raises:
        UnknownNameError: there is neither such a file nor such a model.
        GearError: no weights are shipped under that name.
    """
    path = Path(name)
    if not path.exists() and not path.suffix and path.name == str(name):
        return resolve(SHIPPED, find("model", path.name).spec.name) or path
    return path
