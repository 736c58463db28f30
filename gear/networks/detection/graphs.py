"""The torch modules of the detectors, with the parameter names of torchvision."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from functools import partial
from typing import Any

import torch
from torch import Tensor, nn

from gear.networks import torchvision_import
from gear.networks.detection.network import OFFICIAL_CLASSES
from gear.networks.efficientnet_lite0 import CHANNELS as LITE0_CHANNELS
from gear.networks.efficientnet_lite0 import OnLite0, features_of_lite0

TRAINABLE_STAGES = 3
"""Number of trainable stages of the published detectors' backbone; its stem and its first stage keep their
ImageNet weights.
"""

CHANNELS = 128
"""Number of channels of the feature pyramid and the heads of gear's reference detectors."""

GROUPS = 32

STRIDES_PX = (8, 16, 32, 64, 128)
ANCHOR_STRIDES = 1.5
"""Side of the smallest anchor of a feature map, in strides of that map; the published networks use 4."""

OCTAVES = (1.0, 2 ** (1 / 3), 2 ** (2 / 3))
ASPECT_RATIOS = (0.5, 1.0, 2.0)
"""Aspect ratios of the anchors: height divided by width."""

LITE0_LEVELS = (2, 3, 4)
"""Levels of EfficientNet-Lite0 that feed the pyramid: the feature maps at 1/8, 1/16 and 1/32 (indices into
`gear.networks.efficientnet_lite0.LEVELS`).
"""

LITE0_TAPS = (1, 2, 4, 6)
"""Indices of the stages of EfficientNet-Lite0 at whose ends the feature maps have 1/4, 1/8, 1/16 and 1/32 of the sides
of the graph's input.
"""

LITE0_HEAD_DEPTH = 2
"""Number of convolutions in each head on EfficientNet-Lite0. RetinaNet's four would take half of the time of a
training step on a CPU.
"""


def fasterrcnn_r50_fpn(score_threshold: float) -> nn.Module:
    """Builds Faster R-CNN on ResNet-50 with a feature pyramid and random weights, as the published weights need
    it: FrozenBatchNorm2d with eps 0, 91 classes.

    Args:
        score_threshold: smallest score of a detection that is reported, 0..1.
    """
    torchvision_import.need()
    from torchvision.models.detection import FasterRCNN
    from torchvision.models.detection._utils import overwrite_eps

    backbone = _official_backbone()
    graph: nn.Module = FasterRCNN(backbone, OFFICIAL_CLASSES, box_score_thresh=score_threshold)
    overwrite_eps(graph, 0.0)
    return graph


def retinanet_r50_fpn(score_threshold: float) -> nn.Module:
    """Builds RetinaNet on ResNet-50 with a feature pyramid and random weights, as the published weights need it:
    FrozenBatchNorm2d with eps 0, 91 classes.

    Args:
        score_threshold: smallest score of a detection that is reported, 0..1.
    """
    torchvision_import.need()
    from torchvision.models.detection import RetinaNet
    from torchvision.models.detection._utils import overwrite_eps
    from torchvision.ops.feature_pyramid_network import LastLevelP6P7

    backbone = _official_backbone(returned_layers=[2, 3, 4], extra_blocks=LastLevelP6P7(256, 256))
    graph: nn.Module = RetinaNet(backbone, OFFICIAL_CLASSES, score_thresh=score_threshold)
    overwrite_eps(graph, 0.0)
    return graph


def retinanet_r18_fpn(classes: int, score_threshold: float) -> nn.Module:
    """Builds RetinaNet on ResNet-18 with random weights, all layers trainable, with narrow heads, group
    normalisation and small anchors (`reference_retinanet`).

    Args:
        classes: number of classes; there is no class for background.
        score_threshold: smallest score of a detection that is reported, 0..1.
    """
    torchvision_import.need()
    from torchvision.models import resnet18
    from torchvision.models.detection.backbone_utils import BackboneWithFPN
    from torchvision.ops.feature_pyramid_network import LastLevelP6P7

    backbone = BackboneWithFPN(
        resnet18(weights=None),
        return_layers={"layer2": "0", "layer3": "1", "layer4": "2"},
        in_channels_list=[128, 256, 512],
        out_channels=CHANNELS,
        extra_blocks=LastLevelP6P7(CHANNELS, CHANNELS),
    )
    return reference_retinanet(backbone, classes, score_threshold)


def retinanet_lite0_fpn(classes: int, score_threshold: float) -> nn.Module:
    """Builds RetinaNet on EfficientNet-Lite0 with random weights, all layers trainable, with narrow heads, group
    normalisation and small anchors (`reference_retinanet`).

    Args:
        classes: number of classes; there is no class for background.
        score_threshold: smallest score of a detection that is reported, 0..1.
    """
    graph = reference_retinanet(LitePyramid(), classes, score_threshold)
    heads: Any = graph.head
    for head in (heads.classification_head, heads.regression_head):
        head.conv = head.conv[:LITE0_HEAD_DEPTH]
    return graph


def reference_retinanet(backbone: nn.Module, classes: int, score_threshold: float) -> nn.Module:
    """Builds torchvision's RetinaNet with narrower heads, group normalisation and smaller anchors, and random
    weights.

    Anchors are small because the network receives pictures at about half their size: a person of 32 pixels height is
    then only 16 pixels high and 6 wide.

    Args:
        backbone: trunk with a feature pyramid of `CHANNELS` channels.
        classes: number of classes; there is no class for background.
        score_threshold: smallest score of a detection that is reported, 0..1.
    """
    torchvision_import.need()
    from torchvision.models.detection import RetinaNet
    from torchvision.models.detection.anchor_utils import AnchorGenerator
    from torchvision.models.detection.retinanet import RetinaNetHead

    sizes = tuple(tuple(round(ANCHOR_STRIDES * stride * octave) for octave in OCTAVES) for stride in STRIDES_PX)
    anchors = AnchorGenerator(sizes, (ASPECT_RATIOS,) * len(sizes))
    head = RetinaNetHead(
        CHANNELS, anchors.num_anchors_per_location()[0], classes, norm_layer=partial(nn.GroupNorm, GROUPS)
    )
    graph: nn.Module = RetinaNet(
        backbone, classes, anchor_generator=anchors, head=head, score_thresh=score_threshold, detections_per_img=100
    )
    return graph


class LitePyramid(OnLite0):
    """A backbone: EfficientNet-Lite0 with a feature pyramid. It takes the place of torchvision's `BackboneWithFPN`."""

    out_channels = CHANNELS

    def __init__(self) -> None:
        torchvision_import.need()
        from torchvision.ops import FeaturePyramidNetwork
        from torchvision.ops.feature_pyramid_network import LastLevelP6P7

        super().__init__()
        self.body = features_of_lite0(LITE0_LEVELS)
        channels = [LITE0_CHANNELS[level] for level in LITE0_LEVELS]
        self.fpn = FeaturePyramidNetwork(channels, CHANNELS, extra_blocks=LastLevelP6P7(CHANNELS, CHANNELS))

    def lite0(self) -> nn.Module:
        """The trunk, an EfficientNet-Lite0 whose outputs feed the pyramid."""
        return self.body

    def forward(self, pictures: Tensor) -> Mapping[str, Tensor]:
        """Returns the pyramid's feature maps by level, under torchvision's names, finest first.

        The maps are in channels-last memory format. In the default format, gradients of depth-wise convolutions take up
        to ten times as long on a CPU, and a whole training step takes a seventh longer.

        Args:
            pictures: (B, 3, H, W), normalised.
        """
        stages = self.body(pictures.contiguous(memory_format=torch.channels_last))
        maps: Mapping[str, Tensor] = self.fpn(OrderedDict((str(i), each) for i, each in enumerate(stages)))
        return maps


def lite_taps(graph: nn.Module) -> Mapping[str, nn.Module]:
    """Returns the ends of the trunk's stages by name, `layer1` (1/4 of the sides of the graph's input) to `layer4`
    (1/32).

    Args:
        graph: detector whose backbone is a `LitePyramid`.
    """
    blocks = graph.get_submodule("backbone.body.blocks")
    return {f"layer{i}": blocks.get_submodule(str(stage)) for i, stage in enumerate(LITE0_TAPS, start=1)}


def _official_backbone(**levels: Any) -> nn.Module:
    from torchvision.models import resnet50
    from torchvision.models.detection.backbone_utils import _resnet_fpn_extractor
    from torchvision.ops import FrozenBatchNorm2d

    body = resnet50(weights=None, norm_layer=FrozenBatchNorm2d)
    backbone: nn.Module = _resnet_fpn_extractor(body, TRAINABLE_STAGES, **levels)
    return backbone
