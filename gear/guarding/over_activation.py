"""Where a feature map is active beyond measure: Z-Mask's spatial pooling refinement (Rossolini et al., AAAI 2023)."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional

LEAST_DEVIATION = 1e-5

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
    """Of one (C, h, w) map, as it is on the grid."""
    cells = on_grid(features, grid)
    return ChannelStatistics(mean=cells.mean(dim=(1, 2)), deviation=cells.std(dim=(1, 2)))


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
    return on_grid((down @ z @ across.T).abs().mean(dim=0)[None], grid)[0]


def refined(pooled: Sequence[Tensor]) -> Tensor:
    """One layer's heat map from its pooled sizes, those of the largest windows first.

    H is the first, and then H / (1 + max H) times one after the other: where large windows see nothing, small ones find
    nothing.
    """
    result = pooled[0]
    for one in pooled[1:]:
        result = result / (1 + result.amax()) * one
    return result


@functools.lru_cache(maxsize=64)
def _window_means(cells: int, grid: int, kernel: int) -> Tensor:
    """(windows, cells): from a line of cells to the means of windows of a grid on which each has the nearest one."""
    nearest = functional.interpolate(torch.eye(cells)[None], size=grid, mode="nearest")[0].T
    sums = functional.pad(nearest.double().cumsum(dim=0), (0, 0, 1, 0))
    kernel = min(kernel, grid)
    return ((sums[kernel:] - sums[:-kernel]) / kernel).float()
