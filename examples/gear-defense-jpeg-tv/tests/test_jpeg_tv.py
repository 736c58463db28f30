"""Every promise of a defense, and what this one is for."""

from __future__ import annotations

import numpy as np
import pytest
from gear.testing.defense_contract import DefenseContract, noisy_patch, street_picture
from gear.values.errors import FieldError

from gear_defense_jpeg_tv import JpegTvConfig, spec
from gear_defense_jpeg_tv.jpeg_tv import JpegTv, denoised, divergence, gradient


class TestJpegTv(DefenseContract):
    spec = spec


def test_divergence_is_the_adjoint_of_the_gradient() -> None:
    rng = np.random.default_rng(1)
    picture, dual = rng.normal(size=(5, 7, 3)).astype(np.float32), rng.normal(size=(2, 5, 7, 3)).astype(np.float32)
    dual[0, -1], dual[1, :, -1] = 0, 0
    assert float((gradient(picture) * dual).sum()) == pytest.approx(
        -float((picture * divergence(dual)).sum()), abs=1e-3
    )


def test_noise_goes_and_the_mean_stays() -> None:
    noisy = np.random.default_rng(1).normal(100, 10, (32, 32, 3)).astype(np.float32)
    smooth = denoised(noisy, 30, 60)
    assert smooth.std() < 0.3 * noisy.std()
    assert float(smooth.mean()) == pytest.approx(float(noisy.mean()), abs=0.01)


def test_a_strong_edge_stays_where_it_is() -> None:
    edge = np.zeros((16, 32, 3), np.float32)
    edge[:, 16:] = 200
    smooth = denoised(edge, 8, 100)
    steps = np.diff(smooth[8, :, 0])
    assert int(steps.argmax()) == 15 and steps.max() > 150


def test_a_patch_of_noise_suffers_more_than_the_street() -> None:
    patched, area = noisy_patch(street_picture(128, 72, 1), 1)
    cleaned = JpegTv(JpegTvConfig()).clean(patched)[0]
    change = np.abs(cleaned.astype(float) - patched).mean(2)
    assert change[area].mean() > 3 * change[~area].mean()


@pytest.mark.parametrize("options", [{"quality": 0}, {"weight_levels": 0.0}, {"iterations": 0}])
def test_absurd_options_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(FieldError, match=next(iter(options))):
        JpegTvConfig(**options)  # type: ignore[arg-type]
