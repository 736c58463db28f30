"""Object detection with DETR and its descendants, whose outputs are classes and boxes of object queries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import torch
from gear.formats.coco import CATEGORY_NAMES, Detection
from torch import Tensor

from gear_model_transformers import DetectorConfig
from gear_model_transformers.adapter import FolderModel, numbers_of_classes


class Detector(FolderModel):
    """Outputs: `logits` (B, N, classes) and `pred_boxes` (B, N, 4), centre and size as shares of the picture's."""

    def __init__(self, config: DetectorConfig) -> None:
        super().__init__(config, "AutoModelForObjectDetection")
        self.score_threshold = config.score_threshold
        known = {name: number for number, name in CATEGORY_NAMES.items()}
        self.category_ids = numbers_of_classes(self.network, known, config)

    def outputs(self, pictures: Tensor) -> Mapping[str, Tensor]:
        """`logits` and `pred_boxes`, one row for each of N object queries."""
        raw = self.network(**self.seen(pictures))
        return {"logits": raw.logits, "pred_boxes": raw.pred_boxes}

    def losses(self, pictures: Tensor, targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """The network's own set loss against the objects of classes that it has."""
        labels = [self.labels(sample, pictures) for sample in targets]
        return {"set_loss": self.network(**self.seen(pictures), labels=labels).loss}

    def labels(self, sample: Any, pictures: Tensor) -> dict[str, Tensor]:
        """A sample's objects in the format of transformers."""
        index_of = {category: index for index, category in reversed(self.category_ids.items())}
        things = [thing for thing in sample.objects if not thing.is_ignored and thing.category_id in index_of]
        size = torch.tensor([pictures.shape[3], pictures.shape[2]])
        edges = torch.tensor([thing.box_px for thing in things]).reshape(-1, 2, 2) / size
        boxes = torch.cat([edges.mean(1), edges[:, 1] - edges[:, 0]], dim=1)
        classes = torch.tensor([index_of[thing.category_id] for thing in things], dtype=torch.int64)
        return {"class_labels": classes.to(pictures.device), "boxes": boxes.to(pictures.device)}

    def answer(self, picture: Tensor) -> tuple[Detection, ...]:
        """COCO detections by falling score; the family's processor interprets the scores, and boxes are clipped to the
        picture.
        """
        height, width = picture.shape[2:]
        raw = self.network(**self.seen(picture))
        sizes = torch.tensor([[height, width]], device=picture.device)
        (found,) = self.processor.post_process_object_detection(raw, threshold=self.score_threshold, target_sizes=sizes)
        corners = found["boxes"].clamp(min=0).minimum(torch.tensor([width, height] * 2, device=picture.device))
        detections = [
            Detection(category_id=self.category_ids[index], box_px=(box[0], box[1], box[2], box[3]), score=score)
            for score, index, box in zip(
                found["scores"].tolist(), found["labels"].tolist(), corners.tolist(), strict=True
            )
            if index in self.category_ids
        ]
        return tuple(sorted(detections, key=lambda one: -one.score))
