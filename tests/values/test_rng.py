"""Generators derived from a seed and names."""

from __future__ import annotations

import numpy as np

from gear.values.rng import derive_rng


def test_each_purpose_has_its_own_generator_and_repeats_it() -> None:
    first = derive_rng(7, "scene", 12).random(4)
    assert np.array_equal(first, derive_rng(7, "scene", 12).random(4))
    for other in (
        derive_rng(7, "scene", 13),
        derive_rng(8, "scene", 12),
        derive_rng(7, "patch", 12),
        derive_rng(7, "scene", "12"),
    ):
        assert not np.array_equal(first, other.random(4))
