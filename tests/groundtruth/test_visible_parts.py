"""Visible parts of hand-made id buffers, against a count pixel by pixel."""

import numpy as np
import pytest

from gear.groundtruth.visible_parts import gather, visible_parts
from gear.values.frames import GeomTable, SceneObject, Shape
from gear.values.geometry import RigidTransform
from gear.values.labels import LABEL_BY_NAME

RIDER, BICYCLE, CAR = (LABEL_BY_NAME[name].code for name in ("rider", "bicycle", "car"))
EMPTY = Shape(
    vertices_m=np.zeros((0, 3)),
    faces=np.zeros((0, 3), np.int32),
    face_label_code=np.zeros(0, np.uint8),
    box_centre_m=np.zeros(3),
    box_size_m=np.zeros(3),
)
# Geoms: the ground, a rider and a bicycle of object 5, a car (object 2), the ego car (1), a car that is no object.
GEOMS = GeomTable(
    label_code=np.array([0, RIDER, BICYCLE, CAR, CAR, CAR], np.uint8),
    object_id=np.array([-1, 5, 5, 2, 1, 9], np.int32),
    surface_index=np.full(6, -1, np.int16),
)


def thing(number: int, label_code: int, is_ego: bool = False) -> SceneObject:
    pose = RigidTransform.from_yaw("world", "object", (0.0, 0.0, 0.0), 0.0)
    return SceneObject(
        id=number,
        asset="",
        label_code=label_code,
        kitti_type=None,
        is_ego=is_ego,
        world_from_object=pose,
        shape=EMPTY,
    )


OBJECTS = {5: thing(5, BICYCLE), 2: thing(2, CAR), 1: thing(1, CAR, is_ego=True)}


@pytest.mark.parametrize("by_label", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_parts_are_the_pixels_of_their_geoms(by_label: bool, seed: int) -> None:
    """Every part has its tight box, its mask and its number of pixels, and nothing else is a part."""
    rng = np.random.default_rng(seed)
    ids = np.full((90, 40), -1, np.int32)
    for geom in rng.integers(-1, 6, 14):
        top, left = rng.integers(0, 80), rng.integers(0, 34)
        ids[top : top + rng.integers(1, 30), left : left + rng.integers(1, 12)] = geom
    expected = {}
    for geoms, key in (
        (([1], (5, RIDER)), ([2], (5, BICYCLE)), ([3], (2, CAR)))
        if by_label
        else (
            ([1, 2], (5, BICYCLE)),
            ([3], (2, CAR)),
        )
    ):
        if np.isin(ids, geoms).any():
            expected[key] = np.isin(ids, geoms)
    parts = visible_parts(ids, GEOMS, OBJECTS, by_label=by_label)
    assert list(parts) == sorted(expected)
    for key, whole in expected.items():
        part = parts[key]
        rows, columns = np.nonzero(whole)
        assert (part.left_px, part.top_px) == (columns.min(), rows.min())
        np.testing.assert_array_equal(part.mask, whole[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1])
        assert part.count_px == whole.sum()


def test_a_picture_of_nothing_has_no_parts() -> None:
    assert visible_parts(np.full((3, 4), -1, np.int32), GEOMS, OBJECTS, by_label=True) == {}
    assert visible_parts(np.zeros((3, 4), np.int32), GEOMS, OBJECTS, by_label=True) == {}


def test_the_last_entry_of_a_table_stands_for_nothing() -> None:
    np.testing.assert_array_equal(gather(np.array([10, 20, 99]), np.array([[0, -1], [1, 0]])), [[10, 99], [20, 10]])
