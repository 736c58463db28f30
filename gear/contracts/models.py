"""The model protocol. torch appears in types alone.

What `forward` gives without targets is named the same for every network of a task, so that losses and attacks need not
know networks: `logits` (B, C, H, W) for semantic segmentation, at the picture's size, C = 19 Cityscapes train ids or 34
label ids; `depth_m` (B, H, W) for depth, metres, at the picture's size. Detectors and stereo networks give their heads'
raw outputs, one tensor a name with the batch in front. Their losses are what attacks work on.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol, runtime_checkable

from gear.values.frames import UInt8Image

if TYPE_CHECKING:
    from torch import Tensor, nn


class Model(Protocol):
    """A network behind one face."""

    def predict(self, views: Mapping[str, UInt8Image]) -> Any:
        """The task's prediction for one sample.

        (H, W, 3) uint8 sRGB pictures by camera name. Never sees ground truth.
        """
        ...

    def forward(self, views: Mapping[str, Tensor], targets: Any | None = None) -> Mapping[str, Tensor]:
        """Outputs of a batch, or losses where `targets` are given.

        `views` holds (B, 3, H, W) float pictures in 0..1 by camera name; everything is differentiable to them.
        """
        ...

    def taps(self) -> Mapping[str, nn.Module]:
        """Modules whose outputs are the named feature maps."""
        ...


@runtime_checkable
class Trainable(Protocol):
    """A model whose weights gear reads and writes, and that `gear train` can train.

    Its losses are those of `Model.forward` with the batch's samples.
    """

    def module(self) -> nn.Module:
        """The network, under the key names that its weights are saved with."""
        ...


@runtime_checkable
class BatchPredictor(Protocol):
    """A model that predicts several samples at once, which is faster on most machines."""

    def predict_many(self, samples: Sequence[Mapping[str, UInt8Image]]) -> list[Any]:
        """The predictions of `Model.predict` for each sample, in order; pictures may differ in size."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Recipe:
    """How a network is trained unless one says otherwise.

    Attributes:
        optimiser: AdamW, or SGD with momentum 0.9.
        learning_rate: at its highest; it warms up and then falls with a cosine.
        weight_decay: of weights; biases and normalisation have none.
        batch: samples a step.
        epochs: passes over the data.
        crop_px: height and width of random crops; None trains on whole pictures.
        scales: range of random resizing before the crop; (1, 1) for none.
        gradient_norm: gradients are clipped to this; 0 for not at all.
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
    """Weights that others publish; nothing is downloaded.

    Attributes:
        data: what they were trained on.
        source: where a user finds them.
        licence: of the weights, as far as their authors say.
        size_mb: of the file.
    """

    data: str
    source: str
    licence: str
    size_mb: float
