import math
from dataclasses import dataclass

import numpy as np
import pytest

from gear.metrics.depth import DepthEvaluator


@dataclass(frozen=True)
class Deep:
    depth_m: np.ndarray


def two_pixels() -> tuple[Deep, np.ndarray]:
    truth = np.array([[10.0, 40.0, np.nan]], dtype=np.float32)
    return Deep(truth), np.array([[12.0, 30.0, 5.0]], dtype=np.float32)


def test_by_hand() -> None:
    evaluator = DepthEvaluator()
    result = evaluator.update(*two_pixels())
    d = [math.log(10 / 12), math.log(40 / 30)]
    mean, square = sum(d) / 2, sum(v * v for v in d) / 2
    expected = {
        "mae_m": 6.0,
        "rmse_m": math.sqrt((4 + 100) / 2),
        "imae_per_km": 1000 * (abs(1 / 10 - 1 / 12) + abs(1 / 40 - 1 / 30)) / 2,
        "irmse_per_km": 1000 * math.sqrt(((1 / 10 - 1 / 12) ** 2 + (1 / 40 - 1 / 30) ** 2) / 2),
        "log_mae": (abs(d[0]) + abs(d[1])) / 2,
        "log_rmse": math.sqrt(square),
        "silog": 100 * math.sqrt(square - mean**2),
        "abs_rel": (2 / 10 + 10 / 40) / 2,
        "sq_rel": ((2 / 10) ** 2 + (10 / 40) ** 2) / 2,
        "eigen_d1": 0.5,
        "eigen_d2": 1.0,
        "eigen_sq_rel": (4 / 10 + 100 / 40) / 2,
        "eigen_rmse_log": math.sqrt(square),
        "eigen_log10": (abs(math.log10(12 / 10)) + abs(math.log10(30 / 40))) / 2,
        "eigen_silog": math.sqrt(square - 0.5 * mean**2),
    }
    for name, value in expected.items():
        assert result[name] == pytest.approx(value, rel=1e-5), name
    assert evaluator.result() == pytest.approx(dict(result))


def test_far_things_count_in_the_devkits_figures_alone() -> None:
    sample = Deep(np.array([[10.0, 200.0]], dtype=np.float32))
    result = DepthEvaluator().update(sample, np.array([[10.0, 100.0]], dtype=np.float32))
    assert result["mae_m"] == pytest.approx(50.0)
    assert result["eigen_rmse_m"] == 0.0


def test_predictions_are_clipped_for_eigens_figures() -> None:
    sample = Deep(np.array([[70.0]], dtype=np.float32))
    assert DepthEvaluator().update(sample, np.array([[500.0]], dtype=np.float32))["eigen_rmse_m"] == pytest.approx(10.0)


def test_crops_look_at_their_part() -> None:
    truth = np.full((100, 200), 10.0, dtype=np.float32)
    prediction = truth.copy()
    prediction[:40] = 20.0
    assert DepthEvaluator(crop="garg").update(Deep(truth), prediction)["eigen_rmse_m"] == 0.0
    assert DepthEvaluator(crop="eigen").update(Deep(truth), prediction)["eigen_rmse_m"] > 0.0
    assert DepthEvaluator().update(Deep(truth), prediction)["eigen_rmse_m"] == pytest.approx(10 * math.sqrt(0.4))


def test_figures_are_means_over_pictures() -> None:
    evaluator = DepthEvaluator()
    for wrong in (0.0, 3.0):
        truth = np.full((4, 4), 10.0, dtype=np.float32)
        evaluator.update(Deep(truth), truth + np.float32(wrong))
    evaluator.update(Deep(np.full((4, 4), np.nan, dtype=np.float32)), np.ones((4, 4), dtype=np.float32))
    assert evaluator.result()["mae_m"] == pytest.approx(1.5)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_impossible_predictions_are_refused(bad: float) -> None:
    sample, prediction = two_pixels()
    prediction[0, 0] = bad
    with pytest.raises(ValueError, match="positive and finite"):
        DepthEvaluator().update(sample, prediction)
    with pytest.raises(ValueError, match="shape"):
        DepthEvaluator().update(sample, prediction[:, :2])
