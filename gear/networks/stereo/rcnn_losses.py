"""Training targets and the six losses of Stereo R-CNN (Li, Chen, Shen, CVPR 2019, sections 3 and 5)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from gear.formats.kitti_object import Calibration, clip_box
from gear.groundtruth.boxes import Box3d, project_box
from gear.networks.stereo.centre_losses import LabelledPair
from gear.networks.stereo.legacy_boxes import encode, overlaps
from gear.values.geometry import Array

CAR = "Car"
BOX_DEVIATION = (0.1, 0.1, 0.2, 0.2, 0.1, 0.2)
"""Scales of the six numbers of box codes, which are divided by them: x, y, width, height of the left box, x and
width of the right box.
"""

SIZE_MEAN = (1.6, 1.5, 4.0, 0.0, 0.0)
SIZE_DEVIATION = 0.5
"""Scale of the encoding of width, height, length (metres), sine and cosine of the observation angle: (value -
`SIZE_MEAN`) / scale.
"""

SIDE_MARGIN_PX = 3.0
"""Distance from a side of the 2D box, in pixels, below which the visible ground corner is not used, because it
adds no information to the side.
"""

LEAST_HEIGHT_PX, LEAST_SEEN_PX = 10.0, 3.0
RPN_SAMPLES, RPN_HIGH, RPN_LOW = 256, 0.7, 0.3
REGION_SAMPLES, REGION_SHARE, REGION_HIGH, REGION_LOW = 128, 0.25, 0.5, 0.1
RPN_SIGMA = 3.0


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class CarTargets:
    """Training targets of one picture: its cars, in pixels of the network's input.

    Attributes:
        left, right, union: (N, 4) boxes in the left picture, in the right picture, and around both.
        size_and_direction: (N, 5) width, height, length in metres, sine and cosine of the observation angle.
        corner_px: (N, 4) columns of the four ground corners; NaN except for the corner that is visible between the
            sides.
        borders_px: (N, 2) first and last column in which no nearer object occludes the car.
        ignored: (M, 4) union boxes of objects that are neither targets nor background.
    """

    left: Tensor
    right: Tensor
    union: Tensor
    size_and_direction: Tensor
    corner_px: Tensor
    borders_px: Tensor
    ignored: Tensor

    def to(self, device: torch.device) -> CarTargets:
        """Returns a copy of these training targets on another torch device.

        Args:
            device: the device.
        """
        return CarTargets(**{field.name: getattr(self, field.name).to(device) for field in fields(self)})


def car_targets(sample: LabelledPair, scale: float) -> CarTargets:
    """Computes the training targets of a sample in pixels of the network's input.

    Args:
        sample: a sample with labelled objects.
        scale: factor from the sample's pictures to the network's input.
    """
    calibration = sample.calibration
    rows: list[Array] = []
    ignored: list[Array] = []
    boxes = [(thing, _pair_of(thing.box, calibration)) for thing in sample.objects]
    for thing, pair in boxes:
        if pair is None:
            continue
        left, right = pair
        union = np.concatenate([np.minimum(left[:2], right[:2]), np.maximum(left[2:], right[2:])])
        if thing.is_ignored or thing.kitti_type != CAR:
            # Other vehicles are background, as in the authors' training; ignored objects are not.
            ignored += [union] if thing.is_ignored else []
            continue
        nearer = [
            other for each, two in boxes if two is not None and _is_nearer(each.box, thing.box) for other in two[:1]
        ]
        borders = _uncovered(left, nearer)
        if left[3] - left[1] < LEAST_HEIGHT_PX or borders[1] - borders[0] < LEAST_SEEN_PX:
            ignored.append(union)
            continue
        corners = _corner_between(thing.box, calibration, borders)
        alpha = thing.box.alpha_rad
        body = (thing.box.width_m, thing.box.height_m, thing.box.length_m, math.sin(alpha), math.cos(alpha))
        rows.append(np.concatenate([left, right, union, body, corners, borders]))
    table = torch.from_numpy(np.stack(rows) if rows else np.zeros((0, 23))).float()
    left_, right_, union_, body_, corner_, border_ = torch.split(table, [4, 4, 4, 5, 4, 2], dim=1)
    return CarTargets(
        left=left_ * scale,
        right=right_ * scale,
        union=union_ * scale,
        size_and_direction=body_,
        corner_px=corner_ * scale,
        borders_px=border_ * scale,
        ignored=torch.from_numpy(np.stack(ignored) if ignored else np.zeros((0, 4))).float() * scale,
    )


def _is_nearer(one: Box3d, two: Box3d) -> bool:
    return one.bottom_m[2] < two.bottom_m[2]


def _pair_of(box: Box3d, calibration: Calibration) -> tuple[Array, Array] | None:
    """The projections of a 3D box into both pictures, clipped; None if it lies outside one of them."""
    found = []
    for right_m in (0.0, calibration.baseline_m):
        projected = project_box(box.corners_m - (right_m, 0.0, 0.0), calibration.intrinsics)
        clipped = None if projected is None else clip_box(projected, calibration.intrinsics)
        if clipped is None:
            return None
        found.append(np.array(clipped))
    return found[0], found[1]


def _uncovered(left: Array, nearer: Sequence[Array]) -> Array:
    """(2,) first and last column of a box that no nearer object's box overlaps; twice the left side if all
    columns are overlapped.
    """
    columns = np.arange(math.floor(left[0]), math.floor(left[2]) + 1)
    is_free = np.ones(len(columns), dtype=np.bool_)
    for other in nearer:
        if other[1] < left[3] and other[3] > left[1]:
            is_free &= (columns < other[0]) | (columns > other[2])
    if not is_free.any():
        return np.array([left[0], left[0]])
    seen = columns[is_free]
    return np.array([max(left[0], seen[0]), left[2] if is_free[-1] else seen[-1]])


def ground_corners(box: Box3d) -> Array:
    """Returns the (4, 3) corners of a 3D box's bottom face in the camera frame, metres: rear left, front left,
    front right, rear right, as seen by the driver.

    Args:
        box: 3D box in the camera frame.
    """
    c, s = math.cos(box.rotation_y_rad), math.sin(box.rotation_y_rad)
    front, right = np.array([c, 0.0, -s]), np.array([-s, 0.0, -c])
    signs = np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)]) / 2
    return np.asarray(np.array(box.bottom_m) + signs[:, :1] * box.width_m * right + signs[:, 1:] * box.length_m * front)


def _corner_between(box: Box3d, calibration: Calibration, borders: Array) -> Array:
    """(4,) columns of the ground corners; NaN except for the near corner that is visible between the sides."""
    corners = ground_corners(box)
    if corners[:, 2].min() <= 0:
        return np.full(4, np.nan)
    columns = calibration.intrinsics.project(corners)[:, 0]
    is_between = (columns > columns.min() + SIDE_MARGIN_PX) & (columns < columns.max() - SIDE_MARGIN_PX)
    is_seen = (columns >= borders[0]) & (columns <= borders[1]) & (corners[:, 2] < box.bottom_m[2])
    return np.asarray(np.where(is_between & is_seen, columns, np.nan))


def rpn_losses(
    logits: Tensor, codes: Tensor, anchors: Tensor, cars: CarTargets, size_px: tuple[int, int], draws: torch.Generator
) -> dict[str, Tensor]:
    """Computes the two losses of the region proposal network for one picture.

    Args:
        logits: (A, 2) of the anchors.
        codes: (A, 6) codes of the box pairs.
        anchors: (A, 4) anchors in pixels of the network's input.
        cars: training targets of the picture.
        size_px: height and width of the network's input.
        draws: random generator that samples anchors.

    Returns:
        `rpn_class`, the cross-entropy of sampled anchors, and `rpn_boxes`, the smooth L1 loss of the codes; 0 if there
        is nothing to train on.
    """
    is_inside = (anchors[:, :2] >= 0).all(dim=1) & (anchors[:, 2] < size_px[1]) & (anchors[:, 3] < size_px[0])
    shared = overlaps(anchors, cars.union)
    best, owner = shared.max(dim=1) if len(cars.union) else (anchors.new_zeros(len(anchors)), None)
    is_wanted = best >= RPN_HIGH
    if owner is not None:
        most = (shared * is_inside[:, None]).max(dim=0).values.clamp(min=1e-5)
        is_wanted |= (shared == most).any(dim=1)
    is_other = (best < RPN_LOW) & ~is_wanted & ~_touches(anchors, cars.ignored)
    wanted = _some(is_wanted & is_inside, RPN_SAMPLES // 2, draws)
    other = _some(is_other & is_inside, RPN_SAMPLES - len(wanted), draws)
    chosen = torch.cat([wanted, other])
    if not len(chosen):
        return {"rpn_class": logits.sum() * 0, "rpn_boxes": codes.sum() * 0}
    labels = torch.cat([torch.ones_like(wanted), torch.zeros_like(other)])
    boxes = codes.sum() * 0
    if owner is not None and len(wanted):
        targets = _six(cars.left[owner[wanted]], cars.right[owner[wanted]], anchors[wanted], anchors[wanted])
        boxes = smooth_l1(codes[wanted], targets, RPN_SIGMA).sum() / (6 * len(chosen))
    return {"rpn_class": functional.cross_entropy(logits[chosen], labels), "rpn_boxes": boxes}


def _touches(boxes: Tensor, ignored: Tensor) -> Tensor:
    if not len(ignored):
        return torch.zeros(len(boxes), dtype=torch.bool, device=boxes.device)
    return overlaps(boxes, ignored).max(dim=1).values >= RPN_LOW


def _some(mask: Tensor, most: int, draws: torch.Generator) -> Tensor:
    """Indices at which the mask is True: at most `most`, drawn without replacement."""
    places = mask.nonzero()[:, 0]
    if len(places) <= most:
        return places
    return places[torch.randperm(len(places), generator=draws)[:most].to(places.device)]


def _six(left: Tensor, right: Tensor, left_from: Tensor, right_from: Tensor) -> Tensor:
    """(N, 6) codes of box pairs."""
    return torch.cat([encode(left, left_from), encode(right, right_from)[:, [0, 2]]], dim=1)


def smooth_l1(predicted: Tensor, target: Tensor, sigma: float = 1.0) -> Tensor:
    """Smooth L1 loss, element by element: quadratic for differences below 1 / sigma^2, linear above.

    Args:
        predicted, target: tensors of one shape.
        sigma: determines where the loss becomes linear.
    """
    return functional.smooth_l1_loss(predicted, target, reduction="none", beta=1 / sigma**2)


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SampledPairs:
    """Box pairs on which the second stage is trained; pairs that overlap a car come first.

    Attributes:
        left, right: (R, 4) boxes.
        owner: (F,) index of the car for each of the first F pairs; the other R - F pairs are background.
    """

    left: Tensor
    right: Tensor
    owner: Tensor


def sample_pairs(left: Tensor, right: Tensor, cars: CarTargets, draws: torch.Generator) -> SampledPairs:
    """Samples pairs of boxes for the training of the second stage, from the proposals and the boxes of the cars.

    At most a quarter of the sampled pairs overlap the same car in both pictures by an IoU of at least 0.5. The other
    pairs overlap a car by an IoU of 0.1 to 0.5 in at least one picture. If there is no car, all pairs are background.

    Args:
        left, right: (P, 4) proposals in the left and the right picture: left, top, right, bottom.
        cars: training targets of the picture.
        draws: random generator that samples pairs.
    """
    left, right = torch.cat([left, cars.left]), torch.cat([right, cars.right])
    if not len(cars.left):
        other = _some(~_touches(left, cars.ignored), REGION_SAMPLES, draws)
        return SampledPairs(left=left[other], right=right[other], owner=other[:0])
    (best_left, owner), (best_right, owner_right) = (
        overlaps(boxes, truth).max(dim=1) for boxes, truth in ((left, cars.left), (right, cars.right))
    )
    is_car = (best_left >= REGION_HIGH) & (best_right >= REGION_HIGH) & (owner == owner_right)
    is_other = ((best_left < REGION_HIGH) & (best_left >= REGION_LOW)) | (
        (best_right < REGION_HIGH) & (best_right >= REGION_LOW)
    )
    car = _some(is_car, round(REGION_SAMPLES * REGION_SHARE), draws)
    other = _some(is_other & ~is_car & ~_touches(left, cars.ignored), REGION_SAMPLES - len(car), draws)
    chosen = torch.cat([car, other])
    return SampledPairs(left=left[chosen], right=right[chosen], owner=owner[car])


def region_losses(predicted: Mapping[str, Tensor], pairs: SampledPairs, cars: CarTargets) -> dict[str, Tensor]:
    """Computes the four losses of the second stage for one picture.

    Args:
        predicted: outputs of `gear.networks.stereo.rcnn_graph.StereoRcnn.regions` for the R pairs.
        pairs: the R sampled pairs of boxes; the pairs that lie on a car are first.
        cars: training targets of the picture.

    Returns:
        Four scalar losses by name. `class`: cross-entropy, mean over the pairs. `boxes` and `size_and_direction`:
        smooth L1, summed over the pairs that lie on a car and divided by R. `keypoints`: mean of the three
        cross-entropies of the visible ground corner, the left border and the right border. The last three are 0 if no
        pair lies on a car.
    """
    count, held = max(len(pairs.left), 1), len(pairs.owner)
    labels = torch.zeros(len(pairs.left), dtype=torch.long, device=pairs.left.device)
    labels[:held] = 1
    nothing = torch.stack([tensor.sum() for tensor in predicted.values()]).sum() * 0
    losses = dict.fromkeys(("class", "boxes", "size_and_direction", "keypoints"), nothing)
    if len(labels):
        losses["class"] = functional.cross_entropy(predicted["class_logits"], labels)
    if not held:
        return losses
    left, right = pairs.left[:held], pairs.right[:held]
    codes = _six(cars.left[pairs.owner], cars.right[pairs.owner], left, right)
    losses["boxes"] = smooth_l1(predicted["box_codes"][:held, 1], codes / codes.new_tensor(BOX_DEVIATION)).sum() / count
    body = (cars.size_and_direction[pairs.owner] - codes.new_tensor(SIZE_MEAN)) / SIZE_DEVIATION
    losses["size_and_direction"] = smooth_l1(predicted["size_and_direction"][:held, 1], body).sum() / count
    corner = _columns(cars.corner_px[pairs.owner], left, predicted["keypoint_logits"].shape[-1])
    borders = _columns(cars.borders_px[pairs.owner], left, predicted["border_logits"].shape[-1])
    parts = [_corner_entropy(predicted["keypoint_logits"][:held], corner)]
    parts += [_column_entropy(predicted["border_logits"][:held, side], borders[:, side]) for side in (0, 1)]
    losses["keypoints"] = torch.stack(parts).mean()
    return losses


def _columns(where_px: Tensor, boxes: Tensor, cells: int) -> Tensor:
    """(N, K) grid cell of each column in its box; -1 for missing columns and columns outside the box.

    The box's last column belongs to the last cell. The authors' rounding excludes it, and with it most right borders.
    """
    start, width = boxes[:, :1], boxes[:, 2:3] - boxes[:, :1] + 1
    cell = ((where_px - start) * cells / width).round()
    return torch.where((cell >= 0) & (cell <= cells), cell.clamp(max=cells - 1), -1.0).nan_to_num(-1.0).long()


def _corner_entropy(logits: Tensor, columns: Tensor) -> Tensor:
    """One cross-entropy over all cells of all four corners: it trains which corner is visible, and where."""
    best, corner = columns.max(dim=1)
    return _column_entropy(logits.flatten(1), torch.where(best >= 0, corner * logits.shape[-1] + best, -1))


def _column_entropy(logits: Tensor, wanted: Tensor) -> Tensor:
    is_known = wanted >= 0
    if not bool(is_known.any()):
        return logits.sum() * 0
    return functional.cross_entropy(logits[is_known], wanted[is_known])
