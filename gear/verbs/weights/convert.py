"""`gear.convert_weights`: converts a published weights file to safetensors and checks it against the network."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterable
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from gear.config.dump import to_plain
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.models import Trainable
from gear.contracts.specs import ModelSpec
from gear.dataset.files import read_bytes, sha256
from gear.networks.checkpoints import read_entries
from gear.networks.options import CIRCUMSTANCES, NONE
from gear.networks.shipped import inspect
from gear.networks.weights import write
from gear.plugins.build import NO_OPTIONS, build, find
from gear.plugins.catalogue import PluginEntry
from gear.plugins.manager import DISTRIBUTION
from gear.values.errors import GearError
from gear.values.serial import Json
from gear.verbs.weights.choose import choose_state

SUFFIX = ".safetensors"

PLAIN_BUILD = {"weights": NONE, "device": "cpu"}
"""Options with which a network is built only to compare keys; they are omitted where the network has no such option."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConvertReport:
    """The result of `gear.convert_weights` or `gear.average_weights`.

    Attributes:
        model: name of the model.
        path: path of the new file.
        sha256: hash of the new file.
        size_mb: size of the new file in 10^6 bytes.
        tensors: number of tensors in the new file.
        entry: path of the converted entry of the published file, such as `model` or `checkpoint.net.module`; "" for the
            whole file.
        others: paths of further entries that also fit the network.
    """

    model: str
    path: Path
    sha256: str
    size_mb: float
    tensors: int
    entry: str = ""
    others: tuple[str, ...] = ()

    @classmethod
    def of(cls, model: str, path: Path, tensors: int) -> ConvertReport:
        """Returns the report on a weights file that was just written.

        Args:
            model: name of the network.
            path: path of the written file.
            tensors: number of its tensors.
        """
        data = read_bytes(path)
        return cls(model=model, path=path, sha256=sha256(data), size_mb=len(data) / 1e6, tensors=tensors)

    def summary(self) -> str:
        """Returns the result as a few lines of text."""
        taken = f"taken from: {self.entry}\n" if self.entry else ""
        others = f"fits, too, and was not taken (--entry NAME): {', '.join(self.others)}\n" if self.others else ""
        return (
            f"{self.path}: {self.tensors} tensors of {self.model}, {self.size_mb:.1f} MB\nsha256 {self.sha256}\n"
            f"{taken}{others}use it with: gear evaluate --model {self.model} --set weights={self.path}"
        )


def convert_weights(
    model: str,
    source: str | Path,
    out: str | Path,
    *,
    settings: Iterable[str] = (),
    entry: str = "",
    halves: bool = False,
) -> ConvertReport:
    """Converts a published weights file to safetensors; all keys and shapes are checked against the network.

    No code in the published file is executed. Data that do not belong to the network, such as the state of an
    optimiser, are left out. Prefixes of wrappers (`module.`, `_orig_mod.`, `net.module.`) are removed from the keys. If
    several entries of a checkpoint fit, such as `model` and `ema`, the report names the converted entry and the others.
    The metadata of a safetensors file are preserved, and the options in `settings` are added.

    Args:
        model: name of a model plugin.
        source: a PyTorch checkpoint (zip or older format), a safetensors file, or the JSON file of a graph model of
            TensorFlow.js.
        out: file to write; must end in `.safetensors`.
        settings: `KEY=VALUE` texts for the model's options that change its graph.
        entry: path of the checkpoint's entry to convert, such as `ema` or `checkpoint.model`; "" takes the first one
            that fits.
        halves: whether tensors with two or more dimensions are stored in float16.

    Returns:
        A report with the path, hash and size of the new file.

    Raises:
        GearError: an error that the user can correct; the message is one line.
    """
    target, origin = Path(out), Path(source)
    check_target(target, origin)
    found, settings = find("model", model), tuple(settings)
    graph = _graph(found, settings)
    chosen = choose_state(found, graph.state_dict(), read_entries(origin), origin, entry)
    spec = found.spec
    assert isinstance(spec, ModelSpec)
    published = read_bytes(origin)
    metadata = _said(origin) | {
        "model": spec.name,
        "package": found.owner.package,
        "source": origin.name,
        "source_sha256": sha256(published),
        "gear": _version(),
    }
    options = _options(spec, settings, metadata.get("options", ""))
    if options:
        metadata["options"] = json.dumps(options, sort_keys=True)
    write(target, chosen.state, metadata, halves=halves)
    report = ConvertReport.of(spec.name, target, len(chosen.state))
    return dataclasses.replace(report, entry=chosen.name, others=chosen.others)


def check_target(target: Path, *origins: Path) -> None:
    """Checks the path of a weights file that will be written.

    Args:
        target: path of the file to write.
        *origins: paths of the files to read.

    Raises:
        GearError: the path does not end in `.safetensors`, or is one of the source files.
    """
    if target.suffix != SUFFIX:
        raise GearError(f"{target}: the file to write is to end in {SUFFIX}")
    if any(target.exists() and origin.exists() and target.samefile(origin) for origin in origins):
        raise GearError(f"{target}: is the file to read; write another one")


def _graph(found: PluginEntry, settings: Iterable[str]) -> Any:
    """Returns the network's torch module with random weights.

    Raises:
        GearError: the options do not fit, a required module is not installed, or the model has no torch module.
    """
    names = {field.name for field in dataclasses.fields(found.spec.config)}
    plain = [f"{name}={value}" for name, value in PLAIN_BUILD.items() if name in names]
    product = build(found, with_overrides(NO_OPTIONS, [*plain, *settings]))
    if not isinstance(product, Trainable):
        raise GearError(f"model {found.spec.name!r} has no module whose weights could be converted")
    return product.module()


def _said(origin: Path) -> dict[str, str]:
    """Returns the metadata of the published file; empty if it is not a safetensors file."""
    return dict(inspect(origin).metadata) if origin.suffix == SUFFIX else {}


def _options(spec: ModelSpec[Any], settings: Iterable[str], said: str) -> dict[str, Json]:
    """Returns the options of the model: those in the file's metadata, overridden by those in `settings`."""
    try:
        options = json.loads(said)
    except ValueError:
        options = {}
    plain = to_plain(read_node(spec.config, with_overrides(NO_OPTIONS, settings), ""))
    given = {text.partition("=")[0].partition(".")[0] for text in settings} - set(CIRCUMSTANCES)
    return (options if isinstance(options, dict) else {}) | {key: plain[key] for key in plain if key in given}


def _version() -> str:
    try:
        return version(DISTRIBUTION)
    except PackageNotFoundError:
        return "source"
