import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gear.groundtruth import silhouettes
from gear.groundtruth.silhouettes import NEAR_M, bounds, clip_near, count, fill, project_mesh
from gear.values.geometry import Intrinsics

WINDOW = (0, 0, 40, 30)
coordinate = st.floats(-60, 90, allow_nan=False).map(lambda v: round(v, 3) + 0.0004)


def by_edge_functions(triangle: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Inside, and too close to an edge to say."""
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    signs, nearest = [], np.full((height, width), np.inf)
    for i in range(3):
        (x0, y0), (x1, y1) = triangle[i], triangle[(i + 1) % 3]
        value = (x1 - x0) * (y - y0) - (y1 - y0) * (x - x0)
        signs.append(value > 0)
        nearest = np.minimum(nearest, np.abs(value))
    return (signs[0] & signs[1] & signs[2]) | ~(signs[0] | signs[1] | signs[2]), nearest < 1e-6


def test_a_rectangle_covers_the_pixels_whose_centres_are_in_it() -> None:
    corners = np.array([[1.2, 2.1], [5.7, 2.1], [5.7, 4.9], [1.2, 4.9]])
    mask = fill(corners[[[0, 1, 2], [0, 2, 3]]], WINDOW)
    rows, columns = np.nonzero(mask)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (3, 4, 2, 5)
    assert mask.sum() == 8


def test_edges_through_centres_count_on_the_left_and_at_the_top() -> None:
    corners = np.array([[1.0, 2.0], [4.0, 2.0], [4.0, 5.0], [1.0, 5.0]])
    mask = fill(corners[[[0, 1, 2], [0, 2, 3]]], WINDOW)
    rows, columns = np.nonzero(mask)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (2, 4, 1, 3)
    assert mask.sum() == 9


@given(st.lists(st.tuples(coordinate, coordinate), min_size=3, max_size=3))
@settings(max_examples=150, deadline=None)
def test_a_triangle_is_what_its_edges_enclose(points: list[tuple[float, float]]) -> None:
    triangle = np.array(points)
    expected, unsure = by_edge_functions(triangle, 40, 30)
    mask = fill(triangle[None], WINDOW)
    assert not ((mask != expected) & ~unsure).any()


def test_many_triangles_are_the_union() -> None:
    rng = np.random.default_rng(3)
    triangles = rng.uniform(-10, 50, (200, 1, 2)) + rng.uniform(-6, 6, (200, 3, 2))
    expected = np.any([fill(t[None], WINDOW) for t in triangles], axis=0)
    np.testing.assert_array_equal(fill(triangles, WINDOW), expected)


@pytest.mark.parametrize("portion", [1, 7, 100])
def test_triangles_may_be_filled_in_portions(portion: int, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(5)
    triangles = rng.uniform(-10, 50, (60, 1, 2)) + rng.uniform(-9, 9, (60, 3, 2))
    whole = fill(triangles, WINDOW)
    monkeypatch.setattr(silhouettes, "SPANS_AT_ONCE", portion)
    np.testing.assert_array_equal(fill(triangles, WINDOW), whole)


@given(st.integers(0, 2**32 - 1), st.integers(1, 60), st.sampled_from([1, 50, 10_000]))
@settings(max_examples=60, deadline=None)
def test_counts_are_those_of_masks(seed: int, triangles: int, portion: int) -> None:
    rng = np.random.default_rng(seed)
    corners = rng.uniform(-20, 60, (triangles, 1, 2)) + rng.uniform(-30, 30, (triangles, 3, 2))
    expected = int(fill(corners, WINDOW).sum())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(silhouettes, "SPANS_AT_ONCE", portion)
        assert count(corners, WINDOW, 30) == count(corners, WINDOW, 1000) == expected


@pytest.mark.parametrize("step", [3, 5])
def test_rows_that_stand_for_others_are_those_in_their_middle(step: int) -> None:
    triangles = np.random.default_rng(6).uniform(-10, 50, (4, 3, 2))
    window = (-15, -10, 55, -10 + 12 * step)
    assert count(triangles, window, 12) == step * fill(triangles, window)[step // 2 :: step].sum()


def test_bounds_are_the_smallest_window_that_holds_all_covered_pixels() -> None:
    corners = np.array([[1.2, -2.1], [5.7, -2.1], [5.7, 4.0], [1.2, 4.0]])
    window = bounds(corners[[[0, 1, 2], [0, 2, 3]]])
    assert window == (2, -2, 6, 4)
    assert fill(corners[[[0, 1, 2], [0, 2, 3]]], window).all()


def test_windows_may_lie_anywhere() -> None:
    triangle = np.array([[[-30.5, -20.5], [25.5, -12.0], [-3.0, 60.5]]])
    whole = fill(triangle, (-40, -30, 40, 70))
    np.testing.assert_array_equal(fill(triangle, (-5, 3, 12, 20)), whole[33:50, 35:52])


def test_few_rows_keep_the_area() -> None:
    triangle = np.array([[[0.0, 0.0], [20_000.0, 3000.0], [5000.0, 15_000.0]]])
    area = 0.5 * (20_000 * 15_000 - 5000 * 3000)
    assert count(triangle, bounds(triangle), 500) == pytest.approx(area, rel=1e-4)


def test_nothing_gives_nothing() -> None:
    assert bounds(np.zeros((0, 3, 2))) == (0, 0, 0, 0)
    assert fill(np.zeros((0, 3, 2)), WINDOW).shape == (30, 40)
    assert not fill(np.zeros((0, 3, 2)), WINDOW).any()
    assert count(np.zeros((0, 3, 2)), WINDOW, 9) == 0
    for empty in ((5, 0, 5, 9), (0, 7, 9, 7), (9, 0, 5, 9)):
        assert count(np.array([[[0.0, 0.0], [20.0, 3.0], [5.0, 15.0]]]), empty, 9) == 0


def test_the_near_plane_cuts_triangles() -> None:
    corners = np.array([[[0.0, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 0, 1], [1, 0, -1], [-1, 0, -1]], [[0, 0, -1]] * 3])
    cut = clip_near(corners)
    # One corner behind leaves two triangles, two behind leave one, three none.
    assert len(cut) == 3
    assert cut[..., 2].min() == pytest.approx(NEAR_M)
    span = cut[np.abs(cut[..., 2] - NEAR_M) < 1e-9][:, 0]
    assert np.abs(span).max() <= 0.55 + 1e-9


def test_a_plane_through_the_camera_projects_below_the_horizon_only() -> None:
    ground = np.array([[-5.0, 1.5, -3.0], [5.0, 1.5, -3.0], [5.0, 1.5, 20.0], [-5.0, 1.5, 20.0]])
    pinhole = Intrinsics(40, 30, 20.0)
    triangles = project_mesh(ground, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32), pinhole)
    mask = fill(triangles, WINDOW)
    horizon = pinhole.cy_px + 1.5 / 20 * 20.0
    assert not mask[: int(horizon)].any()
    assert mask[-1].all()


def test_an_empty_window_has_a_mask_of_its_own_shape() -> None:
    triangle = np.array([[[0.0, 0.0], [0.0, 9.0], [9.0, 0.0]]])
    assert fill(triangle, (0, 5, 7, 5)).shape == (0, 7)
    assert fill(triangle, (5, 0, 5, 7)).shape == (7, 0)
    assert fill(triangle, (5, 6, 2, 1)).shape == (0, 0)
