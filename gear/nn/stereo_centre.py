"""A siamese network with a correlation volume that finds objects in a rectified pair by their centres.

Both pictures go through the same first layers (stem and one stage of a ResNet-18); their features are correlated over
disparities at half the resolution (as DispNetC does, Mayer et al., CVPR 2016), and what comes out runs, with the left
features, through the remaining stages of the ResNet and a feature pyramid. Every cell of the finest level then says
whether an object's centre lies there and what the object is (CenterNet, Zhou et al., 2019; StereoCenterNet, Shi et al.,
2021; RTS3D, Li et al., AAAI 2021). Which way it faces is a distribution over directions (as in Mousavian et al., CVPR
2017): a car that may stand one way or the other is not taken to stand between them. The disparity of an object's centre
is the expectation of a distribution over bins with equal steps of its logarithm, plus a correction, with its own
uncertainty. No anchors, no boxes to be matched between the pictures; everything is differentiable to the pixels.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torch.nn import functional

KINDS = ("Car", "Van", "Truck", "Pedestrian", "Cyclist", "Misc")
"""KITTI's types, in the order of the channels of `heat`."""

STRIDE = 4
MULTIPLE = 32
MATCHING_STRIDE = 2
PRIOR_SIZE_M = (1.6, 1.8, 3.9)
HEADINGS = 24
"""Directions, evenly round the circle from 0 on, of which an observation angle is a distribution."""

PRIOR_HEAT = -4.6
"""A hundredth: what a cell says at first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoCentreShape:
    """How large the network is.

    Attributes:
        width: channels of the stem; the stages have 2, 4, 6 and 8 times as many.
        disparities: how many shifts are correlated, each of two pixels of the network's input.
        bins: of an object's disparity.
        disparity_px: smallest and largest disparity of an object's centre, in pixels of the network's input.
    """

    width: int = 32
    disparities: int = 32
    bins: int = 48
    disparity_px: tuple[float, float] = (1.5, 96.0)


class Block(nn.Module):
    """ResNet's basic block; its shortcut averages before it projects (ResNet-D, He et al., CVPR 2019)."""

    def __init__(self, inputs: int, outputs: int, stride: int) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(inputs, outputs, 3, stride, 1, bias=False)
        self.bn1 = nn.BatchNorm2d(outputs)
        self.conv2 = nn.Conv2d(outputs, outputs, 3, 1, 1, bias=False)
        self.bn2 = nn.BatchNorm2d(outputs)
        self.skip: nn.Module = nn.Identity()
        if stride != 1 or inputs != outputs:
            self.skip = nn.Sequential(nn.AvgPool2d(stride), _conv(inputs, outputs, 1))

    def forward(self, features: Tensor) -> Tensor:
        """(B, C, H, W) to (B, C', H / stride, W / stride)."""
        inner = functional.relu(self.bn1(self.conv1(features)))
        return functional.relu(self.bn2(self.conv2(inner)) + self.skip(features))


def _conv(inputs: int, outputs: int, size: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(
        nn.Conv2d(inputs, outputs, size, stride, size // 2, bias=False),
        nn.BatchNorm2d(outputs),
    )


def _conv_relu(inputs: int, outputs: int, size: int, stride: int = 1) -> nn.Sequential:
    return nn.Sequential(_conv(inputs, outputs, size, stride), nn.ReLU(inplace=True))


def _stage(inputs: int, outputs: int) -> nn.Sequential:
    return nn.Sequential(Block(inputs, outputs, 2), Block(outputs, outputs, 1))


def correlate(left: Tensor, right: Tensor, disparities: int) -> Tensor:
    """Cosine of the left features at x and the right ones at x - d.

    Args:
        left, right: (B, C, H, W) features of a rectified pair.
        disparities: d = 0 .. disparities - 1.

    Returns:
        (B, disparities, H, W); 0 where x - d lies outside. In float32, under autocast too: what lies between two
        disparities is in differences that bfloat16 does not have.
    """
    with torch.autocast(left.device.type, enabled=False):
        return _band(left.float(), right.float(), disparities)


def _band(left: Tensor, right: Tensor, disparities: int) -> Tensor:
    batch, channels, height, width = left.shape
    one = functional.normalize(left, dim=1).permute(0, 2, 3, 1).reshape(batch * height, width, channels)
    two = functional.normalize(right, dim=1).permute(0, 2, 1, 3).reshape(batch * height, channels, width)
    # All columns against all columns of a row is one product of matrices, of which a band is kept: faster than a
    # product for each shift. With one more column a row, the band's rows lie one apart in memory.
    all_pairs = functional.pad(torch.bmm(one, two), (disparities - 1, 1))
    rows, _, step = all_pairs.stride()
    band = all_pairs.as_strided((batch * height, width, disparities), (rows, width + disparities + step, step)).flip(2)
    return band.reshape(batch, height, width, disparities).permute(0, 3, 1, 2)


class Head(nn.Module):
    """One hidden layer and one number a channel and cell."""

    def __init__(self, inputs: int, hidden: int, outputs: int) -> None:
        super().__init__()
        self.hidden = _conv_relu(inputs, hidden, 3)
        self.out = nn.Conv2d(hidden, outputs, 1)
        nn.init.normal_(self.out.weight, std=0.01)
        self.start_at(0.0)

    def start_at(self, value: float) -> None:
        """What it says of everything before it has learnt anything."""
        assert self.out.bias is not None
        nn.init.constant_(self.out.bias, value)

    def forward(self, features: Tensor) -> Tensor:
        """(B, C, h, w) to (B, outputs, h, w)."""
        raw: Tensor = self.out(self.hidden(features))
        return raw


class StereoCentre(nn.Module):
    """The graph: two normalised pictures in, one map an output name."""

    log_bins: Tensor

    def __init__(self, shape: StereoCentreShape) -> None:
        super().__init__()
        width = shape.width
        stages = [width * factor for factor in (2, 4, 6, 8)]
        pyramid = 3 * width
        self.shape = shape
        self.stem = nn.Sequential(_conv_relu(3, width, 3, 2), _conv_relu(width, width, 3))
        self.layer1 = _stage(width, stages[0])
        self.match_fine = nn.Conv2d(width, width, 1)
        self.match_coarse = nn.Conv2d(stages[0], width, 1)
        self.match = nn.Sequential(_conv_relu(width, width, 3), nn.Conv2d(width, width, 1))
        self.volume = nn.Sequential(_conv_relu(shape.disparities, 2 * width, 3, 2), _conv_relu(2 * width, 2 * width, 3))
        self.surface = nn.Conv2d(2 * width, shape.bins, 1)
        self.fuse = _conv_relu(stages[0] + 2 * width, stages[0], 1)
        self.layer2 = _stage(stages[0], stages[1])
        self.layer3 = _stage(stages[1], stages[2])
        self.layer4 = _stage(stages[2], stages[3])
        self.lateral = nn.ModuleList(nn.Conv2d(channels, pyramid, 1) for channels in stages)
        self.smooth = nn.ModuleList(_conv_relu(pyramid, pyramid, 3) for _ in stages[:-1])
        self.heat = Head(pyramid, pyramid, len(KINDS))
        self.place = Head(pyramid, pyramid, 6)
        self.body = Head(pyramid, pyramid, 3 + HEADINGS + 1)
        self.disparity = Head(pyramid + 2 * width, pyramid, shape.bins + 2)
        self.heat.start_at(PRIOR_HEAT)
        nearest, farthest = (math.log(value) for value in shape.disparity_px)
        self.register_buffer("log_bins", torch.linspace(nearest, farthest, shape.bins), persistent=False)

    def features(self, pictures: Tensor) -> tuple[Tensor, Tensor]:
        """Features of single pictures at stride 4, and those to be matched at stride 2."""
        fine = self.stem(pictures)
        coarse = self.layer1(fine)
        up = functional.interpolate(self.match_coarse(coarse), scale_factor=2, mode="bilinear", align_corners=False)
        return coarse, self.match(self.match_fine(fine) + up)

    def forward(self, left: Tensor, right: Tensor) -> dict[str, Tensor]:
        """Maps of (B, ..., H / 4, W / 4); lengths are in pixels of the pictures given.

        Args:
            left, right: (B, 3, H, W), H and W multiples of 32.

        Returns:
            `heat`: logits, a channel a kind of `KINDS`.
            `sides_px`: 4, above 0, from the cell to the left, top, right and bottom of the object's box.
            `centre_px`: 2, from the cell to where the middle of the object in space is seen, x and y.
            `size_m`: 3, above 0, height, width and length.
            `heading_logits`: a channel a direction of `HEADINGS`, of the observation angle.
            `hidden`: 1, logit of the share that other things cover.
            `disparity_logits`: a channel a bin.
            `disparity_px`: 1, above 0, of the middle of the object in space.
            `surface_logits`: a channel a bin, of the disparity of what is seen in the cell, from the volume alone.
            `disparity_spread`: 1, logarithm of the mean absolute error expected of the disparity's logarithm.
        """
        coarse, matching = self.features(torch.cat([left, right]))
        left_features, right_features = matching.chunk(2)
        volume = self.volume(correlate(left_features, right_features, self.shape.disparities))
        stages = [self.fuse(torch.cat([coarse.chunk(2)[0], volume], dim=1))]
        for layer in (self.layer2, self.layer3, self.layer4):
            stages.append(layer(stages[-1]))
        level = self.lateral[3](stages[3])
        for index in (2, 1, 0):
            up = functional.interpolate(level, scale_factor=2, mode="nearest")
            level = self.smooth[index](self.lateral[index](stages[index]) + up)
        return {
            "heat": self.heat(level),
            **self._where(level),
            **self._disparity(torch.cat([level, volume], dim=1)),
            "surface_logits": self.surface(volume),
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

    def _disparity(self, features: Tensor) -> dict[str, Tensor]:
        raw = self.disparity(features).float()
        logits = raw[:, : self.shape.bins]
        expected = (logits.softmax(dim=1) * self.log_bins[:, None, None]).sum(dim=1, keepdim=True)
        return {
            "disparity_logits": logits,
            "disparity_px": (expected + raw[:, -2:-1]).exp(),
            "disparity_spread": raw[:, -1:].clamp(-6, 2),
        }


def _exp(raw: Tensor) -> Tensor:
    """exp within bounds that no real object leaves, so that no weights whatever give infinities."""
    return raw.clamp(-5, 5).exp()


def fit_to_network(picture: Tensor, scale: float) -> tuple[Tensor, tuple[float, float]]:
    """Shrinks (B, 3, H, W) pictures and pads them on the right and below to multiples of 32.

    Returns:
        The pictures, and how many pixels of the picture given one pixel of them is, in x and in y.
    """
    height, width = picture.shape[-2:]
    size = (max(1, round(height * scale)), max(1, round(width * scale)))
    if size != (height, width):
        picture = functional.interpolate(picture, size=size, mode="bilinear", align_corners=False, antialias=True)
    padding = (0, -size[1] % MULTIPLE, 0, -size[0] % MULTIPLE)
    return functional.pad(picture, padding), (width / size[1], height / size[0])


def in_picture_px(raw: Mapping[str, Tensor], ratio: tuple[float, float]) -> dict[str, Tensor]:
    """The graph's outputs with lengths in pixels of a picture `ratio` times as large, in x and y."""
    x, y = ratio
    factors = {"sides_px": (x, y, x, y), "centre_px": (x, y), "disparity_px": (x,)}
    return {
        name: tensor * tensor.new_tensor(factors[name])[:, None, None] if name in factors else tensor
        for name, tensor in raw.items()
    }
