"""Specs: declarations of plugins as data. Making a spec is quick and imports no heavy package; only `build`
imports them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, Literal, TypeVar

from gear.contracts.attacks import Attack
from gear.contracts.controllers import Controller
from gear.contracts.defenses import Defense
from gear.contracts.loggers import Logger
from gear.contracts.models import Model, PublishedWeights, Recipe
from gear.contracts.tasks import Evaluator, Task

ConfigT = TypeVar("ConfigT")
ProductT = TypeVar("ProductT", covariant=True)

PROTOCOL_VERSION = 1
"""Version of the plugin protocols; increased when a protocol changes in a way that breaks older plugins."""

Gradient = Literal["differentiable", "surrogate", "none"]
"""How gradients pass a defense: exactly (`differentiable`), through a substitute function (`surrogate`), or not at
all (`none`).
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spec(Generic[ConfigT, ProductT]):
    """Base class of specs: the declarations of every plugin.

    Attributes:
        name: name by which users select the plugin; matches `[a-z][a-z0-9_]*`.
        summary: description in one line.
        config: frozen dataclass of the options, all with defaults.
        build: function that makes the task, model, attack, defense, controller, evaluator or logger from the options;
            imports heavy packages.
        protocol: version of the plugin protocol for which the plugin was written.
    """

    name: str
    summary: str
    config: type[ConfigT]
    build: Callable[[ConfigT], ProductT]
    protocol: int = PROTOCOL_VERSION


def no_notes(_options: Any) -> tuple[str, ...]:
    """The default of `TaskSpec.notes`: no notes, whatever the options.

    Args:
        _options: options of the task; not used.
    """
    return ()


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskSpec(Spec[ConfigT, Task[Any, Any]]):
    """The spec of a task, that is, of a dataset format with its ground truth and metric.

    Attributes:
        views: camera names of the default rig, the reference camera first.
        layout: one line about the files that the task writes.
        original_name: name in CARLA-GeAR's configuration files and JSON; "" where CARLA-GeAR does not have the task.
        metric: the metric by which training chooses among checkpoints, of the evaluator or of a report
            (`<report>.<metric>`); "" chooses by the loss.
        lower_is_better: whether that metric is an error.
        notes: function from the options to notes for the user, one line each, which `gear collect` shows; for options
            whose ground truth is only approximate.
    """

    views: tuple[str, ...]
    layout: str
    original_name: str = ""
    metric: str = ""
    lower_is_better: bool = False
    notes: Callable[[ConfigT], tuple[str, ...]] = no_notes


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelSpec(Spec[ConfigT, Model]):
    """The spec of a model, that is, a network.

    Attributes:
        tasks: names of the tasks that it performs.
        views: names of the cameras whose pictures it takes.
        taps: names of the feature maps that defenses and attacks can read.
        has_gradients: whether `forward` is differentiable with respect to the pixels.
        recipe: training defaults; None where `gear train` cannot train it.
        published: weights that its authors publish.
        normalisation: one line on how its graph normalises a picture in 0..1.
        parameters: number of its parameters with default options; 0 for unknown.
        input_scale: for networks with an option of this name: the factor by which pictures are resized before the
            network where neither the option nor the weights state one.
        needs: modules that `build` imports and that are no dependencies of gear, such as `torchvision`.
        convert: function from the tensors of a published file, by key, to those of `module().state_dict()`. `gear
            weights convert` calls it on each candidate state of a checkpoint and checks the result strictly. None where
            published files have the network's own keys. Imports torch inside, if at all.
        starts: further choices of `gear train --init NAME`, in addition to random weights and files: by name (usually
            `imagenet`), a function that loads weights into the built model. It raises a GearError that names the
            package to install where the weights are missing. Imports torch inside.
    """

    tasks: tuple[str, ...]
    views: tuple[str, ...]
    taps: tuple[str, ...] = ()
    has_gradients: bool = True
    recipe: Recipe | None = None
    published: tuple[PublishedWeights, ...] = ()
    normalisation: str = ""
    parameters: int = 0
    input_scale: float = 1.0
    needs: tuple[str, ...] = ()
    convert: Callable[[Mapping[str, Any]], Mapping[str, Any]] | None = None
    starts: Mapping[str, Callable[[Any], None]] = field(default_factory=dict)


@dataclass(frozen=True, slots=True, kw_only=True)
class AttackSpec(Spec[ConfigT, Attack]):
    """The spec of an attack.

    Attributes:
        tasks: names of the tasks that it can attack; empty for any.
        needs_gradients: whether the model must have gradients.
        needs_probes: whether the dataset must have probes: each sample rendered with the surface black and white.
        max_surfaces: number of surfaces that it can optimise jointly.
        is_control: whether it is a control, which uses no model and with which attacks are compared.
    """

    tasks: tuple[str, ...] = ()
    needs_gradients: bool = True
    needs_probes: bool = True
    max_surfaces: int = 16
    is_control: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class DefenseSpec(Spec[ConfigT, Defense]):
    """The spec of a defense.

    Attributes:
        tasks: names of the tasks whose models it can protect; empty for any.
        outputs: kinds of results: cleaned `images`, a `mask` of the patch, a `score` that the sample is attacked.
        gradient: how gradients pass it.
        taps: names of the model's feature maps that it reads.
        needs_calibration: whether `fit` must be called before `apply`.
        needs_model: whether `apply` needs the model; defenses with `taps` do.
    """

    tasks: tuple[str, ...] = ()
    outputs: frozenset[Literal["images", "mask", "score"]] = frozenset({"images"})
    gradient: Gradient = "none"
    taps: tuple[str, ...] = ()
    needs_calibration: bool = False
    needs_model: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class MetricSpec(Spec[ConfigT, Evaluator[Any, Any]]):
    """The spec of a metric that a plugin adds to existing tasks; `gear evaluate --report NAME` shows it.

    `build` returns a new, empty evaluator at every call. The evaluator's `update` receives the task's samples and
    predictions.

    Attributes:
        tasks: names of the tasks whose samples and predictions it understands; at least one.
        metric: name of the evaluator's main metric, by which predictions are compared.
        unit: unit of its metrics, such as `m` or `px`; "" for shares and counts.
        lower_is_better: whether the main metric is an error.
    """

    tasks: tuple[str, ...]
    metric: str
    unit: str = ""
    lower_is_better: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ControllerSpec(Spec[ConfigT, Controller]):
    """The spec of a controller, which drives the ego car in `gear drive`.

    Attributes:
        tasks: names of the tasks whose predictions it reads; empty for a controller without a network.
        needs_views: whether it receives the pictures themselves, as a policy that drives end to end does.
        needs_truth: whether it receives the true positions of all road users, and of red traffic lights; only for
            comparisons.
        reads_lights: whether it stops at red traffic lights. `gear drive` leaves scenarios with a red light out for
            controllers that read a task but no lights, unless the config names the scenario.
    """

    tasks: tuple[str, ...] = ()
    needs_views: bool = False
    needs_truth: bool = False
    reads_lights: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class LoggerSpec(Spec[ConfigT, Logger]):
    """The spec of a logger, which `gear attack`, `gear train` and `gear bench` use for `--log-to NAME`.

    `build` raises a `GearError` that names the package to install if the logger's tool is missing.
    """


AnySpec = Spec[Any, Any]
Kind = Literal["task", "model", "attack", "defense", "controller", "metric", "logger"]
KINDS: tuple[Kind, ...] = ("task", "model", "attack", "defense", "controller", "metric", "logger")
SPEC_TYPES: dict[Kind, type[AnySpec]] = {
    "task": TaskSpec,
    "model": ModelSpec,
    "attack": AttackSpec,
    "defense": DefenseSpec,
    "controller": ControllerSpec,
    "metric": MetricSpec,
    "logger": LoggerSpec,
}
