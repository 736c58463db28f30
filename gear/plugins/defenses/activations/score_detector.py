"""Defenses that score how far one feature map deviates from clean pictures, such as HyperNeuron and FPDA."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from gear.contracts.defenses import DefendedBatch, DefenseResult, FitReport, FitsInPhases
from gear.contracts.models import Model
from gear.plugins.defenses.activations.feature_maps import deepest, feature_maps, tapped
from gear.plugins.defenses.activations.z_scores import (
    CleanStatistics,
    Moments,
    alarm_level,
    false_alarm_interval,
    moments,
    normalised_score,
    normalised_score_tensor,
)
from gear.values.errors import GearError
from gear.values.frames import UInt8Image
from gear.values.progress import PhaseProgress

Views = Mapping[str, UInt8Image]

FOLDS = 4
"""Number of folds for the scores of clean pictures. Each quarter of the pictures is scored with the statistics of the
other quarters, because pictures deviate less from their own statistics than new pictures do.
"""


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class DetectorState:
    """The state of a detector after calibration with clean pictures.

    Attributes:
        layer: name of the tap (layer) whose feature map is read.
        statistics: mean and standard deviation of the features on clean pictures.
        level: raw score above which the alarm is raised.
        report: numbers on the calibration, for the user.
    """

    layer: str
    statistics: CleanStatistics
    level: float
    report: FitReport

    def fit_report(self) -> FitReport:
        """Returns numbers on the calibration by name: the number of clean pictures (`clean_pictures`), the alarm
        level (`level`), and the 95 % interval of the share of similar clean pictures above it
        (`false_alarms_low`, `false_alarms_high`).
        """
        return self.report


class Detector(FitsInPhases):
    """A defense that only scores: pictures are unchanged, and the score grows with the suspicion of an attack.

    Args:
        layer: name of the tap (layer) to read; "" for the deepest.
        compress: function from a (C, h, w) feature map to the features that are compared with clean pictures.
        aggregate: function from the z-scores of these features to one number, 0 or more.
        false_alarms: share of clean pictures whose score may exceed 0.5.
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

    def fit_in_phases(
        self,
        clean: Sequence[Views],
        patched: Sequence[Views],
        model: Model | None,
        rng: np.random.Generator,
        on_phase: PhaseProgress,
    ) -> DetectorState:
        """Calibrates the detector: statistics of features and the alarm level, from the clean pictures alone.

        Args:
            clean: pictures without a patch, (H, W, 3) uint8 by camera name, one mapping per sample.
            patched: pictures of the same scenes with a patch; [] if there are none.
            model: the network whose feature maps are read.
            rng: random generator of the calibration.
            on_phase: called with the unit of the phase and the numbers of finished and of all steps.

        Raises:
            GearError: there are too few pictures, they differ in size, or the model has no such feature map.
        """
        assert model is not None
        if len(clean) < FOLDS:
            raise GearError(f"calibration needs at least {FOLDS} clean pictures; there are {len(clean)}")
        layer = self._layer or deepest(model, clean[0])
        folds = [range(first, len(clean), FOLDS) for first in range(FOLDS)]
        read = itertools.count(1)

        def features(index: int) -> Tensor:
            found = self._numbers(model, clean[index], layer)
            on_phase("clean picture", next(read), len(clean))
            return found

        parts = [moments(features(i) for i in fold) for fold in folds]
        scores: list[float] = []
        for number, fold in enumerate(folds):
            others = functools.reduce(Moments.merged, parts[:number] + parts[number + 1 :]).clean_statistics()
            for i in fold:
                scores.append(self._raw(others, self._numbers(model, clean[i], layer)))
                on_phase("clean score", len(scores), len(clean))
        level = alarm_level(scores, self._false_alarms)
        low, high = false_alarm_interval(len(scores), self._false_alarms)
        values = {"clean_pictures": len(scores), "level": level, "false_alarms_low": low, "false_alarms_high": high}
        statistics = functools.reduce(Moments.merged, parts).clean_statistics()
        return DetectorState(layer=layer, statistics=statistics, level=level, report=FitReport(values=values))

    def apply(self, views: Views, model: Model | None, state: DetectorState, rng: np.random.Generator) -> DefenseResult:
        """Returns the unchanged pictures of one sample and their score in 0..1, which is 0.5 at the alarm level.

        Args:
            views: (H, W, 3) uint8 pictures of the sample by camera name.
            model: the network whose feature maps are read.
            state: result of the calibration.
            rng: not used.
        """
        assert model is not None
        raw = self._raw(state.statistics, self._numbers(model, views, state.layer))
        return DefenseResult(views=dict(views), score=normalised_score(raw, state.level))

    def forward(self, views: Mapping[str, Tensor]) -> Mapping[str, Tensor]:
        """Returns the pictures unchanged.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
        """
        return dict(views)

    def defend_batch(self, views: Mapping[str, Tensor], model: Model, state: DetectorState) -> DefendedBatch:
        """Returns the unchanged pictures, and (B,) scores in 0..1 with gradients with respect to the pictures.

        Args:
            views: (B, 3, H, W) pictures by camera name, float in 0..1.
            model: the network whose feature maps are read.
            state: result of the calibration.
        """
        features = tapped(model, views, [state.layer])[state.layer]
        raw = torch.stack([self._aggregate(state.statistics.z_scores(self._compress(one))) for one in features])
        return DefendedBatch(views=dict(views), scores=normalised_score_tensor(raw, state.level))

    def wrap(self, model: Model) -> Model:
        """Returns the model unchanged, because the detector only reads feature maps.

        Args:
            model: the network to be defended.
        """
        return model

    def _numbers(self, model: Model, views: Views, layer: str) -> Tensor:
        return self._compress(feature_maps(model, views, [layer])[layer])

    def _raw(self, statistics: CleanStatistics, numbers: Tensor) -> float:
        return float(self._aggregate(statistics.z_scores(numbers)))
