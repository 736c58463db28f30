"""The contract of metrics accepts a sound metric and finds each way of breaking a promise."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from gear.contracts.specs import MetricSpec
from gear.testing.metric_contract import MetricContract


@dataclass(frozen=True, kw_only=True)
class Config:
    limit_m: float = 80.0


class MeanOff:
    """Mean absolute error of depth, in metres."""

    def __init__(self, config: Config) -> None:
        self.limit_m, self.sum_m, self.count = config.limit_m, 0.0, 0

    def update(self, sample: Any, prediction: Any) -> Mapping[str, float]:
        counted = np.isfinite(sample.depth_m) & (sample.depth_m < self.limit_m)
        self.sum_m += float(np.abs(prediction[counted] - sample.depth_m[counted]).sum(dtype=np.float64))
        self.count += int(counted.sum())
        return self.result()

    def merge(self, other: Any) -> None:
        self.sum_m += other.sum_m
        self.count += other.count

    def result(self) -> Mapping[str, float]:
        return {"error_m": self.sum_m / self.count if self.count else math.nan}


def metric(build: Any = MeanOff, **facts: Any) -> MetricSpec[Config]:
    said: dict[str, Any] = {"name": "error", "summary": "Mean error.", "config": Config, "tasks": ("depth",)}
    return MetricSpec(**(said | {"metric": "error_m", "lower_is_better": True, "build": build} | facts))


class TestMeanOff(MetricContract):
    spec = metric()


class Sharing(MeanOff):
    total = 0.0

    def update(self, sample: Any, prediction: Any) -> Mapping[str, float]:
        Sharing.total += 1.0
        return super().update(sample, prediction)

    def result(self) -> Mapping[str, float]:
        return {"error_m": Sharing.total or math.nan}


class Unmerged(MeanOff):
    def merge(self, other: Any) -> None:
        self.sum_m, self.count = other.sum_m, other.count


class ZeroAtFirst(MeanOff):
    def result(self) -> Mapping[str, float]:
        return {"error_m": self.sum_m / max(self.count, 1)}


class OtherName(MeanOff):
    def result(self) -> Mapping[str, float]:
        return {"error": self.sum_m / self.count if self.count else math.nan}


@pytest.mark.parametrize(
    ("spec", "test"),
    [
        (metric(Sharing), "test_every_evaluator_is_a_fresh_one"),
        (metric(Unmerged), "test_merged_evaluators_equal_the_whole"),
        (metric(ZeroAtFirst), "test_an_empty_evaluator_gives_nan"),
        (metric(OtherName), "test_metrics_are_numbers_by_name"),
        (metric(lower_is_better=False), "test_a_spoilt_prediction_is_worse"),
        (metric(tasks=("dreams",)), "test_the_spec_can_be_used"),
    ],
)
def test_a_broken_promise_is_found(spec: MetricSpec[Config], test: str) -> None:
    contract = type("Broken", (MetricContract,), {"spec": spec})()
    with pytest.raises(AssertionError):
        getattr(contract, test)()
