"""What a weights file says of itself."""

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
    """A file and its hash.

    Attributes:
        file: its header.
        sha256: of the whole file.
    """

    file: WeightsFile
    sha256: str

    def to_json(self) -> Json:
        """As JSON, without the shapes."""
        return {
            "path": str(self.file.path),
            "size_mb": round(self.file.size_mb, 3),
            "sha256": self.sha256,
            "tensors": len(self.file.shapes),
            "numbers": self.file.numbers,
            "metadata": self.file.facts(),
        }


def show_weights(name: str | Path) -> WeightsFacts:
    """Reads a file's header and hashes it.

    Args:
        name: a safetensors file, or the name of a model whose shipped weights are meant.

    Raises:
        UnknownNameError: it is no file and no model.
        GearError: there is no such file, nothing is shipped under that name, or it is no safetensors.
    """
    path = file_of(name)
    file = inspect(path)
    digest = hashlib.sha256()
    with path.open("rb") as stream:
        while chunk := stream.read(CHUNK_BYTES):
            digest.update(chunk)
    return WeightsFacts(file=file, sha256=digest.hexdigest())


def file_of(name: str | Path) -> Path:
    """The file that is meant: one of that path, or the shipped weights of the model of that name.

    Raises:
        UnknownNameError: it is no file and no model.
        GearError: nothing is shipped under that name.
    """
    path = Path(name)
    if not path.exists() and not path.suffix and path.name == str(name):
        return resolve(SHIPPED, find("model", path.name).spec.name) or path
    return path
