"""Checks the saved state of an attack (a checkpoint) before the attack is resumed from the state."""

from __future__ import annotations

import numpy as np

from gear.contracts.attacks import State
from gear.values.errors import GearError

TEXTURE_AXES = 4
"""Number of axes of arrays that have the shape of the textures (S, 3, h, w)."""


def check_saved(saved: State, fresh: State) -> None:
    """Checks that a saved state has every array of an initial state, with the same shape and dtype and without
    NaN.

    Args:
        saved: the saved state, arrays by name; it may have further arrays.
        fresh: an initial state of the same attack, whose values do not count.

    Raises:
        GearError: the saved state is incomplete or damaged, or its patches have another size; the message names the
            array.
    """
    if missing := fresh.keys() - saved.keys():
        raise GearError(f"the saved attack is of an older gear, it lacks {', '.join(sorted(missing))}; start it afresh")
    for name, wanted in fresh.items():
        there = saved[name]
        if there.shape != wanted.shape and wanted.ndim == TEXTURE_AXES:
            raise GearError(f"the saved attack has patches of {there.shape}, not {wanted.shape}; start it afresh")
        if there.shape != wanted.shape or there.dtype != wanted.dtype or np.isnan(there).any():
            kind = f"{wanted.dtype} of {wanted.shape}" if wanted.shape else f"{wanted.dtype}"
            raise GearError(f"the saved attack is damaged, its {name!r} is no {kind}; start it afresh")
