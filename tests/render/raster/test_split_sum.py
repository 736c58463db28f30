"""The table of the split-sum approximation."""

from __future__ import annotations

import numpy as np
import pytest

from gear.render.raster.split_sum import split_sum_table


def test_a_smooth_metal_mirrors_all_and_a_smooth_dielectric_its_reflectance() -> None:
    shares = split_sum_table()
    smooth = shares[0, 3:]
    assert np.allclose(smooth.sum(axis=-1), 1, atol=0.03)
    assert 0.04 * shares[0, -1, 0] + shares[0, -1, 1] == pytest.approx(0.04, abs=1e-3)
    grazing, straight = (0.04 * shares[8, k, 0] + shares[8, k, 1] for k in (2, -1))
    assert grazing > 4 * straight
    rough = shares[-1].sum(axis=-1)
    assert (rough < 0.95).all(), "what meets several facets is lost, and added again by the shader"
