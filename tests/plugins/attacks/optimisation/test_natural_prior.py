"""The prior of natural pictures: its pictures have the spectrum, the colours and the contrast of photographs."""

from __future__ import annotations

import itertools
import math

import numpy as np
import numpy.typing as npt
import pytest
import torch
from scipy.fft import dctn

from gear.plugins.attacks.optimisation.natural_prior import COLOUR_ROOT, MAX_COEFFICIENT, NaturalPrior
from gear.values.rng import derive_rng

SIZES = ((150, 300), (300, 150), (64, 64), (2, 2), (2, 300), (16, 32))


def prior(height_px: int = 150, width_px: int = 300, slack: float = 1.25) -> NaturalPrior:
    return NaturalPrior(height_px, width_px, modes=32, contrast=0.225, slack=slack)


def slope_of(grey: npt.NDArray[np.floating]) -> float:
    """Exponent of the amplitude spectrum between 2 and 14 periods per longer side, by SciPy's cosine transform."""
    height, width = grey.shape
    amplitude = np.abs(dctn(grey, norm="ortho"))
    u, v = np.meshgrid(np.arange(height), np.arange(width), indexing="ij")
    half_periods = np.hypot(u * max(height, width) / height, v * max(height, width) / width)
    edges = np.geomspace(2, 28, 8)
    middles = np.sqrt(edges[1:] * edges[:-1])
    rings = [(half_periods >= low) & (half_periods < high) for low, high in itertools.pairwise(edges)]
    return float(np.polyfit(np.log(middles), [np.log(np.sqrt((amplitude[r] ** 2).mean())) for r in rings], 1)[0])


def pushed(one: NaturalPrior, seed: int) -> torch.Tensor:
    """Coefficients that were pushed far in one direction, with some of no or infinite-like size, and projected."""
    rng = derive_rng(seed, "pushed")
    wild = rng.standard_normal(one.shape(3)) * 10 ** rng.uniform(-6, 6, one.shape(3))
    wild[1] = 0
    wild[2, :, :, 1:] *= 1e-9
    return one.projected(torch.from_numpy(wild.astype(np.float32)))


@pytest.mark.parametrize("seed", range(4))
def test_the_spectrum_stays_that_of_photographs(seed: int) -> None:
    """White noise has a slope of 0, and the exponents of photographs lie around -1."""
    one = prior()
    for parameters in (one.first(3, derive_rng(seed, "first")), pushed(one, seed)):
        for texture in one.textures(parameters):
            assert -1.4 < slope_of(texture.mean(0).numpy()) < -0.4
    assert abs(slope_of(derive_rng(seed, "white").uniform(0, 1, (150, 300)))) < 0.1


@pytest.mark.parametrize("seed", range(4))
def test_colours_and_contrast_stay_those_of_photographs(seed: int) -> None:
    one = prior()
    textures = one.textures(one.first(3, derive_rng(seed, "first")))
    for values in (textures, one.textures(pushed(one, seed))):
        for texture in values:
            pixels = texture.flatten(1).numpy().astype(np.float64)
            assert pixels.min() >= 0 and pixels.max() <= 1
            assert (pixels.mean(axis=1) > 0.2).all() and (pixels.mean(axis=1) < 0.75).all()
            assert 0.1 < pixels.std(axis=1).mean() < 0.33
            variances = np.sort(np.linalg.eigvalsh(np.cov(pixels)))
            assert variances[-1] / variances.sum() > 0.75, "brightness is most of the variance"


def test_a_drawn_picture_has_the_colours_covariance() -> None:
    one = prior(slack=1.0)
    waves = one.first(200, derive_rng(1, "many")) * one._amplitude
    unclipped = one._root @ (one._down @ waves @ one._across.T).flatten(2)
    inside = unclipped - unclipped.mean(dim=2, keepdim=True)
    found = (inside @ inside.transpose(1, 2)).mean(dim=0) / inside.shape[2]
    root = torch.tensor(COLOUR_ROOT)
    wanted = root @ root.T * (0.225 / root.norm(dim=1).mean()) ** 2
    torch.testing.assert_close(found, wanted, atol=2e-3, rtol=0.05)


@pytest.mark.parametrize("size", SIZES)
def test_projected_coefficients_are_in_the_set(size: tuple[int, int]) -> None:
    one = prior(*size)
    found = pushed(one, 7)
    assert bool(found.isfinite().all()) and float(found.abs().max()) <= MAX_COEFFICIENT
    assert float(found[..., 0, 0].abs().max()) <= 1
    for octave in one._octaves:
        rms = found[..., octave].square().mean(dim=-1).sqrt()
        assert float(rms.min()) > 0.79 and float(rms.max()) < 1.26
    assert not bool(found[..., ~one._is_used].flatten(2)[..., 1:].any()), "no wave beyond the shortest"
    assert one.textures(found).shape == (3, 3, *size)


def test_projection_leaves_what_is_in_the_set() -> None:
    one = prior()
    drawn = one.first(2, derive_rng(3, "drawn"))
    torch.testing.assert_close(one.projected(drawn), drawn)


def test_few_coefficients_make_many_pixels() -> None:
    one = prior()
    assert 3 * (int(one._is_used.sum()) + 1) < 0.01 * 3 * 150 * 300
    assert math.prod(one.shape(1)) < 3 * 150 * 300 / 50


def test_textures_do_not_share_memory_with_their_input() -> None:
    one = prior(16, 32)
    given = one.first(1, derive_rng(0, "given"))
    before = given.clone()
    one.projected(given)
    assert torch.equal(given, before)
