"""Heat maps of over-activated regions: Z-Mask's spatial pooling refinement (Rossolini et al., AAAI 2023)."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional

LEAST_DEVIATION = 1e-5
CHANNELS_AT_ONCE = 64
"""Number of channels that are pooled at a time, because maps with many channels would need gigabytes."""

Cells = tuple[int, int]


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class ChannelStatistics:
    """Mean and standard deviation of each channel of a feature map on clean pictures (without patch).

    Attributes:
        mean, deviation: (C,) mean and standard deviation over the cells of the feature map.
    """

    mean: Tensor
    deviation: Tensor

    def z_scores(self, features: Tensor) -> Tensor:
        """Returns the z-scores of a feature map: deviations from the channel's mean, in standard deviations of the
        channel.

        Args:
            features: (C, rows, columns) feature map.
        """
        mean, deviation = self.mean[:, None, None], self.deviation[:, None, None]
        return (features - mean) / (deviation + LEAST_DEVIATION)


def channel_statistics(features: Tensor, grid: Cells) -> ChannelStatistics:
    """Returns the mean and standard deviation of each channel of a feature map that is resized to a grid.

    The map is not actually resized: each cell has as much weight as there are grid cells to which it is the nearest.

    Args:
        features: (C, h, w) feature map of one picture.
        grid: numbers of rows and columns of the grid.
    """
    down, across = (_nearest(*sizes).sum(dim=0) for sizes in zip(features.shape[1:], grid, strict=True))
    times, count = down[:, None] * across, grid[0] * grid[1]
    mean = (features * times).sum(dim=(1, 2)) / count
    squares = ((features - mean[:, None, None]).square() * times).sum(dim=(1, 2))
    return ChannelStatistics(mean=mean, deviation=(squares / max(count - 1, 1)).sqrt())


def mean_of(many: Sequence[ChannelStatistics]) -> ChannelStatistics:
    """Returns the mean of the channel statistics of several pictures. Means and deviations are averaged
    separately, as published.

    Args:
        many: statistics of each picture, at least one.
    """
    return ChannelStatistics(
        mean=torch.stack([one.mean for one in many]).mean(dim=0),
        deviation=torch.stack([one.deviation for one in many]).mean(dim=0),
    )


def on_grid(features: Tensor, grid: Cells) -> Tensor:
    """Returns a tensor that is resized by nearest neighbour to (C, rows, columns).

    Args:
        features: (C, h, w) feature map.
        grid: numbers of rows and columns.
    """
    return functional.interpolate(features[None], size=grid, mode="nearest")[0]


def pooled_sizes(z: Tensor, grid: Cells, kernels: Sequence[Cells]) -> list[Tensor]:
    """Magnitudes of the mean z-scores in windows of the grid, averaged over channels and resized to the grid.

    Windows lie inside the grid, as published. Nearest-neighbour resizing and averaging over windows are both linear and
    separable. Along the columns, windows are differences of cumulative sums, which are computed once for all sizes of
    windows; along the rows, they are a matrix product. The time does not depend on the size of the windows.

    Args:
        z: (C, h, w) z-scores of any size.
        grid: rows and columns of the grid.
        kernels: rows and columns of the windows of each result, limited to those of the grid.

    Returns:
        (rows, columns) values of at least 0 for each of `kernels`.
    """
    kernels = [(min(kernel[0], grid[0]), min(kernel[1], grid[1])) for kernel in kernels]
    columns = functional.interpolate(torch.arange(z.shape[2]).float()[None, None], size=grid[1], mode="nearest")
    sizes = [torch.zeros(grid[0] - rows + 1, grid[1] - across + 1) for rows, across in kernels]
    for channels in torch.split(z, CHANNELS_AT_ONCE):
        sums = functional.pad(channels[..., columns[0, 0].long()].cumsum(dim=-1), (1, 0))
        for size, (rows, across) in zip(sizes, kernels, strict=True):
            beside = (sums[..., across:] - sums[..., :-across]) / across
            # In place, because a copy of the windows takes a sixth of the time.
            size += (_window_means(z.shape[1], grid[0], rows) @ beside).abs_().sum(dim=0)
    return [on_grid(size[None] / len(z), grid)[0] for size in sizes]


def refined(pooled: Sequence[Tensor]) -> Tensor:
    """Returns the (rows, columns) heat map of one layer, from its pooled magnitudes.

    H starts as the first map. For each next map, H becomes H / (1 + max H) times that map, so small windows count only
    where large windows are active.

    Args:
        pooled: (rows, columns) maps of `pooled_sizes`, from the largest to the smallest windows.
    """
    result = pooled[0]
    for one in pooled[1:]:
        result = result / (1 + result.amax()) * one
    return result


def cell_auroc(heat: Tensor, truth: Tensor) -> float:
    """Area under the ROC curve of a heat map that classifies cells into patch and background.

    The result is NaN if all cells or no cells show the patch.

    Args:
        heat: (rows, columns) heat map.
        truth: (rows, columns), 1 in cells that the patch covers, 0 elsewhere.
    """
    is_patch = truth.flatten() > 0
    inside, others = int(is_patch.sum()), int((~is_patch).sum())
    if not inside or not others:
        return float("nan")
    ranks = heat.flatten().argsort().argsort().double()
    return float((ranks[is_patch].sum() - inside * (inside - 1) / 2) / (inside * others))


def select_layers(heats: Mapping[str, Sequence[Tensor]], truths: Sequence[Tensor]) -> tuple[str, ...]:
    """Selects the layers whose common heat map (largest value in each cell) separates patches from other cells best.

    The selection starts with the best single layer. The other layers follow in the order of their own AUROC; a layer is
    selected if it raises the mean AUROC of the common map.

    Args:
        heats: (rows, columns) heat maps by layer, one per picture.
        truths: (rows, columns) of each picture, 1 in cells that the patch covers, 0 elsewhere.

    Returns:
        Names of the selected layers; empty if no picture shows a patch.
    """

    def area(names: Sequence[str]) -> float:
        pictures = zip(*(heats[name] for name in names), strict=True)
        found = [cell_auroc(torch.stack(maps).amax(dim=0), truth) for maps, truth in zip(pictures, truths, strict=True)]
        known = [value for value in found if not math.isnan(value)]
        return sum(known) / len(known) if known else math.nan

    alone = {name: area([name]) for name in heats}
    kept: list[str] = []
    best = 0.0
    for name in sorted((name for name in alone if not math.isnan(alone[name])), key=lambda name: -alone[name]):
        together = area([*kept, name])
        if together > best:
            kept, best = [*kept, name], together
    return tuple(kept)


def _nearest(cells: int, grid: int) -> Tensor:
    """The (grid, cells) matrix of nearest-neighbour resizing along one axis.

    An entry is 1 where a grid cell takes its value from a cell of the map, otherwise 0.
    """
    return functional.interpolate(torch.eye(cells)[None], size=grid, mode="nearest")[0].T


@functools.lru_cache(maxsize=64)
def _window_means(cells: int, grid: int, kernel: int) -> Tensor:
    """The (windows, cells) matrix along one axis from the cells of a map to the window means of the resized grid."""
    sums = functional.pad(_nearest(cells, grid).double().cumsum(dim=0), (0, 0, 1, 0))
    kernel = min(kernel, grid)
    return ((sums[kernel:] - sums[:-kernel]) / kernel).float()
