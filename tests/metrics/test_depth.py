import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
import pytest

from gear.formats.kitti_depth import MAX_PNG_DEPTH_M, to_predicted_units, to_units
from gear.metrics.depth import CROPS, PIXELS_AT_ONCE, DepthEvaluator


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


def test_far_things_count_in_the_devkits_metrics_alone() -> None:
    sample = Deep(np.array([[10.0, 200.0]], dtype=np.float32))
    result = DepthEvaluator().update(sample, np.array([[10.0, 100.0]], dtype=np.float32))
    assert result["mae_m"] == pytest.approx(50.0)
    assert result["eigen_rmse_m"] == 0.0


def test_the_devkits_metrics_are_those_of_its_own_pictures() -> None:
    rng = np.random.default_rng(11)
    truth = rng.uniform(2, 900, (40, 60)).astype(np.float32)
    found = (truth * rng.uniform(0.7, 1.2, truth.shape)).astype(np.float32)
    found[0, :9], found[1, :9] = 2e-3, 1e-5  # nearer than a file can say
    t, p = to_units(truth) / 256, to_predicted_units(found) / 256  # as `evaluate_depth.cpp` reads the files
    t, p = t[t > 0], p[t > 0]
    assert (p > 255).any() and (p < 0.004).any(), "some of what is said is beyond what a file says"
    result = DepthEvaluator().update(Deep(truth), found)
    assert 0.1 < len(t) / truth.size < 0.5
    assert result["mae_m"] == pytest.approx(np.mean(np.abs(t - p)), rel=1e-3)
    assert result["rmse_m"] == pytest.approx(np.sqrt(np.mean((t - p) ** 2)), rel=1e-3)
    assert result["silog"] == pytest.approx(100 * np.std(np.log(p) - np.log(t)), rel=1e-3)


@pytest.mark.parametrize("most_m", [80.0, 500.0])
def test_how_far_eigens_metrics_look_changes_none_of_the_devkits(most_m: float) -> None:
    truth = np.linspace(2, 900, 4000, dtype=np.float32)[None]
    found = truth * np.float32(0.9)
    expected = DepthEvaluator().update(Deep(truth), found)
    result = DepthEvaluator(max_depth_m=most_m).update(Deep(truth), found)
    assert {name: result[name] for name in ("mae_m", "rmse_m", "abs_rel")} == pytest.approx(
        {name: expected[name] for name in ("mae_m", "rmse_m", "abs_rel")}
    )
    seen = truth[truth < most_m].astype(float)
    assert result["eigen_rmse_m"] == pytest.approx(np.sqrt(np.mean((0.1 * seen) ** 2)), rel=1e-3)


def test_predictions_are_clipped_for_eigens_metrics() -> None:
    sample = Deep(np.array([[70.0]], dtype=np.float32))
    assert DepthEvaluator().update(sample, np.array([[500.0]], dtype=np.float32))["eigen_rmse_m"] == pytest.approx(10.0)


def test_crops_look_at_their_part() -> None:
    truth = np.full((100, 200), 10.0, dtype=np.float32)
    prediction = truth.copy()
    prediction[:40] = 20.0
    assert DepthEvaluator(crop="garg").update(Deep(truth), prediction)["eigen_rmse_m"] == 0.0
    assert DepthEvaluator(crop="eigen").update(Deep(truth), prediction)["eigen_rmse_m"] > 0.0
    assert DepthEvaluator().update(Deep(truth), prediction)["eigen_rmse_m"] == pytest.approx(10 * math.sqrt(0.4))


@pytest.mark.parametrize(
    ("crop", "inside"), [("garg", (153, 371, 44, 1197)), ("eigen", (124, 342, 44, 1197)), ("none", (0, 375, 0, 1242))]
)
def test_crops_are_the_published_ones(
    crop: Literal["none", "garg", "eigen"], inside: tuple[int, int, int, int]
) -> None:
    """Of KITTI's pictures of 375 x 1242: first and past the last row and column."""
    top, bottom, left, right = inside
    truth = np.full((375, 1242), 10.0, dtype=np.float32)
    prediction = np.full_like(truth, 20.0)
    prediction[top:bottom, left:right] = 10.0
    assert DepthEvaluator(crop=crop).update(Deep(truth), prediction)["eigen_rmse_m"] == 0.0
    for row, column in ((top, left), (bottom - 1, right - 1)):
        one_off = prediction.copy()
        one_off[row, column] = 20.0
        assert DepthEvaluator(crop=crop).update(Deep(truth), one_off)["eigen_rmse_m"] > 0.0


def test_merged_pictures_count_as_if_one_had_seen_them_all() -> None:
    whole, first, second = DepthEvaluator(), DepthEvaluator(), DepthEvaluator()
    truth = np.full((4, 4), 10.0, dtype=np.float32)
    for off, part in ((1.0, first), (2.0, second), (4.0, second)):
        for evaluator in (whole, part):
            evaluator.update(Deep(truth), truth + np.float32(off))
    first.merge(second)
    assert first.result() == whole.result() and first.result()["mae_m"] == pytest.approx(7 / 3)


def test_metrics_are_means_over_pictures() -> None:
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


@pytest.mark.parametrize("crop", ["none", "garg"])
def test_many_pieces_are_one_picture(crop: Literal["none", "garg"]) -> None:
    rng = np.random.default_rng(4)
    truth = np.exp(rng.uniform(0, 6, (300, 3 * PIXELS_AT_ONCE // 280))).astype(np.float32)
    truth[rng.random(truth.shape) < 0.2] = np.nan
    truth[:90] = np.nan
    found = np.nan_to_num(truth, nan=70.0) * rng.uniform(0.6, 1.5, truth.shape).astype(np.float32)
    result = DepthEvaluator(crop=crop).update(Deep(truth), found)
    window = np.zeros(truth.shape, bool)
    top, bottom, left, right = CROPS[crop]
    rows, columns = truth.shape
    window[int(top * rows) : int(bottom * rows), int(left * columns) : int(right * columns)] = True
    known = np.isfinite(truth)
    told = known & (truth <= MAX_PNG_DEPTH_M)
    t, p = truth[told].astype(float), found[told].astype(float).clip(1 / 256, MAX_PNG_DEPTH_M)
    assert result["rmse_m"] == pytest.approx(np.sqrt(np.mean((t - p) ** 2)), rel=1e-8)
    assert result["irmse_per_km"] == pytest.approx(1000 * np.sqrt(np.mean((1 / t - 1 / p) ** 2)), rel=1e-8)
    assert result["silog"] == pytest.approx(100 * np.std(np.log(p) - np.log(t)), rel=1e-8)
    near = known & window & (truth < 80)
    t, p = truth[near].astype(float), found[near].astype(float).clip(1e-3, 80)
    assert result["eigen_d1"] == np.mean(np.maximum(t / p, p / t) < 1.25)
    assert result["eigen_sq_rel"] == pytest.approx(np.mean((t - p) ** 2 / t), rel=1e-8)
    assert result["eigen_rmse_log"] == pytest.approx(np.sqrt(np.mean((np.log(t) - np.log(p)) ** 2)), rel=1e-8)


@pytest.mark.parametrize("ratio", [1.25, 1.25**2, 1.25**3, 1 / 1.25, 1 / 1.25**2, 1 / 1.25**3])
def test_shares_are_those_of_double_precision_even_at_the_bound(ratio: float) -> None:
    truth = np.random.default_rng(7).uniform(2, 30, (60, 70)).astype(np.float32)
    found = (truth * ratio).astype(np.float32)  # rounding alone decides on which side a pixel is
    t, p = truth.astype(float), found.astype(float)
    result = DepthEvaluator().update(Deep(truth), found)
    for name, bound in (("eigen_d1", 1.25), ("eigen_d2", 1.25**2), ("eigen_d3", 1.25**3)):
        assert result[name] == np.mean(np.maximum(t / p, p / t) < bound)


def test_absurd_depths_are_measured_as_files_say_them() -> None:
    truth, found = Deep(np.array([[10.0, 40.0]], dtype=np.float32)), np.array([[1e-38, 3e38]], dtype=np.float32)
    t, p = truth.depth_m.astype(float), np.array([[1 / 256, MAX_PNG_DEPTH_M]])
    result = DepthEvaluator().update(truth, found)
    assert result["rmse_m"] == pytest.approx(np.sqrt(np.mean((t - p) ** 2)))
    assert result["irmse_per_km"] == pytest.approx(1000 * np.sqrt(np.mean((1 / t - 1 / p) ** 2)))
    assert result["log_rmse"] == pytest.approx(np.sqrt(np.mean((np.log(t) - np.log(p)) ** 2)))


@pytest.mark.parametrize("value", [1e-38, 1e-20, 1e20, 3e38])
def test_absurd_depths_have_finite_metrics(value: float) -> None:
    truth, _ = two_pixels()
    result = DepthEvaluator().update(truth, np.full_like(truth.depth_m, value))
    assert all(math.isfinite(metric) for metric in result.values())


@pytest.mark.parametrize("kind", [np.float16, np.float64, np.uint8])
def test_predictions_of_other_types_are_measured_as_they_are_kept(kind: type) -> None:
    truth, found = two_pixels()
    expected = DepthEvaluator().update(truth, found.astype(kind).astype(np.float32))
    assert DepthEvaluator().update(truth, found.astype(kind)) == expected


def test_a_scale_alone_is_no_error_of_scale_invariant_metrics() -> None:
    truth = np.linspace(2, 200, 5000, dtype=np.float32)[None]
    assert DepthEvaluator().update(Deep(truth), truth * np.float32(1.25))["silog"] < 1e-4


@pytest.mark.parametrize("count", [PIXELS_AT_ONCE, 40_001, 1000])
def test_no_metric_depends_on_where_memory_lies(count: int) -> None:
    """OpenCV's sums of float32 differ in the last digits with the alignment of an array."""
    rng = np.random.default_rng(3)
    truth = rng.uniform(2, 79, (1, count)).astype(np.float32)
    found = (truth * rng.lognormal(0, 1, truth.shape)).astype(np.float32).clip(0.1, 79)

    def moved(values: np.ndarray, offset: int) -> np.ndarray:
        room = np.zeros(values.nbytes + 128, np.uint8)
        start = -room.ctypes.data % 64 + offset
        there = room[start : start + values.nbytes].view(values.dtype).reshape(values.shape)
        there[...] = values
        return there

    results = {
        tuple(DepthEvaluator().update(Deep(moved(truth, offset)), moved(found, 60 - offset)).values())
        for offset in range(0, 64, 4)
    }
    assert len(results) == 1


def test_the_metrics_of_eigen_have_their_names_and_definitions() -> None:
    """Eigen et al. 2014, and `eigen_log10` of Laina et al. 2016; thresholds are powers of 1.25."""
    truth = np.array([[10.0, 40.0, 5.0, 20.0]], dtype=np.float32)
    found = np.array([[12.0, 28.0, 9.4, 60.0]], dtype=np.float32)  # off by 1.2, 1.43, 1.88 and 3
    t, p = truth.astype(float), found.astype(float)
    result = DepthEvaluator().update(Deep(truth), found)
    log = np.log(p / t)
    assert {name: value for name, value in result.items() if name.startswith("eigen_")} == pytest.approx(
        {
            "eigen_d1": 1 / 4,
            "eigen_d2": 2 / 4,
            "eigen_d3": 3 / 4,
            "eigen_abs_rel": np.mean(np.abs(p - t) / t),
            "eigen_sq_rel": np.mean((p - t) ** 2 / t),
            "eigen_rmse_m": np.sqrt(np.mean((p - t) ** 2)),
            "eigen_rmse_log": np.sqrt(np.mean(log**2)),
            "eigen_log10": np.mean(np.abs(np.log10(p / t))),
            "eigen_silog": np.sqrt(np.mean(log**2) - 0.5 * np.mean(log) ** 2),
        },
        rel=1e-6,
    )


@pytest.mark.parametrize("edge_m", [1e-3, 80.0])
def test_eigens_range_ends_before_its_bounds(edge_m: float) -> None:
    """As in the published code: ground truth counts where it is greater than one bound and less than the other."""
    truth = np.array([[edge_m, 40.0]], dtype=np.float32)
    assert DepthEvaluator().update(Deep(truth), np.array([[10.0, 40.0]], dtype=np.float32))["eigen_d1"] == 1.0


def test_the_farthest_depth_of_a_picture_counts() -> None:
    truth = np.array([[MAX_PNG_DEPTH_M, 10.0]], dtype=np.float32)
    found = np.array([[300.0, 12.0]], dtype=np.float32)
    assert DepthEvaluator().update(Deep(truth), found)["mae_m"] == pytest.approx((0 + 2) / 2)


@pytest.mark.parametrize(("truth_m", "found_m"), [(2e-38, 256.0), (1.0, 1e25)])
def test_quotients_beyond_single_precision_are_measured(truth_m: float, found_m: float) -> None:
    """The nearest truth in the devkit's metrics, and a far prediction in Eigen's."""
    truth, found = np.array([[truth_m]], dtype=np.float32), np.array([[found_m]], dtype=np.float32)
    result = DepthEvaluator(max_depth_m=1e30).update(Deep(truth), found)
    t, p = float(truth[0, 0]), float(found[0, 0])
    assert result["abs_rel"] == pytest.approx((min(p, MAX_PNG_DEPTH_M) - t) / t)
    if t > 1e-3:
        assert result["eigen_sq_rel"] == pytest.approx((p - t) ** 2 / t)


def test_shares_end_at_one_and_errors_nowhere() -> None:
    for name in ("d1", "d2", "d3", "eigen_d1", "eigen_d3"):
        assert DepthEvaluator().range_of(name) == (0.0, 1.0)
    for name in ("rmse_m", "eigen_rmse_m", "silog"):
        assert DepthEvaluator().range_of(name) == (0.0, math.inf)
