import numpy as np

from gear.groundtruth.labelmaps import coarsen, instance_map, label_map
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import CAR, PERSON, TRAFFIC_LIGHT, Thing
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


def test_coarse_ties_stay() -> None:
    checker = (np.indices((20, 20)).sum(axis=0) // 10 % 2).astype(np.uint16) + 11
    np.testing.assert_array_equal(coarsen(checker, 3)[12:18, 12:18], checker[12:18, 12:18])
