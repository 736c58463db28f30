"""Panoptic quality (Kirillov et al., CVPR 2019), with void and crowds as in COCO's evaluation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

IdMap = npt.NDArray[np.int32]
VOID = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """One segment of a picture.

    Attributes:
        id: its number in the id map, above 0.
        category_id: Cityscapes label id.
        is_crowd: whether it covers several objects that are not separated; crowds are never evaluated.
    """

    id: int
    category_id: int
    is_crowd: bool = False


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Panoptic:
    """A picture's segments: ground truth or prediction.

    Attributes:
        ids: (H, W) int32 ids of segments, 0 for void.
        segments: one for each id in `ids`.
    """

    ids: IdMap
    segments: tuple[Segment, ...]


class HasPanoptic(Protocol):
    """A sample with ground-truth segments."""

    @property
    def panoptic(self) -> Panoptic:
        """The ground-truth segments of the picture."""
        ...


class QualityEvaluator:
    """Gathers matches for each category; `pq`, `sq`, `rq` and `pq_things`, `pq_stuff` are means over categories."""

    def __init__(self, things: frozenset[int]) -> None:
        self.things = things
        self.counts: dict[int, list[float]] = {}

    def update(self, sample: HasPanoptic, prediction: Panoptic) -> Mapping[str, float]:
        """Takes one picture in; returns the metrics of this picture."""
        own = QualityEvaluator(self.things)
        own.counts = match(sample.panoptic, prediction)
        self.merge(own)
        return own.result()

    def merge(self, other: Any) -> None:
        """Takes in what another evaluator of this class has gathered."""
        for category, counts in other.counts.items():
            mine = self.counts.setdefault(category, [0.0, 0.0, 0.0, 0.0])
            self.counts[category] = [a + b for a, b in zip(mine, counts, strict=True)]

    def result(self) -> Mapping[str, float]:
        """`pq`, `sq`, `rq`, `pq_things` and `pq_stuff` over all pictures, 0..1; NaN where nothing counts."""
        rows = {c: _quality(*counts) for c, counts in self.counts.items() if sum(counts[1:]) > 0}
        metrics = {name: _mean([row[i] for row in rows.values()]) for i, name in enumerate(("pq", "sq", "rq"))}
        for name, wanted in (("pq_things", True), ("pq_stuff", False)):
            metrics[name] = _mean([row[0] for c, row in rows.items() if (c in self.things) == wanted])
        return metrics

    def lower_is_better(self, metric: str) -> bool | None:
        """False: every metric is a share of what is right."""
        return False


def match(truth: Panoptic, prediction: Panoptic) -> dict[int, list[float]]:
    """By category: sum of IoU, true positives, false positives, false negatives."""
    real = {s.id: s for s in truth.segments}
    said = {s.id: s for s in prediction.segments}
    pairs = truth.ids.astype(np.int64) << 32 | prediction.ids.astype(np.int64)
    values, areas = np.unique(pairs, return_counts=True)
    overlap = {(int(v >> 32), int(v & 0xFFFFFFFF)): int(a) for v, a in zip(values, areas, strict=True)}
    real_px = _areas(truth.ids)
    said_px = _areas(prediction.ids)
    counts: dict[int, list[float]] = {}
    found: set[int] = set()
    used: set[int] = set()
    for (r, s), shared in overlap.items():
        if r not in real or s not in said or real[r].is_crowd or real[r].category_id != said[s].category_id:
            continue
        union = real_px[r] + said_px[s] - shared - overlap.get((VOID, s), 0)
        if shared / union > 0.5:
            row = counts.setdefault(real[r].category_id, [0.0, 0.0, 0.0, 0.0])
            row[0] += shared / union
            row[1] += 1
            found.add(r)
            used.add(s)
    crowds = {segment.category_id: segment.id for segment in truth.segments if segment.is_crowd}
    for segment in truth.segments:
        if segment.id not in found and not segment.is_crowd:
            counts.setdefault(segment.category_id, [0.0, 0.0, 0.0, 0.0])[3] += 1
    for segment in prediction.segments:
        if segment.id in used or not said_px.get(segment.id):
            continue
        ignored = overlap.get((VOID, segment.id), 0) + overlap.get((crowds.get(segment.category_id, -1), segment.id), 0)
        if ignored / said_px[segment.id] <= 0.5:
            counts.setdefault(segment.category_id, [0.0, 0.0, 0.0, 0.0])[2] += 1
    return counts


def _areas(ids: IdMap) -> dict[int, int]:
    values, counts = np.unique(ids, return_counts=True)
    return dict(zip(values.tolist(), counts.tolist(), strict=True))


def _quality(iou: float, tp: float, fp: float, fn: float) -> tuple[float, float, float]:
    recognition = tp / (tp + 0.5 * fp + 0.5 * fn)
    segmentation = iou / tp if tp else 0.0
    return segmentation * recognition, segmentation, recognition


def _mean(values: list[float]) -> float:
    return sum(values) / len(values) if values else math.nan
