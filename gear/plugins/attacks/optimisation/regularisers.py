"""Regularisers that keep a patch printable: smoothness, and colours that a printing press can print."""

from __future__ import annotations

import functools
import itertools

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from gear.camera.response import encode_srgb

Floats = npt.NDArray[np.float64]

SOLIDS_LAB = {
    (): (95.0, 0.0, -2.0),
    ("c",): (55.0, -37.0, -50.0),
    ("m",): (48.0, 74.0, -3.0),
    ("y",): (89.0, -5.0, 93.0),
    ("c", "m"): (24.0, 17.0, -46.0),
    ("c", "y"): (50.0, -68.0, 33.0),
    ("m", "y"): (47.0, 68.0, 48.0),
    ("c", "m", "y"): (23.0, 0.0, 0.0),
}
"""CIELAB (D50) colours of paper and of solid overprints in offset printing on coated paper, from ISO
12647-2:2004, paper type 1, on which the characterisation data FOGRA39 are based.
"""

COVERS = (0.0, 0.5, 1.0)
"""Dot areas of each ink, 0..1, whose combinations are the printable colours."""


def smoothness(patch: Tensor) -> Tensor:
    """Returns the sum of squared differences between neighbouring pixels; 0 for a single colour.

    It is the smoothness term of the CARLA-GeAR paper.

    Args:
        patch: (3, h, w), differentiable.
    """
    down, right = patch[:, 1:] - patch[:, :-1], patch[:, :, 1:] - patch[:, :, :-1]
    return down.square().sum() + right.square().sum()


def non_printability(patch: Tensor) -> Tensor:
    """Returns the sum over a patch's pixels of the distance to the nearest printable colour (`palette_srgb`).

    Sharif et al. (CCS 2016) multiply the distances to all printable colours; with many colours the gradient of that
    product nearly vanishes. Like Thys et al. (2019), this function takes the smallest distance.

    Args:
        patch: (3, h, w) sRGB in 0..1, differentiable.
    """
    palette = palette_srgb().to(patch)
    pixels = patch.flatten(1).T
    return torch.cdist(pixels, palette, compute_mode="donot_use_mm_for_euclid_dist").min(dim=1).values.sum()


@functools.cache
def palette_srgb() -> Tensor:
    """The printable colours: (27, 3) sRGB in 0..1, all mixtures of cyan, magenta, yellow at 0, 50 and 100 % coverage.

    Half coverage mixes paper and solid ink by area (Neugebauer's equations with Demichel's areas) in linear light.
    """
    solids = {inks: _xyz_from_lab(lab) for inks, lab in SOLIDS_LAB.items()}
    colours = []
    for covers in itertools.product(COVERS, repeat=3):
        mixture = np.zeros(3)
        for inks, xyz in solids.items():
            areas = [cover if ink in inks else 1 - cover for ink, cover in zip("cmy", covers, strict=True)]
            mixture += np.prod(areas) * xyz
        colours.append(_srgb_from_xyz(mixture))
    return torch.tensor(np.array(colours), dtype=torch.float32)


D50 = np.array([0.9642, 1.0, 0.8251])
LINEAR_RGB_FROM_XYZ_D50 = np.array(
    [[3.1338561, -1.6168667, -0.4906146], [-0.9787684, 1.9161415, 0.0334540], [0.0719453, -0.2289914, 1.4052427]]
)
"""Matrix from CIE XYZ (D50) to linear sRGB, with Bradford adaptation."""


def _xyz_from_lab(lab: tuple[float, float, float]) -> Floats:
    lightness = (lab[0] + 16) / 116
    f = np.array([lightness + lab[1] / 500, lightness, lightness - lab[2] / 200])
    return np.asarray(np.where(f > 6 / 29, f**3, 3 * (6 / 29) ** 2 * (f - 4 / 29)) * D50)


def _srgb_from_xyz(xyz: Floats) -> Floats:
    return encode_srgb(np.clip(LINEAR_RGB_FROM_XYZ_D50 @ xyz, 0, 1))
