from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from gear.camera.effects import Lens
from gear.groundtruth import objects
from gear.groundtruth.objects import in_camera, observe_objects
from gear.groundtruth.silhouettes import bounds, fill, project_mesh
from gear.testing.synthetic import behind_lens, synthetic_frame
from gear.testing.things import CAR, CYCLIST, PERSON, TRUCK, Thing, board, street
from gear.values.frames import Frame
from gear.values.labels import LABEL_BY_NAME
from gear.values.rig import CameraMount, Rig

RIG = Rig(cameras=(CameraMount(name="left", width_px=612, height_px=185),))
# The same pinhole with three times the picture around it: 90 degrees to 143.1.
WIDE = Rig(cameras=(CameraMount(name="left", width_px=1836, height_px=555, hfov_deg=2 * np.degrees(np.arctan(3.0))),))


def observe(frame: Frame, **options: Any) -> tuple[Any, ...]:
    return observe_objects(frame.views["left"], frame.geoms, frame.objects, **options)


def thing(parts: Any, ahead_m: float, left_m: float, yaw_rad: float = 0.3, number: int = 2) -> Thing:
    return Thing(parts=parts, position_m=(ahead_m, left_m, 0.0), yaw_rad=yaw_rad, object_id=number, role="npc")


@pytest.mark.parametrize("index", range(3))
def test_every_silhouette_is_what_the_object_shows_alone(index: int) -> None:
    things = street(7, index)
    frame, _ = synthetic_frame(RIG, things)
    truths = observe(frame, by_label=False)
    assert len(truths) > 6
    for truth in truths:
        alone, _ = synthetic_frame(RIG, [t for t in things if t.object_id == truth.object_id])
        (single,) = observe(alone, by_label=False)
        silhouette = alone.geoms.object_id[np.maximum(alone.views["left"].geom_id, 0)] == truth.object_id
        assert truth.amodal_in_image_px == int((silhouette & (alone.views["left"].geom_id >= 0)).sum())
        assert truth.amodal_box == single.visible_box
        assert single.visible_fraction == 1.0 and single.occluded_fraction == 0.0


def test_visible_pixels_are_counted_on_the_id_buffer() -> None:
    frame, _ = synthetic_frame(RIG)
    ids = frame.views["left"].geom_id
    for truth in observe(frame):
        geoms = np.flatnonzero(
            (frame.geoms.object_id == truth.object_id) & (frame.geoms.label_code == truth.label_code)
        )
        expected = np.isin(ids, geoms)
        left, top, right, bottom = (int(v) for v in truth.visible_box)
        drawn = np.zeros_like(expected)
        drawn[top:bottom, left:right] = truth.mask
        np.testing.assert_array_equal(drawn, expected)
        assert truth.visible_px == expected.sum() == truth.mask.sum()
        assert truth.mask.any(axis=0).all() or truth.mask.any(axis=1)[[0, -1]].all()


def test_what_leaves_the_picture_is_counted_outside_it() -> None:
    truck = [thing(TRUCK, 9.5, 5.5)]
    (cut,) = observe(synthetic_frame(RIG, truck)[0])
    (whole,) = observe(synthetic_frame(WIDE, truck)[0])
    assert whole.truncated_fraction == 0 and 0.2 < cut.truncated_fraction < 0.8
    assert cut.amodal_px == whole.amodal_px
    assert cut.amodal_in_image_px == cut.visible_px
    shifted = [v - d for v, d in zip(whole.amodal_box, (612, 185, 612, 185), strict=True)]
    assert list(cut.amodal_box) == pytest.approx(shifted, abs=1)


@pytest.mark.parametrize(("ahead_m", "left_m"), [(6.0, 3.9), (6.0, -4.4), (4.0, 0.4)])
def test_small_things_that_leave_the_picture_are_counted_to_the_pixel(ahead_m: float, left_m: float) -> None:
    """On the left, on the right and at the bottom."""
    person = [thing(PERSON, ahead_m, left_m)]
    (cut,) = observe(synthetic_frame(RIG, person)[0])
    (whole,) = observe(synthetic_frame(WIDE, person)[0])
    assert 0.05 < cut.truncated_fraction < 0.95 and whole.truncated_fraction == 0
    assert (cut.amodal_px, cut.amodal_in_image_px) == (whole.amodal_px, cut.visible_px)


@pytest.mark.parametrize(("parts", "ahead_m", "left_m"), [(CAR, 5.0, 3.0), (CAR, 2.0, 0.8), (TRUCK, 7.0, 6.0)])
@pytest.mark.parametrize("most_rows", [4096, 200])
def test_large_things_that_leave_the_picture_are_counted_to_a_thousandth(
    parts: Any, ahead_m: float, left_m: float, most_rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(objects, "MOST_ROWS", most_rows)
    frame, _ = synthetic_frame(RIG, [thing(parts, ahead_m, left_m)])
    (cut,) = observe(frame, by_label=False)
    camera, shown = frame.views["left"].camera, frame.objects[2]
    triangles = project_mesh(in_camera(shown, camera), shown.shape.faces, camera.intrinsics)
    whole = bounds(triangles)
    assert max(whole[2] - whole[0], whole[3] - whole[1]) > 512
    outside = int(fill(triangles, whole).sum()) - int(fill(triangles, (0, 0, 612, 185)).sum())
    assert cut.amodal_px - cut.amodal_in_image_px == pytest.approx(outside, rel=0 if most_rows == 4096 else 1e-3)


def test_pixels_that_the_triangles_just_miss_are_part_of_the_object() -> None:
    """A renderer rounds on its own: what it shows is there, at the silhouette's border or where no silhouette is."""
    frame, _ = synthetic_frame(RIG, [thing(CAR, 12.0, 1.0), thing(CAR, -20.0, 0.0, 0.0, 3)])
    view = frame.views["left"]
    (plain,) = observe(frame)
    left, top, right, bottom = (int(v) for v in plain.visible_box)
    ids = view.geom_id.copy()
    ids[top + 3, left - 1], ids[5, 7] = 1, 2
    seen, behind = observe(replace(frame, views={"left": replace(view, geom_id=ids)}))
    assert seen.visible_box == seen.amodal_box == (left - 1, top, right, bottom)
    assert seen.visible_px == seen.amodal_px == plain.visible_px + 1 and seen.occluded_fraction == 0
    assert behind.visible_box == behind.amodal_box == (7, 5, 8, 6)
    assert (behind.visible_px, behind.amodal_px, behind.amodal_in_image_px) == (1, 1, 1)


def test_a_truck_through_the_image_plane_stays_finite() -> None:
    (beside,) = observe(synthetic_frame(RIG, [thing(TRUCK, 3.5, 3.4, 0.0)])[0])
    assert beside.visible_px > 1000
    assert beside.amodal_px >= beside.amodal_in_image_px >= beside.visible_px
    assert beside.truncated_fraction > 0.9
    assert beside.occluded_fraction == 0


def test_a_cyclist_has_two_parts_and_is_one_object() -> None:
    frame, _ = synthetic_frame(RIG, [thing(CYCLIST, 9.0, 0.0)])
    parts = observe(frame)
    assert [t.label_code for t in parts] == [LABEL_BY_NAME["rider"].code, LABEL_BY_NAME["bicycle"].code]
    (whole,) = observe(frame, by_label=False)
    assert whole.label_code == LABEL_BY_NAME["bicycle"].code
    assert whole.visible_px == sum(t.visible_px for t in parts)
    # Parts hide each other, so their silhouettes add up to more than the whole.
    assert whole.amodal_px <= sum(t.amodal_px for t in parts)


def test_hidden_objects_appear_on_request_alone() -> None:
    frame, _ = synthetic_frame(RIG, [board(12.0), thing(CAR, 20.0, 0.0), thing(CAR, -20.0, 0.0, 0.0, 3)])
    assert observe(frame) == ()
    (hidden,) = observe(frame, include_hidden=True)
    assert hidden.object_id == 2
    assert hidden.visible_px == 0 and hidden.visible_box is None and hidden.mask.size == 0
    assert hidden.occluded_fraction == 1.0 and hidden.visible_fraction == 0.0


def test_the_ego_car_is_no_object() -> None:
    ego = Thing(parts=CAR, position_m=(9.0, 0.0, 0.0), object_id=1, role="ego")
    assert observe(synthetic_frame(RIG, [ego])[0], include_hidden=True) == ()


@pytest.mark.parametrize("k1", [-0.3, -0.1, 0.1, 0.3])
def test_behind_a_lens_what_nothing_covers_is_not_occluded(k1: float) -> None:
    lens = Lens(k1=k1)
    for parts, ahead_m, left_m in ((CAR, 16.0, 8.0), (TRUCK, 26.0, -9.0), (CAR, 30.0, -3.0), (CYCLIST, 12.0, 6.0)):
        (truth,) = observe(behind_lens(synthetic_frame(RIG, [thing(parts, ahead_m, left_m)])[0], lens), by_label=False)
        assert truth.occluded_fraction < 0.005 and truth.truncated_fraction == 0
        assert truth.amodal_box == truth.visible_box


@pytest.mark.parametrize("k1", [-0.3, 0.3])
def test_behind_a_lens_silhouettes_are_what_objects_show_alone(k1: float) -> None:
    things, lens = street(7, 1), Lens(k1=k1)
    truths = observe(behind_lens(synthetic_frame(RIG, things)[0], lens), by_label=False)
    whole = [truth for truth in truths if truth.truncated_fraction == 0]
    assert len(whole) > 5 and max(truth.occluded_fraction for truth in whole) > 0.1
    for truth in whole:
        alone = behind_lens(synthetic_frame(RIG, [t for t in things if t.object_id == truth.object_id])[0], lens)
        (single,) = observe(alone, by_label=False)
        assert truth.amodal_in_image_px == single.visible_px
        assert truth.amodal_box == single.visible_box


@pytest.mark.parametrize("k1", [-0.3, 0.2])
def test_behind_a_lens_what_leaves_the_picture_is_counted_outside_it(k1: float) -> None:
    truck = [thing(TRUCK, 9.5, 5.5)]
    frame = behind_lens(synthetic_frame(RIG, truck)[0], Lens(k1=k1))
    (cut,) = observe(frame)
    assert cut.amodal_in_image_px == cut.visible_px
    assert 0.1 < cut.truncated_fraction < 0.9
    assert cut.amodal_box[1] < 0 or cut.amodal_box[0] < 0
    (beside,) = observe(behind_lens(synthetic_frame(RIG, [thing(TRUCK, 3.5, 3.4, 0.0)])[0], Lens(k1=k1)))
    assert beside.amodal_px >= beside.amodal_in_image_px >= beside.visible_px > 1000
    assert beside.truncated_fraction > 0.8
