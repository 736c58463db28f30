"""Finds models and defenses by name, and checks that they fit a dataset, without building them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from gear.config.dump import to_plain
from gear.config.nodes import Node
from gear.config.overrides import with_overrides
from gear.config.reader import read_node
from gear.contracts.specs import DefenseSpec, ModelSpec
from gear.dataset.reading import Dataset
from gear.plugins.build import NO_OPTIONS, find
from gear.plugins.catalogue import PluginEntry
from gear.values.errors import GearError
from gear.values.serial import Json

CAMERA = ("hfov_deg", "baseline_m")
"""Camera options whose values must be equal for a model and a dataset, because pictures do not contain them."""

OWN_PINHOLE = ("focal_px", "focal_y_px", "principal_px")
"""Options of tasks for cameras that the horizontal field of view alone (`hfov_deg`) does not describe."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """A plugin, such as a model, and the options with which it is built.

    Attributes:
        found: the plugin with its package and version.
        options: the given options as a tree of texts, without defaults.
    """

    found: PluginEntry
    options: Node

    def facts(self) -> Json:
        """The plugin's name, package, version and options (including defaults), as JSON for the results."""
        owner = self.found.owner
        config = read_node(self.found.spec.config, self.options, "")
        named = {"name": self.found.spec.name, "package": owner.package, "version": owner.version}
        return {**named, "options": to_plain(config)}


def chosen_model(name: str, settings: Iterable[str]) -> Chosen:
    """Finds a model by name and checks its options.

    Args:
        name: name of the plugin.
        settings: options as `KEY=VALUE` texts.

    Raises:
        GearError: there is no such model, or an option does not fit.
    """
    found, options = find("model", name), with_overrides(NO_OPTIONS, settings)
    read_node(found.spec.config, options, "")
    return Chosen(found=found, options=options)


def chosen_defense(name: str | None, settings: Iterable[str]) -> Chosen | None:
    """Finds a defense by name and checks its options; returns None without a name.

    Args:
        name: name of the defense; None or empty for no defense.
        settings: `KEY=VALUE` options of the defense.

    Raises:
        GearError: there is no such defense, an option does not fit, or options are given without a defense.
    """
    settings = tuple(settings)
    if not name:
        if settings:
            raise GearError(f"{settings[0]} is a defense's option, but there is no defense: name one with --defense")
        return None
    found, options = find("defense", name), with_overrides(NO_OPTIONS, settings)
    read_node(found.spec.config, options, "")
    return Chosen(found=found, options=options)


def check_model(model: Chosen, dataset: Dataset[Any]) -> None:
    """Checks that a model supports the task and the cameras of a dataset.

    Args:
        model: the model with its options.
        dataset: dataset on which the model predicts.

    Raises:
        GearError: the model does not support the task or a camera.
    """
    spec, task = model.found.spec, dataset.plan.task["name"]
    assert isinstance(spec, ModelSpec)
    if task not in spec.tasks:
        raise GearError(f"model {spec.name!r} does {', '.join(spec.tasks)}; {dataset.root} is a {task} dataset")
    cameras = {camera.name for camera in dataset.task.rig().cameras}
    missing = [name for name in spec.views if name not in cameras]
    if missing:
        raise GearError(f"model {spec.name!r} looks at {', '.join(missing)}, which {dataset.root} does not have")
    check_camera(model, dataset)


def check_camera(model: Chosen, dataset: Dataset[Any]) -> None:
    """Checks that a model assumes the camera of a dataset; otherwise its predicted distances would be wrong.

    Args:
        model: the model with its options.
        dataset: dataset whose task options describe the camera.

    Raises:
        GearError: the model assumes another camera.
    """
    check_optics(model, dataset.plan.options, f"{dataset.root} was collected")


def check_optics(model: Chosen, options: Json, collected: str, place: str = "--model-set ") -> None:
    """Checks that a model assumes the camera that the options of a task describe.

    Args:
        model: the model with its options.
        options: the task's options, such as `hfov_deg` (horizontal field of view) and `baseline_m`.
        collected: beginning of the error message, such as `DIR was collected`.
        place: what sets an option of the model, followed by the option in the error message.

    Raises:
        GearError: the model assumes another camera.
    """
    config = read_node(model.found.spec.config, model.options, "")
    own = [name for name in OWN_PINHOLE if options.get(name) is not None]
    if own and hasattr(config, "hfov_deg"):
        raise GearError(
            f"{collected} with {' and '.join(own)}, but model {model.found.spec.name!r} assumes a pinhole whose"
            " principal point is the middle of the picture and whose focal lengths are equal; collect with hfov_deg"
            " instead"
        )
    for name in CAMERA:
        assumed, taken = getattr(config, name, None), options.get(name)
        if assumed is not None and taken is not None and assumed != taken:
            raise GearError(
                f"{collected} with {name} {taken:g}, but model {model.found.spec.name!r} assumes {assumed:g}; say "
                f"{place}{name}={taken:g}"
            )


def check_defense(defense: Chosen, model: Chosen, task: str, *, is_calibrated: bool) -> None:
    """Checks that a defense supports the task and the model, and that required calibration data are given.

    The model must provide all feature maps that the defense reads.

    Args:
        defense: the defense.
        model: the network that it guards.
        task: name of the task of the datasets.
        is_calibrated: whether calibration data are given.

    Raises:
        GearError: the defense fits the task or the model badly, or calibration data are missing.
    """
    spec, guarded = defense.found.spec, model.found.spec
    assert isinstance(spec, DefenseSpec) and isinstance(guarded, ModelSpec)
    if spec.tasks and task not in spec.tasks:
        raise GearError(f"defense {spec.name!r} is for {', '.join(spec.tasks)}; this is a {task} dataset")
    missing = [tap for tap in spec.taps if tap not in guarded.taps]
    if missing:
        has = ", ".join(guarded.taps) or "none"
        raise GearError(
            f"defense {spec.name!r} needs the feature maps {', '.join(missing)}; {guarded.name!r} has {has}"
        )
    if spec.needs_calibration and not is_calibrated:
        raise GearError(
            f"defense {spec.name!r} must learn first: give --calibration DIR, a clean dataset of the task"
            " (and --calibration-patched DIR, its twin with patches, if it wants one)"
        )
