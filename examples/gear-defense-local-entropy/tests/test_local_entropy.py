"""Every promise of a defense, and what this one is for."""

from __future__ import annotations

import numpy as np
import pytest
from gear.testing.defense_contract import DefenseContract, noisy_patch, street_picture
from gear.values.errors import FieldError

from gear_defense_local_entropy import LocalEntropyConfig, spec
from gear_defense_local_entropy.local_entropy import LocalEntropy, entropies, sides


class TestLocalEntropy(DefenseContract):
    spec = spec


class TestLocalEntropyOnOddSizes(DefenseContract):
    spec = spec
    size_px = (83, 41)
    views = ("left",)


def test_entropy_is_shannons() -> None:
    grey = np.zeros((8, 16), np.uint8)
    grey[:, 8:] = np.arange(1, 65, dtype=np.uint8).reshape(8, 8)
    bits = {left: value for _, left, value in entropies(grey, 8)}
    assert bits[0] == 0
    assert bits[8] == pytest.approx(6)
    assert bits[4] == pytest.approx(0.5 * 1 + 0.5 * 6)


def test_windows_reach_the_last_row_and_column() -> None:
    covered = np.zeros((41, 83), np.bool_)
    for top, left, _ in entropies(covered.astype(np.uint8), 8):
        covered[top : top + 8, left : left + 8] = True
    assert covered.all()


def test_window_sizes_are_the_papers() -> None:
    assert sides((500, 375)) == (8, 12, 16)
    assert sides((1024, 2048)) == (22, 34, 44)


def test_it_finds_the_patch_and_spares_the_street() -> None:
    patched, area = noisy_patch(street_picture(256, 144, 1), 1)
    cleaned, mask = LocalEntropy(LocalEntropyConfig()).clean(patched)
    assert mask is not None
    assert mask[area].mean() > 0.9
    assert mask[~area].mean() < 0.1
    assert np.array_equal(cleaned[mask == 0], patched[mask == 0])
    assert np.abs(np.diff(cleaned[area].astype(float), axis=0)).mean() < 10


@pytest.mark.parametrize("options", [{"least_share": 1.0}, {"grow_px": -1}, {"patch_mean": (0.0, 1.0, 1.0)}])
def test_absurd_options_are_refused(options: dict[str, float]) -> None:
    with pytest.raises(FieldError, match=next(iter(options))):
        LocalEntropyConfig(**options)  # type: ignore[arg-type]
