"""The overlap of masks over pictures."""

from __future__ import annotations

import numpy as np
import pytest

from gear.plugins.defenses.masking.mask_iou import LEAST_IOU, MaskIou, overlap_problems


def test_pixels_of_all_pictures_count_together() -> None:
    total = MaskIou()
    assert total.value == 0
    total.update(np.array([[True, True, False]]), np.array([[True, False, False]]))
    total.update(np.array([[True, False, False]]), np.array([[True, True, True]]))
    assert total.value == pytest.approx(2 / 5)


def test_masks_that_miss_the_patches_are_a_problem() -> None:
    assert overlap_problems("sac", LEAST_IOU) == ()
    (problem,) = overlap_problems("sac", 0.0999)
    assert problem.startswith("sac learnt nothing") and problem.endswith("0.100")
