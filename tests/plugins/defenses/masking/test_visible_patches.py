"""Calibration twins in which a patch is visible."""

from __future__ import annotations

import numpy as np
import pytest

from gear.plugins.defenses.masking.visible_patches import visible_patches
from gear.testing.defense_contract import noisy_patch, street_picture
from gear.values.errors import GearError


def test_pictures_without_a_visible_patch_are_left_out() -> None:
    clean = [{"left": street_picture(64, 40, i)} for i in range(5)]
    patched = [{"left": noisy_patch(one["left"], i)[0] if i != 2 else one["left"]} for i, one in enumerate(clean)]
    found = visible_patches(clean, patched, 50, "sac")
    assert len(found) == 4
    area = noisy_patch(clean[0]["left"], 0)[1]
    assert (found[0][2] & area).sum() / (found[0][2] | area).sum() > 0.95
    assert np.array_equal(found[1][0], clean[1]["left"]) and np.array_equal(found[1][1], patched[1]["left"])
    assert len(visible_patches(clean, patched, 2, "sac")) == 2


def test_data_that_are_no_twins_are_refused() -> None:
    clean = [{"left": street_picture(64, 40, i)} for i in range(2)]
    for patched, problem in ((clean[:1], "sac learns from patches"), (clean, "sac has nothing to learn from")):
        with pytest.raises(GearError, match=problem):
            visible_patches(clean, patched, 50, "sac")
