"""The protocol of models. torch is imported for type checkers only.

Without targets, `forward` returns outputs whose names are the same for every network of a task. Losses and attacks
therefore work with any network. Semantic segmentation: `logits` (B, C, H, W) at the picture's size, C = 19 Cityscapes
train ids or 34 label ids. Depth: `depth_m` (B, H, W) in metres at the picture's size. Detectors and stereo networks
return the raw outputs of their heads by name, batch first; attacks maximise their losses.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, runtime_checkable

from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor, nn


class Model(Protocol):
    """A network that predicts, computes losses with gradients, and names layers whose feature maps can be read."""

    def predict(self, views: Mapping[str, UInt8Image]) -> Any:
        """The prediction for one sample, in the form that the task defines. Ground truth is not available to the
        model.

        Args:
            views: (H, W, 3) uint8 sRGB pictures by camera name.
        """
        ...

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        """Computes the outputs of a batch, or its losses if targets are given; both are differentiable with
        respect to the pictures.

        Args:
            views: (B, 3, H, W) float pictures in 0..1 by camera name.
            targets: the batch's samples; None for outputs.

        Returns:
            Tensors with the batch first, by name; or scalar losses by name.
        """
        ...

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules whose outputs are feature maps that defenses and attacks read, by the names in the spec's
        `taps`.
        """
        ...


@runtime_checkable
class Trainable(Protocol):
    """A model that `gear train` can train, and whose weights gear reads and writes.

    Its losses are those of `Model.forward` with the batch's samples as targets.
    """

    def module(self) -> nn.Module:
        """The torch module of the network; its state dict has the keys under which the weights are saved."""
        ...


@runtime_checkable
class BatchPredictor(Protocol):
    """A model that predicts several samples at once, which is faster on most machines."""

    def predict_many(self, samples: Sequence[Mapping[str, UInt8Image]]) -> list[Any]:
        """The prediction for each sample, in order; each equals the result of `Model.predict`. Pictures may differ
        in size.

        Args:
            samples: for each sample, (H, W, 3) uint8 sRGB pictures by camera name.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """Default settings for training a network.

    Attributes:
        optimiser: AdamW, or SGD with momentum 0.9.
        learning_rate: largest learning rate; the rate rises at the start and falls along a cosine.
        weight_decay: decay of weights; biases and normalisation layers have none.
        batch: samples per step.
        epochs: passes over the data.
        crop_px: height and width of random crops; None trains on whole pictures.
        scales: range of random resizing before the crop; (1, 1) for none.
        gradient_norm: limit of the gradient's norm; 0 for no limit.
    """

    optimiser: Literal["adamw", "sgd"] = "adamw"
    learning_rate: float = 1e-3
    weight_decay: float = 1e-2
    batch: int = 8
    epochs: int = 20
    crop_px: tuple[int, int] | None = None
    scales: tuple[float, float] = (1.0, 1.0)
    gradient_norm: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class PublishedWeights:
    """Weights that a network's authors publish; gear does not download them.

    Attributes:
        data: training data.
        source: address at which a user finds the file.
        licence: licence of the weights, as far as their authors state it.
        size_mb: size of the file, 10^6 bytes.
    """

    data: str
    source: str
    licence: str
    size_mb: float
