"""Checks of the patches that an attack returns."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from gear.contracts.attacks import Patch
from gear.measuring.patch_checks import check_patches, is_picture
from gear.plugins.build import find
from gear.values.errors import PluginError

GREY = np.full((2, 3, 3), 0.5, np.float32)


def patches(*pictures: np.ndarray) -> tuple[Patch, ...]:
    return tuple(Patch(name=f"patch_{number}", rgb=rgb) for number, rgb in enumerate(pictures))


def test_one_patch_for_each_surface_passes() -> None:
    check_patches(patches(GREY, np.zeros_like(GREY)), 2, find("attack", "control"))


@pytest.mark.parametrize(
    ("returned", "message"),
    [
        (list(patches(GREY)), "must return a tuple of Patch"),
        ((GREY,), "must return a tuple of Patch"),
        (patches(GREY, GREY), "must return patch_0"),
        (patches(), "must return patch_0"),
        (patches(GREY.astype(np.float64)), r"patch_0 must be \(H, W, 3\) float32 without NaN"),
        (patches(np.full_like(GREY, np.nan)), "without NaN"),
        (patches(GREY[..., :1]), "must be"),
        (patches(GREY * 3), "patch_0 leaves 0..1"),
        (patches(-GREY), "patch_0 leaves 0..1"),
    ],
)
def test_anything_else_names_the_attack(returned: Any, message: str) -> None:
    with pytest.raises(PluginError, match=message) as caught:
        check_patches(returned, 1, find("attack", "control"))
    assert "control" in str(caught.value)


def test_a_picture_has_three_channels_of_finite_float32() -> None:
    assert is_picture(GREY)
    assert not is_picture(GREY[0])
    assert not is_picture(GREY.astype(np.uint8))
