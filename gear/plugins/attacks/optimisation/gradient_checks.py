"""Checks for masked gradients: a small step along the gradient must change the objective as the gradient predicts."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import torch
from torch import Tensor

STEP = 0.02
"""Size of the test step: root mean square over the patch's values in 0..1, about five levels of 255."""


def predicted_and_measured_change(
    value: Callable[[Sequence[Tensor]], Tensor], patches: Sequence[Tensor]
) -> tuple[float, float]:
    """The change of an objective by a small step along its gradient, as predicted by the gradient and as measured.

    If the measured change is far below the predicted one, the gradient is masked: by a defense, by saturation, or by
    arithmetic that is not differentiable.

    Args:
        value: deterministic objective, a function of the patches.
        patches: (3, h, w) each in 0..1: patches at which the gradient is checked.

    Returns:
        The predicted and the measured change of the objective between both ends of the step.
    """
    asked = [patch.detach().clone().requires_grad_(True) for patch in patches]
    total = value(asked)
    gradients = torch.autograd.grad(total, asked, allow_unused=True) if total.requires_grad else [None] * len(asked)
    found = [torch.zeros_like(p) if g is None else g for p, g in zip(asked, gradients, strict=True)]
    # Only values whose step stays inside 0..1 are changed; other steps would be clipped.
    inside = [g * _room(p, g) for p, g in zip(asked, found, strict=True)]
    size = torch.stack([g.square().mean() for g in inside]).mean().sqrt()
    if size == 0:
        return 0.0, 0.0
    steps = [STEP * g / size for g in inside]
    with torch.no_grad():
        ahead = [(p + s / 2).clamp(0, 1) for p, s in zip(asked, steps, strict=True)]
        behind = [(p - s / 2).clamp(0, 1) for p, s in zip(asked, steps, strict=True)]
        # The predicted change uses the step after clipping: if few values carry the gradient, their steps are long.
        ways = [(g * (a - b)).sum() for g, a, b in zip(found, ahead, behind, strict=True)]
        return float(torch.stack(ways).sum()), float(value(ahead) - value(behind))


def _room(patch: Tensor, gradient: Tensor) -> Tensor:
    """A tensor like the patch: 1 for values at which both ends of the step stay inside 0..1, otherwise 0."""
    return ((patch > STEP) & (patch < 1 - STEP)).to(gradient)
