"""`gear.list_models`: describes the installed networks, with their published and their shipped weights."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import Any

from gear.contracts.specs import ModelSpec
from gear.networks.shipped import WeightsFile, inspect, shipped
from gear.plugins.catalogue import PluginEntry
from gear.plugins.manager import catalogue
from gear.values.serial import Json, to_json


@dataclass(frozen=True, slots=True, kw_only=True)
class ShippedWeights:
    """The reference weights of a network, which an installed package contains.

    Attributes:
        file: the weights file with its metadata.
        stale: parts of gear's rendering that changed since the training; None if the file does not record how its
            training pictures were rendered.
    """

    file: WeightsFile
    stale: tuple[str, ...] | None

    def to_json(self) -> Json:
        """Returns the metadata of the weights as JSON: path, size, metrics, training data, options and rendering
        changes.
        """
        facts = self.file.facts()
        return {
            "path": str(self.file.path),
            "size_mb": round(self.file.size_mb, 3),
            "metrics": facts.get("metrics", {}),
            "data": facts.get("data", {}),
            "options": facts.get("options", {}),
            "look_hash": facts.get("look_hash", ""),
            "look_is_current": None if self.stale is None else not self.stale,
            "look_changes": list(self.stale or ()),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelFacts:
    """The description of one installed network.

    Attributes:
        found: the plugin of the network.
        missing: Python modules that the network requires and that are not installed.
        shipped: the reference weights of the network; None if no installed package contains them.
    """

    found: PluginEntry
    missing: tuple[str, ...]
    shipped: ShippedWeights | None

    @property
    def spec(self) -> ModelSpec[Any]:
        """The spec of the network's plugin: name, tasks, cameras, options and published weights."""
        assert isinstance(self.found.spec, ModelSpec)
        return self.found.spec

    def to_json(self) -> Json:
        """Returns the description as JSON: name, package, tasks, cameras (`views`), `parameters`, feature maps
        (`taps`), missing modules, and weights (`published`, `shipped`).
        """
        spec = self.spec
        return {
            "name": spec.name,
            "package": self.found.owner.package,
            "version": self.found.owner.version,
            "summary": spec.summary,
            "tasks": list(spec.tasks),
            "views": list(spec.views),
            "parameters": spec.parameters or None,
            "normalisation": spec.normalisation,
            "taps": list(spec.taps),
            "has_gradients": spec.has_gradients,
            "is_trainable": spec.recipe is not None,
            "starts": sorted(spec.starts),
            "missing": list(self.missing),
            "published": [to_json(weights) for weights in spec.published],
            "shipped": None if self.shipped is None else self.shipped.to_json(),
        }


def list_models(task: str | None = None) -> list[ModelFacts]:
    """Returns a description of every installed network, ordered by name; torch is not imported.

    Args:
        task: name of a task; only networks for this task are returned.

    Raises:
        UnknownNameError: there is no such task.
        GearError: a weights package or a weights file is broken.
    """
    plugins = catalogue()
    if task is not None:
        task = plugins.get("task", task).spec.name
    digests: dict[str, str] = {}  # cache: reading a town's assets is slow, and several networks use the same towns
    return [
        ModelFacts(found=found, missing=_missing(found.spec.needs), shipped=_shipped(found.spec.name, digests))
        for found in plugins.of_kind("model")
        if isinstance(found.spec, ModelSpec) and (task is None or task in found.spec.tasks)
    ]


def _missing(modules: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(name for name in modules if importlib.util.find_spec(name.partition(".")[0]) is None)


def _shipped(name: str, digests: dict[str, str]) -> ShippedWeights | None:
    path = shipped(name)
    if path is None:
        return None
    file = inspect(path)
    return ShippedWeights(file=file, stale=_changes(file, digests))


def _changes(file: WeightsFile, digests: dict[str, str]) -> tuple[str, ...] | None:
    value = file.facts().get("look")
    if value is None:
        return None
    # Imported here because the comparison reads the towns' assets, which only shipped weights need.
    from gear.measuring.appearance_hash import current_appearance, read_appearance

    appearance = read_appearance(value)
    return None if appearance is None else tuple(appearance.differences(current_appearance(appearance, digests)))
