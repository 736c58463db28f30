"""Looks up models and defenses by name, and checks that they fit the data, before anything is loaded."""

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
"""Options that a model and its task must have in common, because pictures do not contain them."""

OWN_PINHOLE = ("focal_px", "focal_y_px", "principal_px")
"""Options of tasks for cameras that `hfov_deg` does not describe."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """A plugin with the options with which it is built."""

    found: PluginEntry
    options: Node

    def facts(self) -> Json:
        """Name, package, version and options with all defaults; JSON."""
        owner = self.found.owner
        config = read_node(self.found.spec.config, self.options, "")
        named = {"name": self.found.spec.name, "package": owner.package, "version": owner.version}
        return {**named, "options": to_plain(config)}


def chosen_model(name: str, settings: Iterable[str], flag: str = "--set") -> Chosen:
    """Looks up a model by name.

    Args:
        name: name of the plugin.
        settings: `KEY=VALUE` texts.
        flag: flag with which the settings were given, for messages.

    Raises:
        GearError: there is no such model, or an option does not fit.
    """
    found, options = find("model", name), with_overrides(NO_OPTIONS, settings, flag=flag)
    read_node(found.spec.config, options, "")
    return Chosen(found=found, options=options)


def chosen_defense(name: str | None, settings: Iterable[str]) -> Chosen | None:
    """Looks up a defense by name.

    Raises:
        GearError: there is no such defense, an option does not fit, or options are given without a defense.
    """
    settings = tuple(settings)
    if not name:
        if settings:
            raise GearError(f"{settings[0]} is a defense's option, but there is no defense: name one with --defense")
        return None
    found, options = find("defense", name), with_overrides(NO_OPTIONS, settings, flag="--defense-set")
    read_node(found.spec.config, options, "")
    return Chosen(found=found, options=options)


def check_model(model: Chosen, dataset: Dataset[Any], flag: str = "--set ") -> None:
    """Checks that the model supports the dataset's task and cameras.

    Args:
        model: the model with its options.
        dataset: dataset whose pictures the model is shown.
        flag: flag of the model's options, for messages.

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
    check_camera(model, dataset, flag)


def check_camera(model: Chosen, dataset: Dataset[Any], flag: str = "--set ") -> None:
    """Checks that the model assumes the camera that took the pictures; with another one, its distances would be
    wrong.

    Args:
        model: the model with its options.
        dataset: dataset whose task options describe the camera.
        flag: flag of the model's options, for messages.

    Raises:
        GearError: the model assumes another camera.
    """
    check_optics(model, dataset.plan.options, f"{dataset.root} was collected", flag)


def check_optics(model: Chosen, options: Json, collected: str, flag: str) -> None:
    """Checks a model against the camera of a task; see `check_camera`.

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
                f"{flag}{name}={taken:g}"
            )


def check_defense(defense: Chosen, model: Chosen, task: str, *, is_calibrated: bool) -> None:
    """Checks that the defense supports the task, that the model has its feature maps, and that required calibration
    data are given.

    Raises:
        GearError: one of these does not hold.
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
