"""The depth error on the nearest obstacle, against sums that are written out here."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from gear.metrics.obstacle_depth import ObstacleDepth
from gear.metrics.obstacle_pixels import nearest_obstacle
from gear.plugins.tasks.depth import DepthConfig, DepthTask
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import CAR, Thing
from gear.values.rng import derive_rng

TASK = DepthTask(DepthConfig(width_px=304, height_px=152))


def sample(ahead_m: float | None = 20.0) -> Any:
    cars = [] if ahead_m is None else [Thing(parts=CAR, position_m=(ahead_m, 0.0, 0.0), object_id=2, role="npc")]
    return TASK.ground_truth(*synthetic_frame(TASK.rig(), cars))


def evaluator() -> Any:
    return TASK.reports()["nearest_obstacle"]


def test_the_errors_are_those_of_the_obstacles_pixels_alone() -> None:
    one, ours = sample(), evaluator()
    obstacle = nearest_obstacle(one.record, "left", one.depth_m)
    assert obstacle is not None
    noise = derive_rng(0, "noise").uniform(0.7, 1.6, one.depth_m.shape)
    said = np.where(obstacle.pixels, one.depth_m * noise, 3.0).astype(np.float32)
    errors, shares, ratios = [], [], []
    for row, column in zip(*np.nonzero(obstacle.pixels), strict=True):
        errors.append(float(said[row, column]) - float(one.depth_m[row, column]))
        shares.append(errors[-1] / float(one.depth_m[row, column]))
        ratios.append(float(said[row, column]) / float(one.depth_m[row, column]))
    wanted = {
        "mae_m": sum(map(abs, errors)) / len(errors),
        "abs_rel": sum(map(abs, shares)) / len(shares),
        "bias_rel": sum(shares) / len(shares),
        "farther_share": sum(ratio > 1.14 for ratio in ratios) / len(ratios),
        "is_much_farther": float(sorted(ratios)[len(ratios) // 2] > 1.25),
        "has_obstacle": 1.0,
    }
    assert ours.update(one, said) == pytest.approx(wanted, rel=1e-9)
    assert ours.result() == pytest.approx(wanted, rel=1e-9)


def test_a_car_that_vanishes_is_much_farther() -> None:
    one, ours = sample(), evaluator()
    ours.update(one, TASK.as_prediction(one) * np.float32(1.3))
    found = ours.result()
    assert found["is_much_farther"] == found["farther_share"] == 1.0
    assert found["abs_rel"] == pytest.approx(0.3, rel=1e-5) and found["bias_rel"] == pytest.approx(0.3, rel=1e-5)
    nearer = evaluator()
    nearer.update(one, TASK.as_prediction(one) * np.float32(0.7))
    assert nearer.result()["bias_rel"] == pytest.approx(-0.3, rel=1e-5)
    assert nearer.result()["is_much_farther"] == nearer.result()["farther_share"] == 0.0


def test_pictures_without_an_obstacle_count_as_such_only() -> None:
    ours, free, car = evaluator(), sample(None), sample()
    found = ours.update(free, TASK.as_prediction(free))
    assert found["has_obstacle"] == 0.0 and math.isnan(found["abs_rel"])
    assert math.isnan(ours.result()["abs_rel"])
    ours.update(car, TASK.as_prediction(car) * np.float32(2))
    assert ours.result()["has_obstacle"] == 0.5 and ours.result()["abs_rel"] == pytest.approx(1.0)
    assert math.isnan(evaluator().result()["has_obstacle"])


def test_resampled_datasets_are_those_that_are_merged() -> None:
    samples = [sample(distance) for distance in (12.0, None, 20.0, 33.0)]
    said = [TASK.as_prediction(one) * np.float32(1.1 + 0.1 * n) for n, one in enumerate(samples)]
    ours = evaluator()
    for one, prediction in zip(samples, said, strict=True):
        ours.update(one, prediction)
    draws = np.array([[0, 1, 2, 3], [3, 3, 1, 0], [1, 1, 1, 1]])
    spread = ours.resampled(draws)
    for row, drawn in enumerate(draws):
        again = evaluator()
        for index in drawn:
            part = evaluator()
            part.update(samples[index], said[index])
            again.merge(part)
        wanted = again.result()
        assert {name: values[row] for name, values in spread.items()} == pytest.approx(wanted, nan_ok=True)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 0.0, -1.0])
def test_predictions_that_are_no_depth_are_refused(wrong: float) -> None:
    one = sample()
    with pytest.raises(ValueError, match="positive and finite"):
        evaluator().update(one, np.full_like(one.depth_m, wrong))
    with pytest.raises(ValueError, match="shape"):
        evaluator().update(one, np.ones((3, 4), np.float32))


def test_every_metric_has_a_range() -> None:
    ours = ObstacleDepth("left")
    assert {name: ours.range_of(name) for name in ours.result()} == {
        "mae_m": (0.0, math.inf), "abs_rel": (0.0, math.inf), "bias_rel": (-1.0, math.inf),
        "farther_share": (0.0, 1.0), "is_much_farther": (0.0, 1.0), "has_obstacle": (0.0, 1.0),
    }  # fmt: skip
