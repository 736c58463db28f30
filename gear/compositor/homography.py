"""The compositor of the CARLA-GeAR paper: a patch is pasted by homography, with its own colours.

It ignores light, air and occluders, which the `transport` compositor models. It differs from the reference code in
three points:

- The mask is the outline of the surface. The reference code takes all pixels that are not black.
- All patches of a picture are pasted.
- Patches that are small in the picture are filtered (2 x 2 samples per pixel, trilinear). The reference code
  subsamples such patches.

Source: CARLA-GeAR (Nesti et al., 2022), section on patch generation; Nesti et al., WACV 2022.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from gear.camera.effects import Exposure, recorded_effects
from gear.compositor.base import BaseCompositor, Prepared, Sizes, picture_of, products
from gear.compositor.pyramid import pyramid_of
from gear.compositor.sampling import Samples, SampleScheme, take_samples, unit_from_image
from gear.compositor.sparse import SparseMatrix
from gear.compositor.warp import warp_matrix
from gear.values.geometry import Array

Ints = npt.NDArray[np.intp]

_FOUR_SAMPLES = SampleScheme(supersampled=True, extrapolates=False, smooths=False)
_NOWHERE = np.zeros((1, 1), np.bool_)

PIXELS_AT_ONCE = 1 << 17
"""Number of pixels whose coverage is tested at once. Testing a whole picture at once would take a gigabyte."""


@dataclass(frozen=True, slots=True, eq=False)
class _Outline:
    """Data of the N pixels that patch surfaces cover, by pinhole projection and lens.

    Attributes:
        background: (N, 3) float32 values of the stored picture, 0..1, multiplied by the share of the pixel that no
            surface covers.
        matrices: for each surface, a sparse matrix (N, columns).
        covers: for each surface, (N, 1) float32: the share of each pixel that it covers and no nearer surface does.
    """

    background: Tensor
    matrices: tuple[SparseMatrix, ...]
    covers: tuple[Tensor, ...]


class HomographyCompositor(BaseCompositor):
    """The compositor of the CARLA-GeAR paper: patches are pasted by homography, without light or occluders.

    It works with every dataset, also without probes (samples rendered with each patch surface black and white).
    `BaseCompositor` documents the arguments.
    """

    def _columns(self, patches: Sequence[Tensor]) -> list[Tensor]:
        return [pyramid_of(int(p.shape[-2]), int(p.shape[-1])).spread(p) for p in patches]

    def _composed(self, inner: Sequence[_Outline], columns: Sequence[Tensor]) -> Tensor:
        shown = torch.cat([view.background for view in inner])
        for number, mine in enumerate(columns):
            cover = torch.cat([view.covers[number] for view in inner])
            shown = shown + products([view.matrices[number] for view in inner], mine) * cover
        return shown.clamp(0.0, 1.0)

    def _load(self, index: int, view: str, sizes: Sizes) -> Prepared:
        sample = self.dataset[index]
        picture = picture_of(sample, view, self.dataset)
        record = sample.record
        self._demand(sizes, len(record.surfaces))
        camera = record.camera(view)
        height, width = picture.shape[:2]
        truths = [self._truth(sample, s.name, view) for s in record.surfaces]
        units = [unit_from_image(t, s, camera) for t, s in zip(truths, record.surfaces, strict=True)]

        # Four samples per pixel; with a lens, four for each pinhole pixel that a pixel mixes.
        scheme = replace(_FOUR_SAMPLES, effects=recorded_effects(camera))
        exposure = Exposure(camera=camera, scene=record)

        def samples_at(unit: Array, where: Ints) -> Samples:
            return take_samples(scheme, unit, (where % width, where // width), _NOWHERE, exposure)

        covered = np.zeros(height * width, np.bool_)
        parts = np.array_split(np.arange(covered.size), math.ceil(covered.size / PIXELS_AT_ONCE))
        for truth, unit in zip(truths, units, strict=True):
            for part in parts if truth.incidence_deg < 90 else ():
                covered[part] |= samples_at(unit, part).coverage > 0
        where = np.flatnonzero(covered)
        found = [samples_at(unit, where) for unit in units]
        left = np.ones(len(where))
        covers = [left] * len(found)
        for number in sorted(range(len(found)), key=lambda n: truths[n].distance_m):
            share = found[number].coverage * (truths[number].incidence_deg < 90)
            covers[number] = left * share
            left = left * (1 - share)
        matrices = tuple(
            SparseMatrix.of(warp_matrix(samples, pyramid_of(*size)), self.device)
            for samples, size in zip(found, sizes, strict=True)
        )
        background = picture.reshape(-1, 3)[where] / np.float32(255) * left[:, None]
        inner = _Outline(self._moved(background), matrices, tuple(self._moved(cover[:, None]) for cover in covers))
        nbytes = inner.background.nbytes + sum(m.nbytes for m in matrices) + sum(c.nbytes for c in inner.covers)
        return self._prepare(picture, where, inner, nbytes)

    def _moved(self, values: Array) -> Tensor:
        return torch.from_numpy(values.astype(np.float32)).to(self.device)
