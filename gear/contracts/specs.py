"""Specs: what a plugin offers, as data. Cheap to make, nothing heavy imported; `build` imports what it needs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, Literal, TypeVar

from gear.contracts.attacks import Attack
from gear.contracts.defenses import Defense
from gear.contracts.models import Model, PublishedWeights, Recipe
from gear.contracts.tasks import Evaluator, Task

ConfigT = TypeVar("ConfigT")
ProductT = TypeVar("ProductT", covariant=True)

PROTOCOL_VERSION = 1
"""Raised when a protocol changes so that old plugins no longer fit."""

Gradient = Literal["differentiable", "surrogate", "none"]
"""How gradients pass a defense: exactly, through a declared stand-in, or not at all."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Spec(Generic[ConfigT, ProductT]):
    """What every plugin says of itself.

    Attributes:
        name: lower case, `[a-z][a-z0-9_]*`; how users ask for it.
        summary: one line.
        config: frozen dataclass of its options, every one with a default.
        build: makes the product from the options; heavy imports belong inside it.
        protocol: the protocol version that it was written for.
    """

    name: str
    summary: str
    config: type[ConfigT]
    build: Callable[[ConfigT], ProductT]
    protocol: int = PROTOCOL_VERSION


def no_notes(_options: Any) -> tuple[str, ...]:
    """Of a task that has nothing to point out."""
    return ()


@dataclass(frozen=True, slots=True, kw_only=True)
class TaskSpec(Spec[ConfigT, Task[Any, Any]]):
    """A task: a dataset format with its ground truth.

    Attributes:
        views: names of the cameras of its default rig, the reference first.
        layout: one line on the files that it writes.
        original_name: what CARLA-GeAR calls it in its configs and JSON, or "" if it does not know it.
        metric: the evaluator's metric by which training chooses among checkpoints, or one of a report's as
            `<report>.<metric>`; "" chooses by the loss.
        less_is_better: whether that metric is an error.
        notes: from the options, what the user may not have meant: lines that are shown once when collecting begins.
    """

    views: tuple[str, ...]
    layout: str
    original_name: str = ""
    metric: str = ""
    less_is_better: bool = False
    notes: Callable[[ConfigT], tuple[str, ...]] = no_notes


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelSpec(Spec[ConfigT, Model]):
    """A network.

    Attributes:
        tasks: names of the tasks that it can do.
        views: names of the cameras that it looks at.
        taps: names of the feature maps that it exposes.
        has_gradients: whether `forward` is differentiable to the pixels.
        recipe: how it is trained; None where `gear train` cannot.
        published: weights that others publish for it.
        normalisation: one line on what its graph wants of a picture in 0..1.
        parameters: how many its graph has with default options; 0 where nobody counted.
        input_scale: of networks with an option of this name: share of the picture's size that they run at where neither
            the option nor the weights say.
        needs: modules that `build` imports beside what gear itself depends on, such as `torchvision`.
        convert: makes of a published file's tensors, by key, those of `module().state_dict()`; `gear weights convert`
            calls it after it has taken the state out of the checkpoint and `module.` off its keys, and checks the
            result strictly. None where published files hold the network's own keys. Imports torch inside, if at all.
        starts: what `gear train --init NAME` can begin with beside random weights and files: by name (`imagenet` is the
            customary one), a function that is given the built model and puts the weights into it. It raises a
            GearError that says which package to install where they are not there. Imports torch inside.
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
    """An attack.

    Attributes:
        tasks: tasks that it can attack; empty for any.
        needs_gradients: whether the model must have gradients.
        needs_probes: whether the dataset must carry the probes of the exact compositor.
        max_surfaces: how many surfaces it can optimise jointly.
        is_control: whether it looks at no model: attacks are measured against it.
    """

    tasks: tuple[str, ...] = ()
    needs_gradients: bool = True
    needs_probes: bool = True
    max_surfaces: int = 16
    is_control: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class DefenseSpec(Spec[ConfigT, Defense]):
    """A defense.

    Attributes:
        tasks: tasks that it can guard; empty for any.
        outputs: what it gives: cleaned images, a mask of the patch, a score of being attacked.
        gradient: how gradients pass it.
        taps: feature maps that it needs of the model.
        needs_calibration: whether `fit` must be called before `apply`.
        needs_model: whether `apply` must be given the model; so it is where `taps` are asked for.
    """

    tasks: tuple[str, ...] = ()
    outputs: frozenset[Literal["images", "mask", "score"]] = frozenset({"images"})
    gradient: Gradient = "none"
    taps: tuple[str, ...] = ()
    needs_calibration: bool = False
    needs_model: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class MetricSpec(Spec[ConfigT, Evaluator[Any, Any]]):
    """A further metric of tasks that exist, for `gear evaluate --report NAME`.

    `build` returns a fresh, empty evaluator at every call. Its `update` is given the task's samples and predictions.

    Attributes:
        tasks: names of the tasks whose samples and predictions it understands; at least one.
        metric: the one of the evaluator's metrics that tells better from worse.
        unit: of its metrics, such as `m` or `px`; "" for shares and counts.
        less_is_better: whether the main metric is an error.
    """

    tasks: tuple[str, ...]
    metric: str
    unit: str = ""
    less_is_better: bool = False


AnySpec = Spec[Any, Any]
Kind = Literal["task", "model", "attack", "defense", "metric"]
KINDS: tuple[Kind, ...] = ("task", "model", "attack", "defense", "metric")
SPEC_TYPES: dict[Kind, type[AnySpec]] = {
    "task": TaskSpec,
    "model": ModelSpec,
    "attack": AttackSpec,
    "defense": DefenseSpec,
    "metric": MetricSpec,
}
