"""The exact compositor: it computes the picture of any patch from two renders of each surface, black and white.

This is possible because light is linear:

    picture = response(B + sum over i of (M_i p_i) (W_i - B))

B and W_i are these renders (probes; `gear.dataset.probe_files`): B with all surfaces black, W_i with surface i white.
p_i is patch i as light, with its mip levels. M_i is a sparse matrix that samples p_i as the renderer samples a texture.
If the dataset has sensor noise, the noise of the stored sample is added.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from scipy import sparse
from torch import Tensor

from gear.camera import torch_response
from gear.camera.effects import CameraEffects, Exposure
from gear.camera.response import IDENTITY, Response
from gear.compositor.base import BaseCompositor, Prepared, Sizes, picture_of, products
from gear.compositor.pyramid import Pyramid, halving_of, pyramid_of
from gear.compositor.sampling import SampleScheme, take_samples, unit_from_image
from gear.compositor.sparse import SparseMatrix
from gear.compositor.warp import warp_matrix
from gear.contracts.rendering import Quality
from gear.dataset.probe_files import Probe, probes_of
from gear.formats import rle
from gear.values.frames import LINEAR_FULL_SCALE


@dataclass(frozen=True, slots=True, eq=False)
class _Light:
    """The light from which the N composed pixels of a view are computed.

    Attributes:
        black: (N, 3) float32 linear light with all surfaces black, 1.0 is full scale.
        matrices: for each surface, the sampling matrix (N, columns of the patch's pyramid).
        gains: for each surface, (N, 3) float32: light with that surface white minus `black`.
        response: exposure and tone curve of the camera.
        effects: the camera's effects that are not linear, such as noise, as functions of (N, 3) light, in order.
    """

    black: Tensor
    matrices: tuple[SparseMatrix, ...]
    gains: tuple[Tensor, ...]
    response: Response
    effects: tuple[Callable[[Tensor], Tensor], ...]

    def shown(self, light: Tensor) -> Tensor:
        """Converts (N, 3) linear light to (N, 3) picture values 0..1."""
        for effect in self.effects:
            light = effect(light)
        return torch_response.apply(self.response, light)

    @property
    def nbytes(self) -> int:
        return self.black.nbytes + sum(m.nbytes + g.nbytes for m, g in zip(self.matrices, self.gains, strict=True))


class TransportCompositor(BaseCompositor):
    """The exact compositor: light, air, occluders and lens act on the patch as in the renderer.

    It needs a dataset with probes (samples rendered with each surface black and white). `BaseCompositor` documents the
    arguments.
    """

    def _columns(self, patches: Sequence[Tensor]) -> list[Tensor]:
        renderer = self._renderer
        return [
            self._pyramid((int(p.shape[-2]), int(p.shape[-1]))).spread(torch_response.face_light(renderer, p))
            for p in patches
        ]

    def _composed(self, inner: Sequence[_Light], columns: Sequence[Tensor]) -> Tensor:
        light = torch.cat([view.black for view in inner])
        for number, mine in enumerate(columns):
            gain = torch.cat([view.gains[number] for view in inner])
            light = light + products([view.matrices[number] for view in inner], mine) * gain
        parts = light.split([len(view.black) for view in inner])  # type: ignore[no-untyped-call]
        return torch.cat([view.shown(part) for view, part in zip(inner, parts, strict=True)])

    def _pyramid(self, size: tuple[int, int]) -> Pyramid:
        """The mip levels for patches of size (height, width), as the dataset's renderer computes them."""
        renderer = self._renderer
        driver = str(self.dataset.manifest["renderer"].get("driver"))
        return pyramid_of(*size, halving_of(renderer, driver))

    @property
    def _renderer(self) -> str:
        return self.dataset.named("renderer")

    def _load(self, index: int, view: str, sizes: Sizes) -> Prepared:
        probes = probes_of(self.dataset, index, view)
        sample = self.dataset[index]
        picture = picture_of(sample, view, self.dataset)
        self._demand(sizes, len(sample.record.surfaces))
        height, width = picture.shape[:2]
        reach = np.zeros((height, width), np.bool_)
        for probe in probes:
            reach[_crop(probe)] |= (probe.black != probe.white).any(axis=2)
        rows, columns = np.nonzero(reach)
        black = np.zeros((height, width, 3), np.float32)
        gains = {surface.name: np.zeros_like(black) for surface in sample.record.surfaces}
        for probe in probes:
            black[_crop(probe)] = probe.black
            gains[probe.surface][_crop(probe)] = probe.white.astype(np.float32) - probe.black
        lit = [gain[rows, columns] for gain in gains.values()]
        dark = self._light(black[rows, columns])
        exposure = Exposure(camera=sample.record.camera(view), scene=sample.record)
        light = _Light(
            black=dark,
            matrices=tuple(
                self._matrix(sample, number, view, (columns, rows), gain, sizes[number])
                for number, gain in enumerate(lit)
            ),
            gains=tuple(self._light(gain) for gain in lit),
            response=probes[0].response if probes else IDENTITY,
            effects=tuple(
                effect.torch_at((rows, columns), exposure, dark)
                for effect in self._effects.active()
                if not effect.IS_LINEAR
            ),
        )
        return self._prepare(picture, rows * width + columns, light, light.nbytes)

    def _matrix(
        self, sample: Any, number: int, view: str, pixels: tuple[Any, Any], gain: Any, size: tuple[int, int]
    ) -> SparseMatrix:
        """The sampling matrix of one surface. Rows of pixels that get no light from the surface are empty."""
        record, pyramid = sample.record, self._pyramid(size)
        surface, camera = record.surfaces[number], record.camera(view)
        lit = np.flatnonzero(gain.any(axis=1))
        spread = sparse.csr_matrix((np.ones(lit.size, np.float32), (lit, np.arange(lit.size))), (len(gain), lit.size))
        if not lit.size:
            return SparseMatrix.of(sparse.csr_matrix((len(gain), pyramid.size), dtype=np.float32), self.device)
        truth = self._truth(sample, surface.name, view)
        samples = take_samples(
            SampleScheme.of(self._renderer, self._quality, self._effects.active()),
            unit_from_image(truth, surface, camera),
            (pixels[0][lit], pixels[1][lit]),
            rle.decode(truth.mask_rle, camera.height_px, camera.width_px),
            Exposure(camera=camera, scene=record),
        )
        return SparseMatrix.of((spread @ warp_matrix(samples, pyramid)).tocsr(), self.device)

    def _light(self, counts: Any) -> Tensor:
        return torch.from_numpy(counts / np.float32(LINEAR_FULL_SCALE)).to(self.device)

    @property
    def _quality(self) -> Quality:
        kind: Any = Quality
        quality: Quality = self.dataset.content(kind, "quality")
        return quality

    @property
    def _effects(self) -> CameraEffects:
        return self.dataset.content(CameraEffects, "camera")


def _crop(probe: Probe) -> Any:
    height, width = probe.black.shape[:2]
    return np.s_[probe.top_px : probe.top_px + height, probe.left_px : probe.left_px + width]
