"""Reports of an evaluation: a third party's metric has its columns, its intervals and its own blame."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from gear.cli.main import main
from gear.contracts.specs import MetricSpec
from gear.testing.tiny_networks import tiny_depth
from gear.values.errors import ConfigError, GearError, PluginError, UnknownNameError
from gear.verbs.evaluate.run import evaluate
from tests.verbs.conftest import Collected, put_package


@dataclass(frozen=True, kw_only=True)
class BiasConfig:
    """Options.

    Attributes:
        limit_m: depth up to which pixels count.
        within_m: pair of bounds that nothing uses.
    """

    limit_m: float = 80.0
    within_m: tuple[float, float] = (0.0, 1.0)


class Bias:
    def __init__(self, config: BiasConfig) -> None:
        self.limit_m, self.sum_m, self.count = config.limit_m, 0.0, 0

    def update(self, sample: Any, prediction: Any) -> Mapping[str, float]:
        counted = np.isfinite(sample.depth_m) & (sample.depth_m < self.limit_m)
        self.sum_m += float((prediction[counted] - sample.depth_m[counted]).sum(dtype=np.float64))
        self.count += int(counted.sum())
        return {"bias_m": self.sum_m / self.count if self.count else math.nan}

    def merge(self, other: Any) -> None:
        self.sum_m += other.sum_m
        self.count += other.count

    def result(self) -> Mapping[str, float]:
        return {"bias_m": self.sum_m / self.count if self.count else math.nan}


def metric(**facts: Any) -> MetricSpec[BiasConfig]:
    said: dict[str, Any] = {"name": "bias", "summary": "Mean error.", "config": BiasConfig, "build": Bias}
    said |= {"tasks": ("depth",), "metric": "bias_m", "unit": "m", "lower_is_better": True}
    return MetricSpec(**(said | facts))


@pytest.fixture(scope="session")
def data(collected: Collected) -> Path:
    return collected("depth", "random", patch="random")


def run(data: Path, out: Path, *reports: str) -> Any:
    return evaluate(data, model="tiny_depth", out=out, reports=reports)


def test_a_metric_of_a_third_party_has_its_columns(tmp_path: Path, data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put_package(monkeypatch, [tiny_depth, metric()])
    report = run(data, tmp_path, "bias", "odd_package/bias", "bias:limit_m=10,within_m=[0.5,2]")
    (row,) = report.rows
    near = row.metrics.pop("bias:limit_m=10,within_m=[0.5,2]")["bias_m"]
    assert row.metrics["bias"]["bias_m"] == row.metrics["odd_package/bias"]["bias_m"] != near
    assert row.metrics["bias"]["bias_m"].interval is not None
    facts = json.loads((tmp_path / "results.json").read_text())["metric_plugins"]
    assert (
        facts["bias"]["unit"] == "m" and facts["bias"]["lower_is_better"] and facts["bias"]["package"] == "odd_package"
    )
    assert facts["bias:limit_m=10,within_m=[0.5,2]"]["options"] == {"limit_m": 10.0, "within_m": [0.5, 2.0]}
    assert "bias.bias_m" in (tmp_path / "table.txt").read_text()


def test_it_is_measured_anew_from_kept_predictions(tmp_path: Path, data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put_package(monkeypatch, [tiny_depth, metric()])
    run(data, tmp_path)
    (row,) = run(data, tmp_path, "bias").rows
    assert row.made == 0 and "bias" in row.metrics


@pytest.mark.parametrize(
    ("name", "error", "text"),
    [
        ("biass", UnknownNameError, r"no report of task 'depth' named 'biass'; did you mean bias\?"),
        ("labels", GearError, r"metric 'labels' is for semseg; .* is a depth dataset"),
        ("bias:limit=3", ConfigError, "limit"),
        ("reference:limit_m=3", UnknownNameError, "no report of task 'depth' named 'reference'"),
    ],
)
def test_what_does_not_fit_is_one_line(
    tmp_path: Path, data: Path, monkeypatch: pytest.MonkeyPatch, name: str, error: type[Exception], text: str
) -> None:
    put_package(monkeypatch, [tiny_depth, metric(), metric(name="labels", tasks=("semseg",))])
    with pytest.raises(error, match=text) as caught:
        run(data, tmp_path / "out", name)
    assert "\n" not in str(caught.value) and not (tmp_path / "out").exists()


class FailsToBuild(Bias):
    def __init__(self, config: BiasConfig) -> None:
        raise RuntimeError("no table")


class FailsToUpdate(Bias):
    def update(self, sample: Any, prediction: Any) -> Mapping[str, float]:
        raise SystemExit(3)


class FailsToMerge(Bias):
    def merge(self, other: Any) -> None:
        raise ZeroDivisionError("nothing")


class GivesText(Bias):
    def result(self) -> Mapping[str, float]:
        return {"bias_m": "large"}  # type: ignore[dict-item]


@pytest.mark.parametrize(
    ("build", "text"),
    [
        (FailsToBuild, "update of its evaluator: RuntimeError: no table"),
        (FailsToUpdate, "update of its evaluator: SystemExit: 3"),
        (FailsToMerge, "result of its evaluator: ZeroDivisionError: nothing"),
        (GivesText, "its evaluator: result: metric 'bias_m' must be a number, got str"),
    ],
)
def test_a_metric_that_fails_is_blamed_and_not_the_model(
    tmp_path: Path, data: Path, monkeypatch: pytest.MonkeyPatch, build: type[Bias], text: str
) -> None:
    put_package(monkeypatch, [tiny_depth, metric(build=build)])
    with pytest.raises(PluginError) as caught:
        run(data, tmp_path, "bias")
    assert str(caught.value) == f"plugin bias (odd_package ?) failed at {text}"


def test_the_cli_lists_and_takes_it(
    tmp_path: Path, data: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    put_package(monkeypatch, [tiny_depth, metric()])
    words = ["evaluate", "--model", "tiny_depth", "--data", str(data), "--out", str(tmp_path)]
    assert main([*words, "--report", "bias"]) == 0
    assert "bias.bias_m" in capsys.readouterr().out
