"""Targets held against geometry, losses against their definitions."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
import torch

from gear.formats.kitti_object import Calibration
from gear.groundtruth.boxes import Box3d, project_box
from gear.networks.stereo.legacy_boxes import clip, decode, encode, left_and_right, overlaps
from gear.networks.stereo.rcnn_losses import (
    BOX_DEVIATION,
    REGION_SAMPLES,
    SIZE_DEVIATION,
    SIZE_MEAN,
    CarTargets,
    SampledPairs,
    car_targets,
    ground_corners,
    region_losses,
    rpn_losses,
    sample_pairs,
)
from gear.values.geometry import Intrinsics
from gear.values.ground_truth import BoxPx

CALIBRATION = Calibration(intrinsics=Intrinsics.from_hfov(1224, 370, math.radians(90)), baseline_m=0.54)
SIZE = (370, 1224)


@dataclass(frozen=True, kw_only=True)
class Thing:
    box: Box3d
    kitti_type: str = "Car"
    is_ignored: bool = False
    occluded_fraction: float = 0.0
    box_px: BoxPx = (0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True, kw_only=True)
class Sample:
    objects: tuple[Thing, ...]
    calibration: Calibration = CALIBRATION


def car(x_m: float = 1.0, z_m: float = 12.0, rotation_y_rad: float = -0.9) -> Thing:
    box = Box3d(height_m=1.5, width_m=1.7, length_m=4.2, bottom_m=(x_m, 1.65, z_m), rotation_y_rad=rotation_y_rad)
    return Thing(box=box)


def draws() -> torch.Generator:
    return torch.Generator().manual_seed(3)


def test_codes_come_back_a_pixel_larger() -> None:
    """The old convention's encode and decode do not quite undo each other; weights were trained so."""
    anchors = torch.tensor([[10.0, 20.0, 50.0, 40.0], [0.0, 0.0, 31.0, 31.0]])
    boxes = torch.tensor([[12.0, 18.0, 70.0, 45.0], [5.0, 6.0, 20.0, 30.0]])
    back = decode(encode(boxes, anchors), anchors)
    assert torch.allclose(back, boxes + torch.tensor([0.0, 0.0, 1.0, 1.0]), atol=1e-4)
    assert torch.allclose(clip(torch.tensor([[-3.0, 5.0, 99.0, 99.0]]), (50, 80)), torch.tensor([[0.0, 5, 79, 49]]))


def test_overlaps_count_the_last_pixel() -> None:
    one, two = torch.tensor([[0.0, 0.0, 9.0, 9.0]]), torch.tensor([[5.0, 0.0, 14.0, 9.0], [10.0, 0.0, 12.0, 9.0]])
    assert overlaps(one, two)[0].tolist() == pytest.approx([50 / 150, 0])


def test_a_pair_shares_its_rows() -> None:
    left, right = left_and_right(torch.tensor([[1.0, 2, 3, 4, 5, 6]]))
    assert left.tolist() == [[1, 2, 3, 4]] and right.tolist() == [[5, 2, 6, 4]]


def test_targets_are_the_projections() -> None:
    thing = car()
    targets = car_targets(Sample(objects=(thing,)), 2.0)
    left = project_box(thing.box.corners_m, CALIBRATION.intrinsics)
    right = project_box(thing.box.corners_m - (0.54, 0.0, 0.0), CALIBRATION.intrinsics)
    assert left is not None and right is not None
    assert targets.left[0].tolist() == pytest.approx([2 * v for v in left], rel=1e-5)
    assert targets.right[0].tolist() == pytest.approx([2 * v for v in right], rel=1e-5)
    assert targets.union[0, 0] == targets.right[0, 0] and targets.union[0, 2] == targets.left[0, 2]
    width, height, length, sine, cosine = targets.size_and_direction[0].tolist()
    assert (width, height, length) == pytest.approx((1.7, 1.5, 4.2))
    assert math.atan2(sine, cosine) == pytest.approx(thing.box.alpha_rad, abs=1e-5)


def test_the_corner_is_the_near_one() -> None:
    """One corner a car, strictly between its sides, the nearest on the ground."""
    thing = car()
    targets = car_targets(Sample(objects=(thing,)), 1.0)
    corners = ground_corners(thing.box)
    nearest = int(corners[:, 2].argmin())
    known = torch.isfinite(targets.corner_px[0]).nonzero()[:, 0].tolist()
    assert known == [nearest]
    column = CALIBRATION.intrinsics.project(corners[nearest])[0]
    assert float(targets.corner_px[0, nearest]) == pytest.approx(column, rel=1e-5)


def test_corners_are_named_as_the_driver_has_them() -> None:
    """Driving away along z: behind is nearer, left is on the left."""
    corners = ground_corners(car(0.0, 10.0, -math.pi / 2).box)
    assert np.allclose(corners[0], (-0.85, 1.65, 7.9)) and np.allclose(corners[1], (-0.85, 1.65, 12.1))
    assert np.allclose(corners[2], (0.85, 1.65, 12.1)) and np.allclose(corners[3], (0.85, 1.65, 7.9))


def test_from_behind_no_corner_is_between() -> None:
    targets = car_targets(Sample(objects=(car(0.0, 10.0, -math.pi / 2),)), 1.0)
    assert not torch.isfinite(targets.corner_px).any()


def test_nearer_cars_cover() -> None:
    """The car behind is seen from where the one in front ends; the one in front is not touched."""
    far, near = car(3.0, 20.0), car(-0.2, 10.0)
    targets = car_targets(Sample(objects=(far, near)), 1.0)
    assert targets.borders_px[1].tolist() == pytest.approx([float(targets.left[1, 0]), float(targets.left[1, 2])])
    assert float(targets.borders_px[0, 0]) == pytest.approx(float(targets.left[1, 2]), abs=1.5)
    assert float(targets.borders_px[0, 1]) == pytest.approx(float(targets.left[0, 2]))


def test_a_hidden_car_is_neither_car_nor_background() -> None:
    targets = car_targets(Sample(objects=(car(0.0, 30.0), car(-0.2, 10.0))), 1.0)
    assert len(targets.left) == 1 and len(targets.ignored) == 1


def test_what_is_no_car_is_not_looked_for() -> None:
    things = (car(), replace(car(-5.0), is_ignored=True), replace(car(6.0), kitti_type="Van"))
    targets = car_targets(Sample(objects=things), 1.0)
    assert len(targets.left) == 1 and len(targets.ignored) == 1
    behind = car_targets(Sample(objects=(car(0.0, -5.0),)), 1.0)
    assert not len(behind.left) and not len(behind.ignored)


def anchors_about(cars: CarTargets) -> torch.Tensor:
    """The cars' own union boxes, and boxes all over the picture."""
    x, y = torch.meshgrid(torch.arange(0, 1150, 25.0), torch.arange(0, 320, 25.0), indexing="xy")
    low = torch.stack([x, y], dim=-1).reshape(-1, 2)
    return torch.cat([cars.union, torch.cat([low, low + 48], dim=1)])


def test_proposals_learn_the_cars() -> None:
    cars = car_targets(Sample(objects=(car(), car(-4.0, 18.0, 0.3))), 1.0)
    anchors = anchors_about(cars)
    shared = overlaps(anchors, cars.union)
    is_car = (shared.max(dim=1).values >= 0.7) | (shared == shared.max(dim=0).values).any(dim=1)
    logits = torch.stack([torch.where(is_car, -9.0, 9.0), torch.where(is_car, 9.0, -9.0)], dim=1)
    owner = shared.argmax(dim=1)
    codes = torch.cat([encode(cars.left[owner], anchors), encode(cars.right[owner], anchors)[:, [0, 2]]], dim=1)
    good = rpn_losses(logits, codes, anchors, cars, SIZE, draws())
    assert float(good["rpn_class"]) < 1e-4 and float(good["rpn_boxes"]) == pytest.approx(0, abs=1e-6)
    bad = rpn_losses(-logits, codes + 0.5, anchors, cars, SIZE, draws())
    assert float(bad["rpn_class"]) > 5 and float(bad["rpn_boxes"]) > 0.001


def test_anchors_on_ignored_objects_learn_nothing() -> None:
    cars = car_targets(Sample(objects=(car(), replace(car(-5.0), is_ignored=True))), 1.0)
    anchors = torch.cat([cars.union, cars.ignored])
    logits = torch.tensor([[-9.0, 9.0], [-9.0, 9.0]])
    codes = torch.cat([encode(cars.left, cars.union), encode(cars.right, cars.union)[:, [0, 2]]], dim=1)
    said = rpn_losses(logits, codes.expand(2, 6), anchors, cars, SIZE, draws())
    assert float(said["rpn_class"]) < 1e-4


def test_anchors_that_leave_the_picture_learn_nothing() -> None:
    cars = car_targets(Sample(objects=(car(),)), 1.0)
    outside = torch.tensor([[-1.0, 9, 60, 60], [9.0, -1, 60, 60], [1160.0, 9, 1224, 60], [9.0, 300, 60, 370]])
    logits = torch.tensor([[-9.0, 9.0]]).repeat(5, 1)  # a car everywhere
    codes = torch.cat([encode(cars.left, cars.union), encode(cars.right, cars.union)[:, [0, 2]]], dim=1).expand(5, 6)
    said = rpn_losses(logits, codes, torch.cat([cars.union, outside]), cars, SIZE, draws())
    assert float(said["rpn_class"]) < 1e-4
    inside = (outside - 1).clamp(min=0)
    said = rpn_losses(logits, codes, torch.cat([cars.union, inside]), cars, SIZE, draws())
    assert float(said["rpn_class"]) > 5, "a pixel farther in they are road"


def test_the_best_anchor_of_a_car_is_wanted_however_little_it_overlaps() -> None:
    cars = car_targets(Sample(objects=(car(),)), 1.0)
    shift = 0.4 * (cars.union[:, 2] - cars.union[:, 0])
    anchors = torch.cat([cars.union + torch.tensor([1.0, 0, 1, 0]) * shift, torch.tensor([[9.0, 9, 60, 60]])])
    assert 0.3 < float(overlaps(anchors, cars.union)[0, 0]) < 0.7
    codes = torch.cat([encode(cars.left, anchors[:1]), encode(cars.right, anchors[:1])[:, [0, 2]]], dim=1)
    logits = torch.tensor([[-9.0, 9.0], [9.0, -9.0]])
    said = rpn_losses(logits, codes.expand(2, 6), anchors, cars, SIZE, draws())
    assert float(said["rpn_class"]) < 1e-4 and float(said["rpn_boxes"]) == pytest.approx(0, abs=1e-6)


def test_a_box_that_leaves_the_car_in_one_picture_holds_none() -> None:
    cars = car_targets(Sample(objects=(car(),)), 1.0)
    aside = torch.tensor([300.0, 0, 300, 0])
    for left, right in ((cars.left, cars.right + aside), (cars.left + aside, cars.right)):
        pairs = sample_pairs(left, right, cars, draws())
        assert len(pairs.owner) == 1 and torch.equal(pairs.left[:1], cars.left), "the car's own pair"


def test_a_car_of_less_than_ten_rows_is_neither_car_nor_background() -> None:
    for ahead_m, is_car in ((85.0, True), (100.0, False)):
        targets = car_targets(Sample(objects=(car(0.0, ahead_m),)), 1.0)
        assert (len(targets.left), len(targets.ignored)) == ((1, 0) if is_car else (0, 1))


def test_pairs_hold_the_same_car_in_both_pictures() -> None:
    """The cars are among the proposals; a left box of one car with a right box of another holds none."""
    cars = car_targets(Sample(objects=(car(), car(-6.0, 14.0))), 1.0)
    left = torch.cat([cars.left[:1], cars.left[:1] + 20])
    right = torch.cat([cars.right[1:], cars.right[:1] + 20])
    pairs = sample_pairs(left, right, cars, draws())
    held = {tuple(box) for box in pairs.left[: len(pairs.owner)].tolist()}
    assert {tuple(box) for box in cars.left.tolist()} <= held
    assert len(pairs.left) <= REGION_SAMPLES
    for box, owner in zip(pairs.right, pairs.owner, strict=False):
        assert float(overlaps(box[None], cars.right)[0, owner]) >= 0.5


def perfect_regions(pairs: SampledPairs, cars: CarTargets) -> dict[str, torch.Tensor]:
    """What a perfect second stage says."""
    count, held = len(pairs.left), len(pairs.owner)
    said = {
        "class_logits": torch.tensor([[9.0, -9.0]]).repeat(count, 1),
        "box_codes": torch.zeros(count, 2, 6),
        "size_and_direction": torch.zeros(count, 2, 5),
        "keypoint_logits": torch.full((count, 4, 28), -20.0),
        "border_logits": torch.full((count, 2, 28), -20.0),
    }
    said["class_logits"][:held] *= -1
    left, right = cars.left[pairs.owner], cars.right[pairs.owner]
    codes = torch.cat([encode(left, pairs.left[:held]), encode(right, pairs.right[:held])[:, [0, 2]]], dim=1)
    said["box_codes"][:held, 1] = codes / torch.tensor(BOX_DEVIATION)
    body = cars.size_and_direction[pairs.owner] - torch.tensor(SIZE_MEAN)
    said["size_and_direction"][:held, 1] = body / SIZE_DEVIATION
    for i, owner in enumerate(pairs.owner.tolist()):
        start, width = pairs.left[i, 0], pairs.left[i, 2] - pairs.left[i, 0] + 1
        for number, where in enumerate(cars.corner_px[owner]):
            cell = float((where - start) * 28 / width)
            if math.isfinite(cell) and 0 <= round(cell) <= 28:
                said["keypoint_logits"][i, number, min(round(cell), 27)] = 20.0
        for side, where in enumerate(cars.borders_px[owner]):
            cell = round(float((where - start) * 28 / width))
            if 0 <= cell <= 28:
                said["border_logits"][i, side, min(cell, 27)] = 20.0
    return said


def test_perfect_regions_cost_nothing_and_others_do() -> None:
    cars = car_targets(Sample(objects=(car(), car(-6.0, 14.0, 0.4))), 1.0)
    shifts = torch.tensor([[0.0, 0, 0, 0], [4.0, 3, 6, 1], [120.0, 0, 120, 0]])
    left, right = ((boxes[:, None] + shifts).reshape(-1, 4) for boxes in (cars.left, cars.right))
    pairs = sample_pairs(left, right, cars, draws())
    assert 0 < len(pairs.owner) < len(pairs.left)
    said = perfect_regions(pairs, cars)
    for name, loss in region_losses(said, pairs, cars).items():
        assert float(loss) < 1e-4, name
    for name, change in (
        ("class", {"class_logits": -said["class_logits"]}),
        ("boxes", {"box_codes": said["box_codes"] + 1}),
        ("size_and_direction", {"size_and_direction": said["size_and_direction"] - 1}),
        ("keypoints", {"keypoint_logits": said["keypoint_logits"].roll(3, dims=2)}),
        ("keypoints", {"border_logits": said["border_logits"].roll(3, dims=2)}),
    ):
        assert float(region_losses(said | change, pairs, cars)[name]) > 0.1, name


def test_a_picture_without_cars_has_losses() -> None:
    cars = car_targets(Sample(objects=()), 1.0)
    anchors = anchors_about(cars)
    logits = torch.zeros(len(anchors), 2, requires_grad=True)
    said = rpn_losses(logits, torch.zeros(len(anchors), 6), anchors, cars, SIZE, draws())
    assert float(said["rpn_class"].detach()) == pytest.approx(math.log(2)) and float(said["rpn_boxes"].detach()) == 0
    pairs = sample_pairs(anchors[:5], anchors[:5], cars, draws())
    losses = region_losses(perfect_regions(pairs, cars), pairs, cars)
    assert all(float(loss) < 1e-4 for loss in losses.values())
