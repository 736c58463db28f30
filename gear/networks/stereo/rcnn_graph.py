"""The torch module of Stereo R-CNN (Li, Chen, Shen, CVPR 2019), with its authors' parameter names.

A ResNet-101 with a feature pyramid processes each picture. A region proposal network reads both pyramids and proposes
pairs of boxes. The second stage predicts for each pair a class, a refined pair, size and heading. From the left box it
also predicts which ground corner of the car is visible between the sides of the box, and the columns in which the car
is not occluded.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.networks.stereo.legacy_boxes import sides
from gear.networks.torchvision_ops import roi_align

RATIOS = (0.5, 1.0, 2.0)
ANCHOR_SIDES = (32, 64, 128, 256, 512)
STRIDES = (4, 8, 16, 32, 64)
POOLED = 7
KEYPOINT_CELLS = 28
"""Number of columns into which a box is divided; the position of a keypoint is predicted as one of these columns."""

CORNERS = 4
LEVEL_AT_SIDE = 224.0
LOSSES = ("rpn_class", "rpn_boxes", "class", "boxes", "size_and_direction", "keypoints")
FIRST_LOG_VARIANCE = -1.0
VARIANCES = "loss_log_variances"


@dataclass(frozen=True, slots=True, kw_only=True)
class StereoRcnnShape:
    """Numbers that determine the size of Stereo R-CNN; the defaults are the authors' values.

    Attributes:
        blocks: number of blocks in each of the four stages.
        width: number of channels of the stem; the stages have 4, 8, 16 and 32 times as many.
        pyramid, proposals, hidden: numbers of channels of the pyramid, the proposal network and the second stage.
        classes: number of classes, background included.
    """

    blocks: tuple[int, int, int, int] = (3, 4, 23, 3)
    width: int = 64
    pyramid: int = 256
    proposals: int = 512
    hidden: int = 2048
    classes: int = 2


class Bottleneck(nn.Module):
    """Bottleneck residual block of ResNet as in Caffe: the first convolution, not the second one, has the stride.

    Args:
        inputs: number of input channels.
        width: number of channels inside the block; the output has four times as many.
        stride: stride of the block.
    """

    def __init__(self, inputs: int, width: int, stride: int) -> None:
        super().__init__()
        self.conv1 = nn.Conv2d(inputs, width, 1, stride, bias=False)
        self.bn1 = nn.BatchNorm2d(width)
        self.conv2 = nn.Conv2d(width, width, 3, 1, 1, bias=False)
        self.bn2 = nn.BatchNorm2d(width)
        self.conv3 = nn.Conv2d(width, 4 * width, 1, bias=False)
        self.bn3 = nn.BatchNorm2d(4 * width)
        self.downsample: nn.Sequential | None = None
        if stride != 1 or inputs != 4 * width:
            self.downsample = nn.Sequential(
                nn.Conv2d(inputs, 4 * width, 1, stride, bias=False), nn.BatchNorm2d(4 * width)
            )

    def forward(self, features: Tensor) -> Tensor:
        """Converts `features` (B, inputs, H, W) to (B, 4 width, H / stride, W / stride)."""
        inner = functional.relu(self.bn1(self.conv1(features)))
        inner = functional.relu(self.bn2(self.conv2(inner)))
        past = features if self.downsample is None else self.downsample(features)
        return functional.relu(self.bn3(self.conv3(inner)) + past)


def _stage(inputs: int, width: int, blocks: int, stride: int) -> nn.Sequential:
    first = Bottleneck(inputs, width, stride)
    return nn.Sequential(nn.Sequential(first, *(Bottleneck(4 * width, width, 1) for _ in range(blocks - 1))))


class StereoRpn(nn.Module):
    """The region proposal network of Stereo R-CNN; it reads the feature pyramids of both pictures.

    Args:
        inputs: number of channels of the pyramids.
        hidden: number of channels of its convolution.
    """

    def __init__(self, inputs: int, hidden: int) -> None:
        super().__init__()
        self.RPN_Conv = nn.Conv2d(inputs, hidden, 3, 1, 1)
        self.RPN_cls_score = nn.Conv2d(2 * hidden, 2 * len(RATIOS), 1)
        self.RPN_bbox_pred_left_right = nn.Conv2d(2 * hidden, 6 * len(RATIOS), 1)

    def forward(self, left: Sequence[Tensor], right: Sequence[Tensor]) -> tuple[Tensor, Tensor, Tensor]:
        """Predicts logits (B, A, 2), objectness (B, A) in 0..1, and codes of box pairs (B, A, 6), for A anchors.

        The authors' softmax pairs channel c with channel c + 3, although anchor a was trained with channels 2 a and 2 a
        + 1. The published weights rely on this pairing, so this module ranks proposals by the same objectness.

        Args:
            left, right: feature maps P2 to P6 of the left and of the right pictures.
        """
        logits, chances, codes = [], [], []
        for one, two in zip(left, right, strict=True):
            both = functional.relu(torch.cat([self.RPN_Conv(one), self.RPN_Conv(two)], dim=1))
            score = self.RPN_cls_score(both)
            batch, channels, height, width = score.shape
            paired = score.view(batch, 2, channels // 2, height, width).softmax(dim=1).view_as(score)
            logits.append(score.permute(0, 2, 3, 1).reshape(batch, -1, 2))
            chances.append(paired[:, 1::2].permute(0, 2, 3, 1).reshape(batch, -1))
            codes.append(self.RPN_bbox_pred_left_right(both).permute(0, 2, 3, 1).reshape(batch, -1, 6))
        return torch.cat(logits, dim=1), torch.cat(chances, dim=1), torch.cat(codes, dim=1)


class StereoRcnn(nn.Module):
    """The whole torch module of Stereo R-CNN. As in the authors' training, batch normalisation and the first two
    stages are never trained.

    Args:
        shape: size of the network.
    """

    def __init__(self, shape: StereoRcnnShape) -> None:
        super().__init__()
        width, pyramid, hidden = shape.width, shape.pyramid, shape.hidden
        self.shape = shape
        self.RCNN_layer0 = nn.Sequential(
            nn.Conv2d(3, width, 7, 2, 3, bias=False),
            nn.BatchNorm2d(width),
            nn.ReLU(inplace=True),
            nn.MaxPool2d(3, 2, 0, ceil_mode=True),
        )
        self.RCNN_layer1 = _stage(width, width, shape.blocks[0], 1)
        self.RCNN_layer2 = _stage(4 * width, 2 * width, shape.blocks[1], 2)
        self.RCNN_layer3 = _stage(8 * width, 4 * width, shape.blocks[2], 2)
        self.RCNN_layer4 = _stage(16 * width, 8 * width, shape.blocks[3], 2)
        self.RCNN_toplayer = nn.Conv2d(32 * width, pyramid, 1)
        self.RCNN_smooth1 = nn.Conv2d(pyramid, pyramid, 3, 1, 1)
        self.RCNN_smooth2 = nn.Conv2d(pyramid, pyramid, 3, 1, 1)
        self.RCNN_smooth3 = nn.Conv2d(pyramid, pyramid, 3, 1, 1)
        self.RCNN_latlayer1 = nn.Conv2d(16 * width, pyramid, 1)
        self.RCNN_latlayer2 = nn.Conv2d(8 * width, pyramid, 1)
        self.RCNN_latlayer3 = nn.Conv2d(4 * width, pyramid, 1)
        self.RCNN_rpn = StereoRpn(pyramid, shape.proposals)
        self.RCNN_top = nn.Sequential(
            nn.Conv2d(2 * pyramid, hidden, POOLED, POOLED),
            nn.ReLU(inplace=True),
            nn.Dropout(0.2),
            nn.Conv2d(hidden, hidden, 1),
            nn.ReLU(inplace=True),
            nn.Dropout(0.2),
        )
        layers: list[nn.Module] = []
        for _ in range(6):
            layers += [nn.Conv2d(pyramid, pyramid, 3, 1, 1), nn.ReLU(inplace=True)]
        self.RCNN_kpts = nn.Sequential(*layers, nn.ConvTranspose2d(pyramid, pyramid, 2, 2), nn.ReLU(inplace=True))
        self.RCNN_cls_score = nn.Linear(hidden, shape.classes)
        self.RCNN_bbox_pred = nn.Linear(hidden, 6 * shape.classes)
        self.RCNN_dim_orien_pred = nn.Linear(hidden, 5 * shape.classes)
        self.kpts_class = nn.Conv2d(pyramid, CORNERS + 2, 1)
        self.loss_log_variances = nn.Parameter(torch.full((len(LOSSES),), FIRST_LOG_VARIANCE))
        self.register_load_state_dict_pre_hook(_complete)  # type: ignore[no-untyped-call]
        self._draw_weights()
        self._freeze()

    def _draw_weights(self) -> None:
        """Initialises the layers as the authors do."""
        small = [self.RCNN_toplayer, self.RCNN_smooth1, self.RCNN_smooth2, self.RCNN_smooth3, self.RCNN_latlayer1]
        small += [self.RCNN_latlayer2, self.RCNN_latlayer3, *self.RCNN_rpn.children()]  # type: ignore[list-item]
        layers: list[tuple[nn.Module, float]] = [(layer, 0.01) for layer in small]
        layers += [(self.RCNN_cls_score, 0.01), (self.RCNN_bbox_pred, 0.001), (self.RCNN_dim_orien_pred, 0.001)]
        layers += [(layer, 0.02) for layer in (*self.RCNN_top, *self.RCNN_kpts) if hasattr(layer, "weight")]
        for layer, deviation in [*layers, (self.kpts_class, 0.1)]:
            assert isinstance(layer.weight, Tensor) and isinstance(layer.bias, Tensor)
            nn.init.normal_(layer.weight, std=deviation)
            nn.init.zeros_(layer.bias)

    def _freeze(self) -> None:
        for module in (self.RCNN_layer0, self.RCNN_layer1, *(m for m in self.modules() if is_norm(m))):
            for parameter in module.parameters():
                parameter.requires_grad_(False)

    def train(self, mode: bool = True) -> StereoRcnn:
        """Sets the mode of all layers except batch normalisation, which stays in eval mode.

        Args:
            mode: whether the other layers are set to training mode.
        """
        super().train(mode)
        for module in self.modules():
            if is_norm(module):
                module.train(False)
        return self

    def pyramid(self, pictures: Tensor) -> list[Tensor]:
        """Computes the feature pyramid of pictures.

        Args:
            pictures: (B, 3, H, W) pictures, channels in the order BGR, values in 0..255 minus
                `gear.networks.stereo.rcnn_network.MEAN_BGR`.

        Returns:
            The feature maps P2 to P6, the finest first: (B, C, H / s, W / s) for the strides s = 4, 8, 16, 32 and 64.
        """
        stages = [self.RCNN_layer0(pictures)]
        for layer in (self.RCNN_layer1, self.RCNN_layer2, self.RCNN_layer3, self.RCNN_layer4):
            stages.append(layer(stages[-1]))
        levels = [self.RCNN_toplayer(stages[4])]
        steps = (
            (self.RCNN_latlayer1, self.RCNN_smooth1, stages[3]),
            (self.RCNN_latlayer2, self.RCNN_smooth2, stages[2]),
            (self.RCNN_latlayer3, self.RCNN_smooth3, stages[1]),
        )
        for lateral, smooth, stage in steps:
            size = stage.shape[-2:]
            up = functional.interpolate(levels[0], size=size, mode="bilinear", align_corners=False)
            levels.insert(0, smooth(up + lateral(stage)))
        return [*levels, levels[-1][:, :, ::2, ::2]]

    def regions(
        self, left: Sequence[Tensor], right: Sequence[Tensor], pairs: tuple[Tensor, Tensor], height_px: int
    ) -> dict[str, Tensor]:
        """Computes the outputs of the second stage for R pairs of boxes in one picture.

        Args:
            left, right: levels P2 .. P5 of the pyramids, for a batch of one.
            pairs: (R, 4) left and (R, 4) right boxes in pixels of the network's input.
            height_px: height of the network's input.

        Returns:
            `class_logits` (R, K); `box_codes` (R, K, 6); `size_and_direction` (R, K, 5): encoded width, height, length,
            sine and cosine; `keypoint_logits` (R, 4, 28); `border_logits` (R, 2, 28): left and right.
        """
        both = [pooled(left, pairs[0], POOLED, height_px), pooled(right, pairs[1], POOLED, height_px)]
        flat = self.RCNN_top(torch.cat(both, dim=1)).mean(dim=(2, 3))
        dense = self.RCNN_kpts(pooled(left, pairs[0], 2 * POOLED, height_px))
        columns = self.kpts_class(dense).sum(dim=2)
        return {
            "class_logits": self.RCNN_cls_score(flat),
            "box_codes": self.RCNN_bbox_pred(flat).unflatten(1, (-1, 6)),
            "size_and_direction": self.RCNN_dim_orien_pred(flat).unflatten(1, (-1, 5)),
            "keypoint_logits": columns[:, :CORNERS],
            "border_logits": columns[:, CORNERS:],
        }


def _complete(module: nn.Module, state: dict[str, Any], prefix: str, *_: Any) -> None:
    """Adds the variances of the losses to a published state, because the authors store them outside the network."""
    assert isinstance(module, StereoRcnn)
    state.setdefault(f"{prefix}{VARIANCES}", module.loss_log_variances.detach())


def is_norm(module: nn.Module) -> bool:
    """Returns whether a layer is a batch normalisation layer.

    Args:
        module: any torch module.
    """
    return isinstance(module, nn.BatchNorm2d)


def pooled(levels: Sequence[Tensor], boxes: Tensor, cells: int, height_px: int) -> Tensor:
    """The (R, C, cells, cells) features of R boxes; each box is pooled from the pyramid level that suits its size.

    The level is 4 + ln(side / 224), rounded. The authors use the natural logarithm here, although the paper on feature
    pyramids has the logarithm to base 2.

    Args:
        levels: levels P2 .. P5 of a pyramid, for a batch of one.
        boxes: (R, 4) in pixels of the network's input.
        cells: number of cells on each side of the grid.
        height_px: height of the network's input.
    """
    side = sides(boxes).prod(dim=1).sqrt()
    level = ((side / LEVEL_AT_SIDE).log() + 4).round().clamp(2, 5).long() - 2
    regions = torch.cat([boxes.new_zeros(len(boxes), 1), boxes], dim=1)
    parts, order = [], []
    for number, features in enumerate(levels):
        chosen = (level == number).nonzero()[:, 0]
        order.append(chosen)
        scale = features.shape[2] / height_px
        parts.append(roi_align(features, regions[chosen], scale, cells, cells, 0, False))
    return torch.cat(parts)[torch.cat(order).argsort()]


def anchors(levels: Sequence[Tensor]) -> Tensor:
    """The (A, 4) anchors in pixels of the network's input, in the order of the proposal network's outputs.

    Args:
        levels: feature maps P2 .. P6.
    """
    found = []
    for features, stride, side in zip(levels, STRIDES, ANCHOR_SIDES, strict=True):
        device = features.device
        ratio = torch.tensor(RATIOS, device=device).sqrt()
        half = torch.stack([side * ratio, side / ratio], dim=1) / 2
        y = torch.arange(features.shape[2], device=device) * stride
        x = torch.arange(features.shape[3], device=device) * stride
        middle = torch.stack([*torch.meshgrid(x, y, indexing="xy")], dim=-1).reshape(-1, 1, 2)
        found.append(torch.cat([middle - half, middle + half], dim=-1).reshape(-1, 4))
    return torch.cat(found)
