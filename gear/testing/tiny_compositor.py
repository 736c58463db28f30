"""A small compositor for tests: pastes patches by homography onto the corners of their surfaces in the ground truth.

It ignores light. Attacks are tested with it without a renderer, whereas gear's exact compositor needs probes (samples
rendered with each surface black and white).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from gear.contracts.tasks import Sample
from gear.formats import rle
from gear.values.ground_truth import SurfaceTruth


class TinyCompositor:
    """A compositor for tests; implements `gear.contracts.attacks.Compositor` for the samples of a task."""

    def __init__(self, dataset: Sequence[Sample]) -> None:
        """Stores the samples.

        Args:
            dataset: samples with equal surfaces, at least one; `compose` counts their indices from 0.
        """
        self._dataset = dataset
        self.calls = 0
        """Number of calls of `compose`."""

    @property
    def surfaces(self) -> int:
        """The number of patches that `compose` expects: the number of patch surfaces."""
        return len(self._dataset[0].record.surfaces)

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        """Composes the patches onto their surfaces in the pictures of some samples.

        Args:
            patches: one for each surface, values in 0..1: (3, h, w), or (B, 3, h, w) with one for each sample.
            samples: B indices of samples.
            view: name of the camera.

        Returns:
            (B, 3, H, W) pictures in 0..1, differentiable with respect to the patches.

        Raises:
            ValueError: the number of patches is not that of the surfaces.
        """
        if len(patches) != self.surfaces:
            raise ValueError(f"there are {self.surfaces} surfaces, got {len(patches)} patches")
        self.calls += 1
        looks = [[patch if patch.ndim == 3 else patch[n] for patch in patches] for n in range(len(samples))]
        shown = zip(looks, samples, strict=True)
        return torch.stack([self._one(look, self._dataset[index], view) for look, index in shown])

    def _one(self, patches: Sequence[Tensor], sample: Sample, view: str) -> Tensor:
        picture = torch.from_numpy(sample.images[view].copy()).permute(2, 0, 1).float() / 255
        names = [surface.name for surface in sample.record.surfaces]
        for truth in sample.surfaces:
            if truth.camera == view and truth.image_from_unit is not None and truth.visible_px:
                picture = _pasted(picture, patches[names.index(truth.name)], truth)
        return picture


def _pasted(picture: Tensor, patch: Tensor, truth: SurfaceTruth) -> Tensor:
    height, width = picture.shape[1], picture.shape[2]
    unit_from_image = np.linalg.inv(np.array(truth.image_from_unit).reshape(3, 3))
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    unit = np.stack([x, y, np.ones_like(x)], axis=-1) @ unit_from_image.T
    with np.errstate(divide="ignore", invalid="ignore"):
        grid = np.nan_to_num(unit[..., :2] / unit[..., 2:] * 2 - 1, nan=9.0, posinf=9.0, neginf=-9.0)
    where = torch.from_numpy(rle.decode(truth.mask_rle, height, width))
    points = torch.from_numpy(grid.astype(np.float32))[None]
    warped = functional.grid_sample(patch[None], points, padding_mode="border", align_corners=False)[0]
    return torch.where(where, warped, picture)
