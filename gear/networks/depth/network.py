"""What gear's depth networks share: the picture's size, ground truth, answers."""

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
    """A network that says `depth_m` (B, H, W), planar z in metres at the picture's size.

    Attributes:
        input_scale: share of the picture's size that the network sees.
        multiple_px: what the sides of the picture that the network sees are multiples of.
        least_px: as many pixels, at least, each of those sides has.
    """

    options: DepthOptions
    multiple_px: ClassVar[int] = 1
    least_px: ClassVar[int] = 1
    has_quick_copy = True

    def __init__(self, graph: nn.Module, options: DepthOptions, *, input_scale: float = 1.0) -> None:
        """Wraps a graph.

        Args:
            graph: as the network wants it.
            options: as given by the user.
            input_scale: used where the options leave it open.
        """
        super().__init__(graph, options, views=(VIEW,))
        self.input_scale = input_scale if options.input_scale is None else options.input_scale

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """`depth_m`, and what else the network says."""
        picture = pictures[VIEW]
        height, width = (int(side) for side in picture.shape[2:])
        outputs = dict(self.estimate(resized(picture, self._seen(height), self._seen(width))))
        outputs[DEPTH] = resized(outputs[DEPTH][:, None].float(), height, width)[:, 0]
        return outputs

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """The network's losses against the samples' `depth_m`."""
        depth_m = torch.from_numpy(np.stack([target.depth_m for target in targets])).to(outputs[DEPTH])
        return self.depth_losses(outputs, depth_m)

    def answers(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[FloatImage]:
        """(H, W) float32 metres each."""
        return [depth_m.cpu().numpy() for depth_m in outputs[DEPTH]]

    def _seen(self, side_px: int) -> int:
        scaled_px = max(round(side_px * self.input_scale / self.multiple_px), 1) * self.multiple_px
        return max(scaled_px, self.least_px)

    @abstractmethod
    def estimate(self, picture: Tensor) -> Mapping[str, Tensor]:
        """`depth_m` (B, h, w) of any size for a (B, 3, H, W) picture in 0..1, and what the losses need beside it."""

    @abstractmethod
    def depth_losses(self, outputs: Mapping[str, Tensor], depth_m: Tensor) -> Mapping[str, Tensor]:
        """Named losses against (B, H, W) metres, NaN where unknown."""


def resized(maps: Tensor, height: int, width: int) -> Tensor:
    """(B, C, H, W) at another size: bilinear, averaging where it becomes smaller. The same tensor at the same size."""
    if tuple(maps.shape[2:]) == (height, width):
        return maps
    is_less = height < maps.shape[2] or width < maps.shape[3]  # elsewhere there is nothing to average, only more to do
    return functional.interpolate(maps, (height, width), mode="bilinear", align_corners=False, antialias=is_less)
