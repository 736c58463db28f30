"""Two operators of torchvision that detectors need, written in NumPy and plain torch, with the same results."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from gear.values.geometry import Array


def nms(boxes: Tensor, scores: Tensor, iou_threshold: float) -> Tensor:
    """Greedy non-maximum suppression, with the results of torchvision's `nms`.

    Args:
        boxes: (N, 4) left, top, right, bottom.
        scores: (N,) scores; boxes with equal scores keep their order.
        iou_threshold: a box whose IoU with a kept box of higher score exceeds this is dropped.

    Returns:
        (K,) int64 indices of the kept boxes, highest score first.
    """
    wide = torch.float64 if boxes.dtype == torch.float64 else torch.float32
    edges: Array = boxes.detach().to("cpu", wide).numpy()
    order = np.argsort(-scores.detach().to("cpu", wide).numpy(), kind="stable")
    areas = (edges[:, 2] - edges[:, 0]) * (edges[:, 3] - edges[:, 1])
    kept: list[int] = []
    while order.size:
        best, rest = order[0], order[1:]
        kept.append(int(best))
        low = np.maximum(edges[best, :2], edges[rest, :2])
        high = np.minimum(edges[best, 2:], edges[rest, 2:])
        shared = np.prod(np.maximum(high - low, 0), axis=1)
        with np.errstate(invalid="ignore", divide="ignore"):
            iou = shared / (areas[best] + areas[rest] - shared)
        order = rest[~(iou > iou_threshold)]  # boxes without area have no IoU and are kept
    return torch.tensor(kept, dtype=torch.int64, device=boxes.device)


def roi_align(
    features: Tensor, rois: Tensor, spatial_scale: float, height: int, width: int, sampling_ratio: int, aligned: bool
) -> Tensor:
    """RoIAlign (He et al., Mask R-CNN, 2017): averages bilinear samples of the features in each cell of a grid
    over each region.

    The result is differentiable with respect to the features. As in torchvision, regions are not rounded to whole
    pixels.

    Args:
        features: (B, C, H, W).
        rois: (K, 5): index of the picture, then left, top, right, bottom in the picture's pixels.
        spatial_scale: factor from the picture's to the features' coordinates.
        height, width: number of cells of the grid.
        sampling_ratio: number of samples in each direction of a cell; 0 or less takes as many as the cell spans feature
            pixels.
        aligned: True if the centre of the first feature pixel is at 0.5, False if it is at 0.

    Returns:
        (K, C, height, width) with the dtype of the features.
    """
    wide = features.dtype if features.dtype in (torch.float32, torch.float64) else torch.float32
    with torch.autocast(features.device.type, enabled=False):
        source, regions = features.to(wide), rois.detach().to(wide)
        corners = regions[:, 1:] * spatial_scale - (0.5 if aligned else 0.0)
        start, size = corners[:, :2], corners[:, 2:] - corners[:, :2]
        if not aligned:
            size = size.clamp(min=1.0)
        cells = torch.tensor([width, height], dtype=wide, device=features.device)
        if sampling_ratio > 0:
            counts = torch.full_like(size, sampling_ratio).long()
        else:
            counts = torch.ceil(size / cells).long().clamp(min=0)
        # Regions of one picture with equally many samples share one call.
        groups = torch.cat([regions[:, :1].long(), counts], dim=1)
        order, pieces = [], [source[:0, :, :1, :1].expand(0, source.shape[1], height, width)]
        for number, across, down in torch.unique(groups, dim=0).tolist():
            chosen = (groups == torch.tensor([number, across, down], device=groups.device)).all(dim=1).nonzero()[:, 0]
            order.append(chosen)
            if across == 0 or down == 0:
                pieces.append(source.new_zeros(len(chosen), source.shape[1], height, width))
                continue
            xs = _places(start[chosen, 0], size[chosen, 0], width, across)
            ys = _places(start[chosen, 1], size[chosen, 1], height, down)
            samples = _bilinear(source[number : number + 1], xs, ys)
            pieces.append(functional.avg_pool2d(samples, (down, across)))
        pooled = torch.cat(pieces)
        if order:
            back = torch.empty(len(pooled), dtype=torch.int64, device=pooled.device)
            back[torch.cat(order)] = torch.arange(len(pooled), device=pooled.device)
            pooled = pooled[back]
    return pooled.to(features.dtype)


def _places(start: Tensor, size: Tensor, cells: int, samples: int) -> Tensor:
    """(K, cells * samples) coordinates of the samples along one axis."""
    steps = (torch.arange(cells * samples, dtype=size.dtype, device=size.device) + 0.5) / samples
    return start[:, None] + size[:, None] / cells * steps


def _bilinear(picture: Tensor, xs: Tensor, ys: Tensor) -> Tensor:
    """(K, C, rows, columns) samples of a (1, C, H, W) picture at (K, columns) x and (K, rows) y coordinates.

    Up to one pixel outside the outermost pixel centres the border's value is used; farther out the value is 0.
    """
    regions, columns, rows = len(xs), xs.shape[1], ys.shape[1]
    height, width = picture.shape[2:]
    inside_x, inside_y = (xs >= -1) & (xs <= width), (ys >= -1) & (ys <= height)
    unit_x, unit_y = (2 * xs / max(width - 1, 1) - 1), (2 * ys / max(height - 1, 1) - 1)
    grid = torch.stack([unit_x[:, None, :].expand(-1, rows, -1), unit_y[:, :, None].expand(-1, -1, columns)], dim=-1)
    tall = grid.reshape(1, regions * rows, columns, 2)
    samples = functional.grid_sample(picture, tall, mode="bilinear", padding_mode="border", align_corners=True)
    samples = samples[0].reshape(-1, regions, rows, columns).transpose(0, 1)
    return samples * (inside_y[:, None, :, None] & inside_x[:, None, None, :])
