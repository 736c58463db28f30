"""Faster R-CNN on EfficientNet-Lite0 with a feature pyramid: a two-stage detector that two CPU cores can train."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from torch import nn

from gear.networks import torchvision_import
from gear.networks.detection.fasterrcnn import FasterRcnnDetector
from gear.networks.detection.graphs import (
    ANCHOR_STRIDES,
    ASPECT_RATIOS,
    CHANNELS,
    OCTAVES,
    STRIDES_PX,
    LitePyramid,
    lite_taps,
)

MAPS = ("0", "1", "2", "p6", "p7")
"""Names that torchvision gives to the feature maps of `LitePyramid`, at 1/8 to 1/128 of the sides of the graph's
input.
"""

POOLED_MAPS = MAPS[:3]
"""Maps from which the features of proposals are pooled."""

POOLED_CELLS = 7
"""Height and width of the pooled features of a proposal, in cells; the value of the paper."""

CANONICAL_PX = 112
"""Side of a proposal, in pixels of the graph's input, whose features are pooled at 1/16 (equation 1 of the FPN paper,
Lin et al., 2017, which uses 224). The graph receives pictures at half their size, so the side is halved too.
"""

HIDDEN = 256
"""Number of features of a proposal in the two layers of the second stage; the published networks use 1024."""

PROPOSALS_TRAINING, PROPOSALS = 500, 300
"""Number of proposals of a picture in training and in use; the published networks use 2000 and 1000."""

CANDIDATES_TRAINING, CANDIDATES = 500, 300
"""Number of anchors of one feature map that compete to be proposals, in training and in use; the published networks
use 2000 and 1000. Non-maximum suppression compares all pairs: with 2000 it takes 45 % of a training step on a CPU.
"""

SAMPLED = 128
"""Number of proposals of a picture that train the second stage; the published networks use 512."""


def fasterrcnn_lite0_fpn(classes: int, score_threshold: float) -> nn.Module:
    """Builds torchvision's Faster R-CNN on EfficientNet-Lite0 with random weights, all layers trainable.

    The pyramid and the anchors are those of `retinanet_lite0_fpn`. The second stage is narrower than that of the
    published networks, and fewer proposals reach it.

    Args:
        classes: number of classes, including the background, which is class 0.
        score_threshold: smallest score of a detection that is reported, 0..1.
    """
    torchvision_import.need()
    from torchvision.models.detection import FasterRCNN
    from torchvision.models.detection.anchor_utils import AnchorGenerator
    from torchvision.models.detection.faster_rcnn import FastRCNNPredictor, TwoMLPHead
    from torchvision.ops import MultiScaleRoIAlign

    sizes = tuple(tuple(round(ANCHOR_STRIDES * stride * octave) for octave in OCTAVES) for stride in STRIDES_PX)
    graph: nn.Module = FasterRCNN(
        LitePyramid(),
        rpn_anchor_generator=AnchorGenerator(sizes, (ASPECT_RATIOS,) * len(sizes)),
        rpn_pre_nms_top_n_train=CANDIDATES_TRAINING,
        rpn_pre_nms_top_n_test=CANDIDATES,
        rpn_post_nms_top_n_train=PROPOSALS_TRAINING,
        rpn_post_nms_top_n_test=PROPOSALS,
        box_roi_pool=MultiScaleRoIAlign(POOLED_MAPS, POOLED_CELLS, sampling_ratio=2, canonical_scale=CANONICAL_PX),
        box_head=TwoMLPHead(CHANNELS * POOLED_CELLS**2, HIDDEN),
        box_predictor=FastRCNNPredictor(HIDDEN, classes),
        box_score_thresh=score_threshold,
        box_batch_size_per_image=SAMPLED,
    )
    return graph


class LiteFasterRcnnDetector(FasterRcnnDetector):
    """Faster R-CNN with EfficientNet-Lite0 of timm as backbone; `FasterRcnnDetector` documents its outputs, which
    here have as many classes as the graph.
    """

    maps: ClassVar[tuple[str, ...]] = MAPS

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules whose outputs are feature maps: the ends of the backbone's stages, `layer1` (1/4 of the
        graph's input) to `layer4` (1/32).
        """
        return lite_taps(self.graph)
