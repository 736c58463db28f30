"""`gear.convert_weights`: converts a published file to safetensors, checked against the network."""

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
"""Options with which a network is built to compare keys; options that a config does not have are left out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ConvertReport:
    """The result of a conversion.

    Attributes:
        model: name of the model.
        path: path of the new file.
        sha256: hash of the new file.
        size_mb: size of the new file in 10^6 bytes.
        tensors: number of tensors in the file.
        entry: path of the converted entry of the published file, such as `model` or `checkpoint.net.module`; "" for
            all.
        others: paths of further entries that fit the network.
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
        """The report on a file that was just written."""
        data = read_bytes(path)
        return cls(model=model, path=path, sha256=sha256(data), size_mb=len(data) / 1e6, tensors=tensors)

    def summary(self) -> str:
        """The result as lines of text."""
        taken = f"taken from: {self.entry}\n" if self.entry else ""
        others = f"fits, too, and was not taken (--entry NAME): {', '.join(self.others)}\n" if self.others else ""
        return (
            f"{self.path}: {self.tensors} tensors of {self.model}, {self.size_mb:.1f} MB\nsha256 {self.sha256}\n"
            f"{taken}{others}use it with: --model {self.model} --set weights={self.path}"
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
    """Converts a published weights file to safetensors, strictly checked against the network.

    No code in the published file is run. Parts that do not belong to the network, such as the state of an optimiser,
    are left out. Prefixes of wrappers (`module.`, `_orig_mod.`, `net.module.`) are removed from the keys. If several
    entries of a checkpoint fit, such as `model` and `ema`, the report names the converted one. The metadata of a
    safetensors file are kept, and given options are added to them.

    Args:
        model: name of a model plugin.
        source: a PyTorch checkpoint (zip or older format), or a safetensors file.
        out: file to write.
        settings: `KEY=VALUE` texts for the model's options that change its graph.
        entry: path of the checkpoint's entry to take, such as `ema` or `checkpoint.model`; "" chooses one that fits.
        halves: whether weights of two dimensions and more are stored in float16.

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
    """Checks the path of the new weights file and returns it.

    Raises:
        GearError: the suffix of the path is wrong, or it is one of the files to read.
    """
    if target.suffix != SUFFIX:
        raise GearError(f"{target}: the file to write is to end in {SUFFIX}")
    if any(target.exists() and origin.exists() and target.samefile(origin) for origin in origins):
        raise GearError(f"{target}: is the file to read; write another one")


def _graph(found: PluginEntry, settings: Iterable[str]) -> Any:
    """The network's module, with random weights.

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
    """The metadata of the published file."""
    return dict(inspect(origin).metadata) if origin.suffix == SUFFIX else {}


def _options(spec: ModelSpec[Any], settings: Iterable[str], said: str) -> dict[str, Json]:
    """Options of the model: those in the file's metadata, overridden by the given ones."""
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
