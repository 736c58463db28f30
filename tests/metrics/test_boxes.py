import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from gear.metrics.boxes import footprints, intersection_over_first, iou_2d, iou_ground_and_space


def boxes(seed: int, count: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    sizes = rng.uniform([1.0, 0.5, 0.5], [2.5, 2.5, 8.0], (count, 3))
    places = rng.uniform([-4, 1.2, 6], [4, 2.0, 14], (count, 3))
    turns = rng.choice([0.0, np.pi / 2, -np.pi], count) + rng.choice([0.0, 1.0], count) * rng.uniform(-2, 2, count)
    return np.concatenate([sizes, places, turns[:, None]], axis=1)


def by_shapely(a: np.ndarray, b: np.ndarray) -> tuple[float, float]:
    """Overlap from above and in space, one pair at a time."""
    first, second = shapely.Polygon(footprints(a[None])[0]), shapely.Polygon(footprints(b[None])[0])
    shared = first.intersection(second).area
    height = max(0.0, min(a[4], b[4]) - max(a[4] - a[0], b[4] - b[0]))
    volume = np.prod(a[:3]) + np.prod(b[:3]) - shared * height
    return shared / first.union(second).area, shared * height / volume


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_turned_boxes_overlap_as_polygons_do(seed: int) -> None:
    a, b = boxes(seed, 6), boxes(seed + 1, 5)
    ground, space = iou_ground_and_space(a, b)
    for i in range(6):
        for j in range(5):
            assert (ground[i, j], space[i, j]) == pytest.approx(by_shapely(a[i], b[j]), abs=1e-9)


def test_the_iou_of_a_box_with_itself_is_one() -> None:
    same = boxes(4, 50)
    ground, space = iou_ground_and_space(same, same)
    np.testing.assert_allclose(np.diag(ground), 1.0, atol=1e-9)
    np.testing.assert_allclose(np.diag(space), 1.0, atol=1e-9)
    turned = same.copy()
    turned[:, 6] += np.pi
    np.testing.assert_allclose(np.diag(iou_ground_and_space(same, turned)[0]), 1.0, atol=1e-9)


def test_by_hand() -> None:
    a = np.array([[2.0, 2.0, 4.0, 0.0, 2.0, 10.0, 0.0]])
    shifted = np.array([[2.0, 2.0, 4.0, 1.0, 2.0, 10.0, 0.0]])
    assert iou_ground_and_space(a, shifted)[0][0, 0] == pytest.approx(3 / 5)
    lifted = np.array([[2.0, 2.0, 4.0, 0.0, 1.0, 10.0, 0.0]])
    assert iou_ground_and_space(a, lifted)[1][0, 0] == pytest.approx(1 / 3)
    across = np.array([[2.0, 2.0, 4.0, 0.0, 2.0, 10.0, np.pi / 2]])
    assert iou_ground_and_space(a, across)[0][0, 0] == pytest.approx(4 / 12)


def test_the_front_points_where_rotation_y_says() -> None:
    corners = footprints(np.array([[1.5, 1.8, 4.2, 0.0, 1.65, 10.0, -np.pi / 2]]))[0]
    # Driving away: the length lies along z.
    assert np.ptp(corners[:, 1]) == pytest.approx(4.2) and np.ptp(corners[:, 0]) == pytest.approx(1.8)


def test_upright_boxes() -> None:
    a, b = np.array([[0.0, 0, 10, 10]]), np.array([[5.0, 0, 15, 10], [20, 20, 30, 30], [2, 2, 4, 4]])
    np.testing.assert_allclose(iou_2d(a, b), [[1 / 3, 0, 0.04]])
    np.testing.assert_allclose(intersection_over_first(b, a), [[0.5], [0], [1]])


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_upright_boxes_overlap_as_polygons_do(seed: int) -> None:
    low, size = (
        np.random.default_rng(seed).uniform((0, 0, 1, 1), (60, 20, 90, 40), (9, 4)).reshape(9, 2, 2).swapaxes(0, 1)
    )
    a, b = np.split(np.concatenate([low, low + size], axis=1), [4])
    for i, one in enumerate(a):
        for j, two in enumerate(b):
            first, second = shapely.box(*one), shapely.box(*two)
            shared = first.intersection(second).area
            assert iou_2d(a, b)[i, j] == pytest.approx(shared / first.union(second).area, abs=1e-9)
            assert intersection_over_first(a, b)[i, j] == pytest.approx(shared / first.area, abs=1e-9)


def test_nothing_overlaps_nothing() -> None:
    none = np.zeros((0, 7))
    assert iou_ground_and_space(none, boxes(1, 3))[0].shape == (0, 3)
    assert iou_2d(np.zeros((0, 4)), np.zeros((2, 4))).shape == (0, 2)
