"""Small but real networks: a few convolutions with the `Model` protocol, fast enough to be attacked in a test.

They have the parts of real networks that are easily handled wrongly: batch normalisation with buffers, a stride,
feature taps, losses. Their weights are drawn from a seed and are not trained.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.contracts.models import Recipe
from gear.contracts.specs import ModelSpec
from gear.values.frames import FloatImage, UInt8Image

LABEL_COUNT = 34
"""Number of Cityscapes label ids (0..33)."""

VIEW = "left"


@dataclass(frozen=True, slots=True, kw_only=True)
class TinyConfig:
    """Options of a tiny network.

    Attributes:
        seed: seed of the network's random weights.
        width: channels of the hidden layers.
    """

    seed: int = 0
    width: int = 8


def as_batch(views: Sequence[Mapping[str, UInt8Image]]) -> dict[str, Tensor]:
    """The pictures of several samples as the input of `Model.forward`: (B, 3, H, W) float32 in 0..1 by camera
    name.

    Args:
        views: (H, W, 3) uint8 pictures of each sample by camera name, of equal size.
    """
    stacked = {name: np.stack([sample[name] for sample in views]).transpose(0, 3, 1, 2) for name in views[0]}
    return {name: torch.from_numpy(np.ascontiguousarray(one)).float() / 255 for name, one in stacked.items()}


class TinyNetwork(nn.Module, ABC):
    """The base class of tiny networks: a stem, a trunk with stride 2 and batch normalisation, and a head.

    The head's map is interpolated back to the size of the picture.
    """

    def __init__(self, config: TinyConfig, channels: int) -> None:
        """Draws random weights and sets the network to evaluation mode.

        Args:
            config: the options.
            channels: number of channels of the head's map.
        """
        super().__init__()
        self.stem = nn.Conv2d(3, config.width, 3, padding=1)
        self.trunk = nn.Conv2d(config.width, config.width, 3, stride=2, padding=1)
        self.norm = nn.BatchNorm2d(config.width)
        self.head = nn.Conv2d(config.width, channels, 1)
        generator = torch.Generator().manual_seed(config.seed)
        with torch.no_grad():
            for layer in (self.stem, self.trunk, self.head):
                fan_in = layer.weight[0].numel()
                layer.weight.normal_(0.0, (2.0 / fan_in) ** 0.5, generator=generator)
                if layer.bias is not None:
                    layer.bias.normal_(0.0, 0.1, generator=generator)
        self.eval()

    def forward(self, views: Mapping[str, Tensor], targets: Sequence[Any] | None = None) -> Mapping[str, Tensor]:
        """The outputs of a batch by name, or its `loss` if `targets` (the batch's samples) are given.

        Args:
            views: (B, 3, H, W) pictures in 0..1 by camera name.
            targets: the batch's samples; None for outputs.
        """
        pictures = views[VIEW]
        hidden = functional.relu(self.stem((pictures - 0.5) * 4))
        hidden = functional.relu(self.norm(self.trunk(hidden)))
        size = (pictures.shape[2], pictures.shape[3])
        raw = functional.interpolate(self.head(hidden), size=size, mode="bilinear", align_corners=False)
        return self.outputs(raw) if targets is None else {"loss": self.loss(raw, targets)}

    def module(self) -> nn.Module:
        """The torch module that `gear train` trains and saves: the network itself."""
        return self

    def taps(self) -> Mapping[str, nn.Module]:
        """The tapped layers `stem` and `trunk` (layers with readable feature maps)."""
        return {"stem": self.stem, "trunk": self.trunk}

    def predict(self, views: Mapping[str, UInt8Image]) -> Any:
        """The prediction for the pictures of one sample, in the form of the network's task.

        Args:
            views: (H, W, 3) uint8 pictures by camera name.
        """
        with torch.no_grad():
            return self.answer(self(as_batch([{VIEW: views[VIEW]}])))

    @abstractmethod
    def outputs(self, raw: Tensor) -> Mapping[str, Tensor]:
        """Converts the head's (B, C, H, W) map to the network's outputs by name.

        Args:
            raw: (B, C, H, W) output of the head.
        """

    @abstractmethod
    def loss(self, raw: Tensor, targets: Sequence[Any]) -> Tensor:
        """The scalar training loss from the head's (B, C, H, W) map and the batch's samples.

        Args:
            raw: (B, C, H, W) output of the head.
            targets: the B samples with their ground truth.
        """

    @abstractmethod
    def answer(self, outputs: Mapping[str, Tensor]) -> Any:
        """Converts the outputs of a batch of one sample to the task's prediction.

        Args:
            outputs: the outputs by name, with B = 1.
        """


class TinySegmenter(TinyNetwork):
    """A tiny semantic segmentation network with the output `logits`, (B, 34, H, W) over Cityscapes label ids."""

    def __init__(self, config: TinyConfig) -> None:
        """Makes the network with 34 channels.

        Args:
            config: the options.
        """
        super().__init__(config, LABEL_COUNT)

    def outputs(self, raw: Tensor) -> Mapping[str, Tensor]:
        """The output `logits`: the head's (B, 34, H, W) map.

        Args:
            raw: (B, 34, H, W) output of the head.
        """
        return {"logits": raw}

    def loss(self, raw: Tensor, targets: Sequence[Any]) -> Tensor:
        """The cross-entropy of the logits with each sample's `label_ids`.

        Args:
            raw: (B, C, H, W) output of the head.
            targets: the B samples with their ground truth.
        """
        labels = torch.from_numpy(np.stack([sample.label_ids for sample in targets])).long()
        return functional.cross_entropy(raw, labels)

    def answer(self, outputs: Mapping[str, Tensor]) -> npt.NDArray[np.uint8]:
        """The prediction for one sample: (H, W) uint8 label ids.

        Args:
            outputs: the outputs by name, with B = 1.
        """
        labels: npt.NDArray[np.uint8] = outputs["logits"][0].argmax(0).to(torch.uint8).numpy()
        return labels


class TinyDepth(TinyNetwork):
    """A tiny monocular depth network with the output `depth_m`, (B, H, W) in metres, above 0."""

    LEAST_M: ClassVar[float] = 0.1

    def __init__(self, config: TinyConfig) -> None:
        """Makes the network with one channel.

        Args:
            config: the options.
        """
        super().__init__(config, 1)

    def outputs(self, raw: Tensor) -> Mapping[str, Tensor]:
        """The output `depth_m`: (B, H, W) in metres, above 0.1 m.

        Args:
            raw: (B, 1, H, W) output of the head.
        """
        return {"depth_m": 10 * functional.softplus(raw[:, 0]) + self.LEAST_M}

    def loss(self, raw: Tensor, targets: Sequence[Any]) -> Tensor:
        """The mean absolute difference of log depth, over the pixels whose `depth_m` is known.

        Args:
            raw: (B, C, H, W) output of the head.
            targets: the B samples with their ground truth.
        """
        depth_m = torch.from_numpy(np.stack([sample.depth_m for sample in targets]))
        is_known = torch.isfinite(depth_m)
        known_m = torch.where(is_known, depth_m, torch.ones_like(depth_m))
        error = (self.outputs(raw)["depth_m"].log() - known_m.log()).abs()
        return (error * is_known).sum() / is_known.sum().clamp_min(1)

    def answer(self, outputs: Mapping[str, Tensor]) -> FloatImage:
        """The prediction for one sample: (H, W) float32 depth in metres.

        Args:
            outputs: the outputs by name, with B = 1.
        """
        depth_m: FloatImage = outputs["depth_m"][0].numpy()
        return depth_m


tiny_segmenter = ModelSpec(
    name="tiny_segmenter",
    summary="Three convolutions with random weights, for tests.",
    config=TinyConfig,
    build=TinySegmenter,
    tasks=("semseg",),
    views=(VIEW,),
    taps=("stem", "trunk"),
    recipe=Recipe(learning_rate=3e-3, batch=2, epochs=2),
)

tiny_depth = ModelSpec(
    name="tiny_depth",
    summary="Three convolutions with random weights, for tests.",
    config=TinyConfig,
    build=TinyDepth,
    tasks=("depth",),
    views=(VIEW,),
    taps=("stem", "trunk"),
    recipe=Recipe(learning_rate=3e-3, batch=2, epochs=2),
)
