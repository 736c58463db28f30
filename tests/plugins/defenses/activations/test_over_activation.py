"""The pooling refinement against torch's own pooling, and what it finds."""

from __future__ import annotations

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from torch.nn import functional

from gear.plugins.defenses.activations.over_activation import (
    ChannelStatistics,
    channel_statistics,
    mean_of,
    on_grid,
    pooled_sizes,
    refined,
    select_layers,
)

ROWS, COLUMNS = 30, 60


GRID = (ROWS, COLUMNS)


def heat(z: torch.Tensor, kernels: list[tuple[int, int]]) -> torch.Tensor:
    return refined(pooled_sizes(z, GRID, kernels))


def noise(seed: int, channels: int = 5) -> torch.Tensor:
    return torch.randn(channels, ROWS, COLUMNS, generator=torch.Generator().manual_seed(seed))


@given(
    st.integers(0, 1000),
    st.sampled_from([(1, 2), (3, 6), (8, 16), (30, 60), (12, 24), (40, 80)]),
    st.sampled_from([(30, 60), (7, 13), (45, 50), (1, 1)]),
)
@settings(max_examples=40, deadline=None)
def test_pooled_sizes_are_those_of_torch_s_own_pooling(
    seed: int, kernel: tuple[int, int], size: tuple[int, int]
) -> None:
    z = torch.randn(5, *size, generator=torch.Generator().manual_seed(seed))
    on = functional.interpolate(z[None], size=GRID, mode="nearest")
    inside = (min(kernel[0], ROWS), min(kernel[1], COLUMNS))
    pooled = functional.avg_pool2d(on, inside, stride=1).abs()
    expected = functional.interpolate(pooled, size=GRID, mode="nearest")[0].mean(dim=0)
    assert torch.allclose(pooled_sizes(z, GRID, [kernel])[0], expected, atol=1e-5)


def test_kernels_refine_one_another_as_published() -> None:
    z = noise(3)
    coarse, fine = heat(z, [(8, 16)]), heat(z, [(2, 4)])
    assert torch.allclose(heat(z, [(8, 16), (2, 4)]), coarse / (1 + coarse.amax()) * fine, atol=1e-6)


def test_signs_cancel_inside_a_window_and_channels_do_not() -> None:
    z = torch.ones(2, ROWS, COLUMNS)
    z[1] = -1
    assert torch.allclose(heat(z, [(4, 8)]), torch.ones(ROWS, COLUMNS))
    checkered = torch.ones(1, ROWS, COLUMNS)
    checkered[:, ::2] = -1
    assert float(heat(checkered, [(4, 8)]).amax()) < 1e-6


def test_a_square_of_large_scores_stands_out_where_it_is() -> None:
    z = 0.1 * noise(1, channels=8)
    z[:, 18:24, 40:52] += 3
    found = heat(z, [(12, 24), (6, 12), (2, 4)])
    row, column = divmod(int(found.argmax()), COLUMNS)
    assert 17 <= row <= 25 and 38 <= column <= 54
    assert float(found[18:24, 40:52].mean()) > 20 * float(found[:, :20].mean())


def test_scores_are_of_each_channel_alone() -> None:
    features = torch.stack([5 + 2 * noise(1, 1)[0], -3 + 0.5 * noise(2, 1)[0]])
    z = channel_statistics(features, GRID).z_scores(features)
    assert z.mean(dim=(1, 2)).tolist() == pytest.approx([0, 0], abs=1e-4)
    assert z.std(dim=(1, 2)).tolist() == pytest.approx([1, 1], abs=1e-3)


def test_statistics_are_those_of_the_grid() -> None:
    features = torch.randn(3, 7, 13, generator=torch.Generator().manual_seed(4)) + 2
    cells, learnt = on_grid(features, GRID), channel_statistics(features, GRID)
    assert torch.allclose(learnt.mean, cells.mean(dim=(1, 2)), atol=1e-5)
    assert torch.allclose(learnt.deviation, cells.std(dim=(1, 2)), atol=1e-5)


def test_channels_are_pooled_in_portions_to_the_same_end() -> None:
    z = noise(2, channels=150)
    alone = torch.stack([pooled_sizes(one[None], GRID, [(4, 8)])[0] for one in z]).mean(dim=0)
    assert torch.allclose(pooled_sizes(z, GRID, [(4, 8)])[0], alone, atol=1e-5)


def test_pictures_are_averaged_not_pooled() -> None:
    """Two pictures that are each flat have no deviation, however far apart they are."""
    each = [channel_statistics(torch.full((1, 4, 8), value), GRID) for value in (0.0, 10.0)]
    both = mean_of(each)
    assert (float(both.mean), float(both.deviation)) == (5.0, 0.0)


def test_the_grid_takes_the_nearest_cell() -> None:
    small = torch.arange(6.0).reshape(1, 2, 3)
    assert torch.equal(on_grid(small, (4, 6)), small.repeat_interleave(2, dim=1).repeat_interleave(2, dim=2))


def test_dead_channels_do_not_divide_by_zero() -> None:
    z = ChannelStatistics(mean=torch.zeros(1), deviation=torch.zeros(1)).z_scores(torch.zeros(1, 4, 8))
    assert torch.equal(z, torch.zeros(1, 4, 8))


def test_a_layer_that_hides_the_patch_is_left_out() -> None:
    """In the common map its heat elsewhere drowns the heat of the others."""
    truth = torch.zeros(4, 8)
    truth[:2, :4] = 1
    upper, lower, drowning = 0.01 * torch.rand(3, 4, 8, generator=torch.manual_seed(1))
    upper[0, :4], lower[1, :4] = 1, 1
    drowning[0, :], drowning[2:, :4] = 9, 9
    maps = {"drowning": [drowning], "upper": [upper], "lower": [lower]}
    assert set(select_layers(maps, [truth])) == {"upper", "lower"}
    assert select_layers({"one": [upper]}, [torch.zeros(4, 8)]) == ()
