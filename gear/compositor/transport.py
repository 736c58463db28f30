"""The exact compositor: light is linear, so two probes of a surface say how any patch on it looks.

    picture = response(B + sum over i of (M_i p_i) (W_i - B))

B and W_i are the probes (`gear.formats.probes`); p_i is patch i as light, with its coarser levels; M_i is a sparse
matrix that samples it as the renderer samples its texture. Noise, if the dataset has any, is the sample's own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor

from gear.camera import torch_response
from gear.camera.response import Response
from gear.compositor.grain import Grain, grain_of
from gear.compositor.pasting import Pasting, Prepared, Sizes, picture_of
from gear.compositor.pyramid import pyramid_of
from gear.compositor.sampling import Scan, take_samples, unit_from_image
from gear.compositor.sparse import SparseMatrix
from gear.compositor.warp import warp_matrix
from gear.formats import rle
from gear.formats.probes import Probe, probes_of
from gear.values.frames import LINEAR_FULL_SCALE
from gear.values.optics import CameraEffects
from gear.values.serial import from_json


@dataclass(frozen=True, slots=True, eq=False)
class _Light:
    """What a view's composed pixels are made of.

    Attributes:
        black: (N, 3) float32 light 0..1.
        surfaces: index of a patch, its matrix, and (N, 3) float32 of white minus black.
        response: of the camera.
        grain: of the sample, or None.
    """

    black: Tensor
    surfaces: tuple[tuple[int, SparseMatrix, Tensor], ...]
    response: Response | None
    grain: Grain | None

    @property
    def nbytes(self) -> int:
        return self.black.nbytes + sum(m.nbytes + d.nbytes for _, m, d in self.surfaces)


class TransportCompositor(Pasting):
    """Implements `gear.contracts.attacks.Compositor` for a dataset with probes. See `Pasting` for its arguments."""

    def _columns(self, patches: Sequence[Tensor]) -> list[Tensor]:
        renderer = self._renderer
        return [
            pyramid_of(int(p.shape[-2]), int(p.shape[-1])).spread(torch_response.face_light(renderer, p))
            for p in patches
        ]

    def _composed(self, inner: _Light, columns: Sequence[Tensor]) -> Tensor:
        light = inner.black
        for number, matrix, gain in inner.surfaces:
            light = light + (matrix @ columns[number]) * gain
        if inner.grain is not None:
            light = inner.grain.on(light)
        return light if inner.response is None else torch_response.apply(inner.response, light)

    @property
    def _renderer(self) -> str:
        return str(self.dataset.manifest["renderer"]["name"])

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
        surfaces = []
        for probe in probes:
            black[_crop(probe)] = probe.black
        for probe in probes:
            surfaces.append(self._surface(sample, probe, (columns, rows), sizes))
        light = _Light(
            black=self._light(black[rows, columns]),
            surfaces=tuple(surfaces),
            response=probes[0].response if probes else None,
            grain=grain_of(self._effects(), sample.record, view, rows, columns, self.device),
        )
        return self._prepare(picture, rows * width + columns, light, light.nbytes)

    def _surface(
        self, sample: Any, probe: Probe, pixels: tuple[Any, Any], sizes: Sizes
    ) -> tuple[int, SparseMatrix, Tensor]:
        record = sample.record
        number = [surface.name for surface in record.surfaces].index(probe.surface)
        truth = next(t for t in sample.surfaces if t.name == probe.surface and t.camera == probe.view)
        camera = record.camera(probe.view)
        gain = np.zeros((camera.height_px, camera.width_px, 3), np.float32)
        gain[_crop(probe)] = probe.white.astype(np.float32) - probe.black
        samples = take_samples(
            Scan.of(self._renderer, self.dataset.plan.content["quality"], self._effects()),
            unit_from_image(truth, record.surfaces[number], camera),
            pixels,
            rle.decode(truth.mask_rle, camera.height_px, camera.width_px),
            camera,
            record.ego.velocity_world_mps,
        )
        matrix = warp_matrix(samples, pyramid_of(*sizes[number]))
        columns, rows = pixels
        return number, SparseMatrix.of(matrix, self.device), self._light(gain[rows, columns])

    def _light(self, counts: Any) -> Tensor:
        return torch.from_numpy(counts / np.float32(LINEAR_FULL_SCALE)).to(self.device)

    def _effects(self) -> CameraEffects:
        return from_json(CameraEffects, self.dataset.plan.content["camera"], "camera")


def _crop(probe: Probe) -> Any:
    height, width = probe.black.shape[:2]
    return np.s_[probe.top_px : probe.top_px + height, probe.left_px : probe.left_px + width]
