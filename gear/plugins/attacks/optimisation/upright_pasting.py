"""Pictures with patches pasted upright at random positions, for attacks that do not use the scene."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from gear.formats import rle
from gear.values.lazy_sequence import LazySequence
from gear.values.rng import derive_rng

Place = tuple[int, int, int, int]
"""Position and size of a pasted patch: top, left, height, width in pixels, inside the picture."""


class Upright(LazySequence[Any]):
    """A dataset and a compositor in one: patches are pasted upright into its pictures at random positions.

    The surfaces in its samples are these positions. Both views of a stereo pair show a patch at the same pixels, like
    an object very far away.

    Args:
        dataset: dataset of the pictures; its own surfaces are not changed.
        seed: seed of the positions.
        aspect: height of a patch divided by its width.
        share: width of a patch as a share of the picture's width.
        scales: range of the random factor on that width, drawn uniformly.
        shift: largest shift of a patch from its regular position, as a share of its size. Regular positions are
            at half the height, evenly spaced over the width.
    """

    def __init__(
        self,
        dataset: Sequence[Any],
        *,
        seed: int,
        aspect: float,
        share: float,
        scales: tuple[float, float],
        shift: float,
    ) -> None:
        self._dataset, self._seed = dataset, seed
        self._aspect, self._share, self._scales, self._shift = aspect, share, scales, shift
        self._step = 0

    def begin(self, step: int) -> None:
        """Starts a step of the attack: positions are drawn anew for each step.

        Args:
            step: number of the completed steps, on which the random draws depend.
        """
        self._step = step

    def __len__(self) -> int:
        return len(self._dataset)

    def item(self, index: int) -> Any:
        """Returns the sample `index` with the positions of the patches as its surfaces."""
        sample = self._dataset[index]
        places = self.places(index)
        surfaces = []
        for truth in sample.surfaces:
            height, width = sample.images[truth.camera].shape[:2]
            number = [surface.name for surface in sample.record.surfaces].index(truth.name)
            mask = np.zeros((height, width), np.bool_)
            top, left, rows, columns = places[number]
            mask[top : top + rows, left : left + columns] = True
            surfaces.append(dataclasses.replace(truth, visible_px=int(mask.sum()), mask_rle=rle.encode(mask)))
        return dataclasses.replace(sample, surfaces=tuple(surfaces))

    def compose(self, patches: Sequence[Tensor], samples: Sequence[int], view: str) -> Tensor:
        """Pastes patches into the pictures of one view.

        Args:
            patches: (3, h, w) for all samples, or (B, 3, h, w) with a patch for each sample; 0..1.
            samples: B indices in the dataset.
            view: name of the camera.

        Returns:
            (B, 3, H, W) pictures in 0..1, differentiable with respect to the patches.
        """
        pictures = []
        for number, index in enumerate(samples):
            stored = self._dataset[index].images[view]
            picture = torch.from_numpy(stored.copy()).permute(2, 0, 1).float() / 255
            for patch, (top, left, rows, columns) in zip(patches, self.places(index), strict=True):
                look = patch if patch.ndim == 3 else patch[number]
                size = (rows, columns)
                pasted = functional.interpolate(look[None], size=size, mode="bilinear", antialias=True)[0]
                around = (left, picture.shape[2] - left - columns, top, picture.shape[1] - top - rows)
                inside = functional.pad(torch.ones(1, rows, columns), around)
                picture = torch.where(inside > 0, functional.pad(pasted, around), picture)
            pictures.append(picture)
        return torch.stack(pictures)

    def places(self, index: int) -> list[Place]:
        """Returns the positions of a sample's patches in the current step: side by side, then scaled and shifted
        at random.

        Args:
            index: index of the sample in the dataset.
        """
        sample = self._dataset[index]
        height, width = next(iter(sample.images.values())).shape[:2]
        count = len(sample.record.surfaces)
        rng = derive_rng(self._seed, "place", self._step, index)
        found = []
        for number in range(count):
            columns = max(2, min(width, round(width * self._share * rng.uniform(*self._scales))))
            rows = max(2, min(height, round(columns * self._aspect)))
            middle_x = width * (number + 1) / (count + 1) + rng.uniform(-self._shift, self._shift) * columns
            middle_y = height / 2 + rng.uniform(-self._shift, self._shift) * rows
            left = int(np.clip(round(middle_x - columns / 2), 0, width - columns))
            top = int(np.clip(round(middle_y - rows / 2), 0, height - rows))
            found.append((top, left, rows, columns))
        return found
