"""Detectors that score how unusual one feature map is: HyperNeuron and FPDA are two of them."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from gear.contracts.defenses import DefendedBatch, DefenseResult, FitReport
from gear.contracts.models import Model
from gear.plugins.defenses.activations.feature_maps import deepest, feature_maps, tapped
from gear.plugins.defenses.activations.z_scores import (
    Moments,
    Usual,
    alarm_level,
    false_alarm_interval,
    moments,
    sureness,
    sureness_tensor,
)
from gear.values.errors import GearError
from gear.values.frames import UInt8Image

Views = Mapping[str, UInt8Image]

FOLDS = 4
"""Each quarter of the clean pictures is scored by what is usual in the others: pictures that have taught what is usual
look more usual than new ones."""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Learnt:
    """What a detector knows after calibration.

    Attributes:
        layer: the tap that it looks at.
        usual: its numbers in clean pictures.
        level: raw score at which it raises the alarm.
        report: what it learnt.
    """

    layer: str
    usual: Usual
    level: float
    report: FitReport

    def fit_report(self) -> FitReport:
        """The alarm level, and how often clean pictures of the same kind exceed it."""
        return self.report


class Detector:
    """A `Defense` that leaves pictures as they are and says how sure it is of an attack.

    Args:
        layer: the tap to look at; "" takes the deepest.
        compress: from a (C, h, w) feature map to the numbers that are compared.
        aggregate: from their Z-scores to one number, 0 or more.
        false_alarms: share of clean pictures that score above 0.5.
    """

    def __init__(
        self,
        layer: str,
        compress: Callable[[Tensor], Tensor],
        aggregate: Callable[[Tensor], Tensor],
        false_alarms: float,
    ) -> None:
        self._layer, self._compress, self._aggregate = layer, compress, aggregate
        self._false_alarms = false_alarms

    def fit(
        self, clean: Sequence[Views], patched: Sequence[Views], model: Model | None, rng: np.random.Generator
    ) -> Learnt:
        """Learns from clean pictures alone.

        Raises:
            GearError: there are too few, they differ in size, or the model has no such feature map.
        """
        assert model is not None
        if len(clean) < FOLDS:
            raise GearError(f"calibration needs at least {FOLDS} clean pictures; there are {len(clean)}")
        layer = self._layer or deepest(model, clean[0])
        folds = [range(first, len(clean), FOLDS) for first in range(FOLDS)]
        parts = [moments(self._numbers(model, clean[i], layer) for i in fold) for fold in folds]
        scores = []
        for number, fold in enumerate(folds):
            others = functools.reduce(Moments.merged, parts[:number] + parts[number + 1 :]).usual()
            scores += [self._raw(others, self._numbers(model, clean[i], layer)) for i in fold]
        level = alarm_level(scores, self._false_alarms)
        low, high = false_alarm_interval(len(scores), self._false_alarms)
        values = {"clean_pictures": len(scores), "level": level, "false_alarms_low": low, "false_alarms_high": high}
        learnt = functools.reduce(Moments.merged, parts).usual()
        return Learnt(layer=layer, usual=learnt, level=level, report=FitReport(values=values))

    def apply(self, views: Views, model: Model | None, state: Learnt, rng: np.random.Generator) -> DefenseResult:
        """The pictures as they came, and the score."""
        assert model is not None
        raw = self._raw(state.usual, self._numbers(model, views, state.layer))
        return DefenseResult(views=dict(views), score=sureness(raw, state.level))

    def forward(self, views: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """The pictures as they came."""
        return dict(views)

    def defend_batch(self, views: Mapping[str, Tensor], model: Model, state: Learnt) -> DefendedBatch:
        """The pictures unchanged, and their scores with the gradient to the pictures."""
        features = tapped(model, views, [state.layer])[state.layer]
        raw = torch.stack([self._aggregate(state.usual.z_scores(self._compress(one))) for one in features])
        return DefendedBatch(views=dict(views), scores=sureness_tensor(raw, state.level))

    def wrap(self, model: Model) -> Model:
        """The model as it is."""
        return model

    def _numbers(self, model: Model, views: Views, layer: str) -> Tensor:
        return self._compress(feature_maps(model, views, [layer])[layer])

    def _raw(self, learnt: Usual, numbers: Tensor) -> float:
        return float(self._aggregate(learnt.z_scores(numbers)))
