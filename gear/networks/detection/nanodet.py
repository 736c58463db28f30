"""NanoDet as a gear network: its input, its boxes, and the losses of Generalized Focal Loss with which it was trained.

Source of the losses: Li et al., Generalized Focal Loss: Learning Qualified and Distributed Bounding Boxes for Dense
Object Detection, 2020; weights as in the published configuration `nanodet-g`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from gear.formats.coco import CATEGORIES, Detection
from gear.networks.detection.atss import assigned
from gear.networks.detection.nanodet_graph import BINS, STRIDES_PX
from gear.networks.detection.network import (
    MOSTLY,
    PICTURE,
    VIEW,
    Detector,
    Size,
    Sizing,
    Targets,
    fitted,
    picture_size,
    share_inside,
    size_of,
)
from gear.networks.detection.options import OfficialDetectorOptions

LOGITS, SIDES, CENTRES_PX = "cls_logits", "box_sides", "centres_px"

MEAN_RGB = (123.675 / 255, 116.28 / 255, 103.53 / 255)
STD_RGB = (58.395 / 255, 57.12 / 255, 57.375 / 255)
"""Normalisation of the training code: mean and standard deviation for red, green, blue pictures in 0..1."""

ANCHOR_STRIDES = 8.0
"""Side of the square anchors that choose the cells of an object (`atss`), in strides."""

MOST_DETECTIONS = 100
LARGEST_IOU = 0.6
"""Non-maximum suppression drops a box whose IoU with a box of the same class and a higher score exceeds this."""

BOX_WEIGHT, DISTRIBUTION_WEIGHT = 2.0, 0.25

CATEGORY_IDS = tuple(category["id"] for category in CATEGORIES)


class NanoDetDetector(Detector):
    """NanoDet as a gear network.

    Outputs for N cells: `cls_logits` (B, N, 80) in the order of COCO's categories; `box_sides` (B, N, 4, 11), logits of
    the distances in strides from the cell's centre to the left, top, right and bottom sides; and `centres_px` (B, N,
    2), x and y of the cells in pixels of the graph's input. Losses are `quality_focal`, `giou` and
    `distribution_focal`.

    Args:
        graph: the torch module.
        options: options that the user gave, such as the size of the input.
    """

    def __init__(self, graph: nn.Module, options: OfficialDetectorOptions) -> None:
        sizing = Sizing(
            inner_px=fitted(options.min_size_px, options.max_size_px), smooth=True, mean=MEAN_RGB, std=STD_RGB
        )
        super().__init__(graph, options, sizing=sizing, categories=CATEGORY_IDS)

    def taps(self) -> Mapping[str, nn.Module]:
        """The modules whose outputs are feature maps: the CSP stages, `layer1` (1/4 of the graph's input) to
        `layer4` (1/32).
        """
        stages = self.graph.get_submodule("backbone.stages")
        return {f"layer{number}": stages.get_submodule(str(number + 1)) for number in (1, 2, 3, 4)}

    def run(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the outputs by name (see the class). The graph reads blue, green, red; the channels are swapped
        here.

        Args:
            pictures: (B, 3, H, W) RGB picture `left`, float in 0..1, on the network's device.
        """
        picture = pictures[VIEW]
        logits, sides = self.graph(self.preprocess(picture).flip(1))
        centres = self._centres(size_of(picture)).expand(len(picture), -1, -1)
        return {LOGITS: logits, SIDES: sides, CENTRES_PX: centres}

    def run_for_losses(self, pictures: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the input of `losses`: the outputs of `run`, and `picture_px`, height and width of the pictures.

        Args:
            pictures: (B, 3, H, W) RGB picture `left`, float in 0..1, on the network's device.
        """
        picture = pictures[VIEW]
        size = torch.tensor(size_of(picture), device=self.device)
        return {**self.run(pictures), PICTURE: size.expand(len(picture), -1)}

    def losses(self, outputs: Mapping[str, Tensor], targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Returns the three losses by name, summed over the objects' cells of all pictures and divided as in the
        training code.

        Background cells that lie mostly inside ignored objects do not count.

        Args:
            outputs: result of `run_for_losses` for a batch of B samples, by name.
            targets: the B samples with their ground truth.
        """
        size = picture_size(outputs)
        wanted = [self.targets(sample, size) for sample in targets]
        parts = [
            self._cell_losses(outputs[LOGITS][index], outputs[SIDES][index], outputs[CENTRES_PX][index], target, size)
            for index, target in enumerate(wanted)
        ]
        quality, giou, distribution, weight, count = (torch.stack(each).sum() for each in zip(*parts, strict=True))
        weight = weight.clamp(min=1e-6)
        return {
            "quality_focal": quality / count.clamp(min=1.0),
            "giou": BOX_WEIGHT * giou / weight,
            "distribution_focal": DISTRIBUTION_WEIGHT * distribution / weight,
        }

    def predictions(self, outputs: Mapping[str, Tensor], size_px: tuple[int, ...]) -> Sequence[tuple[Detection, ...]]:
        """Detections of each picture, highest score first.

        Args:
            outputs: result of `run_for_predictions` for a batch of B pictures, by name.
            size_px: height and width of the pictures.
        """
        from torchvision.ops import batched_nms

        size = (size_px[0], size_px[1])
        strides = self._strides(size)[:, None]
        edges = torch.tensor([size[1], size[0]] * 2, dtype=torch.float32, device=self.device)
        answers = []
        for logits, sides, centres in zip(outputs[LOGITS], outputs[SIDES], outputs[CENTRES_PX], strict=True):
            cells, labels = (logits.sigmoid() >= self.options.score_threshold).nonzero(as_tuple=True)
            scores = logits[cells, labels].sigmoid()
            boxes = _boxes(centres, _distances(sides) * strides)[cells] / self.shrinkage(size)
            boxes = boxes.clamp(min=0).minimum(edges)
            kept = batched_nms(boxes, scores, labels, LARGEST_IOU)[:MOST_DETECTIONS]
            answers.append(self.detections({"boxes": boxes[kept], "scores": scores[kept], "labels": labels[kept]}))
        return answers

    def _cell_losses(
        self, logits: Tensor, sides: Tensor, centres: Tensor, target: Targets, size: Size
    ) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
        """Sums over the cells of one picture: quality focal loss, GIoU loss, distribution focal loss, the weight of
        the last two, and the number of cells with an object.
        """
        from torchvision.ops import box_iou, generalized_box_iou_loss

        strides = self._strides(size)
        half = strides[:, None] * ANCHOR_STRIDES / 2
        objects = assigned(target.boxes, torch.cat((centres - half, centres + half), dim=1), self._counts(size))
        is_object = objects >= 0
        cells = torch.cat((centres - strides[:, None] / 2, centres + strides[:, None] / 2), dim=1)
        counts = is_object | (share_inside(cells, target.ignored) < MOSTLY)
        quality = torch.zeros_like(logits)
        weights = logits.detach().sigmoid().amax(dim=1)[is_object]
        truth = target.boxes[objects[is_object]]
        found = _boxes(centres[is_object], _distances(sides[is_object]) * strides[is_object, None])
        if len(truth):
            reached = box_iou(found.detach(), truth).diagonal()
            quality[is_object, target.labels[objects[is_object]]] = reached
        focal = functional.binary_cross_entropy_with_logits(logits, quality, reduction="none")
        focal = focal * (quality - logits.sigmoid()).abs().square()
        giou = generalized_box_iou_loss(found, truth) * weights
        wanted = _sides(centres[is_object], truth) / strides[is_object, None]
        distribution = _distribution_focal(sides[is_object], wanted) * weights
        return focal[counts].sum(), giou.sum(), distribution.sum(), weights.sum(), is_object.sum().float()

    def _grids(self, picture_px: Size) -> list[Size]:
        height, width = self.input_px(picture_px)
        return [(height // stride, width // stride) for stride in STRIDES_PX]

    def _counts(self, picture_px: Size) -> list[int]:
        """Number of cells of each scale."""
        return [rows * columns for rows, columns in self._grids(picture_px)]

    def _strides(self, picture_px: Size) -> Tensor:
        """(N,) stride of each cell, in pixels of the graph's input."""
        counts = zip(self._counts(picture_px), STRIDES_PX, strict=True)
        each = [torch.full((count,), float(stride)) for count, stride in counts]
        return torch.cat(each).to(self.device)

    def _centres(self, picture_px: Size) -> Tensor:
        """(N, 2) x and y of the cells' centres, in pixels of the graph's input."""
        centres = []
        for (rows, columns), stride in zip(self._grids(picture_px), STRIDES_PX, strict=True):
            y, x = torch.meshgrid(torch.arange(rows) + 0.5, torch.arange(columns) + 0.5, indexing="ij")
            centres.append(torch.stack((x.flatten(), y.flatten()), dim=1) * stride)
        return torch.cat(centres).to(self.device)


def _distances(sides: Tensor) -> Tensor:
    """(N, 4) expected distances in strides, of (N, 4, 11) logits."""
    return sides.softmax(dim=2) @ torch.arange(BINS, dtype=sides.dtype, device=sides.device)


def _boxes(centres: Tensor, distances_px: Tensor) -> Tensor:
    """(N, 4) left, top, right, bottom, of (N, 2) centres and (N, 4) distances to the four sides."""
    return torch.cat((centres - distances_px[:, :2], centres + distances_px[:, 2:]), dim=1)


def _sides(centres: Tensor, boxes: Tensor) -> Tensor:
    """(N, 4) distances from the centres to the left, top, right and bottom sides of the boxes."""
    return torch.cat((centres - boxes[:, :2], boxes[:, 2:] - centres), dim=1)


def _distribution_focal(sides: Tensor, wanted: Tensor) -> Tensor:
    """(N,) distribution focal loss, the mean over the four sides: cross-entropy with the two bins next to the true
    distance, weighted by its distance from them.
    """
    clipped = wanted.clamp(0, BINS - 1 - 0.1)
    low = clipped.long()
    share = clipped - low
    logs = sides.log_softmax(dim=2)
    below = logs.gather(2, low[..., None])[..., 0]
    above = logs.gather(2, low[..., None] + 1)[..., 0]
    return -(below * (1 - share) + above * share).mean(dim=1)
