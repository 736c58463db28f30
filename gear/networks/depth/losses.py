"""Losses of monocular depth. Pixels without ground truth, such as the sky, are NaN and do not count.

Depths are (B, H, W) distances along the optical axis in metres. Means are taken over the known pixels of the whole
batch; a batch without known pixels has loss 0 and no gradient.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

LEAST_M = 1e-3
"""Lower limit, in metres, to which depths are clamped before taking logarithms; no object is nearer."""

LEAST_SQUARE = 1e-12
"""Value added to the argument of a square root; it keeps the gradient finite where the error is 0."""

MAX_DEPTH_M = 80.0
"""Greatest true depth that the losses use by default, in metres, as in most training and evaluation on KITTI."""


def valid_mask(depth_m: Tensor, max_depth_m: float | None = MAX_DEPTH_M) -> Tensor:
    """Returns the (B, H, W) bool mask of the pixels whose true depth is known and counts: above 1 mm and not too
    far.

    Args:
        depth_m: (B, H, W) true depth in metres, NaN where unknown.
        max_depth_m: greatest true depth that counts; None for no limit.
    """
    is_known = torch.isfinite(depth_m) & (depth_m > LEAST_M)
    return is_known if max_depth_m is None else is_known & (depth_m <= max_depth_m)


def silog(
    predicted_m: Tensor,
    depth_m: Tensor,
    *,
    balance: float = 0.5,
    scale: float = 1.0,
    max_depth_m: float | None = MAX_DEPTH_M,
) -> Tensor:
    """Scale-invariant logarithmic error: scale * sqrt(mean(g^2) - balance * mean(g)^2).

    g is the difference of the logarithms of predicted and true depth. The formula is the square root of equation 3 in
    Eigen et al., NeurIPS 2014. GLPDepth (arXiv 2201.07436, equation 3) uses balance 0.5. AdaBins (CVPR 2021, equation
    4) uses balance 0.85 and scale 10; `adabins_silog` computes this variant.

    Args:
        predicted_m: (B, H, W) predicted depth, above 0.
        depth_m: (B, H, W) ground truth, NaN where unknown.
        balance: 0 gives the root mean square of g; 1 ignores an error that is the same factor everywhere.
        scale: factor of the result.
        max_depth_m: greatest true depth that counts; None for no limit.
    """
    mask = valid_mask(depth_m, max_depth_m)
    count = mask.sum().clamp_min(1)
    errors = _log_errors(predicted_m, depth_m, mask)
    mean = errors.sum() / count
    square = (errors.square().sum() / count - balance * mean.square()).clamp_min(LEAST_SQUARE)
    loss: Tensor = scale * (square.sqrt() - LEAST_SQUARE**0.5)
    return loss


def adabins_silog(predicted_m: Tensor, depth_m: Tensor, *, max_depth_m: float | None = MAX_DEPTH_M) -> Tensor:
    """AdaBins' pixel loss: 10 * sqrt(variance + 0.15 * mean^2) of the differences between logarithms of depth.

    Args:
        predicted_m: (B, H, W) predicted depth, above 0.
        depth_m: (B, H, W) ground truth, NaN where unknown.
        max_depth_m: greatest true depth that counts; None for no limit.
    """
    return silog(predicted_m, depth_m, balance=0.85, scale=10.0, max_depth_m=max_depth_m)


def log_l1(predicted_m: Tensor, depth_m: Tensor, *, max_depth_m: float | None = MAX_DEPTH_M) -> Tensor:
    """Mean absolute difference between the logarithms of depth, a relative error that is robust to outliers.

    Args:
        predicted_m: (B, H, W) predicted depth, above 0.
        depth_m: (B, H, W) ground truth, NaN where unknown.
        max_depth_m: greatest true depth that counts; None for no limit.
    """
    mask = valid_mask(depth_m, max_depth_m)
    return _log_errors(predicted_m, depth_m, mask).abs().sum() / mask.sum().clamp_min(1)


def root_mean_square(predicted_m: Tensor, depth_m: Tensor, *, max_depth_m: float = MAX_DEPTH_M) -> Tensor:
    """Root mean square error in metres; predictions beyond `max_depth_m` are set to `max_depth_m`, as in the
    evaluation.

    The metric is that of Eigen et al., NeurIPS 2014. Logarithmic losses give near pixels the most weight; this loss
    gives far pixels the most weight.

    Args:
        predicted_m: (B, H, W) predicted depth, above 0.
        depth_m: (B, H, W) ground truth, NaN where unknown.
        max_depth_m: greatest true depth that counts, metres.
    """
    mask = valid_mask(depth_m, max_depth_m)
    errors = torch.where(mask, predicted_m.clamp_max(max_depth_m) - torch.where(mask, depth_m, 0.0), 0.0)
    mean = errors.square().sum() / mask.sum().clamp_min(1)
    loss: Tensor = (mean + LEAST_SQUARE).sqrt() - LEAST_SQUARE**0.5
    return loss


def smooth_l1(
    predicted_m: Tensor, depth_m: Tensor, *, beta_m: float = 1.0, max_depth_m: float | None = MAX_DEPTH_M
) -> Tensor:
    """Mean smooth L1 error in metres: quadratic below `beta_m`, linear above (Girshick, ICCV 2015).

    Args:
        predicted_m: (B, H, W) predicted depth, above 0.
        depth_m: (B, H, W) ground truth, NaN where unknown.
        beta_m: error at which the loss changes from quadratic to linear, metres.
        max_depth_m: greatest true depth that counts; None for no limit.
    """
    mask = valid_mask(depth_m, max_depth_m)
    target_m = torch.where(mask, depth_m, predicted_m.detach())
    return functional.smooth_l1_loss(predicted_m, target_m, beta=beta_m, reduction="sum") / mask.sum().clamp_min(1)


def bins_chamfer(centres_m: Tensor, depth_m: Tensor, *, max_depth_m: float | None = MAX_DEPTH_M) -> Tensor:
    """Chamfer distance between the centres of depth bins and the true depths (Fan et al., CVPR 2017; AdaBins, CVPR
    2021, equation 5).

    The distance of one picture is the sum of two means: over known pixels, the squared distance to the nearest bin
    centre; over bins, the squared distance to the nearest known depth. The result is the mean over pictures that have
    known pixels. Nearest neighbours are found by sorting, which needs no table of pixels by bins.

    Args:
        centres_m: (B, bins) centres in any order.
        depth_m: (B, H, W) ground truth, NaN where unknown.
        max_depth_m: greatest true depth that counts; None for no limit.
    """
    terms = []
    for centres, picture, mask in zip(centres_m, depth_m, valid_mask(depth_m, max_depth_m), strict=True):
        if bool(mask.any()):
            depths = picture[mask].sort().values
            ordered = centres.sort().values
            to_bins = (depths - _nearest(ordered, depths)).square().mean()
            to_depths = (ordered - _nearest(depths, ordered)).square().mean()
            terms.append(to_bins + to_depths)
    return torch.stack(terms).mean() if terms else centres_m.sum() * 0


def _nearest(ordered: Tensor, wanted: Tensor) -> Tensor:
    """For each value of `wanted`, the nearest value in the ascending `ordered`, with its gradient."""
    with torch.no_grad():
        above = torch.searchsorted(ordered.detach(), wanted.detach()).clamp(1, max(len(ordered) - 1, 1))
        above = above.clamp_max(len(ordered) - 1)
        below = (above - 1).clamp_min(0)
        chosen = torch.where(wanted - ordered[below] <= ordered[above] - wanted, below, above)
    return ordered[chosen]


def _log_errors(predicted_m: Tensor, depth_m: Tensor, mask: Tensor) -> Tensor:
    """Differences of logarithms, 0 where the mask is false."""
    target_m = torch.where(mask, depth_m, torch.ones_like(depth_m))
    errors = predicted_m.clamp_min(LEAST_M).log() - target_m.log()
    return torch.where(mask, errors, torch.zeros_like(errors))
