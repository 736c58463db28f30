"""Mip levels of environment maps."""

from __future__ import annotations

import numpy as np

from gear.render.raster.environment import mip_chain


def test_mirrored_light_gets_coarser_and_keeps_its_mean() -> None:
    radiance = np.random.default_rng(0).random((6, 16, 16, 3))
    levels = mip_chain(radiance)
    assert [level.shape[1] for level in levels] == [16, 8, 4, 2, 1]
    assert np.allclose(levels[-1][:, 0, 0], radiance.mean(axis=(1, 2)))
