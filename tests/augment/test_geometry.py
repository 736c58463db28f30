"""Mirrors and windows, held against geometry: what is measured on a moved picture is what moving the truth says."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import numpy as np
import pytest

from gear.augment.geometry import Window, cut_map, cut_picture, draw_window, whole_window
from gear.augment.registry import geometry_of
from gear.formats import rle
from gear.groundtruth.visibility import Visibility
from gear.plugins.build import build_task
from gear.testing.synthetic import synthetic_frame
from gear.testing.things import CAR, PERSON, TRUCK, VAN, Thing
from gear.values.rng import derive_rng

WIDTH, HEIGHT = 192, 96
TASKS = ("semseg", "depth", "detect2d", "stereo3d")


def sample_of(name: str, index: int = 0) -> Any:
    spec, _ = build_task(name)
    task = spec.build(spec.config(width_px=WIDTH, height_px=HEIGHT))
    return task.ground_truth(*synthetic_frame(task.rig(), index=index, seed=3))


def moved(sample: Any, window: Window | None = None) -> Any:
    geometry = geometry_of(sample)
    assert geometry is not None
    return geometry.flip(sample) if window is None else geometry.cut(sample, window)


def window(left: int, top: int, width: int, height: int, out: tuple[int, int] | None = None) -> Window:
    out_width, out_height = out or (width, height)
    return Window(
        left_px=left, top_px=top, width_px=width, height_px=height, out_width_px=out_width, out_height_px=out_height
    )


def plain(value: Any) -> Any:
    return [f"{getattr(value, field.name)}" for field in dataclasses.fields(value)]


@pytest.mark.parametrize("task", TASKS)
def test_two_mirrors_are_none(task: str) -> None:
    sample = sample_of(task)
    twice = moved(moved(sample))
    for name, picture in sample.images.items():
        assert np.array_equal(twice.images[name], picture)
    for name in ("label_ids", "instance_ids", "depth_m"):
        if hasattr(sample, name):
            assert np.array_equal(getattr(twice, name), getattr(sample, name), equal_nan=True)
    for one, two in zip(getattr(sample, "objects", ()), getattr(twice, "objects", ()), strict=True):
        assert np.allclose(one.box_px, two.box_px) and one.is_ignored == two.is_ignored
        if task == "stereo3d":
            assert np.allclose(one.box.bottom_m, two.box.bottom_m)
            assert math.cos(one.box.rotation_y_rad - two.box.rotation_y_rad) == pytest.approx(1)
        else:
            assert plain(one) == plain(two)


@pytest.mark.parametrize("task", TASKS)
def test_moving_leaves_what_it_was_given(task: str) -> None:
    sample = sample_of(task)
    for picture in sample.images.values():
        picture.setflags(write=False)
    before = {name: picture.copy() for name, picture in sample.images.items()}
    moved(sample)
    moved(sample, window(16, 8, 160, 80, (80, 40)))
    assert all(np.array_equal(before[name], picture) for name, picture in sample.images.items())


def test_boxes_and_masks_of_a_mirror_lie_on_the_same_things() -> None:
    sample = sample_of("detect2d")
    assert sample.objects
    for thing, other in zip(sample.objects, moved(sample).objects, strict=True):
        mask = rle.decode(other.rle, HEIGHT, WIDTH)
        assert np.array_equal(mask[:, ::-1], rle.decode(thing.rle, HEIGHT, WIDTH))
        columns = np.flatnonzero(mask.any(axis=0))
        assert (other.box_px[0], other.box_px[2]) == (columns[0], columns[-1] + 1)
        for before, after in ((thing.box_px, other.box_px), (thing.amodal_box_px, other.amodal_box_px)):
            assert after == (WIDTH - before[2], before[1], WIDTH - before[0], before[3])


@pytest.mark.parametrize("shape", [(0, 0, 192, 96), (40, 10, 100, 60), (-20, -10, 232, 116), (64, 40, 64, 32)])
def test_boxes_in_a_window_are_those_of_their_masks(shape: tuple[int, int, int, int]) -> None:
    sample, part = sample_of("detect2d"), window(*shape)
    result = moved(sample, part)
    by_id = {(thing.object_id, thing.label): thing for thing in sample.objects}
    for thing in result.objects:
        mask = rle.decode(thing.rle, part.out_height_px, part.out_width_px)
        before = by_id[(thing.object_id, thing.label)]
        expected = cut_map(rle.decode(before.rle, HEIGHT, WIDTH).astype(np.uint8), part, 0)
        assert np.array_equal(mask, expected.astype(bool)) and thing.area_px == mask.sum()
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        assert thing.box_px == (columns[0], rows[0], columns[-1] + 1, rows[-1] + 1)
        kept = thing.area_px / before.area_px
        side_px = min(columns[-1] + 1 - columns[0], rows[-1] + 1 - rows[0])
        assert thing.is_ignored == (before.is_ignored or kept < 0.3 or side_px < 4)
        assert thing.visible_fraction == pytest.approx(before.visible_fraction * kept)
    left_out = by_id.keys() - {(thing.object_id, thing.label) for thing in result.objects}
    for key in left_out:
        assert not cut_map(rle.decode(by_id[key].rle, HEIGHT, WIDTH).astype(np.uint8), part, 0).any()


@pytest.mark.parametrize(
    ("shape", "shown"),
    [
        ((0, 0, 192, 96), 1.0),
        ((-40, -20, 272, 136), 1.0),
        ((10, 0, 100, 96), 0.5),
        ((-40, 0, 272, 45), 0.5),
        ((-40, 45, 272, 51), 0.5),
    ],
)
def test_what_leaves_a_window_is_truncated_and_padding_shows_nothing(
    shape: tuple[int, int, int, int], shown: float
) -> None:
    """A third of its box lies to the left of the picture, 20 x 30 pixels in it, half of which are covered."""
    sample = sample_of("detect2d")
    mask = np.zeros((HEIGHT, WIDTH), np.bool_)
    mask[30:60:2, :20] = True
    thing = dataclasses.replace(
        sample.objects[0], box_px=(0.0, 30.0, 20.0, 59.0), amodal_box_px=(-10.0, 30.0, 20.0, 60.0),
        area_px=int(mask.sum()), rle=rle.encode(mask), visible_fraction=1 / 3, occluded_fraction=0.5,
        truncated_fraction=1 / 3,
    )  # fmt: skip
    (result,) = moved(dataclasses.replace(sample, objects=(thing,)), window(*shape)).objects
    assert result.truncated_fraction == pytest.approx(1 - 2 / 3 * shown)
    assert result.visible_fraction == pytest.approx(shown / 3, abs=0.03)
    assert result.occluded_fraction == pytest.approx(0.5, abs=0.04)
    left, top = shape[:2]
    assert result.amodal_box_px == (-10.0 - left, 30.0 - top, 20.0 - left, 60.0 - top)


def test_labels_stay_labels_and_nothing_is_known_beyond_the_picture() -> None:
    sample = sample_of("semseg")
    result = moved(sample, window(-32, -16, 256, 128, (128, 64)))
    assert set(np.unique(result.label_ids)) <= {*np.unique(sample.label_ids), 0}
    assert not result.label_ids[:8].any() and not result.instance_ids[:, :16].any()
    assert np.array_equal(result.label_ids[8:56, 16:112], sample.label_ids[1::2, 1::2])
    assert result.images["left"].shape == (64, 128, 3)


def test_what_is_shown_twice_as_large_is_half_as_far() -> None:
    sample = sample_of("depth")
    result = moved(sample, window(48, 24, 96, 48, (192, 96)))
    assert np.allclose(result.depth_m[::2, ::2], sample.depth_m[24:72, 48:144] / 2, equal_nan=True)
    beyond = moved(sample, window(-10, 0, 192, 96))
    assert np.isnan(beyond.depth_m[:, :10]).all() and beyond.depth_m.dtype == np.float32


def test_the_mirrored_pair_is_a_pair_of_the_mirrored_scene() -> None:
    """Measuring the scene's mirror image gives what mirroring the sample gives: the two are made independently.

    The right camera, 0.54 m to the right, becomes the left one: the mirror stands 0.27 m to the right.
    """
    spec, _ = build_task("stereo3d")
    task = spec.build(spec.config(width_px=612, height_px=185, visibility=Visibility(preset="kitti", min_pixels_px=1)))
    placed = [(CAR, 9.0, 1.0, 0.4), (VAN, 16.0, -4.0, 2.5), (TRUCK, 12.0, 8.0, -0.2), (PERSON, 7.0, -2.0, 1.0),
              (CAR, 5.0, -4.2, 0.1), (CAR, 6.0, 4.9, -0.3)]  # fmt: skip
    samples = []
    for side in (1, -1):
        things = [
            Thing(parts=parts, position_m=(ahead, -0.27 + side * (left + 0.27), 0.0), yaw_rad=side * yaw,
                  object_id=number + 2, role="npc")
            for number, (parts, ahead, left, yaw) in enumerate(placed)
        ]  # fmt: skip
        samples.append(task.ground_truth(*synthetic_frame(task.rig(), things)))
    sample, wanted = samples
    result = moved(sample)
    assert np.array_equal(result.images["left"], sample.images["right"][:, ::-1])
    assert np.array_equal(result.images["right"], sample.images["left"][:, ::-1])
    assert [thing.object_id for thing in result.objects] == [thing.object_id for thing in wanted.objects]
    assert len(result.objects) == len(placed)
    assert sum(thing.truncated > 0.1 for thing in wanted.objects) >= 2
    for one, two in zip(result.objects, wanted.objects, strict=True):
        assert one.box.bottom_m == pytest.approx(two.box.bottom_m)
        assert math.sin(one.box.rotation_y_rad - two.box.rotation_y_rad) == pytest.approx(0, abs=1e-9)
        assert math.cos(one.box.rotation_y_rad - two.box.rotation_y_rad) == pytest.approx(1)
        is_cut = max(one.truncated, two.truncated) > 0
        assert one.box_px == pytest.approx(two.box_px, abs=6 if is_cut else 0.6)
        assert one.truncated == pytest.approx(two.truncated, abs=0.03)


def test_a_window_of_a_pair_keeps_metres_and_has_its_own_calibration() -> None:
    sample = sample_of("stereo3d")
    result = moved(sample, window(48, 24, 96, 48, (192, 96)))
    assert result.calibration.intrinsics.focal_px == pytest.approx(2 * sample.calibration.intrinsics.focal_px)
    boxes = {thing.object_id: thing.box for thing in sample.objects}
    assert all(thing.box == boxes[thing.object_id] for thing in result.objects)
    point = np.array([0.4, 0.3, 9.0])
    before = sample.calibration.intrinsics.project(point) + 0.5
    after = result.calibration.intrinsics.project(point) + 0.5
    assert np.allclose(after, (before - [48, 24]) * 2)
    with pytest.raises(ValueError, match="centre"):
        moved(sample, window(40, 24, 96, 48))


def test_boxes_of_a_pair_end_where_its_picture_ends() -> None:
    sample = sample_of("stereo3d")
    result = moved(sample, window(-32, -16, 256, 128))
    assert len(result.objects) == len(sample.objects)
    for one, two in zip(sample.objects, result.objects, strict=True):
        assert np.allclose(np.add(one.box_px, (32, 16, 32, 16)), two.box_px)
        assert two.truncated == pytest.approx(one.truncated)


@pytest.mark.parametrize(("left_m", "ahead_m"), [(0.0, 5.2), (4.0, 6.5), (-4.0, 6.5)])
def test_boxes_of_near_objects_end_at_every_side_of_the_picture(left_m: float, ahead_m: float) -> None:
    spec, _ = build_task("stereo3d")
    task = spec.build(spec.config(width_px=WIDTH, height_px=HEIGHT))
    near = Thing(parts=CAR, position_m=(ahead_m, left_m, 0.0), object_id=2, role="npc")
    sample = task.ground_truth(*synthetic_frame(task.rig(), [near]))
    (before,) = sample.objects
    (whole,) = moved(sample, window(0, 0, 192, 96)).objects
    assert whole == before and 0.1 < whole.truncated < 0.9
    assert whole.box_px[3] == HEIGHT - 1 or 0.0 in whole.box_px or whole.box_px[2] == WIDTH - 1
    (padded,) = moved(sample, window(-32, -16, 256, 128)).objects
    assert np.allclose(np.add(whole.box_px, (32, 16, 32, 16)), padded.box_px)
    assert padded.truncated == pytest.approx(whole.truncated)
    (larger,) = moved(sample, window(0, 0, 192, 96, (384, 288))).objects
    assert (padded.visible_px, larger.visible_px) == (before.visible_px, 6 * before.visible_px)
    edges = np.add(before.box_px, 0.5) * (2, 3, 2, 3) - 0.5
    assert larger.box_px == pytest.approx(edges, abs=1) and larger.truncated == pytest.approx(whole.truncated)


def test_a_window_of_a_pair_cuts_boxes_and_says_how_much() -> None:
    spec, _ = build_task("stereo3d")
    task = spec.build(spec.config(width_px=WIDTH, height_px=HEIGHT))
    things = [Thing(parts=CAR, position_m=(12.0, y, 0.0), object_id=i, role="npc") for i, y in ((2, 0.0), (3, 5.5))]
    sample = task.ground_truth(*synthetic_frame(task.rig(), things))
    result = moved(sample, window(72, 24, 48, 48))
    (whole,) = (thing for thing in sample.objects if thing.object_id == 2)
    (kept,) = result.objects
    assert kept.box_px == pytest.approx(np.subtract(whole.box_px, (72, 24, 72, 24))) and kept.truncated == 0
    narrow = moved(sample, window(90, 0, 12, 96))
    (cut,) = narrow.objects
    left, right = whole.amodal_box_px[0] + 0.5, whole.amodal_box_px[2] + 0.5
    assert cut.box_px[::2] == (0.0, 11.0) and cut.truncated == pytest.approx(1 - 12 / (right - left))


@pytest.mark.parametrize("scale", [0.5, 0.9, 1.0, 1.7])
@pytest.mark.parametrize("centred", [False, True])
def test_windows_are_drawn_inside_or_around(scale: float, centred: bool) -> None:
    for number in range(20):
        drawn = draw_window((96, 192), (64, 128), scale, derive_rng(0, "window", number), is_centred=centred)
        assert (drawn.out_height_px, drawn.out_width_px) == (64, 128)
        assert abs(drawn.scale / scale - 1) < 0.03
        for start, length, whole in ((drawn.left_px, drawn.width_px, 192), (drawn.top_px, drawn.height_px, 96)):
            assert 0 <= start <= whole - length if length <= whole else whole - length <= start <= 0
            assert not centred or 2 * start + length == whole


@pytest.mark.parametrize(("out_px", "lefts"), [(190, {0, 1, 2}), (194, {-2, -1, 0}), (192, {0})])
def test_windows_are_drawn_at_every_place_that_there_is(out_px: int, lefts: set[int]) -> None:
    drawn = [draw_window((96, 192), (96, out_px), 1.0, derive_rng(0, "window", number)) for number in range(60)]
    assert {one.left_px for one in drawn} == lefts and {one.top_px for one in drawn} == {0}


def test_pictures_are_averaged_where_they_shrink_and_exact_where_they_do_not() -> None:
    picture = np.random.default_rng(1).integers(0, 256, (24, 48, 3)).astype(np.uint8)
    small = cut_picture(picture, window(4, 8, 40, 16, (10, 4))).astype(float)
    blocks = picture[8:24, 4:44].astype(float).reshape(4, 4, 10, 4, 3).mean(axis=(1, 3))
    assert np.abs(small - blocks).max() <= 0.5 + 1e-6
    assert np.array_equal(cut_picture(picture, window(4, 8, 40, 16)), picture[8:24, 4:44])
    beyond = cut_picture(picture, window(-2, -1, 52, 26))
    assert np.array_equal(beyond[1:25, 2:50], picture)
    assert (beyond[0] == 114).all() and (beyond[:, 50:] == 114).all() and (beyond[-1, :, 0] == 114).all()


@pytest.mark.parametrize("scale", [0.75, 0.93, 1.21, 1.5])
def test_a_pairs_focal_length_is_that_of_its_columns(scale: float) -> None:
    """Disparities are columns; rows are shown as large, as far as whole pixels allow."""
    drawn = draw_window((370, 1224), (192, 640), scale, derive_rng(0, "window"), is_centred=True)
    assert abs(drawn.scale_y / drawn.scale_x - 1) < 1.01 / drawn.height_px
    sample = sample_of("stereo3d")
    some = draw_window((HEIGHT, WIDTH), (31, 77), scale, derive_rng(0, "window"), is_centred=True)
    focal_px = moved(sample, some).calibration.intrinsics.focal_px
    assert focal_px == pytest.approx(some.scale_x * sample.calibration.intrinsics.focal_px)


@pytest.mark.parametrize("place", [(-60, 0), (60, 0), (0, -30), (0, 30), (-52, -26), (52, 26), (50, 0), (0, 25)])
def test_a_window_beyond_the_picture_shows_padding_alone(place: tuple[int, int]) -> None:
    """Also one that touches the picture's border."""
    picture = np.full((25, 50, 3), 7, np.uint8)
    beyond = window(*place, 50, 25)
    assert cut_picture(picture, beyond).shape == (beyond.out_height_px, beyond.out_width_px, 3)
    assert (cut_picture(picture, beyond) == 114).all()
    assert (cut_map(picture[..., 0], beyond, 3) == 3).all()


@pytest.mark.parametrize("size_px", [(96, 192), (97, 191), (96, 191)])
def test_a_centred_window_has_the_nearest_size_that_can_share_the_middle(size_px: tuple[int, int]) -> None:
    """Widths as even as the picture's, at least one pixel, and the height that belongs to the width."""
    for scale in (*np.linspace(0.4, 3.0, 40), 500.0):
        drawn = draw_window(size_px, (64, 128), scale, derive_rng(0, "centred"), is_centred=True)
        for found, whole, wanted in (
            (drawn.width_px, size_px[1], 128 / scale),
            (drawn.height_px, size_px[0], 64 * drawn.width_px / 128),
        ):
            candidates = np.arange(2 - whole % 2, 1000, 2)
            assert found in candidates
            assert abs(found - wanted) == pytest.approx(np.abs(candidates - wanted).min())


def test_a_window_of_the_whole_picture_is_the_scaled_picture_of_at_least_one_pixel() -> None:
    half = whole_window((97, 192), 0.5)
    assert (half.left_px, half.top_px, half.width_px, half.height_px) == (0, 0, 192, 97)
    assert (half.out_width_px, half.out_height_px) == (96, 48)
    tiny = whole_window((3, 5), 0.05)
    assert (tiny.out_width_px, tiny.out_height_px) == (1, 1)
