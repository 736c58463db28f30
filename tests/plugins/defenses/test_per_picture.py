"""The built-in defenses that need nothing but the picture."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
import pytest
import torch

from gear.plugins.defenses import bit_depth, gaussian, jpeg, lgs, median
from gear.testing.defense_contract import DefenseContract, noisy_patch, street_picture
from gear.values.errors import FieldError


class TestMedian(DefenseContract):
    spec = median.spec


class TestWideMedian(DefenseContract):
    spec = median.spec
    options: ClassVar[dict[str, int]] = {"radius_px": 2}


class TestGaussian(DefenseContract):
    spec = gaussian.spec


class TestBitDepth(DefenseContract):
    spec = bit_depth.spec


class TestJpeg(DefenseContract):
    spec = jpeg.spec


class TestLgs(DefenseContract):
    spec = lgs.spec


class TestLgsOnOddSizes(DefenseContract):
    spec = lgs.spec
    size_px = (83, 41)
    views = ("left",)


def test_the_median_removes_a_single_speck() -> None:
    picture = np.full((9, 9, 3), 100, np.uint8)
    picture[4, 4] = 255
    assert np.all(median.Median(median.MedianConfig()).clean(picture)[0] == 100)


def test_the_blur_spreads_a_point_as_its_bell_says() -> None:
    picture = np.zeros((31, 31, 3), np.uint8)
    picture[15, 15] = 255
    blurred = gaussian.Gaussian(gaussian.GaussianConfig(sigma_px=1.5)).clean(picture)[0][..., 0].astype(float)
    assert blurred[15, 15] == pytest.approx(255 / (2 * np.pi * 1.5**2), abs=1.0)
    assert blurred[15, 17] == pytest.approx(blurred[17, 15], abs=1.0)
    assert blurred[15, 17] / blurred[15, 15] == pytest.approx(np.exp(-2 / 1.5**2), abs=0.05)


@pytest.mark.parametrize("size_px", [(9, 7), (1, 5), (2, 30)])
def test_a_blur_wider_than_the_picture_is_the_same_in_torch(size_px: tuple[int, int]) -> None:
    picture = np.random.default_rng(2).integers(0, 256, (*size_px, 3), np.uint8)
    wide = gaussian.Gaussian(gaussian.GaussianConfig(sigma_px=6))
    tensor = torch.from_numpy(picture).permute(2, 0, 1)[None].float()
    cleaned = wide.clean_tensor(tensor)[0].permute(1, 2, 0).numpy()
    assert np.abs(cleaned - wide.clean(picture)[0]).max() <= 0.51


def test_four_bits_are_sixteen_levels_with_black_and_white_kept() -> None:
    ramp = np.repeat(np.arange(256, dtype=np.uint8)[None, :, None], 3, axis=2)
    squeezed = bit_depth.BitDepth(bit_depth.BitDepthConfig(bits=4)).clean(ramp)[0]
    assert len(np.unique(squeezed)) == 16
    assert (int(squeezed.min()), int(squeezed.max())) == (0, 255)
    assert int(np.abs(squeezed.astype(int) - ramp).max()) <= 9


def test_jpeg_damages_noise_more_than_streets() -> None:
    street = street_picture(128, 72, 1)
    patched, area = noisy_patch(street, 1)
    cleaned = jpeg.Jpeg(jpeg.JpegConfig(quality=30)).clean(patched)[0]
    change = np.abs(cleaned.astype(float) - patched).mean(2)
    assert change[area].mean() > 3 * change[~area].mean()


def test_lgs_masks_the_patch_and_spares_the_street() -> None:
    patched, area = noisy_patch(street_picture(240, 135, 1), 1)
    cleaned, mask = lgs.Lgs(lgs.LgsConfig()).clean(patched)
    assert mask is not None
    assert mask[area].mean() > 0.5
    assert mask[~area].mean() < 0.1
    far = np.ones_like(area)
    rows, columns = np.nonzero(area)
    far[rows.min() - 15 : rows.max() + 16, columns.min() - 15 : columns.max() + 16] = False
    quiet = far & (mask == 0)
    assert np.array_equal(cleaned[quiet], patched[quiet])
    assert cleaned[area].mean() < 0.7 * patched[area].mean()


def test_lgs_covers_the_last_strip() -> None:
    picture = np.full((47, 47, 3), 128, np.uint8)
    picture[:, 44:] = np.random.default_rng(1).integers(0, 256, (47, 3, 3))
    mask = lgs.Lgs(lgs.LgsConfig()).clean(picture)[1]
    assert mask is not None
    assert mask[:, 44:46].mean() > 0.3


def test_lgs_on_a_flat_picture_does_nothing_and_has_a_finite_gradient() -> None:
    flat = torch.full((1, 3, 40, 40), 0.5, requires_grad=True)
    cleaned = lgs.Lgs(lgs.LgsConfig()).clean_tensor(flat)
    cleaned.sum().backward()
    assert torch.equal(cleaned.detach(), flat.detach())
    assert flat.grad is not None
    assert bool(torch.isfinite(flat.grad).all())


@pytest.mark.parametrize(
    ("config", "options", "field"),
    [
        (median.MedianConfig, {"radius_px": 0}, "radius_px"),
        (gaussian.GaussianConfig, {"sigma_px": 0.0}, "sigma_px"),
        (bit_depth.BitDepthConfig, {"bits": 8}, "bits"),
        (jpeg.JpegConfig, {"quality": 0}, "quality"),
        (lgs.LgsConfig, {"overlap_px": 15}, "overlap_px"),
        (lgs.LgsConfig, {"threshold": 1.5}, "threshold"),
    ],
)
def test_absurd_options_are_refused(config: type, options: dict[str, float], field: str) -> None:
    with pytest.raises(FieldError, match=field):
        config(**options)
