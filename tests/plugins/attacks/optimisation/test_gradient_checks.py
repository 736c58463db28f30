"""What a gradient promises, and what is kept of it."""

from __future__ import annotations

import pytest
import torch

from gear.plugins.attacks.optimisation.gradient_checks import predicted_and_measured_change


@pytest.mark.parametrize("saturated", [0.0, 0.5, 0.95])
def test_what_is_linear_keeps_its_promise(saturated: float) -> None:
    """Also where few values carry the gradient, as of a board that is far away, and most are at an end of 0..1."""
    generator = torch.Generator().manual_seed(3)
    patch = torch.rand(3, 20, 40, generator=generator)
    patch = torch.where(torch.rand(patch.shape, generator=generator) < saturated, patch.round(), patch)
    weight = torch.randn(patch.shape, generator=generator) * torch.randn(patch.shape, generator=generator).mul(2).exp()
    predicted, measured = predicted_and_measured_change(lambda patches: (patches[0].double() * weight).sum(), [patch])
    assert predicted > 0 and measured == pytest.approx(predicted, rel=1e-3)


def test_what_hides_its_gradient_keeps_little() -> None:
    patch = torch.full((3, 8, 8), 0.5)

    def hidden(patches: list[torch.Tensor]) -> torch.Tensor:
        """Flat, but with a slope to see."""
        return patches[0].sum() - (patches[0].sum() - 7.0).detach()

    predicted, measured = predicted_and_measured_change(hidden, [patch])  # type: ignore[arg-type]
    assert predicted > 0 and measured == pytest.approx(0.0, abs=1e-3 * predicted)
