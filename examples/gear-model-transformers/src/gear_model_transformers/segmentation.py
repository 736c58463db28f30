"""Semantic segmentation with networks that classify pixels, and with networks that predict masks and their classes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from gear.formats.cityscapes import LABELS
from gear.networks.segmentation.losses import train_ids
from torch import Tensor
from torch.nn import functional

from gear_model_transformers import LabelledConfig
from gear_model_transformers.adapter import FolderModel, numbers_of_classes

EVALUATED = sorted((label for label in LABELS if label.is_evaluated), key=lambda label: label.train_id)

UNKNOWN_LOGIT = -50.0
"""Of classes that the network does not have."""

LEAST = 1e-6
"""Added to a share of masks before its logarithm, where no mask says anything."""


class Segmenter(FolderModel):
    """`logits` (B, 19, H, W) over Cityscapes train ids, at the picture's size."""

    def __init__(self, config: LabelledConfig) -> None:
        super().__init__(config, "AutoModelForSemanticSegmentation", "AutoModelForUniversalSegmentation")
        known = {label.name: label.train_id for label in EVALUATED}
        numbers = numbers_of_classes(self.network, known, config)
        self.indices = [[i for i, number in numbers.items() if number == label.train_id] for label in EVALUATED]
        self.label_ids: npt.NDArray[np.uint8] = np.array([label.id for label in EVALUATED], np.uint8)

    def outputs(self, pictures: Tensor) -> Mapping[str, Tensor]:
        """`logits`; probabilities of several classes of the network that are one of Cityscapes add up."""
        theirs = self.their_logits(pictures)
        nothing = torch.full_like(theirs[:, 0], UNKNOWN_LOGIT)
        ours = torch.stack([theirs[:, each].logsumexp(1) if each else nothing for each in self.indices], dim=1)
        return {"logits": at_size_of(pictures, ours)}

    def their_logits(self, pictures: Tensor) -> Tensor:
        """(B, classes, h, w) over the network's own classes."""
        said = self.network(**self.seen(pictures))
        if "class_queries_logits" not in said:
            logits: Tensor = said.logits
            return logits
        # MaskFormer, section 3.4: a class counts in a pixel as much as the masks there that show it.
        shows = said.class_queries_logits.softmax(-1)[..., :-1]  # the last one is "nothing"
        masks = at_size_of(pictures, said.masks_queries_logits).sigmoid()
        scores: Tensor = torch.einsum("bqc,bqhw->bchw", shows, masks)
        return (scores + LEAST).log()

    def losses(self, pictures: Tensor, targets: Sequence[Any]) -> Mapping[str, Tensor]:
        """Cross-entropy over the pixels whose class the network has."""
        ids = train_ids(targets, pictures.device)
        known = torch.tensor([number for number, each in enumerate(self.indices) if each], device=ids.device)
        is_known = torch.isin(ids, known)
        logits = self.outputs(pictures)["logits"]
        each = functional.cross_entropy(logits, ids.where(is_known, 0), reduction="none")
        return {"cross_entropy": (each * is_known).sum() / is_known.sum().clamp_min(1)}

    def answer(self, picture: Tensor) -> npt.NDArray[np.uint8]:
        """(H, W) uint8 Cityscapes label ids of a batch of one."""
        answer: npt.NDArray[np.uint8] = self.label_ids[self.outputs(picture)["logits"][0].argmax(0).cpu().numpy()]
        return answer


def at_size_of(pictures: Tensor, maps: Tensor) -> Tensor:
    """(B, C, h, w) at the pictures' size."""
    size = (pictures.shape[2], pictures.shape[3])
    return functional.interpolate(maps, size, mode="bilinear", align_corners=False)
