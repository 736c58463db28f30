from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from gear.groundtruth.label_maps import coarsen, instance_map, label_map
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import CAR, PERSON, TRAFFIC_LIGHT, Part, Thing
from gear.values.frames import GeomTable
from gear.values.labels import LABEL_BY_NAME
from gear.values.rig import CameraMount, Rig

RIG = Rig(cameras=(CameraMount(name="left", width_px=320, height_px=160),))


def test_instances_are_numbered_by_class() -> None:
    things = [
        Thing(parts=parts, position_m=(12.0, left, 0.0), object_id=number, role="npc")
        for number, (parts, left) in enumerate([(CAR, 4.0), (PERSON, 1.0), (CAR, -2.0)], start=2)
    ]
    things.append(Thing(parts=TRAFFIC_LIGHT, position_m=(14.0, -5.0, 0.0), object_id=1000))
    frame, _ = synthetic_frame(RIG, things)
    ids = frame.views["left"].geom_id
    instances = instance_map(ids, frame.geoms, frame.objects)
    assert instances.dtype == np.uint16
    of_geom = [set(np.unique(instances[ids == geom])) for geom in range(5)]
    # The ground, two cars, a person, and a light that has no instances in Cityscapes.
    assert of_geom == [{7}, {26000}, {24000}, {26001}, {19}]
    assert set(np.unique(instances[ids == -1])) == {23}
    np.testing.assert_array_equal(np.unique(label_map(instances)), [7, 19, 23, 24, 26])


def test_an_object_of_many_geoms_is_one_instance_and_the_ego_car_is_none() -> None:
    roof = Part(label="car", centre_m=(0.0, 0.0, 1.7), size_m=(2.0, 1.6, 0.4))
    things = [
        Thing(parts=CAR, position_m=(12.0, 3.0, 0.0), object_id=1, role="ego"),
        Thing(parts=(*CAR, roof), position_m=(12.0, 0.0, 0.0), object_id=2, role="npc"),
        Thing(parts=(*CAR, roof), position_m=(12.0, -3.0, 0.0), object_id=3, role="npc"),
    ]
    frame, _ = synthetic_frame(RIG, things)
    ids = frame.views["left"].geom_id
    instances = instance_map(ids, frame.geoms, frame.objects)
    assert [set(np.unique(instances[ids == geom])) for geom in range(1, 6)] == [
        {1}, {26000}, {26000}, {26001}, {26001}
    ]  # fmt: skip


def test_after_a_thousand_instances_of_a_class_the_rest_have_the_class_alone() -> None:
    """The thousand and first would be the first of the next class."""
    car = LABEL_BY_NAME["car"].code
    geoms = GeomTable(
        label_code=np.full(1002, car, np.uint8),
        object_id=np.arange(1002, dtype=np.int32),
        surface_index=np.full(1002, -1, np.int16),
    )
    frame, _ = synthetic_frame(RIG, [Thing(parts=CAR, position_m=(12.0, 0.0, 0.0), object_id=2, role="npc")])
    objects = {number: replace(frame.objects[2], id=number) for number in range(1002)}
    instances = instance_map(np.arange(1002, dtype=np.int32)[None], geoms, objects)
    assert instances[0].tolist() == [*range(26000, 27000), 26, 26]


@given(st.integers(0, 2**32 - 1), st.sampled_from([1, 3, 5, 9]), st.integers(1, 6))
@settings(max_examples=40, deadline=None)
def test_coarse_maps_hold_what_fills_most_of_each_window(seed: int, window_px: int, labels: int) -> None:
    instances = np.random.default_rng(seed).integers(0, labels, (9, 13)).astype(np.uint16)
    expected, reach = instances.copy(), window_px // 2
    for (y, x), own in np.ndenumerate(instances):
        around = instances[max(0, y - reach) : y + reach + 1, max(0, x - reach) : x + reach + 1]
        values, counts = np.unique(around, return_counts=True)
        expected[y, x] = values[np.argmax(2 * counts + (values == own))]
    np.testing.assert_array_equal(coarsen(instances, window_px), expected)


def test_coarse_maps_keep_borders_and_lose_specks() -> None:
    instances = np.full((60, 80), 11, dtype=np.uint16)
    instances[:, 40:] = 21
    instances[20:22, 10:12] = 20
    instances[:, 60] = 17
    instances[30:50, 5:25] = 26003
    coarse = coarsen(instances, 9)
    assert set(np.unique(coarse)) == {11, 21, 26003}
    np.testing.assert_array_equal(coarse[0:15, :], np.where(np.arange(80) < 40, 11, 21)[None].repeat(15, axis=0))
    assert (coarse[33:47, 8:22] == 26003).all()
    assert instances[20, 10] == 20, "the input is untouched"


def test_a_crowd_is_not_outvoted_by_what_stands_behind_it() -> None:
    """Each pixel of the crowd has more of the wall around it than of any one person, and more people than wall."""
    people = 24000 + np.arange(40 * 60, dtype=np.uint16).reshape(40, 60) // 3 % 40
    instances = np.where(np.arange(40)[:, None] % 5 < 3, people, np.uint16(11)).astype(np.uint16)
    coarse = coarsen(instances, 9)
    assert (label_map(coarse)[4:-4] == 24).all()
    np.testing.assert_array_equal(label_map(coarse), coarsen(label_map(instances).astype(np.uint16), 9))
    for y, x in ((10, 20), (13, 31), (21, 44)):
        around = instances[y - 4 : y + 5, x - 4 : x + 5]
        shares = {value: (around == value).sum() for value in np.unique(around) if value >= 24000}
        assert shares[coarse[y, x]] == max(shares.values())


def test_coarse_ties_stay() -> None:
    checker = (np.indices((20, 20)).sum(axis=0) // 10 % 2).astype(np.uint16) + 11
    np.testing.assert_array_equal(coarsen(checker, 3)[12:18, 12:18], checker[12:18, 12:18])


def test_a_single_pixel_goes_to_what_surrounds_it() -> None:
    for row, column in ((4, 6), (0, 0), (8, 12)):
        instances = np.full((9, 13), 11, dtype=np.uint16)
        instances[row, column] = 20
        assert (coarsen(instances, 3) == 11).all()
        np.testing.assert_array_equal(coarsen(instances, 1), instances)
