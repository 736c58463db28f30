"""Depth losses against closed forms, a plain table of distances, and the reference implementation of transformers."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
import torch
from torch import Tensor

from gear.networks.depth.losses import (
    adabins_silog,
    bins_chamfer,
    log_l1,
    root_mean_square,
    silog,
    smooth_l1,
    valid_mask,
)

LOSSES: list[Callable[[Tensor, Tensor], Tensor]] = [silog, adabins_silog, log_l1, root_mean_square, smooth_l1]


def depths(seed: int, shape: tuple[int, ...] = (2, 6, 9)) -> Tensor:
    generator = torch.Generator().manual_seed(seed)
    return 1 + 70 * torch.rand(shape, generator=generator)


def test_what_has_no_truth_is_masked() -> None:
    depth_m = torch.tensor([[[1.0, float("nan"), 0.0, 80.0, 80.1, float("inf")]]])
    assert valid_mask(depth_m).tolist() == [[[True, False, False, True, False, False]]]
    assert valid_mask(depth_m, None).tolist() == [[[True, False, False, True, True, False]]]


@pytest.mark.parametrize("loss", LOSSES)
def test_right_is_nought_and_wrong_is_not(loss: Callable[[Tensor, Tensor], Tensor]) -> None:
    truth = depths(1)
    assert float(loss(truth.clone(), truth)) == pytest.approx(0, abs=2e-5)
    assert float(loss(depths(2), truth)) > 0.1


@pytest.mark.parametrize("loss", LOSSES)
def test_unknown_pixels_count_for_nothing(loss: Callable[[Tensor, Tensor], Tensor]) -> None:
    truth, predicted = depths(1), depths(2).requires_grad_()
    holes = truth.clone()
    holes[:, ::2] = float("nan")
    holes[:, 1] = 300.0
    value = loss(predicted, holes)
    kept = (slice(None), slice(3, None, 2))
    torch.testing.assert_close(value, loss(predicted[kept], truth[kept]))
    (gradient,) = torch.autograd.grad(value, predicted)
    assert bool(torch.isfinite(gradient).all())
    assert not bool(gradient[:, ::2].any()) and not bool(gradient[:, 1].any())
    assert bool((gradient[kept] != 0).all())


@pytest.mark.parametrize("loss", [*LOSSES, lambda p, t: bins_chamfer(p.flatten(1), t)])
def test_a_batch_without_truth_has_no_loss_and_no_gradient(loss: Callable[[Tensor, Tensor], Tensor]) -> None:
    predicted = depths(2).requires_grad_()
    value = loss(predicted, torch.full_like(predicted, float("nan")))
    (gradient,) = torch.autograd.grad(value, predicted)
    assert float(value.detach()) == pytest.approx(0, abs=1e-9) and not bool(gradient.any())


def test_a_wrong_scale_costs_what_the_balance_says() -> None:
    truth = depths(1)
    for balance in (0.0, 0.5, 0.85):
        expected = math.log(2) * math.sqrt(1 - balance)
        assert float(silog(2 * truth, truth, balance=balance)) == pytest.approx(expected, rel=1e-4)
    assert float(silog(2 * truth, truth)) == pytest.approx(math.log(2) * math.sqrt(0.5), rel=1e-4), "GLPDepth's"
    assert float(silog(2 * truth, truth, balance=1.0)) == pytest.approx(0, abs=2e-3)
    assert float(adabins_silog(2 * truth, truth)) == pytest.approx(10 * math.log(2) * math.sqrt(0.15), rel=1e-4)
    assert float(log_l1(truth / 2, truth)) == pytest.approx(math.log(2), rel=1e-5)


def test_adabins_silog_is_variance_and_squared_mean() -> None:
    predicted, truth = depths(2), depths(1)
    errors = predicted.log() - truth.log()
    expected = 10 * (errors.var(correction=0) + 0.15 * errors.mean() ** 2).sqrt()
    torch.testing.assert_close(adabins_silog(predicted, truth), expected, rtol=1e-4, atol=1e-5)


def test_smooth_l1_is_square_near_and_straight_far() -> None:
    truth = torch.full((1, 1, 2), 20.0)
    assert float(smooth_l1(truth + torch.tensor([0.5, 5.0]), truth)) == pytest.approx((0.125 + 4.5) / 2)


@pytest.mark.parametrize("bins", [1, 7, 40])
def test_chamfer_is_that_of_the_whole_table(bins: int) -> None:
    truth = depths(1)
    truth[0, 0] = float("nan")
    centres = depths(3, (2, bins)).requires_grad_()
    expected = []
    for row, picture in zip(centres, truth, strict=True):
        square = (row[:, None] - picture[torch.isfinite(picture)][None, :]) ** 2
        expected.append(square.amin(0).mean() + square.amin(1).mean())
    wanted = torch.stack(expected).mean()
    value = bins_chamfer(centres, truth)
    torch.testing.assert_close(value, wanted)
    torch.testing.assert_close(torch.autograd.grad(value, centres), torch.autograd.grad(wanted, centres))


def test_the_root_mean_square_is_in_metres_and_answers_end_at_the_cap() -> None:
    truth = torch.tensor([[[10.0, 20.0, 79.0, 200.0, torch.nan]]])
    predicted = torch.tensor([[[13.0, 16.0, 500.0, 1.0, 1.0]]], requires_grad=True)
    loss = root_mean_square(predicted, truth)
    assert float(loss.detach()) == pytest.approx(math.sqrt((9 + 16 + 1) / 3), rel=1e-4)
    loss.backward()
    assert predicted.grad is not None and (predicted.grad[0, 0] == 0).tolist() == [False, False, True, True, True]
