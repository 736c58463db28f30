"""Completion of masks to rectangles, against a plain search over all rectangles."""

from __future__ import annotations

import numpy as np
import pytest

from gear.plugins.defenses.masking.shape_completion import completed


def plainly(mask: np.ndarray, sizes: list[tuple[int, int]]) -> np.ndarray:
    similarity = 0.9
    for _ in range(15):
        result = np.zeros_like(mask)
        for height, width in sizes:
            for top in range(mask.shape[0] - height + 1):
                for left in range(mask.shape[1] - width + 1):
                    rectangle = np.zeros_like(mask)
                    rectangle[top : top + height, left : left + width] = True
                    if (rectangle != mask).sum() / (height * width) < 1 - similarity:
                        result |= rectangle
        if result.any():
            return result
        similarity *= 0.7
    return np.zeros_like(mask)


@pytest.mark.parametrize("seed", range(6))
def test_it_is_the_search_of_the_paper(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mask = np.zeros((14, 18), np.bool_)
    mask[3:9, 5:13] = rng.random((6, 8)) < 0.3 + 0.12 * seed
    mask |= rng.random(mask.shape) < 0.02
    sizes = [(6, 8), (4, 6), (3, 3), (20, 20)]
    assert np.array_equal(completed(mask, sizes), plainly(mask, sizes[:3]))


def test_a_mask_with_holes_becomes_the_rectangle() -> None:
    mask = np.zeros((30, 40), np.bool_)
    mask[8:18, 10:30] = True
    damaged = mask.copy()
    damaged[10:14, 12:14] = False
    assert np.array_equal(completed(damaged, [(10, 20), (5, 10)]), mask)


def test_an_empty_mask_and_rectangles_that_do_not_fit_give_nothing() -> None:
    assert not completed(np.zeros((5, 5), np.bool_), [(2, 2)]).any()
    assert not completed(np.ones((5, 5), np.bool_), [(6, 2)]).any()
