"""A low-dimensional prior of natural pictures: few cosine coefficients with the spectrum and colours of photographs.

The prior holds three measured facts about photographs, and needs no network:

- The amplitude spectrum falls as 1/f with the spatial frequency f (Field, "Relations between the statistics of natural
  images and the response properties of cortical cells", JOSA A 1987; Torralba and Oliva, "Statistics of natural image
  categories", Network 2003: exponents of about 0.7 to 1.3).
- The colour channels are strongly correlated: most of the variance is brightness, then blue-yellow, then red-green
  (Ruderman et al., "Statistics of cone responses to natural images", JOSA A 1998).
- Mean colour and contrast lie in a small range (ImageNet's means and standard deviations).

The parametrisation, scaled frequencies times a matrix of colour correlation, is that of Mordvintsev et al.
("Differentiable image parameterizations", Distill 2018). Unlike there, the coefficients are bounded, so that a picture
cannot leave the prior however long it is optimised. Low-frequency attacks are studied by Guo et al. ("Low frequency
adversarial perturbation", UAI 2019) and by Sharma et al. (IJCAI 2019).
"""

from __future__ import annotations

import math

import numpy as np
import torch
from torch import Tensor

MEAN_RGB = (0.485, 0.456, 0.406)
"""Mean colour of ImageNet's pictures, sRGB in 0..1."""

COLOUR_ROOT = ((0.26, 0.09, 0.02), (0.27, 0.00, -0.05), (0.27, -0.09, 0.03))
"""Square root of the covariance of ImageNet's colours (rows: red, green, blue), from the code of Mordvintsev et al.
Its columns are brightness, blue-yellow and red-green.
"""

MEAN_SPREAD = 0.7
"""Standard deviation of the mean colours of photographs, as a share of the standard deviation inside one."""

MAX_COEFFICIENT = 3.0
"""Largest absolute value of a coefficient, in standard deviations, so that no single wave dominates a picture."""

TINIEST = 1e-12
"""Size of coefficients, in standard deviations, below which they count as zero; their squares are still numbers."""

ROUNDS = 200
"""Largest number of alternating projections onto the bound of the coefficients and onto the spectrum. One or two are
enough after a step of an attack; coefficients of very different sizes need more.
"""


class NaturalPrior:
    """Textures with the statistics of photographs, computed from (S, 3, u, v) coefficients of cosine waves.

    The second axis is brightness, blue-yellow, red-green; u and v are the half periods of the wave along the height and
    the width. The coefficients are whitened: photographs have a standard deviation of 1 in each of them. `projected`
    keeps them in the prior's set: the mean colour within one standard deviation, every coefficient within
    `MAX_COEFFICIENT`, and the root mean square of the coefficients in each octave of frequencies, for each colour
    component, between 1 / `slack` and `slack`.

    Args:
        height_px, width_px: size of the textures.
        modes: half periods of the shortest wave along the longer side. Waves in other directions are as long.
        contrast: standard deviation of the textures' values, mean over the colour channels.
        slack: largest factor by which the amplitude of an octave differs from the spectrum 1/f.
    """

    def __init__(self, height_px: int, width_px: int, *, modes: int, contrast: float, slack: float) -> None:
        longer = max(height_px, width_px)
        self._down, self._across = (
            _cosines(side, max(2, min(side, math.ceil(modes * side / longer) + 1))) for side in (height_px, width_px)
        )
        u, v = torch.arange(self._down.shape[1]), torch.arange(self._across.shape[1])
        radius = torch.hypot(u[:, None] * (longer / height_px), v[None] * (longer / width_px))
        octave = torch.where(radius > 0, radius.clamp_min(1e-9).log2().floor(), -1.0)
        self._is_used = (radius > 0) & (radius <= max(modes, float(radius[radius > 0].min())))
        self._octaves = [self._is_used & (octave == n) for n in sorted(set(octave[self._is_used].tolist()))]
        amplitude = torch.where(self._is_used, 1 / radius.clamp_min(1e-9), 0.0)
        self._amplitude = amplitude / amplitude.square().sum().sqrt()
        self._amplitude[0, 0] = MEAN_SPREAD
        root = torch.tensor(COLOUR_ROOT)
        self._root = root * (contrast / root.norm(dim=1).mean())
        self._slack = slack

    def shape(self, surfaces: int) -> tuple[int, ...]:
        """Returns the shape of the coefficients, (surfaces, 3, u, v)."""
        return (surfaces, 3, self._down.shape[1], self._across.shape[1])

    def first(self, surfaces: int, rng: np.random.Generator) -> Tensor:
        """Draws coefficients at random from the prior.

        Args:
            surfaces: number of patch surfaces.
            rng: random generator of the draw.
        """
        drawn = rng.standard_normal(self.shape(surfaces)).astype(np.float32)
        return self.projected(torch.from_numpy(drawn))

    def textures(self, parameters: Tensor) -> Tensor:
        """Computes the (S, 3, h, w) textures from the coefficients, clipped to 0..1; differentiable.

        Args:
            parameters: (S, 3, u, v) coefficients.
        """
        components = self._down @ (parameters * self._amplitude) @ self._across.T
        mean = torch.tensor(MEAN_RGB).view(3, 1, 1)
        return (mean + torch.einsum("rc,schw->srhw", self._root, components)).clamp(0, 1)

    def projected(self, parameters: Tensor) -> Tensor:
        """Returns coefficients in the prior's set, near the given ones.

        Args:
            parameters: (S, 3, u, v) coefficients.
        """
        kept = parameters * self._is_used
        kept[..., 0, 0] = parameters[..., 0, 0].clamp(-1, 1)
        for octave in self._octaves:
            kept[..., octave] = self._octave_projected(kept[..., octave])
        return kept

    def _octave_projected(self, part: Tensor) -> Tensor:
        """Returns (S, 3, n) coefficients of one octave with bounded sizes and a bounded root mean square."""
        low, high = 1 / self._slack, self._slack
        # Without any wave there is no direction to grow in. These signs give a wave without a peak (Schroeder, 1970).
        number = torch.arange(part.shape[-1])
        signs = torch.where((math.pi * number.square() / len(number)).cos() >= 0, low, -low)
        part = torch.where(part.abs().amax(dim=-1, keepdim=True) > TINIEST, part, signs)
        part = part.clamp(-MAX_COEFFICIENT, MAX_COEFFICIENT)
        for _ in range(ROUNDS):
            size = part.square().mean(dim=-1, keepdim=True).sqrt()
            if bool(((size > low * 0.999) & (size < high * 1.001)).all()):
                break
            part = (part * (size.clamp(low, high) / size)).clamp(-MAX_COEFFICIENT, MAX_COEFFICIENT)
        return part


def _cosines(side_px: int, count: int) -> Tensor:
    """(side, count) cosine waves with 0, 1, ... half periods over a side; each wave has a mean square of 1."""
    angles = math.pi * (torch.arange(side_px) + 0.5)[:, None] * torch.arange(count) / side_px
    waves = angles.cos() * math.sqrt(2)
    waves[:, 0] = 1
    return waves
