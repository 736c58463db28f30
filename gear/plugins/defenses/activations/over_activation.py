"""Where a feature map is active beyond measure: Z-Mask's spatial pooling refinement (Rossolini et al., AAAI 2023)."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional

LEAST_DEVIATION = 1e-5
CHANNELS_AT_ONCE = 64
"""As many are pooled together: deep maps of many channels would take gigabytes."""

Cells = tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ChannelStatistics:
    """What is usual in the channels of a feature map.

    Attributes:
        mean, deviation: (C,) over the cells of a picture.
    """

    mean: Tensor
    deviation: Tensor

    def z_scores(self, features: Tensor) -> Tensor:
        """(C, rows, columns) features, by channel."""
        mean, deviation = self.mean[:, None, None], self.deviation[:, None, None]
        return (features - mean) / (deviation + LEAST_DEVIATION)


def channel_statistics(features: Tensor, grid: Cells) -> ChannelStatistics:
    """Of one (C, h, w) map, as it is on the grid: every cell counts as often as it is the nearest one there."""
    down, across = (_nearest(*sizes).sum(dim=0) for sizes in zip(features.shape[1:], grid, strict=True))
    times, count = down[:, None] * across, grid[0] * grid[1]
    mean = (features * times).sum(dim=(1, 2)) / count
    squares = ((features - mean[:, None, None]).square() * times).sum(dim=(1, 2))
    return ChannelStatistics(mean=mean, deviation=(squares / max(count - 1, 1)).sqrt())


def mean_of(many: Sequence[ChannelStatistics]) -> ChannelStatistics:
    """The means of several pictures' means and deviations, as published; at least one picture."""
    return ChannelStatistics(
        mean=torch.stack([one.mean for one in many]).mean(dim=0),
        deviation=torch.stack([one.deviation for one in many]).mean(dim=0),
    )


def on_grid(features: Tensor, grid: Cells) -> Tensor:
    """(C, h, w) to (C, rows, columns), each cell as the nearest one."""
    return functional.interpolate(features[None], size=grid, mode="nearest")[0]


def pooled_sizes(z: Tensor, grid: Cells, kernel: Cells) -> Tensor:
    """Mean over channels of the size of the Z-scores' mean in windows of the grid, stretched to the grid.

    Windows lie inside the grid, as published. Taking the nearest cell and the mean of a window are both linear, and the
    same for rows as for columns: two products of matrices, whose cost does not grow with the window.

    Args:
        z: (C, h, w), of any size.
        grid: rows and columns.
        kernel: rows and columns of the windows; larger ones than the grid are as large as the grid.

    Returns:
        (rows, columns), 0 or more.
    """
    down, across = (_window_means(*sizes) for sizes in zip(z.shape[1:], grid, kernel, strict=True))
    sizes = torch.zeros(len(down), len(across))
    for channels in torch.split(z, CHANNELS_AT_ONCE):
        sizes += (down @ channels @ across.T).abs().sum(dim=0)
    return on_grid(sizes[None] / len(z), grid)[0]


def refined(pooled: Sequence[Tensor]) -> Tensor:
    """One layer's heat map from its pooled sizes, those of the largest windows first.

    H is the first, and then H / (1 + max H) times one after the other: where large windows see nothing, small ones find
    nothing.
    """
    result = pooled[0]
    for one in pooled[1:]:
        result = result / (1 + result.amax()) * one
    return result


def cell_auroc(heat: Tensor, truth: Tensor) -> float:
    """How often a cell of the patch is hotter than another cell: area under the ROC curve; NaN without both kinds.

    Args:
        heat: (rows, columns).
        truth: (rows, columns), 1 where the patch is, 0 elsewhere.
    """
    is_patch = truth.flatten() > 0
    inside, others = int(is_patch.sum()), int((~is_patch).sum())
    if not inside or not others:
        return float("nan")
    ranks = heat.flatten().argsort().argsort().double()
    return float((ranks[is_patch].sum() - inside * (inside - 1) / 2) / (inside * others))


def _nearest(cells: int, grid: int) -> Tensor:
    """(grid, cells): 1 where a place of the grid takes its value from a cell."""
    return functional.interpolate(torch.eye(cells)[None], size=grid, mode="nearest")[0].T


@functools.lru_cache(maxsize=64)
def _window_means(cells: int, grid: int, kernel: int) -> Tensor:
    """(windows, cells): from a line of cells to the means of windows of a grid on which each has the nearest one."""
    sums = functional.pad(_nearest(cells, grid).double().cumsum(dim=0), (0, 0, 1, 0))
    kernel = min(kernel, grid)
    return ((sums[kernel:] - sums[:-kernel]) / kernel).float()
