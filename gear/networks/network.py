"""The base class of gear's networks: a torch module that implements the `Model` protocol."""

from __future__ import annotations

import copy
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from typing import Any, ClassVar

import cv2
import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn

from gear.networks.fused_inference import KeptCopy, quick_copy
from gear.networks.options import NetworkOptions
from gear.networks.runtime import autocast, device_of, prepare
from gear.values.frames import UInt8Image

Run = Callable[[Mapping[str, Tensor]], Mapping[str, Tensor]]

IMAGENET_MEAN = (0.485, 0.456, 0.406)
IMAGENET_STD = (0.229, 0.224, 0.225)


class Network(nn.Module, ABC):
    """Base class of gear's networks: a torch module with its normalisation, losses and predictions.

    Attributes:
        graph: the torch module that computes the outputs, with the parameter names of the published weights.
        options: options that the user gave.
        device: torch device on which the graph runs.
        has_quick_copy: whether predictions on a CPU use a faster copy of the graph (`gear.networks.fused_inference`).
            True is allowed only if the output of each convolution goes to its normalisation and nowhere else.
    """

    has_quick_copy: ClassVar[bool] = False

    def __init__(self, graph: nn.Module, options: NetworkOptions, *, views: Sequence[str] = ("left",)) -> None:
        """Moves the network to the device of its options and sets it to eval mode.

        Args:
            graph: the torch module that computes the outputs.
            options: options that the user gave.
            views: names of the cameras whose pictures the network reads; pictures of other cameras are ignored.
        """
        super().__init__()
        prepare()
        self.graph = graph
        self.options = options
        self.device = device_of(options.device)
        self._views = tuple(views)
        self._quick: KeptCopy[Network] = KeptCopy()
        self.to(self.device)
        self.eval()

    def module(self) -> nn.Module:
        """The torch module of the network; weights files store its state dict."""
        return self.graph

    def forward(self, views: Mapping[str, Tensor], targets: Sequence[Any] | None = None) -> Mapping[str, Tensor]:
        """Runs the network on a batch of pictures, and computes the losses if `targets` are given.

        Args:
            views: (B, 3, H, W) pictures in 0..1 by camera, on any device.
            targets: the samples of the batch, with ground truth; None for outputs.

        Returns:
            Outputs by name, or scalar losses by name: float32 tensors on the network's device.
        """
        if targets is None:
            return self._outputs(self.run, views)
        return self.losses(self._outputs(self.run_for_losses, views), targets)

    def _outputs(self, run: Run, views: Mapping[str, Tensor]) -> dict[str, Tensor]:
        pictures = {name: views[name].to(self.device) for name in self._views}
        with autocast(self.device, self.options.precision):
            raw = run(pictures)
        return {name: tensor.float() for name, tensor in raw.items()}

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules, by name, whose outputs are feature maps that defenses and attacks read; none by default."""
        return {}

    def predict(self, views: Mapping[str, UInt8Image]) -> Any:
        """Returns the prediction for one sample, in the form that the task defines.

        Args:
            views: (H, W, 3) uint8 pictures of the sample by camera name.
        """
        return self.predict_many([views])[0]

    def predict_many(self, samples: Sequence[Mapping[str, UInt8Image]]) -> list[Any]:
        """Returns the predictions for several samples, in their order. Pictures of equal size go through the graph
        as one batch.

        Args:
            samples: (H, W, 3) uint8 pictures by camera name, one mapping per sample.
        """
        sizes = [sample[self._views[0]].shape[:2] for sample in samples]
        answers: list[Any] = [None] * len(samples)
        for size in dict.fromkeys(sizes):
            chosen = [index for index, other in enumerate(sizes) if other == size]
            with torch.inference_mode():
                batch = as_batch([samples[index] for index in chosen], self._views, self.device)
                quick = self.for_predictions(batch)
                outputs = quick._outputs(quick.run_for_predictions, batch)
                for index, answer in zip(chosen, self.predictions(outputs, size), strict=True):
                    answers[index] = answer
        return answers

    def for_predictions(self, batch: Mapping[str, Tensor]) -> Network:
        """Returns the network to use for predictions: on a CPU an equivalent with a faster copy of the graph,
        otherwise itself.

        Predictions are the same up to rounding.

        Args:
            batch: (B, 3, H, W) pictures in 0..1 by camera; a new copy is traced with the first sample.
        """
        if not self.has_quick_copy or self.device.type != "cpu":
            return self
        first = {name: pictures[:1] for name, pictures in batch.items()}
        return (
            self._quick.of(self.graph, lambda: self._with(quick_copy(self.graph, lambda g: self._with(g)(first))))
            or self
        )

    def _with(self, graph: nn.Module) -> Network:
        """This network with another graph; all other attributes are shared."""
        other = copy.copy(self)
        other._modules = self._modules | {"graph": graph}
        return other

    @abstractmethod
    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the outputs by name, float tensors with the batch as first dimension; subclasses implement this.

        Args:
            pictures: (B, 3, H, W) pictures by camera name, float in 0..1, on the network's device.
        """

    def run_for_losses(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the input of `losses`: the outputs, and further tensors of networks with heads that only
        training uses.

        Args:
            pictures: (B, 3, H, W) pictures by camera name, float in 0..1, on the network's device.
        """
        return self.run(pictures)

    def run_for_predictions(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the input of `predictions`: the outputs, or a smaller intermediate result for networks that
        predict faster from it.

        Args:
            pictures: (B, 3, H, W) pictures by camera name, float in 0..1, on the network's device.
        """
        return self.run(pictures)

    @abstractmethod
    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Scalar losses by name; training minimises their sum. Subclasses implement this.

        Args:
            outputs: result of `run_for_losses` for a batch of B samples, by name.
            targets: the B samples with their ground truth.
        """

    @abstractmethod
    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[Any]:
        """Converts the result of `run_for_predictions` to one prediction for each picture, in the form that the
        task defines; subclasses implement this.

        Args:
            outputs: result of `run_for_predictions`.
            size_px: height and width of the pictures.
        """


class Normalise(nn.Module):
    """A layer that computes (x - mean) / std for each channel; mean and std are not part of the saved weights.

    Args:
        mean, std: mean and standard deviation of the three channels of pictures in 0..1.
    """

    mean: Tensor
    std: Tensor

    def __init__(self, mean: Sequence[float] = IMAGENET_MEAN, std: Sequence[float] = IMAGENET_STD) -> None:
        super().__init__()
        self.register_buffer("mean", torch.tensor(mean).view(1, -1, 1, 1), persistent=False)
        self.register_buffer("std", torch.tensor(std).view(1, -1, 1, 1), persistent=False)

    def forward(self, pictures: Tensor) -> Tensor:
        """Returns normalised pictures.

        Args:
            pictures: (B, 3, H, W) in 0..1.
        """
        return (pictures - self.mean) / self.std


def as_batch(
    samples: Sequence[Mapping[str, UInt8Image]], views: Sequence[str], device: torch.device | None = None
) -> dict[str, Tensor]:
    """Stacks pictures of one size into the input of `Model.forward`: (B, 3, H, W) float32 in 0..1 by camera name.

    If `device` is not None, the pictures are copied to this device as bytes and converted to float32 there.

    Args:
        samples: (H, W, 3) uint8 pictures by camera name, one mapping per sample.
        views: names of the cameras.
        device: device of the batch; None for the CPU.
    """
    stacked = {name: _channels_first([sample[name] for sample in samples]) for name in views}
    return {name: torch.from_numpy(one).to(device).float().div_(255) for name, one in stacked.items()}


def _channels_first(pictures: Sequence[UInt8Image]) -> npt.NDArray[np.uint8]:
    """(B, 3, H, W) uint8, contiguous in this order, because torch's CPU backward pass of small strided
    convolutions fails with channels last.
    """
    height, width, channels = size = pictures[0].shape
    stacked = np.empty((len(pictures), channels, height, width), np.uint8)
    for planes, picture in zip(stacked, pictures, strict=True):
        if picture.shape != size or picture.dtype != np.uint8:  # otherwise OpenCV would not write into `planes`
            raise ValueError(f"a batch has uint8 pictures of one size: {size} and {picture.dtype} {picture.shape}")
        cv2.split(picture, list(planes))
    return stacked
