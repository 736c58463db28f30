"""Stereo networks that detect objects in a rectified pair of pictures by their centres.

Both pictures pass the same first layers of a trunk. Their features are correlated over disparities at half the
resolution (as in DispNetC, Mayer et al., CVPR 2016). The result passes, together with the left features, the trunk's
other layers and a feature pyramid. Each cell of the finest level then predicts whether the centre of an object lies in
it, and the properties of that object (CenterNet, Zhou et al., 2019; StereoCenterNet, Shi et al., 2021; RTS3D, Li et
al., AAAI 2021).

The heading is predicted as a distribution over directions (as in Mousavian et al., CVPR 2017). A network that confuses
front and rear of a car therefore predicts one of the two headings and not their mean. The disparity of an object's
centre is the expectation of a distribution over bins with equal steps of the disparity's logarithm, plus a correction,
with an uncertainty.

There are no anchors and no matching of boxes; all outputs are differentiable with respect to the pixels.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar

import torch
from torch import Tensor, nn
from torch.nn import functional

KINDS = ("Car", "Van", "Truck", "Pedestrian", "Cyclist", "Misc")
"""KITTI's object types that the networks detect, in the order of the channels of the output `heat`."""

STRIDE = 4
MULTIPLE = 32
MATCHING_STRIDE = 2
PRIOR_SIZE_M = (1.6, 1.8, 3.9)
HEADINGS = 24
"""Number of bins of the distribution over observation angles; bins are evenly spaced from 0."""

PRIOR_HEAT = -4.6
"""Logit of a centre in every cell before training; it is the logit of a probability of 0.01."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoCentreShape:
    """Numbers that determine the size of a centre-based stereo network.

    Attributes:
        width: number of channels of the matched features; the volume, the pyramid and the heads have multiples of it.
        disparities: number of correlated shifts; each is two pixels of the network's input.
        bins: number of bins of an object's disparity.
        disparity_px: smallest and largest disparity of an object's centre, in pixels of the network's input.
    """

    width: int = 32
    disparities: int = 32
    bins: int = 48
    disparity_px: tuple[float, float] = (1.5, 96.0)


def conv(inputs: int, outputs: int, size: int, stride: int = 1) -> nn.Sequential:
    """A layer: convolution without bias, then batch normalisation.

    Args:
        inputs, outputs: numbers of channels.
        size: side length of the kernel.
        stride: stride in both directions.
    """
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False),
        nn.BatchNorm2d(outputs),
    )


def conv_relu(inputs: int, outputs: int, size: int, stride: int = 1) -> nn.Sequential:
    """A layer: convolution without bias, batch normalisation, then ReLU.

    Args:
        inputs, outputs: numbers of channels.
        size: side length of the kernel.
        stride: stride in both directions.
    """
    return nn.Sequential(conv(inputs, outputs, size, stride), nn.ReLU(inplace=True))


def correlate(left: Tensor, right: Tensor, disparities: int) -> Tensor:
    """Computes the correlation volume: cosine similarity of the left features at column x and the right features
    at column x - d.

    Args:
        left, right: (B, C, H, W) features of a rectified pair.
        disparities: number of values of d, which are 0 .. disparities - 1.

    Returns:
        (B, disparities, H, W); 0 where x - d lies outside. The dtype is float32 also under autocast, because
        differences below one disparity step are smaller than the precision of bfloat16.
    """
    with torch.autocast(left.device.type, enabled=False):
        return _band(left.float(), right.float(), disparities)


def _band(left: Tensor, right: Tensor, disparities: int) -> Tensor:
    batch, channels, height, width = left.shape
    one = functional.normalize(left, dim=1).permute(0, 2, 3, 1).reshape(batch * height, width, channels)
    two = functional.normalize(right, dim=1).permute(0, 2, 1, 3).reshape(batch * height, channels, width)
    # One matrix product gives all pairs of columns in a row; only a band of it is kept. This is faster than one product
    # for each shift. One additional column per row makes each row of the band start one element later in memory.
    all_pairs = functional.pad(torch.bmm(one, two), (disparities - 1, 1))
    rows, _, step = all_pairs.stride()
    band = all_pairs.as_strided((batch * height, width, disparities), (rows, width + disparities + step, step)).flip(2)
    return band.reshape(batch, height, width, disparities).permute(0, 3, 1, 2)


class Head(nn.Module):
    """Output head: a hidden layer and an output layer, applied to each cell of a feature map.

    Args:
        inputs: number of input channels.
        hidden: number of channels of the hidden layer.
        outputs: number of output channels.
    """

    def __init__(self, inputs: int, hidden: int, outputs: int) -> None:
        super().__init__()
        self.hidden = conv_relu(inputs, hidden, 3)
        self.out = nn.Conv2d(hidden, outputs, 1)
        nn.init.normal_(self.out.weight, std=0.01)
        self.start_at(0.0)

    def start_at(self, value: float) -> None:
        """Sets the bias of the output layer, so that every output is about this value before training.

        Args:
            value: the bias.
        """
        assert self.out.bias is not None
        nn.init.constant_(self.out.bias, value)

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, h, w) to (B, outputs, h, w) output maps."""
        raw: Tensor = self.out(self.hidden(features))
        return raw


class CentreGraph(nn.Module, ABC):
    """Base class of the centre-based stereo networks' torch modules: matching, pyramid and heads. A subclass
    provides the trunk.

    The input are two normalised pictures, the output is a dictionary of maps.
    """

    log_bins: Tensor

    corrects_surface: ClassVar[bool] = False
    """Whether the network predicts the disparity of an object's centre as a correction of the disparity of the
    visible surface, which follows from the volume alone.
    """

    def __init__(self, shape: StereoCentreShape, channels: Sequence[int], pyramid: int) -> None:
        """Builds the matching layers, the pyramid and the heads; subclasses build the trunk.

        Args:
            shape: size of the network.
            channels: numbers of channels of the trunk's maps at 1/2 (both pictures) and at 1/4, 1/8, 1/16 and 1/32
                (left picture).
            pyramid: number of channels of the pyramid and the heads.
        """
        super().__init__()
        width, (fine, *stages) = shape.width, channels
        self.shape = shape
        self._add(self.shared_layers())
        self.match_fine = nn.Conv2d(fine, width, 1)
        self.match_coarse = nn.Conv2d(stages[0], width, 1)
        self.match = nn.Sequential(conv_relu(width, width, 3), nn.Conv2d(width, width, 1))
        self.volume = nn.Sequential(conv_relu(shape.disparities, 2 * width, 3, 2), conv_relu(2 * width, 2 * width, 3))
        self.surface = nn.Conv2d(2 * width, shape.bins, 1)
        self._add(self.left_layers())
        self.lateral = nn.ModuleList(nn.Conv2d(each, pyramid, 1) for each in stages)
        self.smooth = nn.ModuleList(conv_relu(pyramid, pyramid, 3) for _ in stages[:-1])
        self.heat = Head(pyramid, pyramid, len(KINDS))
        self.place = Head(pyramid, pyramid, 6)
        self.body = Head(pyramid, pyramid, 3 + HEADINGS + 1)
        self.disparity = Head(pyramid + 2 * width, pyramid, shape.bins + 2)
        self.heat.start_at(PRIOR_HEAT)
        nearest, farthest = (math.log(value) for value in shape.disparity_px)
        self.register_buffer("log_bins", torch.linspace(nearest, farthest, shape.bins), persistent=False)

    def _add(self, layers: Mapping[str, nn.Module]) -> None:
        for name, layer in layers.items():
            self.add_module(name, layer)

    @abstractmethod
    def shared_layers(self) -> Mapping[str, nn.Module]:
        """The trunk's layers that process both pictures, by key name.

        In the state dict these layers come before the layers of the correlation volume, and `left_layers` come after.
        This order is fixed, because hashes of weights depend on the order of the keys.
        """

    @abstractmethod
    def left_layers(self) -> Mapping[str, nn.Module]:
        """The trunk's layers after the correlation volume, by key name; they process the features of the left
        picture only.
        """

    @abstractmethod
    def shared(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Returns the feature maps of single pictures at stride 2, (B, C, H / 2, W / 2), and at stride 4, (B, C',
        H / 4, W / 4).

        Args:
            pictures: (B, 3, H, W), normalised; left and right pictures alike.
        """

    @abstractmethod
    def stages(self, coarse: Tensor, volume: Tensor) -> Sequence[Tensor]:
        """The trunk's feature maps of the left pictures at strides 4, 8, 16 and 32.

        Args:
            coarse: features of the left pictures at stride 4.
            volume: features of the correlation volume at stride 4.
        """

    def forward(self, left: Tensor, right: Tensor) -> dict[str, Tensor]:
        """Predicts maps (B, ..., H / 4, W / 4) by name; lengths are in pixels of the input pictures.

        Args:
            left, right: (B, 3, H, W), normalised; H and W are multiples of 32.

        Returns:
            `heat`: logits of centres, one channel for each of `KINDS`.
            `sides_px`: 4 channels above 0: distances from the cell to the left, top, right and bottom side of the
                object's 2D box.
            `centre_px`: 2 channels: x and y from the cell to the projection of the object's 3D centre.
            `size_m`: 3 channels above 0: height, width and length.
            `heading_logits`: one channel for each of `HEADINGS` directions of the observation angle.
            `hidden`: 1 channel: logit of the occluded share of the object.
            `disparity_logits`: one channel for each bin of the disparity.
            `disparity_px`: 1 channel above 0: disparity of the object's 3D centre.
            `surface_logits`: one channel for each bin: disparity of the visible surface, from the volume alone.
            `disparity_spread`: 1 channel: logarithm of the expected absolute error of the disparity's logarithm.
        """
        fine, coarse = self.shared(torch.cat([left, right]))
        up = functional.interpolate(self.match_coarse(coarse), scale_factor=2, mode="bilinear", align_corners=False)
        matching = self.match(self.match_fine(fine) + up)
        left_features, right_features = matching.chunk(2)
        volume = self.volume(correlate(left_features, right_features, self.shape.disparities))
        stages = self.stages(coarse.chunk(2)[0], volume)
        level = self.lateral[3](stages[3])
        for index in (2, 1, 0):
            up = functional.interpolate(level, scale_factor=2, mode="nearest")
            level = self.smooth[index](self.lateral[index](stages[index]) + up)
        surface = self.surface(volume)
        return {
            "heat": self.heat(level),
            **self._where(level),
            **self._disparity(torch.cat([level, volume], dim=1), surface),
            "surface_logits": surface,
        }

    def _where(self, level: Tensor) -> dict[str, Tensor]:
        place, body = self.place(level).float(), self.body(level).float()
        prior = body.new_tensor(PRIOR_SIZE_M)[:, None, None]
        return {
            "sides_px": 3 * STRIDE * _exp(place[:, :4]),
            "centre_px": STRIDE * place[:, 4:],
            "size_m": prior * _exp(body[:, :3]),
            "heading_logits": body[:, 3:-1],
            "hidden": body[:, -1:],
        }

    def _disparity(self, features: Tensor, surface: Tensor) -> dict[str, Tensor]:
        raw = self.disparity(features).float()
        logits = raw[:, : self.shape.bins]
        if self.corrects_surface:
            logits = logits + surface.float()
        expected = (logits.softmax(dim=1) * self.log_bins[:, None, None]).sum(dim=1, keepdim=True)
        return {
            "disparity_logits": logits,
            "disparity_px": (expected + raw[:, -2:-1]).exp(),
            "disparity_spread": raw[:, -1:].clamp(-6, 2),
        }


def _exp(raw: Tensor) -> Tensor:
    """exp with limits outside the range of real objects, so that no weights give infinite values."""
    return raw.clamp(-5, 5).exp()


def fit_to_network(picture: Tensor, scale: float) -> tuple[Tensor, tuple[float, float]]:
    """Converts pictures to the network's input: resized by `scale`, and padded at the right and the bottom to
    multiples of 32.

    Args:
        picture: (B, 3, H, W).
        scale: factor on H and W.

    Returns:
        The network's input (B, 3, h, w), and the size of one pixel of the input in pixels of `picture`, in x and in y.
    """
    height, width = picture.shape[-2:]
    size = (max(1, round(height * scale)), max(1, round(width * scale)))
    if size != (height, width):
        picture = functional.interpolate(picture, size=size, mode="bilinear", align_corners=False, antialias=True)
    padding = (0, -size[1] % MULTIPLE, 0, -size[0] % MULTIPLE)
    return functional.pad(picture, padding), (width / size[1], height / size[0])


def in_picture_px(raw: Mapping[str, Tensor], ratio: tuple[float, float]) -> dict[str, Tensor]:
    """Converts lengths in the graph's outputs from pixels of its input to pixels of the picture.

    Args:
        raw: result of `CentreGraph.forward`.
        ratio: size of a pixel of the input in pixels of the picture, in x and in y.

    Returns:
        The outputs by name; those that are no lengths in pixels are unchanged.
    """
    x, y = ratio
    factors = {"sides_px": (x, y, x, y), "centre_px": (x, y), "disparity_px": (x,)}
    return {
        name: tensor * tensor.new_tensor(factors[name])[:, None, None] if name in factors else tensor
        for name, tensor in raw.items()
    }
