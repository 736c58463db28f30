"""Random changes of a patch's appearance (expectation over transformation), in the order that CARLA-GeAR uses."""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from gear.plugins.attacks.optimisation.settings import Appearance


def vary(appearance: Appearance, patch: Tensor, rng: np.random.Generator) -> Tensor:
    """Returns a patch with a randomly changed appearance, as printing and photographing would change it;
    differentiable.

    The changes are noise, brightness, contrast and box blur, in this order.

    Args:
        appearance: strengths of the changes.
        patch: (3, h, w) in 0..1.
        rng: random generator of the changes.

    Returns:
        (3, h, w) in 0..1.
    """
    brightness, contrast, seed = rng.normal(), rng.normal(), int(rng.integers(2**63))
    side = int(rng.integers(3, max(appearance.blur_px, 3) + 1))
    seen = patch
    if appearance.noise:
        generator = torch.Generator(device="cpu").manual_seed(seed)
        noise = torch.randn(patch.shape, generator=generator, dtype=patch.dtype).to(patch.device)
        seen = (seen + appearance.noise * noise).clamp(0, 1)
    seen = ((seen + appearance.brightness * brightness) * (1 + appearance.contrast * contrast)).clamp(0, 1)
    return _box_blurred(seen, side) if appearance.blur_px >= 3 else seen


def _box_blurred(patch: Tensor, side: int) -> Tensor:
    before, after = (side - 1) // 2, side // 2
    padded = functional.pad(patch[None], (before, after, before, after), mode="replicate")
    # A depth-wise convolution is about three times as fast as pooling with stride one.
    box = patch.new_full((len(patch), 1, side, side), 1 / side**2)
    return functional.conv2d(padded, box, groups=len(patch))[0]
