"""Targets at centres are held against geometry, and their losses against their definitions."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import torch

from gear.formats.kitti_object import Calibration
from gear.groundtruth.boxes import Box3d, project_box
from gear.networks.stereo.centre_losses import CentreTargets, Grid, centre_losses, centre_targets
from gear.values.geometry import Intrinsics
from gear.values.ground_truth import BoxPx

KINDS = ("Car", "Pedestrian")
CALIBRATION = Calibration(intrinsics=Intrinsics.from_hfov(256, 96, math.radians(90)), baseline_m=0.5)
GRID = Grid(height=12, width=32, cell_px=(8.0, 8.0))
BINS_PX = torch.logspace(math.log10(2.0), math.log10(64.0), 16)


@dataclass(frozen=True, kw_only=True)
class Thing:
    box: Box3d
    kitti_type: str = "Car"
    is_ignored: bool = False
    occluded_fraction: float = 0.25

    @property
    def box_px(self) -> BoxPx:
        found = project_box(self.box.corners_m, CALIBRATION.intrinsics)
        assert found is not None
        return found


@dataclass(frozen=True, kw_only=True)
class Pair:
    objects: tuple[Thing, ...]
    calibration: Calibration = CALIBRATION


def car(x_m: float = 1.0, z_m: float = 8.0) -> Thing:
    box = Box3d(height_m=1.5, width_m=1.8, length_m=4.2, bottom_m=(x_m, 1.6, z_m), rotation_y_rad=-1.4)
    return Thing(box=box)


def shared_out(angle_rad: torch.Tensor, count: int = 24) -> torch.Tensor:
    """Logits of directions that give an angle's chance to the two next to it."""
    chances = torch.full((len(angle_rad), count), 1e-9)
    for row, angle in enumerate(angle_rad.tolist()):
        place = angle / (2 * math.pi) * count
        chances[row, math.floor(place) % count] += 1 - place % 1
        chances[row, (math.floor(place) + 1) % count] += place % 1
    return chances.log()


def perfect(targets: CentreTargets) -> dict[str, torch.Tensor]:
    """Outputs that say exactly what the targets want, and are sure of it."""
    shape = (len(targets.heat), GRID.height, GRID.width)
    batch, row, column = targets.where.unbind(dim=1)

    def spread_out(values: torch.Tensor, fill: float) -> torch.Tensor:
        maps = torch.full((shape[0], values.shape[1], *shape[1:]), fill)
        maps[batch, :, row, column] = values
        return maps

    sides, centre, size, heading, hidden = torch.split(targets.values, [4, 2, 3, 1, 1], dim=1)
    disparity_px = targets.disparity_px[:, None]
    return {
        "heat": torch.where(targets.heat > 0.999, 20.0, -20.0),
        "sides_px": spread_out(sides, 1.0),
        "centre_px": spread_out(centre, 0.0),
        "size_m": spread_out(size, 1.0),
        "heading_logits": spread_out(shared_out(heading[:, 0]), 0.0),
        "hidden": spread_out(torch.logit(hidden, eps=1e-6), 0.0),
        "disparity_logits": torch.zeros(shape[0], len(BINS_PX), *shape[1:]),
        "surface_logits": torch.zeros(shape[0], len(BINS_PX), *shape[1:]),
        "disparity_px": spread_out(disparity_px, 1.0),
        "disparity_spread": spread_out(torch.full_like(disparity_px, -6.0), 0.0),
    }


def losses(outputs: dict[str, torch.Tensor], targets: CentreTargets) -> dict[str, torch.Tensor]:
    return centre_losses(outputs, targets, bins_px=BINS_PX, cell_px=GRID.cell_px)


def test_an_objects_cell_is_that_of_the_middle_of_its_box() -> None:
    thing = car()
    targets = centre_targets([Pair(objects=(thing,))], KINDS, GRID)
    kind, row, column = (int(value) for value in (targets.heat[0] == 1).nonzero()[0])
    left, top, right, bottom = thing.box_px
    assert (kind, row, column) == (0, (top + bottom + 1) / 2 // 8, (left + right + 1) / 2 // 8)


def test_the_cells_lead_back_to_the_object() -> None:
    """From each cell's values alone: the box in the picture, the place in space, the angle."""
    thing = car()
    targets = centre_targets([Pair(objects=(thing,))], KINDS, GRID)
    assert len(targets.where) > 1 and float(targets.weight.sum()) == pytest.approx(1)
    for (_, row, column), said, disparity in zip(targets.where, targets.values, targets.disparity_px, strict=True):
        u, v = float(column + 0.5) * 8 - 0.5, float(row + 0.5) * 8 - 0.5
        box = (u - said[0], v - said[1], u + said[2], v + said[3])
        assert np.allclose(box, thing.box_px, atol=1e-3)
        depth_m = CALIBRATION.intrinsics.focal_px * 0.5 / float(disparity)
        middle = CALIBRATION.intrinsics.unproject([u + float(said[4]), v + float(said[5])], np.array(depth_m))
        assert np.allclose(middle + np.array((0, thing.box.height_m / 2, 0)), thing.box.bottom_m, atol=1e-3)
        assert said[6:9].tolist() == pytest.approx([1.5, 1.8, 4.2])
        assert float(said[9]) == pytest.approx(thing.box.alpha_rad, abs=1e-5)


def test_the_nearer_object_has_the_cells() -> None:
    near, far = car(z_m=8.0), car(x_m=1.3, z_m=12.0)
    targets = centre_targets([Pair(objects=(near, far))], KINDS, GRID)
    alone = centre_targets([Pair(objects=(near,))], KINDS, GRID)
    near_px = float(alone.disparity_px[0])
    assert int((targets.disparity_px == near_px).sum()) == len(alone.where)


def test_ignored_objects_and_other_kinds_teach_nothing() -> None:
    """Neither their centres nor that there is nothing; outside them the picture counts."""
    for thing in (replace(car(), is_ignored=True), replace(car(), kitti_type="Tram")):
        targets = centre_targets([Pair(objects=(thing,))], KINDS, GRID)
        assert not targets.heat.any() and not len(targets.where)
        left, top, right, bottom = (round(value / 8) for value in thing.box_px)
        assert not targets.is_counted[0, 0, top:bottom, left:right].any()
        assert targets.is_counted[0, 0, :, 0].all()
        quiet = perfect(targets)
        loud = quiet | {"heat": torch.where(targets.is_counted, -20.0, 20.0).expand_as(targets.heat)}
        assert float(losses(loud, targets)["heat"]) == pytest.approx(0, abs=1e-6)


def test_an_empty_batch_has_losses() -> None:
    targets = centre_targets([Pair(objects=())], KINDS, GRID)
    found = losses(perfect(targets), targets)
    assert all(math.isfinite(float(value)) for value in found.values())
    assert float(found["heat"]) == pytest.approx(0, abs=1e-6) and float(found["disparity"]) == 0


def test_perfect_outputs_cost_nothing_and_others_do() -> None:
    targets = centre_targets([Pair(objects=(car(),)), Pair(objects=(car(-3.0, 15.0),))], KINDS, GRID)
    outputs = perfect(targets)
    best = losses(outputs, targets)
    for name in ("heat", "sides", "centre", "size"):
        assert float(best[name]) == pytest.approx(0, abs=1e-5), name
    assert float(best["disparity"]) == pytest.approx(0.5 * -6, abs=1e-3)
    worse = {
        "heat": {"heat": -outputs["heat"]},
        "sides": {"sides_px": outputs["sides_px"] * 1.2},
        "centre": {"centre_px": outputs["centre_px"] + 8},
        "size": {"size_m": outputs["size_m"] * 0.8},
        "heading": {"heading_logits": outputs["heading_logits"].roll(1, dims=1)},
        "hidden": {"hidden": outputs["hidden"] + 3},
        "disparity": {"disparity_px": outputs["disparity_px"] * 1.1},
    }
    for name, change in worse.items():
        assert float(losses(outputs | change, targets)[name]) > float(best[name]) + 0.01, name


@pytest.mark.parametrize("other", [-0.1, 0.1, math.pi])
def test_no_heading_costs_less_than_the_right_one(other: float) -> None:
    targets = centre_targets([Pair(objects=(car(),))], KINDS, GRID)
    outputs, angle_rad = perfect(targets), targets.values[:, 9]
    batch, row, column = targets.where.unbind(dim=1)
    right = float(losses(outputs, targets)["heading"])
    outputs["heading_logits"][batch, :, row, column] = shared_out(angle_rad + other)
    assert float(losses(outputs, targets)["heading"]) > right + 0.01


def test_the_disparity_loss_is_the_relative_error() -> None:
    """Ten per cent cost the same near and far; with spread b the density's part is |e| / b + log b."""
    costs = []
    for z_m in (8.0, 24.0):
        targets = centre_targets([Pair(objects=(car(z_m=z_m),))], KINDS, GRID)
        outputs = perfect(targets)
        outputs["disparity_px"] = outputs["disparity_px"] * math.exp(0.1)
        outputs["disparity_spread"] = torch.full_like(outputs["disparity_spread"], -1.0)
        costs.append(float(losses(outputs, targets)["disparity"]))
    assert costs[0] == pytest.approx(costs[1], rel=1e-4)
    assert costs[0] == pytest.approx(0.5 * (0.1 * math.e - 1.0) + 5 * 0.1, rel=1e-3)


def test_the_bins_learn_the_two_beside_the_disparity() -> None:
    """The cross-entropy is least where exactly those two share the probability so that its mean is the target."""
    targets = centre_targets([Pair(objects=(car(),))], KINDS, GRID)
    outputs = perfect(targets)
    logits = outputs["disparity_logits"].requires_grad_()
    optimiser = torch.optim.Adam([logits], lr=1.0)
    for _ in range(60):
        optimiser.zero_grad()
        losses(outputs, targets)["disparity_bins"].backward()
        optimiser.step()
    batch, row, column = targets.where[0]
    expected = (logits[batch, :, row, column].softmax(dim=0) * BINS_PX.log()).sum().exp()
    assert float(expected.detach()) == pytest.approx(float(targets.disparity_px[0]), rel=0.02)


def test_surfaces_are_where_the_rays_meet_the_boxes() -> None:
    """A car head-on, wall-like from behind: its back, not its middle; a nearer one stands before it."""
    box = replace(car(0.0, 10.0).box, rotation_y_rad=-math.pi / 2)
    targets = centre_targets([Pair(objects=(Thing(box=box, occluded_fraction=0.0),))], KINDS, GRID)
    seen = targets.surface_px[0][torch.isfinite(targets.surface_px[0])]
    assert len(seen) > 3 and torch.allclose(seen, torch.tensor(128 * 0.5 / (10.0 - 2.1)), rtol=1e-5)
    nearer = Thing(box=replace(box, bottom_m=(0.0, 1.6, 6.0)), occluded_fraction=0.0)
    both = centre_targets([Pair(objects=(nearer, Thing(box=box, occluded_fraction=0.9)))], KINDS, GRID)
    seen = both.surface_px[0][torch.isfinite(both.surface_px[0])]
    assert torch.allclose(seen, torch.tensor(128 * 0.5 / (6.0 - 2.1)), rtol=1e-5)


def test_surfaces_are_the_lower_half_of_boxes_less_the_feet() -> None:
    thing = replace(car(0.0, 6.0), occluded_fraction=0.0)
    left, top, right, bottom = thing.box_px
    grid = Grid(height=48, width=128, cell_px=(2.0, 2.0))
    rows, columns = np.nonzero(np.isfinite(centre_targets([Pair(objects=(thing,))], KINDS, grid).surface_px[0].numpy()))
    middles_px = grid.middles_px(rows, columns)
    low, high = middles_px.min(axis=0), middles_px.max(axis=0)
    # To two cells: those beside the border have it, too, and rays may miss the box there.
    assert (low[1], high[1]) == pytest.approx(((top + bottom) / 2, bottom - 0.1 * (bottom - top)), abs=4)
    assert low[0] >= left - 4 and high[0] <= right + 4


@pytest.mark.parametrize("change", [{"is_ignored": True}, {"occluded_fraction": 0.31}])
def test_what_is_hidden_or_ignored_is_no_surface(change: dict[str, Any]) -> None:
    seen = replace(car(), occluded_fraction=0.3)
    assert torch.isfinite(centre_targets([Pair(objects=(seen,))], KINDS, GRID).surface_px).any()
    hidden = replace(seen, **change)
    assert not torch.isfinite(centre_targets([Pair(objects=(hidden,))], KINDS, GRID).surface_px).any()


def test_bumps_are_as_wide_as_boxes_in_cells_that_need_not_be_square() -> None:
    grid = Grid(height=24, width=32, cell_px=(8.0, 4.0))
    for thing in (car(0.0, 6.0), car(1.0, 30.0)):
        left, top, right, bottom = thing.box_px
        (heat,) = centre_targets([Pair(objects=(thing,))], KINDS, grid).heat[:, 0]
        row, column = divmod(int(heat.argmax()), 32)
        middle = (left + right + 1) / 2, (top + bottom + 1) / 2
        assert (column, row) == (middle[0] // 8, middle[1] // 4)
        wide, tall = max(0.09 * (right - left) / 8, 0.7), max(0.09 * (bottom - top) / 4, 0.7)
        assert float(heat[row, column + 1]) == pytest.approx(math.exp(-((1 / wide) ** 2) / 2), rel=1e-4)
        assert float(heat[row + 2, column]) == pytest.approx(math.exp(-((2 / tall) ** 2) / 2), rel=1e-4)


def test_cells_and_pixels_lead_to_each_other() -> None:
    grid = Grid(height=24, width=16, cell_px=(16.0, 4.0))
    assert grid.middles_px(np.array([0, 5]), np.array([0, 3])).tolist() == [[7.5, 1.5], [55.5, 21.5]]
    assert grid.cell_of(55.5, 21.5) == (3, 5) and grid.cell_of(-0.5, -0.5) == (-0.5, -0.5)


def test_people_are_no_surfaces() -> None:
    targets = centre_targets([Pair(objects=(replace(car(), kitti_type="Pedestrian"),))], KINDS, GRID)
    assert not torch.isfinite(targets.surface_px).any()


def test_the_volume_learns_the_surfaces() -> None:
    targets = centre_targets([Pair(objects=(car(),))], KINDS, GRID)
    outputs = perfect(targets)
    bins = (targets.surface_px.log() - BINS_PX[0].log()) / (BINS_PX[1] / BINS_PX[0]).log()
    right = torch.nn.functional.one_hot(bins.nan_to_num(0).round().long(), len(BINS_PX)).permute(0, 3, 1, 2) * 3.0
    assert float(losses(outputs | {"surface_logits": right}, targets)["surface"]) < float(
        losses(outputs, targets)["surface"]
    )
