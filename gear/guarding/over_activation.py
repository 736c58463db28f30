"""Where a feature map is active beyond measure: Z-Mask's spatial pooling refinement (Rossolini et al., AAAI 2023)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.nn import functional

LEAST_DEVIATION = 1e-5
CHANNELS_AT_ONCE = 32
"""As many are pooled together, so that deep maps of many channels fit into memory."""

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


def channel_statistics(features: Tensor) -> ChannelStatistics:
    """Of one (C, rows, columns) map."""
    return ChannelStatistics(mean=features.mean(dim=(1, 2)), deviation=features.std(dim=(1, 2)))


def mean_of(many: Sequence[ChannelStatistics]) -> ChannelStatistics:
    """The means of several pictures' means and deviations, as published; at least one picture."""
    return ChannelStatistics(
        mean=torch.stack([one.mean for one in many]).mean(dim=0),
        deviation=torch.stack([one.deviation for one in many]).mean(dim=0),
    )


def on_grid(features: Tensor, grid: Cells) -> Tensor:
    """(C, h, w) to (C, rows, columns), each cell as the nearest one."""
    return functional.interpolate(features[None], size=grid, mode="nearest")[0]


def heat(z: Tensor, kernels: Sequence[Cells]) -> Tensor:
    """One layer's heat map.

    With H_k the mean over channels of the size of the Z-scores' mean in windows of k cells, H is that of the largest
    windows, and then H / (1 + max H) H_k for one kernel after the other: where large windows see nothing, small ones
    find nothing. Windows lie inside the map, and their means are stretched to its size, as published.

    Args:
        z: (C, rows, columns).
        kernels: rows and columns of the windows, large ones first.

    Returns:
        (rows, columns), 0 or more.
    """
    grid = (z.shape[1], z.shape[2])
    sums = [torch.zeros(grid) for _ in kernels]
    for channels in torch.split(z, CHANNELS_AT_ONCE):
        integral = functional.pad(channels.double().cumsum(dim=1).cumsum(dim=2), (1, 0, 1, 0))
        for place, kernel in enumerate(kernels):
            sizes = _window_means(integral, kernel).abs().sum(dim=0).float()
            sums[place] += on_grid(sizes[None], grid)[0]
    result = sums[0] / len(z)
    for total in sums[1:]:
        result = result / (1 + result.amax()) * (total / len(z))
    return result


def _window_means(integral: Tensor, kernel: Cells) -> Tensor:
    """Means of all windows, from sums over everything above and to the left: no dearer for large windows."""
    rows, columns = (min(side, size - 1) for side, size in zip(kernel, integral.shape[1:], strict=True))
    total = integral[:, rows:, columns:] - integral[:, :-rows, columns:] - integral[:, rows:, :-columns]
    return (total + integral[:, :-rows, :-columns]) / (rows * columns)
