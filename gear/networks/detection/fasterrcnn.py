"""Faster R-CNN (Ren et al., 2015) with a feature pyramid, built on the implementation of torchvision."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, ClassVar

import torch
from torch import Tensor
from torch.nn import functional

from gear.formats.coco import Detection
from gear.networks.detection.network import (
    ANCHORS,
    MOSTLY,
    PICTURE,
    VIEW,
    Detector,
    Targets,
    picture_size,
    share_inside,
    size_of,
)
from gear.networks.runtime import autocast, seeded

OBJECTNESS, RPN_DELTAS, ANCHORS_PX = "objectness", "rpn_bbox_regression", "anchors_px"
PROPOSALS, LOGITS, DELTAS = "proposals_px", "class_logits", "box_regression"

MAPS = ("0", "1", "2", "3", "pool")
"""Names that torchvision gives to the feature maps of ResNet-50's pyramid, at 1/4 to 1/64 of the sides of the graph's
input.
"""

SURE_BACKGROUND = 20.0
"""Background logit of the empty proposals with which a picture's list of proposals is padded to a fixed length."""


class FasterRcnnDetector(Detector):
    """Faster R-CNN as a gear network.

    Outputs of the region proposal network, for N anchors: `objectness` (B, N), `rpn_bbox_regression` (B, N, 4) and
    `anchors_px` (B, N, 4). Outputs of the second stage, for R proposals: `class_logits` (B, R, 91), `box_regression`
    (B, R, 364) and `proposals_px` (B, R, 4). R is fixed; the proposals of a picture with fewer are padded with empty
    boxes of class background. Boxes are left, top, right, bottom in edge pixels of the picture. Losses are
    `loss_classifier`, `loss_box_reg`, `loss_objectness` and `loss_rpn_box_reg`.

    Attributes:
        maps: names of the pyramid's feature maps, finest first.
    """

    generator = "rpn.anchor_generator"
    maps: ClassVar[tuple[str, ...]] = MAPS

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the outputs of the region proposal network and of the second stage, by name (see the class).

        Pictures are processed one by one, because convolutions over a batch round differently from convolutions over a
        single picture. The smallest difference may change which proposals are kept, and thereby all further outputs.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        each = [self._run_one(picture[None]) for picture in pictures[VIEW]]
        return {name: torch.cat([outputs[name] for outputs in each]) for name in each[0]}

    def _run_one(self, picture: Tensor) -> dict[str, Tensor]:
        trunk = self.run_for_losses({VIEW: picture})
        graph: Any = self.graph
        (proposals,) = self._proposals(trunk)
        logits, deltas = self._box_heads(trunk, [proposals])
        missing = graph.rpn.post_nms_top_n() - len(proposals)
        nothing = logits.new_zeros(1, logits.shape[1])  # fills the missing proposals; a picture may have none
        nothing[:, 0] = SURE_BACKGROUND
        shrinkage = self.shrinkage(size_of(picture))
        return {
            OBJECTNESS: trunk[OBJECTNESS],
            RPN_DELTAS: trunk[RPN_DELTAS],
            ANCHORS_PX: trunk[ANCHORS] / shrinkage,
            PROPOSALS: torch.cat([proposals / shrinkage, torch.zeros(missing, 4, device=self.device)])[None],
            LOGITS: torch.cat([logits, nothing.expand(missing, -1)])[None],
            DELTAS: functional.pad(deltas, (0, 0, 0, missing))[None],
        }

    def run_for_losses(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the input of `losses`: feature maps, outputs of the region proposal network, anchors in pixels
        of the graph's input, and the picture's size.

        Args:
            pictures: (B, 3, H, W) picture `left`, float in 0..1, on the network's device.
        """
        from torchvision.models.detection.rpn import concat_box_prediction_layers

        graph: Any = self.graph
        picture = pictures[VIEW]
        maps = graph.backbone(self.preprocess(picture))
        objectness, deltas = concat_box_prediction_layers(*graph.rpn.head(list(maps.values())))
        anchors = self.anchors(size_of(picture), [size_of(each) for each in maps.values()])
        size = torch.tensor(size_of(picture), device=self.device)
        return dict(maps) | {
            OBJECTNESS: objectness.reshape(len(picture), -1).float(),
            RPN_DELTAS: deltas.reshape(len(picture), -1, 4).float(),
            ANCHORS: anchors.expand(len(picture), -1, -1),
            PICTURE: size.expand(len(picture), -1),
        }

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """The four losses of torchvision by name. Background that lies mostly inside ignored objects is never
        sampled.

        Anchors and proposals are sampled with `options.seed`, so each call samples the same ones. In training mode,
        torch's own generator samples them.

        Args:
            outputs: result of `run_for_losses` for a batch of B samples, by name.
            targets: the B samples with their ground truth.
        """
        wanted = [self.targets(sample, picture_size(outputs)) for sample in targets]
        graph: Any = self.graph
        with _as_in_training(graph.rpn):
            proposals = self._proposals(outputs)
        with contextlib.nullcontext() if self.training else seeded(self.options.seed):
            proposal_losses = self._proposal_losses(outputs, wanted)
            return self._box_losses(outputs, proposals, wanted) | proposal_losses

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[tuple[Detection, ...]]:
        """Detections of each picture, highest score first.

        Args:
            outputs: result of `run_for_predictions` for a batch of B pictures, by name.
            size_px: height and width of the pictures.
        """
        heads: Any = self.graph.get_submodule("roi_heads")
        answers = []
        for proposals, logits, deltas in zip(outputs[PROPOSALS], outputs[LOGITS], outputs[DELTAS], strict=True):
            real = (proposals[:, 2:] > proposals[:, :2]).all(dim=1)
            boxes, scores, labels = heads.postprocess_detections(
                logits[real], deltas[real], [proposals[real]], [(size_px[0], size_px[1])]
            )
            answers.append(self.detections({"boxes": boxes[0], "scores": scores[0], "labels": labels[0]}))
        return answers

    def _proposals(self, outputs: Mapping[str, Tensor]) -> list[Tensor]:
        """(R, 4) boxes of each picture in pixels of the graph's input, highest score first; without gradient."""
        rpn: Any = self.graph.get_submodule("rpn")
        anchors = outputs[ANCHORS]
        boxes = rpn.box_coder.decode(outputs[RPN_DELTAS].detach(), list(anchors)).view(anchors.shape)
        each = rpn.anchor_generator.num_anchors_per_location()
        counts = [
            outputs[name].shape[-2] * outputs[name].shape[-1] * count
            for name, count in zip(self.maps, each, strict=True)
        ]
        sizes = [self.sizing.inner_px(picture_size(outputs))] * len(anchors)
        proposals: list[Tensor] = rpn.filter_proposals(boxes, outputs[OBJECTNESS], sizes, counts)[0]
        return proposals

    def _box_heads(self, outputs: Mapping[str, Tensor], proposals: Sequence[Tensor]) -> tuple[Tensor, Tensor]:
        """Class logits and box deltas of the proposals of all pictures, concatenated, float32."""
        heads: Any = self.graph.get_submodule("roi_heads")
        sizes = [self.sizing.inner_px(picture_size(outputs))] * len(proposals)
        maps = {name: outputs[name] for name in self.maps}
        with autocast(self.device, self.options.precision):
            pooled = heads.box_roi_pool(maps, list(proposals), sizes)
            logits, deltas = heads.box_predictor(heads.box_head(pooled))
        return logits.float(), deltas.float()

    def _proposal_losses(self, outputs: Mapping[str, Tensor], wanted: Sequence[Targets]) -> dict[str, Tensor]:
        rpn: Any = self.graph.get_submodule("rpn")
        anchors = list(outputs[ANCHORS])
        labels, boxes = rpn.assign_targets_to_anchors(anchors, [target.as_torchvision() for target in wanted])
        labels = _without_ignored(labels, anchors, wanted)
        deltas = rpn.box_coder.encode(boxes, anchors)
        objectness, box_reg = rpn.compute_loss(outputs[OBJECTNESS], outputs[RPN_DELTAS].reshape(-1, 4), labels, deltas)
        return {"loss_objectness": objectness, "loss_rpn_box_reg": box_reg}

    def _box_losses(
        self, outputs: Mapping[str, Tensor], proposals: list[Tensor], wanted: Sequence[Targets]
    ) -> dict[str, Tensor]:
        from torchvision.models.detection.roi_heads import fastrcnn_loss

        heads: Any = self.graph.get_submodule("roi_heads")
        boxes = [target.boxes for target in wanted]
        proposals = heads.add_gt_proposals(proposals, boxes)
        matched, labels = heads.assign_targets_to_proposals(proposals, boxes, [target.labels for target in wanted])
        chosen = heads.subsample(_without_ignored(labels, proposals, wanted))
        # In a picture without objects the background is matched to one empty box, which no loss uses.
        some = [each if len(each) else each.new_zeros(1, 4) for each in boxes]
        truth = [each[match[keep]] for each, match, keep in zip(some, matched, chosen, strict=True)]
        kept = [each[keep] for each, keep in zip(proposals, chosen, strict=True)]
        labels = [each[keep] for each, keep in zip(labels, chosen, strict=True)]
        logits, deltas = self._box_heads(outputs, kept)
        classifier, box_reg = fastrcnn_loss(logits, deltas, labels, heads.box_coder.encode(truth, kept))
        return {"loss_classifier": classifier, "loss_box_reg": box_reg}


def _without_ignored(labels: Sequence[Tensor], boxes: Sequence[Tensor], wanted: Sequence[Targets]) -> list[Tensor]:
    """Labels in which background that lies mostly inside ignored objects is -1, so that it is never sampled.

    If a picture would have no background left, it keeps all of it.
    """
    answers = []
    for label, box, target in zip(labels, boxes, wanted, strict=True):
        is_masked = (label == 0) & (share_inside(box, target.ignored) >= MOSTLY)
        masked = label.masked_fill(is_masked, -1)
        answers.append(masked if bool((masked >= 0).any()) else label)
    return answers


@contextlib.contextmanager
def _as_in_training(rpn: Any) -> Iterator[None]:
    """Context in which torchvision's region proposal network keeps as many proposals as in training; its layers
    stay in their modes.
    """
    was, rpn.training = rpn.training, True
    try:
        yield
    finally:
        rpn.training = was
