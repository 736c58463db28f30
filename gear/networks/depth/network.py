"""The base class of gear's depth networks: it resizes pictures, and converts ground truth and predictions."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.networks.depth.options import DepthOptions
from gear.networks.network import Network
from gear.values.frames import FloatImage

VIEW = "left"
DEPTH = "depth_m"


class DepthNetwork(Network):
    """Base class of depth networks.

    The main output is `depth_m` (B, H, W): distance along the optical axis in metres, at the picture's size.

    Attributes:
        input_scale: factor by which pictures are resized before the network.
        multiple_px: the sides of the network's input are multiples of this number of pixels.
        least_px: smallest side of the network's input, pixels.
    """

    options: DepthOptions
    multiple_px: ClassVar[int] = 1
    least_px: ClassVar[int] = 1
    has_quick_copy = True

    def __init__(self, graph: nn.Module, options: DepthOptions, *, input_scale: float = 1.0) -> None:
        """Makes a gear network from the torch module of a depth network.

        Args:
            graph: torch module.
            options: options that the user gave.
            input_scale: factor by which pictures are resized, used if the options state none; plugins pass that of the
                weights.
        """
        super().__init__(graph, options, views=(VIEW,))
        self.input_scale = input_scale if options.input_scale is None else options.input_scale

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the network's outputs by name: `depth_m` (B, H, W), depth in metres at the picture's size, and
        the further outputs of `estimate`.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        picture = pictures[VIEW]
        height, width = (int(side) for side in picture.shape[2:])
        outputs = dict(self.estimate(resized(picture, self._seen(height), self._seen(width))))
        outputs[DEPTH] = resized(outputs[DEPTH][:, None].float(), height, width)[:, 0]
        return outputs

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Returns the scalar losses by name, computed from the network's outputs and the samples' ground truth
        `depth_m`.

        Args:
            outputs: result of `run_for_losses` for a batch of B samples, by name.
            targets: the B samples with their ground truth.
        """
        depth_m = torch.from_numpy(np.stack([target.depth_m for target in targets])).to(outputs[DEPTH])
        return self.depth_losses(outputs, depth_m)

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[FloatImage]:
        """Returns the predicted depth of each picture: (H, W) float32 in metres.

        Args:
            outputs: result of `run_for_predictions` for a batch of B pictures, by name.
            size_px: height and width of the pictures; not used.
        """
        return [depth_m.cpu().numpy() for depth_m in outputs[DEPTH]]

    def _seen(self, side_px: int) -> int:
        scaled_px = max(round(side_px * self.input_scale / self.multiple_px), 1) * self.multiple_px
        return max(scaled_px, self.least_px)

    @abstractmethod
    def estimate(self, picture: Tensor) -> Mapping[str, Tensor]:
        """Runs the graph (the torch module) on pictures; subclasses implement this method.

        Args:
            picture: (B, 3, H, W) in 0..1.

        Returns:
            `depth_m` (B, h, w) in metres, of any size, and further outputs that the losses need.
        """

    @abstractmethod
    def depth_losses(self, outputs: Mapping[str, Tensor], depth_m: Tensor) -> Mapping[str, Tensor]:
        """Computes the scalar losses by name; subclasses implement this method.

        Args:
            outputs: result of `run`, by name.
            depth_m: (B, H, W) true depth in metres, NaN where unknown.
        """


def resized(maps: Tensor, height: int, width: int) -> Tensor:
    """Resizes maps bilinearly, with anti-aliasing when reducing. Maps that have the size already are returned
    unchanged.

    Args:
        maps: (B, C, h, w), any values.
        height, width: size of the result.
    """
    if tuple(maps.shape[2:]) == (height, width):
        return maps
    # When enlarging, anti-aliasing changes nothing and costs time.
    is_less = height < maps.shape[2] or width < maps.shape[3]
    return functional.interpolate(maps, (height, width), mode="bilinear", align_corners=False, antialias=is_less)
