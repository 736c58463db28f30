"""Targeted attacks on detectors: all objects vanish, or an object appears on the patch.

The ground truth is replaced by the labels that the detector shall predict. The attack then minimises the detector's own
training losses against these labels, as in Lee and Kolter (2019) and in DPatch (Liu et al., 2019).
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from torch import Tensor

from gear.contracts.attacks import Term
from gear.contracts.models import Model
from gear.formats import rle
from gear.plugins.tasks.detect2d import Detect2dSample, Object2d

Goal = Literal["vanish", "appear"]


@dataclass(frozen=True, slots=True, kw_only=True)
class DetectionGoal:
    """The objective of targeted attacks on detectors: `vanish` (`detect2d`, `stereo3d`) or `appear` (`detect2d`).

    Attributes:
        goal: `vanish`: the detector shall predict no object; `appear`: it shall predict an object on each patch.
        category_id: COCO category of the object that shall appear.
        left_out: names of the detector's losses that are not used.
    """

    goal: Goal
    category_id: int = 0
    left_out: frozenset[str] = frozenset()

    def terms(
        self, model: Model, views: Mapping[str, Tensor], samples: Sequence[Any], indices: Sequence[int]
    ) -> Mapping[str, Term]:
        """Returns one term for each loss of the detector: the negative loss against the labels that it shall
        predict.

        Args:
            model: the attacked network.
            views: (B, 3, H, W) pictures with the patches by camera name, float in 0..1.
            samples: the B samples with their ground truth.
            indices: indices of these samples in the dataset; not used.

        Returns:
            The terms by the names of the losses, without `left_out`.
        """
        wanted = [self.rewritten(sample) for sample in samples]
        losses = model.forward(views, wanted)
        return {name: Term(value=-loss) for name, loss in losses.items() if name not in self.left_out}

    def rewritten(self, sample: Any) -> Any:
        """Returns a copy of a sample with the labels that shall be predicted: none, or an object on each visible
        surface.

        Args:
            sample: sample with `objects`; for the goal `appear` of 2D detection.
        """
        objects = self._on_surfaces(sample) if self.goal == "appear" else ()
        return dataclasses.replace(sample, objects=objects)

    def _on_surfaces(self, sample: Detect2dSample) -> tuple[Object2d, ...]:
        found = []
        for number, surface in enumerate(sample.surfaces):
            if not surface.visible_px:
                continue
            height, width = sample.images[surface.camera].shape[:2]
            mask = rle.decode(surface.mask_rle, height, width)
            rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
            box = (float(columns[0]), float(rows[0]), float(columns[-1] + 1), float(rows[-1] + 1))
            found.append(
                Object2d(
                    object_id=-1 - number,
                    label="",
                    category_id=self.category_id,
                    is_ignored=False,
                    box_px=box,
                    amodal_box_px=box,
                    area_px=surface.visible_px,
                    rle=surface.mask_rle,
                    visible_fraction=1.0,
                    occluded_fraction=0.0,
                    truncated_fraction=0.0,
                    distance_m=surface.distance_m,
                )
            )
        return tuple(found)
