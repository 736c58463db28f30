import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gear.formats.kitti_depth import (
    MAX_PNG_DEPTH_M,
    file_list,
    from_metres_file,
    from_units,
    intrinsics_text,
    to_metres_file,
    to_predicted_units,
    to_units,
)
from gear.values.geometry import Intrinsics


@given(hnp.arrays(np.float32, (3, 4), elements=st.floats(0.015625, 255, width=32) | st.just(float("nan"))))
def test_units_are_256ths_of_a_metre(depth_m: np.ndarray) -> None:
    back = from_units(to_units(depth_m))
    np.testing.assert_array_equal(np.isnan(back), np.isnan(depth_m))
    known = ~np.isnan(depth_m)
    np.testing.assert_allclose(back[known], depth_m[known], atol=0.5 / 256 + 1e-5)


def test_what_cannot_be_said_is_no_ground_truth() -> None:
    depth_m = np.array([np.nan, np.inf, 300.0, MAX_PNG_DEPTH_M, 1.0, 0.001], dtype=np.float32)
    np.testing.assert_array_equal(to_units(depth_m), [0, 0, 0, 65535, 256, 0])


def test_a_prediction_beyond_16_bits_is_still_one() -> None:
    """The devkit takes 0 for no prediction and fills it in: what lies too far would be measured as its neighbours."""
    depth_m = np.array([np.nan, np.inf, 300.0, MAX_PNG_DEPTH_M, 1.0, 0.001], dtype=np.float32)
    np.testing.assert_array_equal(to_predicted_units(depth_m), [0, 65535, 65535, 65535, 256, 1])


@given(hnp.arrays(np.float32, (3, 4), elements=st.floats(0.015625, 1e4, width=32) | st.just(float("nan"))))
def test_metres_come_back(depth_m: np.ndarray) -> None:
    stored = to_metres_file(depth_m)
    assert np.isfinite(stored).all()
    np.testing.assert_array_equal(from_metres_file(stored), depth_m)


def test_a_file_of_metres_holds_nought_for_what_is_not_finite() -> None:
    depth_m = np.array([np.nan, np.inf, -np.inf, 2.5], dtype=np.float32)
    np.testing.assert_array_equal(to_metres_file(depth_m), [0, 0, 0, 2.5])


def test_list_lines() -> None:
    text = file_list([("a/0.png", "b/0.tiff"), ("a/1.png", "b/1.tiff")])
    assert text == b"/a/0.png /b/0.tiff\n/a/1.png /b/1.tiff"


def test_intrinsics_are_one_line_of_nine() -> None:
    numbers = intrinsics_text(Intrinsics(1224, 370, 612.0).matrix).decode().split()
    assert [float(v) for v in numbers] == [612, 0, 611.5, 0, 612, 184.5, 0, 0, 1]
