"""Saved states are checked before an attack is continued."""

from __future__ import annotations

import numpy as np
import pytest

from gear.plugins.attacks.optimisation.checkpoint_state import check_saved
from gear.values.errors import GearError

FRESH = {"textures": np.zeros((1, 3, 4, 8), np.float32), "done": np.array(0), "best": np.zeros(2, np.float32)}


def test_the_same_arrays_and_further_ones_are_accepted() -> None:
    check_saved(FRESH, FRESH)
    check_saved({**FRESH, "more": np.zeros(1)}, FRESH)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("done", None, "is of an older gear, it lacks done"),
        ("textures", np.zeros((1, 3, 8, 8), np.float32), r"has patches of \(1, 3, 8, 8\), not \(1, 3, 4, 8\)"),
        ("textures", FRESH["textures"].astype(np.float64), "is damaged, its 'textures' is no float32"),
        ("textures", FRESH["textures"] + np.nan, "is damaged"),
        ("done", np.zeros(2, int), "is damaged, its 'done' is no int64"),
        ("best", np.zeros(3, np.float32), r"is damaged, its 'best' is no float32 of \(2,\)"),
    ],
)
def test_anything_else_says_what_is_wrong(name: str, value: np.ndarray | None, message: str) -> None:
    saved = {key: array for key, array in {**FRESH, name: value}.items() if array is not None}
    with pytest.raises(GearError, match=message):
        check_saved(saved, FRESH)
