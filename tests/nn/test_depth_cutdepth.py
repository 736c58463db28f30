"""Vertical CutDepth: strips of full height, everything else as it was."""

from __future__ import annotations

import numpy as np

from gear.nn.depth_cutdepth import vertical_cutdepth
from gear.values.rng import derive_rng

PICTURE = np.full((20, 40, 3), 7, np.uint8)
DEPTH_M = np.full((20, 40), 40.0, np.float32)
DEPTH_M[0] = np.nan


def test_strips_are_whole_columns_of_depth() -> None:
    widths = []
    for index in range(200):
        changed = vertical_cutdepth(PICTURE, DEPTH_M, derive_rng(1, "cut", index), probability=1.0)
        columns = np.flatnonzero((changed[1:] != 7).all((0, 2)))
        assert columns.size and columns[-1] - columns[0] + 1 == columns.size
        assert (changed[1:, columns] == 128).all() and (changed[0] == 7).all()
        assert (np.delete(changed, columns, axis=1) == 7).all()
        widths.append(columns.size)
    assert max(widths) <= 30 and min(widths) == 1 and len(set(widths)) > 10


def test_one_in_four_is_changed_and_the_input_never_is() -> None:
    before = PICTURE.copy()
    changed = [
        not np.array_equal(vertical_cutdepth(PICTURE, DEPTH_M, derive_rng(2, "cut", i)), PICTURE) for i in range(400)
    ]
    assert 0.18 < np.mean(changed) < 0.32
    assert np.array_equal(PICTURE, before)


def test_draws_do_not_depend_on_the_outcome() -> None:
    after = []
    for probability in (0.0, 1.0):
        rng = derive_rng(3, "cut")
        vertical_cutdepth(PICTURE, DEPTH_M, rng, probability=probability)
        after.append(rng.random())
    assert after[0] == after[1]
