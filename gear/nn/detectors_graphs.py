"""The detectors' graphs, under torchvision's key names."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Mapping
from functools import partial
from typing import Any

from torch import Tensor, nn

from gear.nn import vision
from gear.nn.detectors import OFFICIAL_CLASSES

TRAINABLE_STAGES = 3
"""Of the published detectors; the stem and the first stage stay as ImageNet left them."""

CHANNELS = 128
"""Of the reference detectors' pyramid and heads."""

GROUPS = 32

STRIDES_PX = (8, 16, 32, 64, 128)
ANCHOR_STRIDES = 1.5
"""Side of the smallest anchor of a feature map in its strides; the published networks have 4."""

OCTAVES = (1.0, 2 ** (1 / 3), 2 ** (2 / 3))
ASPECT_RATIOS = (0.5, 1.0, 2.0)
"""Height over width."""

LITE0 = "tf_efficientnet_lite0"
LITE0_STAGES = (2, 3, 4)
"""Those that end at 1/8, 1/16 and 1/32."""

LITE0_CHANNELS = (40, 112, 320)

LITE0_FROZEN = ("conv_stem", "bn1", "blocks.0", "blocks.1")
"""What stays as ImageNet left it: what looks at half and a quarter of the picture."""

LITE0_HEAD_DEPTH = 2
"""Convolutions in each of its heads; RetinaNet has four, in which CPUs would spend half of every step."""


def fasterrcnn_r50_fpn(least_score: float) -> nn.Module:
    """As published: FrozenBatchNorm2d with eps 0, 91 classes."""
    vision.need()
    from torchvision.models.detection import FasterRCNN
    from torchvision.models.detection._utils import overwrite_eps

    backbone = _official_backbone()
    graph: nn.Module = FasterRCNN(backbone, OFFICIAL_CLASSES, box_score_thresh=least_score)
    overwrite_eps(graph, 0.0)
    return graph


def retinanet_r50_fpn(least_score: float) -> nn.Module:
    """As published: FrozenBatchNorm2d with eps 0, 91 classes."""
    vision.need()
    from torchvision.models.detection import RetinaNet
    from torchvision.models.detection._utils import overwrite_eps
    from torchvision.ops.feature_pyramid_network import LastLevelP6P7

    backbone = _official_backbone(returned_layers=[2, 3, 4], extra_blocks=LastLevelP6P7(256, 256))
    graph: nn.Module = RetinaNet(backbone, OFFICIAL_CLASSES, score_thresh=least_score)
    overwrite_eps(graph, 0.0)
    return graph


def retinanet_r18_fpn(classes: int, least_score: float) -> nn.Module:
    """ResNet-18, trainable throughout; see `reference_retinanet`."""
    vision.need()
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
    return reference_retinanet(backbone, classes, least_score)


def retinanet_lite0_fpn(classes: int, least_score: float) -> nn.Module:
    """EfficientNet-Lite0, trainable throughout; see `reference_retinanet`."""
    graph = reference_retinanet(LitePyramid(), classes, least_score)
    heads: Any = graph.head
    for head in (heads.classification_head, heads.regression_head):
        head.conv = head.conv[:LITE0_HEAD_DEPTH]
    return graph


def reference_retinanet(backbone: nn.Module, classes: int, least_score: float) -> nn.Module:
    """torchvision's RetinaNet with narrower heads that are normalised by groups, and smaller anchors.

    The network looks at pictures at about half their size, where a person of 32 pixels is 16 high and 6 wide.
    """
    vision.need()
    from torchvision.models.detection import RetinaNet
    from torchvision.models.detection.anchor_utils import AnchorGenerator
    from torchvision.models.detection.retinanet import RetinaNetHead

    sizes = tuple(tuple(round(ANCHOR_STRIDES * stride * octave) for octave in OCTAVES) for stride in STRIDES_PX)
    anchors = AnchorGenerator(sizes, (ASPECT_RATIOS,) * len(sizes))
    head = RetinaNetHead(
        CHANNELS, anchors.num_anchors_per_location()[0], classes, norm_layer=partial(nn.GroupNorm, GROUPS)
    )
    graph: nn.Module = RetinaNet(
        backbone, classes, anchor_generator=anchors, head=head, score_thresh=least_score, detections_per_img=100
    )
    return graph


class LitePyramid(nn.Module):
    """EfficientNet-Lite0 (timm's) with a feature pyramid, as torchvision's `BackboneWithFPN`."""

    out_channels = CHANNELS

    def __init__(self) -> None:
        vision.need()
        import timm
        from torchvision.ops import FeaturePyramidNetwork
        from torchvision.ops.feature_pyramid_network import LastLevelP6P7

        super().__init__()
        self.body = timm.create_model(LITE0, pretrained=False, features_only=True, out_indices=LITE0_STAGES)
        extra = LastLevelP6P7(CHANNELS, CHANNELS)
        self.fpn = FeaturePyramidNetwork(LITE0_CHANNELS, CHANNELS, extra_blocks=extra)
        self.is_frozen = False

    def freeze(self) -> None:
        """Keeps the early layers' weights, and ImageNet's statistics throughout the body, from here on.

        Detectors train in small batches, whose statistics are worse than those that the body comes with.
        """
        self.is_frozen = True
        for key, parameter in self.body.named_parameters():
            if key.startswith(tuple(f"{part}." for part in LITE0_FROZEN)):
                parameter.requires_grad_(False)
        self.train(self.training)

    def train(self, mode: bool = True) -> LitePyramid:
        """As ever, but normalisation in a frozen body stays in eval mode."""
        super().train(mode)
        if self.is_frozen:
            for layer in self.body.modules():
                if isinstance(layer, nn.BatchNorm2d):
                    layer.eval()
        return self

    def forward(self, pictures: Tensor) -> Mapping[str, Tensor]:
        """Feature maps by number."""
        maps: Mapping[str, Tensor] = self.fpn(OrderedDict((str(i), each) for i, each in enumerate(self.body(pictures))))
        return maps


def _official_backbone(**levels: Any) -> nn.Module:
    from torchvision.models import resnet50
    from torchvision.models.detection.backbone_utils import _resnet_fpn_extractor
    from torchvision.ops import FrozenBatchNorm2d

    body = resnet50(weights=None, norm_layer=FrozenBatchNorm2d)
    backbone: nn.Module = _resnet_fpn_extractor(body, TRAINABLE_STAGES, **levels)
    return backbone
