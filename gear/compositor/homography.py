"""The paper's compositor: a patch pasted by homography, as it is, over whatever the picture shows there.

It knows nothing of light, air or what stands before a board; that is the gap that `transport` closes. What was broken
in the reference code is mended: the mask is that of the surface's outline, not of pixels that happen not to be black; all
patches stay; and a patch that is small in the picture is averaged, not skipped over (2 x 2 samples a pixel, trilinear).

Source: CARLA-GeAR (Nesti et al., 2022), section on scene-specific attacks; Rossolini et al., WACV 2022.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.compositor.pasting import Pasting, Prepared, Sizes, picture_of
from gear.compositor.pyramid import pyramid_of
from gear.compositor.sampling import Scan, take_samples, unit_from_image
from gear.compositor.sparse import SparseMatrix
from gear.compositor.warp import warp_matrix
from gear.values.optics import CameraEffects

_SCAN = Scan(supersampled=True, extrapolates=False, smooths=False, effects=CameraEffects())


@dataclass(frozen=True, slots=True, eq=False)
class _Outline:
    """Surfaces as the pinhole projects them.

    Attributes:
        background: (N, 3) float32 of the stored picture, 0..1.
        surfaces: index of a patch, its matrix, (N, 1) float32 share of each pixel that it covers; the farthest first.
    """

    background: Tensor
    surfaces: tuple[tuple[int, SparseMatrix, Tensor], ...]


class HomographyCompositor(Pasting):
    """Implements `gear.contracts.attacks.Compositor` for any dataset. See `Pasting` for its arguments."""

    def _columns(self, patches: Sequence[Tensor]) -> list[Tensor]:
        return [pyramid_of(int(p.shape[-2]), int(p.shape[-1])).spread(p) for p in patches]

    def _composed(self, inner: _Outline, columns: Sequence[Tensor]) -> Tensor:
        shown = inner.background
        for number, matrix, cover in inner.surfaces:
            shown = shown + cover * (matrix @ columns[number] - shown)
        return shown.clamp(0.0, 1.0)

    def _load(self, index: int, view: str, sizes: Sizes) -> Prepared:
        sample = self.dataset[index]
        picture = picture_of(sample, view, self.dataset)
        record = sample.record
        self._demand(sizes, len(record.surfaces))
        camera = record.camera(view)
        height, width = picture.shape[:2]
        rows, columns = (grid.reshape(-1) for grid in np.mgrid[0:height, 0:width])
        empty = np.zeros((height, width), np.bool_)
        found = []
        for number, surface in enumerate(record.surfaces):
            truth = next(t for t in sample.surfaces if t.name == surface.name and t.camera == view)
            if truth.incidence_deg >= 90:
                continue
            unit = unit_from_image(truth, surface, camera)
            samples = take_samples(_SCAN, unit, (columns, rows), empty, camera, (0.0, 0.0, 0.0))
            found.append((truth.distance_m, number, unit, np.flatnonzero(samples.coverage)))
        where = np.unique(np.concatenate([np.zeros(0, np.int64), *(pixels for *_, pixels in found)]))
        surfaces = []
        nbytes = 0
        for _, number, unit, _ in sorted(found, key=lambda entry: -entry[0]):
            samples = take_samples(_SCAN, unit, (columns[where], rows[where]), empty, camera, (0.0, 0.0, 0.0))
            matrix = SparseMatrix.of(warp_matrix(samples, pyramid_of(*sizes[number])), self.device)
            cover = torch.from_numpy(samples.coverage[:, None].astype(np.float32)).to(self.device)
            surfaces.append((number, matrix, cover))
            nbytes += matrix.nbytes + cover.nbytes
        background = torch.from_numpy(picture.reshape(-1, 3)[where] / np.float32(255)).to(self.device)
        inner: Any = _Outline(background, tuple(surfaces))
        return self._prepare(picture, where, inner, nbytes + background.nbytes)
