"""Finds weights files and reads their metadata, without importing torch."""

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
from gear.values.serial import Json

GROUP = "gear.weights"
"""Entry points of this group name a module whose `FOLDER` holds `models/` and `patches/`."""

CHECKOUT = Path(__file__).resolve().parents[2] / "weights" / "gear_weights"

JSON_KEYS = ("metrics", "intervals", "options", "data", "look", "averaged")
"""Metadata keys whose texts are JSON."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WeightsFile:
    """Header of a safetensors file.

    Attributes:
        path: of the file.
        size_mb: of the file, in 10^6 bytes.
        shapes: of the tensors, by key.
        metadata: all texts. gear writes, as far as known: `model`, `task`, `gear` (version), `source` and
            `source_sha256` (of a published file), `licence`, `command`, `seed`, `look_hash` (appearance of the training
            pictures), `measured_look_hash` (of the pictures behind the metrics, where it differs), and as JSON `data`
            (training data), `metrics` (values by name), `intervals` (their bounds of 95 %), `options` (of the model,
            such as `input_scale`), `look` (`gear.measuring.appearance_hash.Look`) and `averaged` (hashes of the two
            averaged states).
    """

    path: Path
    size_mb: float
    shapes: Mapping[str, tuple[int, ...]]
    metadata: Mapping[str, str] = field(default_factory=dict)

    @property
    def numbers(self) -> int:
        """Number of values in the file, including statistics."""
        return sum(math.prod(shape) for shape in self.shapes.values())

    def facts(self) -> dict[str, Json]:
        """The metadata with JSON texts decoded; other texts stay as they are."""
        return {key: _read(text) if key in JSON_KEYS else text for key, text in self.metadata.items()}

    def option(self, name: str) -> Json:
        """The value that the file states for an option of the model; None where it states none."""
        options = self.facts().get("options")
        return options.get(name) if isinstance(options, dict) else None


def inspect(path: str | Path) -> WeightsFile:
    """Reads the header of a file.

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
    """Checks that a weights file exists.

    Raises:
        GearError: the file does not exist.
    """
    if path.is_dir():
        raise GearError(f"{path}: is a folder; name the file in it")
    if not path.is_file():
        raise GearError(f"{path}: there is no such weights file")


def not_safetensors(path: str | Path, error: Exception) -> GearError:
    """The error for a file that cannot be read as safetensors."""
    reason = str(error).splitlines()[0]
    return GearError(f"{path}: not a safetensors file ({reason}); gear weights convert makes one of a published file")


def resolve(weights: str, name: str) -> Path | None:
    """The file that the option `weights` of network `name` refers to; None for random weights.

    Raises:
        GearError: `shipped` was requested and no installed package has weights of this network.
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
    """The value that a network's weights state for one of its options; None where they state none.

    Args:
        weights: value of the option `weights`.
        name: of the network.
        option: name of the option.

    Raises:
        GearError: these weights do not exist.
    """
    path = resolve(weights, name)
    return None if path is None else inspect(path).option(option)


def shipped(name: str) -> Path | None:
    """Path of the reference weights of a network; None where no installed package has them."""
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
    """Folders of the installed weights packages, by name; in a checkout, the folder next to gear comes last.

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
    """Pre-computed patch folders of the installed weights packages, by name."""
    return {
        path.name: path
        for folder in reversed(shipped_folders())
        for path in sorted((folder / "patches").glob("*"))
        if (path / "patch_0.png").is_file()
    }
