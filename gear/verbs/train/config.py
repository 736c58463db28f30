"""The configuration of a training: the recipe of the network (its default hyperparameters) with the user's changes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal

from gear.augment.apply import Augmentation, Framing
from gear.config.dump import to_yaml
from gear.config.nodes import Mapping as MappingNode
from gear.config.nodes import Node, Place, Scalar, parse_text
from gear.config.overrides import merged, with_overrides
from gear.config.reader import read_node
from gear.contracts.models import Recipe
from gear.values.errors import FieldError

SCALES, CROPS_PX = (0.1, 100.0), (16, 8192)
"""Allowed ranges of scale factors, and of the sides of crops in pixels; larger pictures would need too much memory."""

MOST_RATE = 1e6
"""Largest allowed learning rate, because optimisers fail at rates that float32 cannot represent."""

SHARES = ("warmup_fraction", "final_lr_fraction", "validation_share")


@dataclass(frozen=True, slots=True, kw_only=True)
class Adversarial:
    """Settings of adversarial patch training: part of the pictures contain patches optimised against the network
    during the training.

    Attributes:
        attack: name of the attack plugin; "" for no adversarial training.
        share: probability that a sample with surfaces gets patches of the pool.
        pool: largest number of patch sets in the pool.
        steps: optimisation steps of the attack for one set.
        samples: number of samples, of one scene, on which a set is optimised.
        compositor: method that puts patches into pictures: `transport` needs data collected with probes, `homography`
            does not.
        options: options of the attack (`gear plugins show ATTACK` lists them).
    """

    SHORTHAND: ClassVar[str] = "attack"

    attack: str = ""
    share: float = 0.5
    pool: int = 8
    steps: int = 30
    samples: int = 16
    compositor: Literal["transport", "homography"] = "transport"
    options: Node = field(default_factory=lambda: MappingNode({}, Place("defaults")))

    def __post_init__(self) -> None:
        if not 0 <= self.share <= 1:
            raise FieldError("share", f"is a share of the samples, 0 to 1, got {self.share:g}")
        for name in ("pool", "steps", "samples"):
            if getattr(self, name) < 1:
                raise FieldError(name, f"must be at least 1, got {getattr(self, name)}")


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainConfig(Recipe):
    """The configuration of one training: the network's recipe (its default hyperparameters) and further settings.

    Attributes:
        seed: seed of initial weights, order, augmentation and the network's own random draws.
        time_budget_s: training time in seconds, which replaces `epochs`; the learning rate then follows the remaining
            time. 0 counts epochs.
        precision: precision of the training steps; `auto` is bfloat16 if there is a time budget and the device is
            faster with it, else float32. Validation always uses float32.
        device: `cpu`, `cuda`, or `auto`, which takes a GPU if there is one.
        init: initial weights: "" for random weights; `shipped` for the reference weights; the path of a safetensors
            file; a name that the network defines, such as `imagenet`; or `trunk:` followed by a file or by a network
            with reference weights, which loads the weights whose keys and shapes match.
        picture_scale: factor by which pictures are resized in training and validation; null is 1, or, with a time
            budget on a CPU, a factor that leaves time for enough steps.
        warmup_fraction: share of the training during which the learning rate rises.
        final_lr_fraction: learning rate at the end, as a share of the peak.
        ema: decay of the exponential moving average of the weights, which is validated and saved; 0 for no averaging.
        validation_share: share of the training data that is held out for validation if no validation data are given.
        validation_samples: largest number of samples of a validation, spread evenly over the data.
        patience: number of validations without improvement after which the training stops; 0 for never.
        workers: number of threads that decode and augment; the result does not depend on it.
        cache_gb: memory in GB for decoded training samples; decoded validation samples, and data that compositors
            precompute, may each take a quarter of this size in addition. Data that do not fit are computed again.
        augmentation: augmentation of training samples.
        adversarial: adversarial patch training.
        options: options of the network (`gear plugins show MODEL` lists them).
    """

    seed: int = 0
    time_budget_s: float = 0.0
    precision: Literal["auto", "float32", "bfloat16"] = "auto"
    device: Literal["auto", "cpu", "cuda"] = "auto"
    init: str = ""
    picture_scale: float | None = None
    warmup_fraction: float = 0.03
    final_lr_fraction: float = 0.01
    ema: float = 0.998
    validation_share: float = 0.08
    validation_samples: int = 48
    patience: int = 0
    workers: int = 2
    cache_gb: float = 4.0
    augmentation: Augmentation = field(default_factory=Augmentation)
    adversarial: Adversarial = field(default_factory=Adversarial)
    options: Node = field(default_factory=lambda: MappingNode({}, Place("defaults")))

    def __post_init__(self) -> None:
        for name in ("batch", "epochs", "workers", "validation_samples"):
            if getattr(self, name) < 1:
                raise FieldError(name, f"must be at least 1, got {getattr(self, name)}")
        for name in ("seed", "time_budget_s", "patience", "cache_gb", "weight_decay", "gradient_norm"):
            if getattr(self, name) < 0:
                raise FieldError(name, f"must not be negative, got {getattr(self, name):g}")
        for name in SHARES:
            if not 0 <= getattr(self, name) < 1:
                raise FieldError(name, f"is a share, 0 or more and below 1, got {getattr(self, name):g}")
        if self.picture_scale is not None and not 0 < self.picture_scale <= 1:
            raise FieldError("picture_scale", f"is a share, above 0 and at most 1, got {self.picture_scale:g}")
        if not 0 < self.learning_rate <= MOST_RATE:
            raise FieldError("learning_rate", f"must be above 0, at most {MOST_RATE:g}, got {self.learning_rate:g}")
        if not 0 <= self.ema < 1:
            raise FieldError("ema", f"must be 0 or more and below 1, got {self.ema:g}")
        if not SCALES[0] <= self.scales[0] <= self.scales[1] <= SCALES[1]:
            raise FieldError("scales", f"must be a range in {SCALES[0]:g} to {SCALES[1]:g}, got {self.scales}")
        if self.crop_px is not None and not CROPS_PX[0] <= min(self.crop_px) <= max(self.crop_px) <= CROPS_PX[1]:
            raise FieldError("crop_px", f"must be {CROPS_PX[0]} to {CROPS_PX[1]} px a side, got {self.crop_px}")

    @property
    def framing(self) -> Framing:
        """The random crops and scale factors of training samples."""
        return Framing(crop_px=self.crop_px, scales=self.scales)


FLAGS = {"learning_rate": "lr", "time_budget_s": "time-budget"}
"""Command-line flags that differ from the name of the config key, by key."""


def read_config(recipe: Recipe, flags: Mapping[str, Any], settings: Iterable[str] = ()) -> TrainConfig:
    """Returns the training config: a recipe (default hyperparameters of the network), overridden by flags and by
    settings.

    Args:
        recipe: recipe of the network.
        flags: values by key of the config; None leaves the value of the recipe.
        settings: `KEY=VALUE` texts; they override flags.

    Raises:
        ConfigError: a key is unknown, or a value is not allowed.
    """
    base = parse_text(to_yaml(recipe), "recipe")
    given: dict[str, tuple[Place, Node]] = {}
    for key, value in flags.items():
        if value is not None:
            place = Place(f"--{FLAGS.get(key, key)}")
            given[key] = (place, Scalar(str(value), False, place))
    node = merged(base, MappingNode(given, base.place))
    return read_node(TrainConfig, with_overrides(node, settings, TrainConfig))
