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
    """Mean and standard deviation of each channel of a feature map, on clean pictures.

    Attributes:
        mean, deviation: (C,) mean and standard deviation over the cells of the feature map.
    """

    mean: Tensor
    deviation: Tensor

    def z_scores(self, features: Tensor) -> Tensor:
        """Z-scores of (C, rows, columns) features, with the statistics of each channel."""
        mean, deviation = self.mean[:, None, None], self.deviation[:, None, None]
        return (features - mean) / (deviation + LEAST_DEVIATION)


def channel_statistics(features: Tensor, grid: Cells) -> ChannelStatistics:
    """Mean and standard deviation of each channel of one (C, h, w) feature map, measured on a grid.

    Each cell of the map has as much weight as there are places on the grid whose nearest cell it is.
    """
    down, across = (_nearest(*sizes).sum(dim=0) for sizes in zip(features.shape[1:], grid, strict=True))
    times, count = down[:, None] * across, grid[0] * grid[1]
    mean = (features * times).sum(dim=(1, 2)) / count
    squares = ((features - mean[:, None, None]).square() * times).sum(dim=(1, 2))
    return ChannelStatistics(mean=mean, deviation=(squares / max(count - 1, 1)).sqrt())


def mean_of(many: Sequence[ChannelStatistics]) -> ChannelStatistics:
    """The mean of the statistics of several pictures (at least one): means and deviations are averaged, as
    published.
    """
    return ChannelStatistics(
        mean=torch.stack([one.mean for one in many]).mean(dim=0),
        deviation=torch.stack([one.deviation for one in many]).mean(dim=0),
    )


def on_grid(features: Tensor, grid: Cells) -> Tensor:
    """Resizes (C, h, w) to (C, rows, columns) by nearest neighbour."""
    return functional.interpolate(features[None], size=grid, mode="nearest")[0]


def pooled_sizes(z: Tensor, grid: Cells, kernel: Cells) -> Tensor:
    """Magnitudes of the mean z-scores in windows of the grid, averaged over channels and resized to the grid.

    Windows lie inside the grid, as published. Nearest-neighbour resizing and averaging over windows are both linear and
    separable, so they are two matrix products, whose time does not depend on the size of the windows.

    Args:
        z: (C, h, w) z-scores of any size.
        grid: rows and columns of the grid.
        kernel: rows and columns of the windows, limited to those of the grid.

    Returns:
        (rows, columns) values of at least 0.
    """
    down, across = (_window_means(*sizes) for sizes in zip(z.shape[1:], grid, kernel, strict=True))
    sizes = torch.zeros(len(down), len(across))
    for channels in torch.split(z, CHANNELS_AT_ONCE):
        sizes += (down @ channels @ across.T).abs().sum(dim=0)
    return on_grid(sizes[None] / len(z), grid)[0]


def refined(pooled: Sequence[Tensor]) -> Tensor:
    """The heat map of one layer from its pooled magnitudes, those of the largest windows first.

    H starts as the first map. It is then normalised to H / (1 + max H) and multiplied by each next map, so that small
    windows count only where large windows are active.
    """
    result = pooled[0]
    for one in pooled[1:]:
        result = result / (1 + result.amax()) * one
    return result


def cell_auroc(heat: Tensor, truth: Tensor) -> float:
    """Area under the ROC curve of a heat map as a detector of the patch's cells; NaN if all cells or no cells show the
    patch.

    Args:
        heat: (rows, columns) heat map.
        truth: (rows, columns), 1 where the patch is, 0 elsewhere.
    """
    is_patch = truth.flatten() > 0
    inside, others = int(is_patch.sum()), int((~is_patch).sum())
    if not inside or not others:
        return float("nan")
    ranks = heat.flatten().argsort().argsort().double()
    return float((ranks[is_patch].sum() - inside * (inside - 1) / 2) / (inside * others))


def telling_layers(heats: Mapping[str, Sequence[Tensor]], truths: Sequence[Tensor]) -> tuple[str, ...]:
    """The layers whose common heat map, the largest value in each cell, tells patches from other cells best.

    It starts with the best single layer. The others follow in the order of their own AUROC, and each is kept if it
    raises the mean AUROC of the common map.

    Args:
        heats: (rows, columns) heat maps by layer, one per picture.
        truths: (rows, columns) of each picture, 1 where the patch is, 0 elsewhere.

    Returns:
        Names of layers; empty if no picture shows a patch.
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
    """(grid, cells) matrix of nearest-neighbour resizing along one axis: 1 where a grid place takes its value from a
    cell.
    """
    return functional.interpolate(torch.eye(cells)[None], size=grid, mode="nearest")[0].T


@functools.lru_cache(maxsize=64)
def _window_means(cells: int, grid: int, kernel: int) -> Tensor:
    """(windows, cells) matrix along one axis from cells to means of windows of the resized grid."""
    sums = functional.pad(_nearest(cells, grid).double().cumsum(dim=0), (0, 0, 1, 0))
    kernel = min(kernel, grid)
    return ((sums[kernel:] - sums[:-kernel]) / kernel).float()
