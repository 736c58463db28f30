"""Finds weights files and reads their metadata. The module does not import torch, so listing weights files is quick."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from safetensors import SafetensorError, safe_open

from gear.dataset.json_text import parse_json
from gear.networks.options import NONE, SHIPPED
from gear.values.entry_points import installed_entry_points
from gear.values.errors import GearError
from gear.values.regular_file import NotAFileError, check_regular
from gear.values.serial import Json

GROUP = "gear.weights"
"""Group of the entry points of weights packages; each entry point names a module whose `FOLDER` contains `models/`
and `patches/`.
"""

CHECKOUT = Path(__file__).resolve().parents[2] / "weights" / "gear_weights"

JSON_KEYS = ("metrics", "intervals", "options", "data", "look", "averaged")
"""Keys of the metadata whose values are JSON texts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightsFile:
    """Header of a safetensors file: shapes of the tensors, and metadata.

    gear writes these metadata, as far as they are known: `model`, `task`, `gear` (version), `source` and
    `source_sha256` (of a published file), `licence`, `command` and `seed`. `look_hash` identifies the appearance
    (assets, light and renderer) of the training pictures, and `measured_look_hash` that of the pictures on which the
    metrics were measured, if it differs.

    These values are stored as JSON: `data` (training data), `metrics` (values by name), `intervals` (their 95 %
    bounds), `options` (of the model, such as `input_scale`), `look` (the appearance,
    `gear.measuring.appearance_hash.Appearance`) and `averaged` (hashes of the two weights files that were averaged).

    Attributes:
        path: path of the file.
        size_mb: size of the file in 10^6 bytes.
        shapes: shape of each tensor, by key.
        metadata: all metadata as texts.
    """

    path: Path
    size_mb: float
    shapes: Mapping[str, tuple[int, ...]]
    metadata: Mapping[str, str] = field(default_factory=dict)

    @property
    def numbers(self) -> int:
        """Number of scalars in the file: weights, and normalisation statistics."""
        return sum(math.prod(shape) for shape in self.shapes.values())

    def facts(self) -> dict[str, Json]:
        """The metadata by key; JSON texts are decoded, other texts are unchanged."""
        return {key: _read(text) if key in JSON_KEYS else text for key, text in self.metadata.items()}

    def option(self, name: str) -> Json:
        """Returns the value of a model's option that the metadata state; None if they state none.

        Args:
            name: name of the option, such as `input_scale`.
        """
        options = self.facts().get("options")
        return options.get(name) if isinstance(options, dict) else None


def inspect(path: str | Path) -> WeightsFile:
    """Reads the header of a weights file.

    Args:
        path: the safetensors file; its tensors are not read.

    Raises:
        GearError: the file does not exist, or is not safetensors.
    """
    file = Path(path)
    check_file(file)
    try:
        with safe_open(str(file), framework="numpy") as opened:
            shapes = {key: tuple(opened.get_slice(key).get_shape()) for key in opened.keys()}  # noqa: SIM118
            metadata = dict(opened.metadata() or {})
    except (SafetensorError, OSError) as error:
        raise not_safetensors(file, error) from error
    return WeightsFile(path=file, size_mb=file.stat().st_size / 1e6, shapes=shapes, metadata=metadata)


def check_file(path: Path) -> None:
    """Checks that a weights file exists and is a regular file.

    Args:
        path: the file.

    Raises:
        GearError: there is no such file, or it is a folder, a device, a FIFO or a socket.
    """
    if path.is_dir():
        raise GearError(f"{path}: is a folder; name the file in it")
    try:
        check_regular(path)
    except NotAFileError as error:
        raise GearError(f"{path}: {error.strerror}") from error
    except OSError as error:
        raise GearError(f"{path}: there is no such weights file") from error


def not_safetensors(path: str | Path, error: Exception) -> GearError:
    """Makes the error for a file that cannot be read as safetensors.

    Args:
        path: the file, for the message.
        error: the exception that reading raised.
    """
    reason = str(error).splitlines()[0]
    return GearError(f"{path}: not a safetensors file ({reason}); gear weights convert makes one of a published file")


def resolve(weights: str, name: str) -> Path | None:
    """Finds the weights file that the option `weights` of a network selects.

    Args:
        weights: value of the option: `shipped`, `none`, or the path of a file.
        name: name of the network.

    Returns:
        Path of the file; None for random weights.

    Raises:
        GearError: `weights` is `shipped` and no installed package has weights of this network.
    """
    if weights == NONE:
        return None
    if weights != SHIPPED:
        return Path(weights)
    path = shipped(name)
    if path is None:
        others = shipped_networks()
        remedy = f"those installed are of {', '.join(others)};" if others else "install mujoco-gear-weights, or"
        raise GearError(
            f"{name} has no weights here: {remedy} say weights=FILE.safetensors "
            "(gear weights convert makes one of a published file, gear train another), or weights=none for random ones"
        )
    return path


def trained_option(weights: str, name: str, option: str) -> Json:
    """The value of one option of a network, such as `input_scale`, that its weights file states; None if the file
    states none.

    Args:
        weights: value of the option `weights`.
        name: name of the network.
        option: name of the option that is looked up.

    Raises:
        GearError: there is no such weights file.
    """
    path = resolve(weights, name)
    return None if path is None else inspect(path).option(option)


def shipped(name: str) -> Path | None:
    """Returns the path of the reference weights of a network; None if no installed package has them.

    Args:
        name: name of the network's model plugin.
    """
    for folder in shipped_folders():
        path = folder / "models" / f"{name}.safetensors"
        if path.is_file():
            return path
    return None


def shipped_networks() -> list[str]:
    """Names of the networks whose reference weights are installed."""
    return sorted({path.stem for folder in shipped_folders() for path in (folder / "models").glob("*.safetensors")})


@functools.cache
def shipped_folders() -> tuple[Path, ...]:
    """Folders of the installed weights packages, sorted by the packages' names.

    In a checkout of the repository, the folder `weights` next to the package gear comes last.

    Raises:
        GearError: a weights package cannot be imported, or has no folder.
    """
    folders = []
    for entry in sorted(installed_entry_points(GROUP)[0], key=lambda entry: (entry.name, entry.value)):
        try:
            folders.append(Path(entry.load().FOLDER))
        except (ImportError, AttributeError, TypeError) as error:
            package = entry.dist.name if entry.dist else entry.value
            raise GearError(f"the weights package {package} is broken ({error}); install it again") from error
    return tuple(dict.fromkeys([*folders, *([CHECKOUT] if CHECKOUT.is_dir() else [])]))


def _read(text: str) -> Json:
    try:
        return parse_json(text)
    except (ValueError, RecursionError):
        return text


def shipped_patches() -> dict[str, Path]:
    """Folders of the pre-computed patches in the installed weights packages, by name of the patch."""
    return {
        path.name: path
        for folder in reversed(shipped_folders())
        for path in sorted((folder / "patches").glob("*"))
        if (path / "patch_0.png").is_file()
    }
