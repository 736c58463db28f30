"""RetinaNet (Lin et al., Focal Loss for Dense Object Detection, 2017), built on the implementation of torchvision."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor, nn

from gear.formats.coco import Detection
from gear.networks.detection.graphs import lite_taps
from gear.networks.detection.network import (
    ANCHORS,
    MOSTLY,
    PICTURE,
    VIEW,
    Detector,
    Size,
    picture_size,
    share_inside,
    size_of,
)

LOGITS, DELTAS, ANCHORS_PX = "cls_logits", "bbox_regression", "anchors_px"

FIRST_STRIDE_PX = 8
LEVELS = 5
"""Number of feature maps of the pyramid, at 1/8 to 1/128 of the graph's input."""


class RetinaNetDetector(Detector):
    """RetinaNet as a gear network.

    Outputs for N anchors: `cls_logits` (B, N, classes), `anchors_px` (B, N, 4), and `bbox_regression` (B, N, 4)
    relative to the anchors. Anchors are left, top, right, bottom in edge pixels of the picture. Losses are
    `classification` and `bbox_regression`.
    """

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the outputs by name: those of the classification head and of the box head, and the anchors in
        pixels of the picture (see the class).

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        outputs = self.run_for_losses(pictures)
        anchors_px = outputs[ANCHORS] / self.shrinkage(picture_size(outputs))
        return {LOGITS: outputs[LOGITS], DELTAS: outputs[DELTAS], ANCHORS_PX: anchors_px}

    def run_for_losses(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the input of `losses`: outputs of the classification and the box head, anchors in pixels of the
        graph's input, and the picture's size.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        picture = pictures[VIEW]
        features = list(self.graph.get_submodule("backbone")(self.preprocess(picture)).values())
        outputs: dict[str, Tensor] = dict(self.graph.get_submodule("head")(features))
        anchors = self.anchors(size_of(picture), [size_of(each) for each in features])
        size = torch.tensor(size_of(picture), device=self.device)
        return outputs | {
            ANCHORS: anchors.expand(len(picture), -1, -1),
            PICTURE: size.expand(len(picture), -1),
        }

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """The two losses of torchvision by name; background anchors that lie mostly inside ignored objects do not
        count.

        Args:
            outputs: result of `run_for_losses` for a batch of B samples, by name.
            targets: the B samples with their ground truth.
        """
        wanted = [self.targets(sample, picture_size(outputs)) for sample in targets]
        graph: Any = self.graph
        matches = []
        for anchors, target in zip(outputs[ANCHORS], wanted, strict=True):
            matched = self._match(anchors, target.boxes)
            is_masked = (matched == graph.proposal_matcher.BELOW_LOW_THRESHOLD) & (
                share_inside(anchors, target.ignored) >= MOSTLY
            )
            matches.append(matched.masked_fill(is_masked, graph.proposal_matcher.BETWEEN_THRESHOLDS))
        truth = [target.as_torchvision() for target in wanted]
        losses: dict[str, Tensor] = graph.head.compute_loss(truth, outputs, list(outputs[ANCHORS]), matches)
        return losses

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[tuple[Detection, ...]]:
        """Detections of each picture, highest score first.

        Args:
            outputs: result of `run_for_predictions` for a batch of B pictures, by name.
            size_px: height and width of the pictures.
        """
        graph: Any = self.graph
        size = (size_px[0], size_px[1])
        counts = self._counts(size)
        levels = {name: list(outputs[name].split_with_sizes(counts, dim=1)) for name in (LOGITS, DELTAS)}
        anchors = [list(each.split_with_sizes(counts)) for each in outputs[ANCHORS_PX]]
        found = graph.postprocess_detections(levels, anchors, [size] * len(anchors))
        return [self.detections(each) for each in found]

    def _match(self, anchors: Tensor, boxes: Tensor) -> Tensor:
        from torchvision.ops import box_iou

        graph: Any = self.graph
        if not len(boxes):
            below: int = graph.proposal_matcher.BELOW_LOW_THRESHOLD
            return torch.full((len(anchors),), below, dtype=torch.int64, device=anchors.device)
        matched: Tensor = graph.proposal_matcher(box_iou(boxes, anchors))
        return matched

    def _counts(self, picture_px: Size) -> list[int]:
        """Number of anchors of each feature map."""
        graph: Any = self.graph
        each = graph.anchor_generator.num_anchors_per_location()
        height, width = (side // FIRST_STRIDE_PX for side in self.input_px(picture_px))
        counts = []
        for level in range(LEVELS):
            counts.append(height * width * each[level])
            height, width = -(-height // 2), -(-width // 2)
        return counts


class LiteRetinaNetDetector(RetinaNetDetector):
    """RetinaNet with EfficientNet-Lite0 of timm as backbone."""

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules whose outputs are feature maps: the ends of the backbone's stages, `layer1` (1/4 of the
        graph's input) to `layer4` (1/32).
        """
        return lite_taps(self.graph)
