"""Training targets and losses of the centre-based stereo networks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor
from torch.nn import functional

from gear.formats.kitti_object import Calibration
from gear.groundtruth.boxes import Box3d
from gear.networks.stereo.object_surface import FOOT_SHARE, MOST_OCCLUDED, SOLID, depth_of_box
from gear.values.geometry import Array
from gear.values.ground_truth import BoxPx

Whole = npt.NDArray[np.int64]

PEAK_SHARE = 0.54 / 6
"""Standard deviation of the Gaussian around a centre, as a share of the 2D box's side (TTFNet, Liu et al., AAAI
2020).
"""

LEAST_SIGMA = 0.7
"""Smallest standard deviation of that Gaussian in cells; with it the Gaussian of a small object reaches the
neighbouring cells.
"""

COUNTED_FROM = 0.1
"""Value of the Gaussian from which a cell is trained to predict the object's properties."""

FOCAL_POWER, BUMP_POWER = 2.0, 4.0
ALMOST_ZERO = 1e-6


class LabelledObject(Protocol):
    """Protocol of the labelled objects that the losses accept: KITTI type, 3D box, 2D box and occlusion.

    `gear.plugins.tasks.stereo3d.Object3d` implements it.
    """

    @property
    def kitti_type(self) -> str:
        """KITTI's type of the object."""
        ...

    @property
    def is_ignored(self) -> bool:
        """Whether the object is neither a target nor background."""
        ...

    @property
    def box(self) -> Box3d:
        """3D box in the frame of the left camera."""
        ...

    @property
    def box_px(self) -> BoxPx:
        """2D box in the left picture: left, top, right, bottom in index pixels."""
        ...

    @property
    def occluded_fraction(self) -> float:
        """Covered share of the silhouette's part in the picture, 0..1."""
        ...


class LabelledPair(Protocol):
    """Protocol of the samples that the losses accept: a rectified pair of pictures with its objects."""

    @property
    def calibration(self) -> Calibration:
        """Calibration of the stereo pair."""
        ...

    @property
    def objects(self) -> Sequence[LabelledObject]:
        """Labelled and ignored objects."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """The grid of the network's output cells over the picture.

    Attributes:
        height, width: number of cells.
        cell_px: width and height of a cell in pixels of the picture.
    """

    height: int
    width: int
    cell_px: tuple[float, float]

    def cell_of(self, u_px: float, v_px: float) -> tuple[float, float]:
        """Column and row, as fractions, of the cell that contains a point (index pixels); the middle of the first
        cell is (0, 0).

        Args:
            u_px, v_px: column and row of the point in index pixels of the picture.
        """
        return (u_px + 0.5) / self.cell_px[0] - 0.5, (v_px + 0.5) / self.cell_px[1] - 0.5

    def middles_px(self, rows: Whole, columns: Whole) -> Array:
        """Returns the (N, 2) centres x, y of cells, in index pixels of the picture.

        Args:
            rows, columns: (N,) positions of the cells.
        """
        return np.stack([(columns + 0.5) * self.cell_px[0] - 0.5, (rows + 0.5) * self.cell_px[1] - 0.5], axis=1)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CentreTargets:
    """Training targets of all cells of a batch.

    Attributes:
        heat: (B, K, h, w) 0..1, 1 at the cells of the centres; K kinds of objects.
        is_counted: (B, 1, h, w) bool; False for empty cells inside objects that are no targets.
        where: (N, 3) batch index, row and column of the N cells that are trained on an object.
        weight: (N,) weight of each of these cells; the weights of one object sum to 1.
        values: (N, 11) sides (4), centre (2), size (3), observation angle and occluded share, as in the network's
            outputs.
        disparity_px: (N,) disparity of the object's 3D centre, pixels of the picture.
        surface_px: (B, h, w) disparity of visible vehicle surfaces, pixels of the picture; NaN elsewhere.
    """

    heat: Tensor
    is_counted: Tensor
    where: Tensor
    weight: Tensor
    values: Tensor
    disparity_px: Tensor
    surface_px: Tensor


def centre_targets(samples: Sequence[LabelledPair], kinds: Sequence[str], grid: Grid) -> CentreTargets:
    """Computes the training targets of a batch from its labelled objects.

    An object belongs to the cell that contains the centre of its 2D box in the picture, and to the cells near it. This
    centre lies in the picture even if the object extends beyond it. If two objects have the same cell, the cell belongs
    to the nearer object. Objects of other kinds and ignored objects are no targets, and empty cells inside their boxes
    do not count.

    Args:
        samples: the batch.
        kinds: KITTI's object types in the order of the channels of `heat`.
        grid: grid of the network's outputs over the picture.
    """
    heat = np.zeros((len(samples), len(kinds), grid.height, grid.width), dtype=np.float32)
    is_counted = np.ones((len(samples), 1, grid.height, grid.width), dtype=np.bool_)
    wheres, weights, values, disparities = [], [], [], []
    for batch, sample in enumerate(samples):
        owner = np.full((grid.height, grid.width), -1)
        bumps: list[Array] = []
        wanted = [thing for thing in sample.objects if not thing.is_ignored and thing.kitti_type in kinds]
        wanted = [thing for thing in wanted if middle_of(thing.box)[2] > 0]
        for thing in sorted(wanted, key=lambda each: -each.box.bottom_m[2]):
            bump = _bump(thing.box_px, grid)
            channel = heat[batch, kinds.index(thing.kitti_type)]
            np.maximum(channel, bump, out=channel)
            owner[bump >= COUNTED_FROM] = len(bumps)
            bumps.append(bump)
        for thing in sample.objects:
            if thing not in wanted:
                is_counted[batch, 0, *_inside(thing.box_px, grid)] = False
        is_counted[batch, 0][heat[batch].max(axis=0) >= COUNTED_FROM] = True
        for number, thing in enumerate(sorted(wanted, key=lambda each: -each.box.bottom_m[2])):
            rows, columns = np.nonzero(owner == number)
            if not len(rows):
                continue
            share = bumps[number][rows, columns]
            wheres.append(np.stack([np.full(len(rows), batch), rows, columns], axis=1))
            weights.append(share / share.sum())
            values.append(_values(thing, sample.calibration, grid.middles_px(rows, columns)))
            disparities.append(np.full(len(rows), disparity_px(thing.box, sample.calibration)))
    return CentreTargets(
        heat=torch.from_numpy(heat),
        is_counted=torch.from_numpy(is_counted),
        where=torch.from_numpy(_joined(wheres, (0, 3))).long(),
        weight=torch.from_numpy(_joined(weights, (0,))).float(),
        values=torch.from_numpy(_joined(values, (0, 11))).float(),
        disparity_px=torch.from_numpy(_joined(disparities, (0,))).float(),
        surface_px=torch.from_numpy(np.stack([_surface_px(sample, grid) for sample in samples])).float(),
    )


def _surface_px(sample: LabelledPair, grid: Grid) -> Array:
    """(h, w) disparity of vehicle surfaces, for the lower halves of sufficiently visible vehicles; the nearer
    one where two overlap.
    """
    lens, reach = sample.calibration.intrinsics, sample.calibration.intrinsics.focal_px * sample.calibration.baseline_m
    surface = np.full((grid.height, grid.width), np.nan)
    for thing in sorted(sample.objects, key=lambda each: -each.box.bottom_m[2]):
        left, top, right, bottom = thing.box_px
        box_px = (left, (top + bottom) / 2, right, bottom - FOOT_SHARE * (bottom - top))
        inside = _inside(box_px, grid)
        rows, columns = (np.arange(grid.height)[inside[0]], np.arange(grid.width)[inside[1]])
        middles = np.stack(np.meshgrid(columns, rows), axis=-1)
        u_px, v_px = ((middles[..., i] + 0.5) * grid.cell_px[i] - 0.5 for i in (0, 1))
        depth_m = depth_of_box(thing.box, lens.unproject(np.stack([u_px, v_px], axis=-1), np.ones(u_px.shape)))
        is_seen = thing.kitti_type in SOLID and not thing.is_ignored and thing.occluded_fraction <= MOST_OCCLUDED
        part = surface[rows[:, None], columns[None]]
        surface[rows[:, None], columns[None]] = np.where(
            np.isfinite(depth_m), reach / depth_m if is_seen else np.nan, part
        )
    return surface


def middle_of(box: Box3d) -> Array:
    """Returns the (3,) centre of a 3D box in the camera's frame, metres.

    Args:
        box: 3D box in the camera's frame.
    """
    return np.array(box.bottom_m) - (0, box.height_m / 2, 0)


def disparity_px(box: Box3d, calibration: Calibration) -> float:
    """Returns the disparity of a 3D box's centre, focal length * baseline / depth, in pixels of the picture.

    Args:
        box: 3D box in the frame of the left camera.
        calibration: calibration of the stereo pair.
    """
    return calibration.intrinsics.focal_px * calibration.baseline_m / float(middle_of(box)[2])


def _joined(parts: Sequence[Array], empty: tuple[int, ...]) -> Array:
    return np.concatenate(parts) if parts else np.zeros(empty)


def _bump(box_px: BoxPx, grid: Grid) -> Array:
    """(h, w) Gaussian with value 1 at the cell of the box's centre."""
    left, top, right, bottom = box_px
    column, row = (round(value) for value in grid.cell_of((left + right) / 2, (top + bottom) / 2))
    column, row = min(max(column, 0), grid.width - 1), min(max(row, 0), grid.height - 1)
    x = (np.arange(grid.width) - column) / max(PEAK_SHARE * (right - left) / grid.cell_px[0], LEAST_SIGMA)
    y = (np.arange(grid.height) - row) / max(PEAK_SHARE * (bottom - top) / grid.cell_px[1], LEAST_SIGMA)
    return np.asarray(np.exp(-(x[None] ** 2 + y[:, None] ** 2) / 2))


def _inside(box_px: BoxPx, grid: Grid) -> tuple[slice, slice]:
    """Rows and columns of the cells whose centres lie in the box, and one more cell on each side."""
    (left, top), (right, bottom) = grid.cell_of(*box_px[:2]), grid.cell_of(*box_px[2:])
    return (
        slice(max(0, math.floor(top)), max(0, math.ceil(bottom) + 1)),
        slice(max(0, math.floor(left)), max(0, math.ceil(right) + 1)),
    )


def _values(thing: LabelledObject, calibration: Calibration, middles_px: Array) -> Array:
    box = thing.box
    left, top, right, bottom = thing.box_px
    u, v = middles_px.T
    least = 1.0
    seen_px = calibration.intrinsics.project(middle_of(box))
    fixed = (box.height_m, box.width_m, box.length_m, box.alpha_rad, thing.occluded_fraction)
    sides = np.stack([u - left, v - top, right - u, bottom - v], axis=1).clip(least)
    return np.concatenate([sides, seen_px - middles_px, np.tile(fixed, (len(u), 1))], axis=1)


def centre_losses(
    outputs: Mapping[str, Tensor], targets: CentreTargets, *, bins_px: Tensor, cell_px: tuple[float, float]
) -> dict[str, Tensor]:
    """The scalar losses of the centre-based networks by name, weighted for training to minimise their sum.

    - `heat`: the focal loss of CenterNet.
    - `sides`, `size`: mean absolute difference of the logarithms of the 2D box's sides and of the object's size.
    - `centre`: smooth L1 loss of the projected 3D centre, in cells.
    - `heading`: cross-entropy over the directions.
    - `hidden`: binary cross-entropy of the occluded share.
    - `disparity`: negative log-likelihood of a Laplace density over the disparity's logarithm (Kendall and Gal, NeurIPS
      2017), plus the mean absolute error of that logarithm. One unit is the same relative error at all distances.
    - `disparity_bins`: cross-entropy of the disparity bins, with the target shared between the two nearest bins.
    - `surface`: the same cross-entropy for the disparities that the volume alone predicts in cells on vehicles. It
      trains the matching features.

    Args:
        outputs: result of `gear.networks.stereo.centre.CentreGraph.forward`, lengths in pixels of the picture.
        targets: training targets of the batch.
        bins_px: (D,) disparities of the bins, in geometric progression.
        cell_px: width and height of a cell in pixels of the picture.
    """
    device = outputs["heat"].device
    batch, row, column = targets.where.to(device).unbind(dim=1)
    weight = targets.weight.to(device)
    count = weight.sum().clamp_min(1.0)
    values, wanted_px = targets.values.to(device), targets.disparity_px.to(device)

    def at(name: str) -> Tensor:
        return outputs[name][batch, :, row, column]

    def mean(each: Tensor) -> Tensor:
        return (each * weight).sum() / count

    sides, centre, size, heading, hidden = torch.split(values, [4, 2, 3, 1, 1], dim=1)
    error = (at("disparity_px")[:, 0].log() - wanted_px.log()).abs()
    spread = at("disparity_spread")[:, 0]
    cells = values.new_tensor(cell_px)
    return {
        "heat": _focal(outputs["heat"], targets.heat.to(device), targets.is_counted.to(device)),
        "sides": mean((at("sides_px").log() - sides.log()).abs().mean(dim=1)),
        "centre": 0.5
        * mean(functional.smooth_l1_loss(at("centre_px") / cells, centre / cells, reduction="none").mean(1)),
        "size": 2 * mean((at("size_m").log() - size.log()).abs().mean(dim=1)),
        "heading": mean(_heading_entropy(at("heading_logits"), heading[:, 0])),
        "hidden": 0.2 * mean(functional.binary_cross_entropy_with_logits(at("hidden"), hidden, reduction="none")[:, 0]),
        "disparity": 0.5 * mean(error * (-spread).exp() + spread) + 5 * mean(error),
        "surface": 0.5 * _surface_entropy(outputs["surface_logits"], targets.surface_px.to(device), bins_px.to(device)),
        "disparity_bins": 0.5 * mean(_bin_entropy(at("disparity_logits"), wanted_px, bins_px.to(device))),
    }


def _focal(logits: Tensor, heat: Tensor, is_counted: Tensor) -> Tensor:
    """Penalty-reduced focal loss, divided by the number of centres."""
    is_centre = heat > 1 - ALMOST_ZERO
    chance = logits.sigmoid()
    hit = functional.logsigmoid(logits) * (1 - chance) ** FOCAL_POWER * is_centre
    empty = functional.logsigmoid(-logits) * chance**FOCAL_POWER * (1 - heat) ** BUMP_POWER * ~is_centre * is_counted
    return -(hit.sum() + empty.sum()) / is_centre.sum().clamp_min(1)


def _surface_entropy(logits: Tensor, wanted_px: Tensor, bins_px: Tensor) -> Tensor:
    is_known = torch.isfinite(wanted_px)
    if not bool(is_known.any()):
        return logits.sum() * 0
    return _bin_entropy(logits.permute(0, 2, 3, 1)[is_known], wanted_px[is_known], bins_px).mean()


def _heading_entropy(logits: Tensor, angle_rad: Tensor) -> Tensor:
    """(N,) cross-entropy with the target shared linearly between the two directions next to it."""
    count = logits.shape[1]
    place = (angle_rad / (2 * math.pi)).remainder(1) * count
    lower = place.floor().long() % count
    share = place - place.floor()
    chances = logits.log_softmax(dim=1)
    before = chances.gather(1, lower[:, None])[:, 0]
    after = chances.gather(1, (lower[:, None] + 1) % count)[:, 0]
    return -((1 - share) * before + share * after)


def _bin_entropy(logits: Tensor, wanted_px: Tensor, bins_px: Tensor) -> Tensor:
    """(N,) cross-entropy with the target shared linearly, in the logarithm, between the two bins next to it."""
    places = bins_px.log()
    place = ((wanted_px.log() - places[0]) / (places[1] - places[0])).clamp(0, len(places) - 1 - ALMOST_ZERO)
    lower = place.floor().long().clamp_max(len(places) - 2)
    share = place - lower
    chances = logits.log_softmax(dim=1)
    below = chances.gather(1, lower[:, None])[:, 0]
    above = chances.gather(1, lower[:, None] + 1)[:, 0]
    return -((1 - share) * below + share * above)
